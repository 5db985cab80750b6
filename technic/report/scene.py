"""What a picture shows, as plain arrays: made by the analysis, drawn by another process."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Literal

import numpy as np
from numpy.typing import NDArray

from technic.geometry import Array

__all__ = [
    "RGB",
    "Camera",
    "Film",
    "FilmKind",
    "LegendItem",
    "Lines",
    "Marker",
    "Panel",
    "Scene",
    "Surface",
    "merge",
]

Faces = NDArray[np.int64]
RGB = tuple[float, float, float]
FilmKind = Literal["gif", "mp4"]


@dataclass(frozen=True, slots=True, eq=False)
class Surface:
    """Triangles of one or many colours.

    Parameters
    ----------
    points : (n, 3) ndarray
        World coordinates (m).
    faces : (m, 3) ndarray of int
    colors : (n, 3) ndarray
        Red, green, blue from 0 to 1.
    opacity : float
    on_top : bool
        Drawn over everything else, so that parts do not hide it.
    """

    points: Array
    faces: Faces
    colors: Array
    opacity: float = 1.0
    on_top: bool = False


@dataclass(frozen=True, slots=True, eq=False)
class Lines:
    """Line segments.

    Parameters
    ----------
    points : (n, 3) ndarray
        World coordinates (m).
    segments : (m, 2) ndarray of int
    colors : (n, 3) ndarray
    width : float
        In pixels.
    opacity : float
    """

    points: Array
    segments: Faces
    colors: Array
    width: float = 1.0
    opacity: float = 1.0


@dataclass(frozen=True, slots=True, eq=False)
class Marker:
    """A word in a small disc at a point of the model."""

    point: Array
    text: str


@dataclass(frozen=True, slots=True, eq=False)
class Camera:
    """A parallel projection.

    Parameters
    ----------
    toward : (3,) ndarray
        Unit vector from the model to the eye.
    up : (3,) ndarray
    center : (3,) ndarray
        World point in the middle of the picture (m).
    half_width, half_height : float
        What must be visible around the centre (m); the picture's shape decides which one binds.
    """

    toward: Array
    up: Array
    center: Array
    half_width: float
    half_height: float

    def axes(self) -> Array:
        """Return rows right, up and toward of the picture, (3, 3), orthonormal."""
        right = np.cross(self.up, self.toward)
        right = right / np.linalg.norm(right)
        return np.array([right, np.cross(self.toward, right), self.toward])


@dataclass(frozen=True, slots=True, eq=False)
class Panel:
    """One view of the model."""

    caption: str
    surfaces: tuple[Surface, ...]
    lines: tuple[Lines, ...]
    camera: Camera
    markers: tuple[Marker, ...] = ()


@dataclass(frozen=True, slots=True)
class LegendItem:
    """A line of the legend: a swatch ("patch", "line", "arrow", "disc" or "none") and words."""

    swatch: str
    color: RGB
    text: str


@dataclass(frozen=True, slots=True, eq=False)
class Scene:
    """A picture: title, panels side by side, legend below.

    With `transparent` the paper is left out; with `depth` the model is drawn in shades of its
    distance from the eye instead of in its colours.
    """

    title: str
    subtitle: str
    panels: tuple[Panel, ...]
    legend: tuple[LegendItem, ...]
    size: tuple[int, int] = (1600, 1200)
    transparent: bool = False
    depth: bool = False


@dataclass(frozen=True, slots=True, eq=False)
class Film:
    """Pictures of one size, shown one after the other and again from the start.

    Parameters
    ----------
    scenes : tuple of Scene
        Each drawn once.
    order : tuple of int
        Which scene is shown when; a swing shows most of them twice.
    seconds : float
        That one round takes.
    kind : {"gif", "mp4"}
        An MP4 has a few rounds: not every player begins again by itself.
    """

    scenes: tuple[Scene, ...]
    order: tuple[int, ...]
    seconds: float
    kind: FilmKind = "gif"


def merge(surfaces: list[Surface], *, opacity: float = 1.0, on_top: bool = False) -> Surface:
    """Return many surfaces as one: one call to the renderer instead of hundreds."""
    starts = np.cumsum([0, *(len(s.points) for s in surfaces)])
    none = np.zeros((0, 3))
    return Surface(
        np.concatenate([none, *(s.points for s in surfaces)]),
        np.concatenate(
            [np.zeros((0, 3), dtype=np.int64)]
            + [s.faces + start for s, start in zip(surfaces, starts, strict=False)]
        ),
        np.concatenate([none, *(s.colors for s in surfaces)]),
        opacity,
        on_top,
    )
