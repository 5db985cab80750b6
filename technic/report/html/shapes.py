"""The drawn shapes of a page: one per type of part, lighter ones when the model is big."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from technic.assembly.model import Part
from technic.geometry import Array
from technic.report.scene import Faces
from technic.report.solids import Solid, sharp_edges
from technic.units import MM

__all__ = ["LIGHT_ABOVE", "Shapes", "lighter", "shapes_of"]

LIGHT_ABOVE = 600
"""Models of more parts are drawn with lighter shapes and without edges: a laptop must turn them."""

_CELL = 1.2 * MM
"""Corners closer than this become one in a lighter shape: a bore's 16 sides become 8."""

_MOST_CORNERS = 65535
"""Corners are numbered in 16 bits."""


@dataclass(frozen=True, slots=True, eq=False)
class Shapes:
    """Distinct shapes and which part has which.

    Parameters
    ----------
    solids : tuple of Solid
    of_part : tuple of int
    light : bool
        True when the shapes are lighter than the drawn ones.
    """

    solids: tuple[Solid, ...]
    of_part: tuple[int, ...]
    light: bool


def lighter(points: Array, faces: Faces, cell: float = _CELL) -> tuple[Array, Faces]:
    """Return a shape with fewer corners: those in one cell of a grid become their mean.

    Triangles that lose their area go; so do pairs that come to lie back to back.
    """
    keys = np.floor(points / cell + 0.5).astype(np.int64)
    _, new = np.unique(keys, axis=0, return_inverse=True)
    new = new.reshape(-1)
    count = int(new.max()) + 1
    mean = np.zeros((count, 3))
    np.add.at(mean, new, points)
    mean /= np.bincount(new, minlength=count)[:, None]
    mapped = new[faces]
    kept = (
        (mapped[:, 0] != mapped[:, 1])
        & (mapped[:, 1] != mapped[:, 2])
        & (mapped[:, 2] != mapped[:, 0])
    )
    mapped = mapped[kept]
    _, first, times = np.unique(
        np.sort(mapped, axis=1), axis=0, return_index=True, return_counts=True
    )
    return mean, mapped[np.sort(first[times == 1])]


def _light_solid(solid: Solid) -> Solid:
    points, faces = lighter(solid.points, solid.faces)
    return Solid(points, faces, np.zeros((0, 2), dtype=np.int64), solid.stand_in)


def shapes_of(parts: Sequence[Part], solids: Sequence[Solid]) -> Shapes:
    """Return the distinct shapes of a model.

    Parameters
    ----------
    parts : sequence of Part
    solids : sequence of Solid
        One per part; parts of one type share one object.
    """
    light = len(parts) > LIGHT_ABOVE
    numbers: dict[int, int] = {}
    distinct: list[Solid] = []
    of_part: list[int] = []
    for solid in solids:
        if id(solid) not in numbers:
            numbers[id(solid)] = len(distinct)
            distinct.append(solid)
        of_part.append(numbers[id(solid)])
    final = []
    for solid in distinct:
        shape = _light_solid(solid) if light else solid
        if len(shape.points) > _MOST_CORNERS:
            # A mesh that a user brought: the coarsest grid that numbers fit.
            cell = _CELL
            points, faces = shape.points, shape.faces
            while len(points) > _MOST_CORNERS:
                points, faces = lighter(solid.points, solid.faces, cell)
                cell *= 2.0
            shape = Solid(points, faces, sharp_edges(points, faces), solid.stand_in)
        final.append(shape)
    return Shapes(tuple(final), tuple(of_part), light)
