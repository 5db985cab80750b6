"""Where to look at a model from."""

from __future__ import annotations

from dataclasses import replace
from typing import Literal, get_args

import numpy as np

from technic.assembly.model import Assembly
from technic.geometry import Array
from technic.report.scene import Camera

__all__ = ["VIEWS", "View", "fit", "fixed_direction", "model_axes", "sight", "view_direction"]

View = Literal["iso", "front", "side", "top", "mode"]
"""Names of views; `mode` is the one that shows the worst mode best."""

_MARGIN = 1.06

_ELEVATION = 30.0
_FLAT_ELEVATION = 50.0
"""Degrees above the horizon: a model that lies flat is seen from higher up."""

_FLAT = 0.5

_AZIMUTHS = (35.0, -35.0, 60.0, -60.0, 15.0)
"""Degrees from the front towards the right side, the usual one first. Not 45, where equal sides of a
frame coincide."""

_USUAL = 0.85
"""The usual view stays when it shows this share of what the best view shows of the movement."""


def _direction(azimuth: float, elevation: float) -> Array:
    # LDraw: x right, y down, z away from the one who looks.
    a, e = np.radians(azimuth), np.radians(elevation)
    return np.array([np.sin(a) * np.cos(e), -np.sin(e), -np.cos(a) * np.cos(e)])


VIEWS: tuple[View, ...] = get_args(View)

_FIXED: dict[str, tuple[float, float, float]] = {
    # The three axes equally long, as in an isometric drawing.
    "iso": (1.0, -1.0, -1.0),
    "front": (0.0, 0.0, -1.0),
    "side": (1.0, 0.0, 0.0),
    # Not quite from above, or "up" of the picture would be undefined.
    "top": (0.0, -1.0, -1e-3),
}


def fixed_direction(view: View) -> Array | None:
    """Return the unit vector from a model towards the eye of a fixed view; None for `mode`."""
    if view not in _FIXED:
        return None
    toward = np.array(_FIXED[view])
    return np.asarray(toward / np.linalg.norm(toward))


def view_direction(points: Array, movement: Array | None = None, aspect: float = 1.5) -> Array:
    """Return the unit vector from a model towards the eye: in front, aside and above.

    Parameters
    ----------
    points : (n, 3) ndarray
        Of the model (m).
    movement : (m, 3) ndarray, optional
        Displacements that the picture is about: the view is one in which they are seen, not one
        that looks along them.
    aspect : float
        Width over height of the picture: a view in which the model fills it shows more.
    """
    size = np.ptp(points, axis=0)
    flat = size[1] < _FLAT * min(size[0], size[2])
    elevation = _FLAT_ELEVATION if flat else _ELEVATION
    views = [_direction(azimuth, elevation) for azimuth in _AZIMUTHS]
    if movement is None:
        return views[0]
    shown = []
    for view in views:
        camera = fit(points, view)
        across = np.linalg.norm(movement - np.outer(movement @ view, view), axis=1).sum()
        shown.append(float(across) / max(camera.half_height, camera.half_width / aspect))
    return views[0] if shown[0] >= _USUAL * max(shown) else views[int(np.argmax(shown))]


def model_axes(assembly: Assembly) -> Array:
    """Return the matrix from LDraw's axes (x right, y down, z away) to those of a model, (3, 3).

    In an assembly file y is up when it is two-dimensional, z when it is three-dimensional.
    """
    if assembly.source.get("format") != "assembly":
        return np.eye(3)
    if assembly.dimension == 2:
        return np.diag([1.0, -1.0, -1.0])
    return np.array([[1.0, 0.0, 0.0], [0.0, 0.0, 1.0], [0.0, -1.0, 0.0]])


def sight(
    assembly: Assembly,
    points: Array,
    *,
    view: View = "mode",
    movement: Array | None = None,
    aspect: float = 1.5,
) -> tuple[Array, Array]:
    """Return where to look at a model from, and what is up: (toward, up), in its own axes.

    Parameters
    ----------
    assembly : Assembly
        Says which way is up; a plane one is looked at square on, whatever the view.
    points : (n, 3) ndarray
    view : {"iso", "front", "side", "top", "mode"}
    movement, aspect
        For "mode", see `view_direction`.
    """
    axes = model_axes(assembly)
    toward = fixed_direction("front" if assembly.dimension == 2 else view)
    if toward is None:
        toward = view_direction(
            points @ axes, None if movement is None else movement @ axes, aspect
        )
    return axes @ toward, axes @ np.array([0.0, -1.0, 0.0])


def fit(points: Array, toward: Array, up: Array | None = None) -> Camera:
    """Return the camera, looking from the direction `toward`, that just sees all points (n, 3).

    `up` is LDraw's, -y, unless given.
    """
    upright = np.array([0.0, -1.0, 0.0]) if up is None else up
    camera = Camera(toward, upright, points[0], 1.0, 1.0)
    axes = camera.axes()
    seen = points @ axes.T
    low, high = seen.min(axis=0), seen.max(axis=0)
    half = np.maximum(0.5 * _MARGIN * (high - low), 1e-4)
    return replace(
        camera,
        center=0.5 * (low + high) @ axes,
        half_width=float(half[0]),
        half_height=float(half[1]),
    )
