"""Solids from simple pieces: the drawing board on which the part builders work.

Lengths here are in LDU (as in the shape tables) and in part coordinates; `technic.parts.shapes.mesh`
turns the finished solid into metres. Unions and differences are done by manifold3d, whose results
are watertight by construction, so that no mesh is ever mended by hand.
"""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from math import cos, pi, sin, sqrt

import numpy as np
from manifold3d import CrossSection, Manifold, OpType
from numpy.typing import ArrayLike

from technic.geometry import Array, axes_from

__all__ = [
    "AXLE_RADIUS",
    "COUNTERBORE_DEPTH",
    "COUNTERBORE_RADIUS",
    "PIN_RADIUS",
    "area_radius",
    "axle_outline",
    "bore_outline",
    "box",
    "circle_points",
    "cross_bore",
    "cylinder",
    "difference",
    "extrude",
    "pin_bore",
    "place",
    "polygon",
    "prism",
    "revolve",
    "sphere",
    "union",
]

PIN_RADIUS = 6.0
"""Radius of a pin hole (LDU)."""
COUNTERBORE_RADIUS = 8.0
"""Radius of the wider end of a pin hole (LDU)."""
COUNTERBORE_DEPTH = 2.0
"""Depth of the wider end of a pin hole (LDU)."""
AXLE_RADIUS = 6.0
"""Half the width of an axle, tip to tip (LDU)."""
AXLE_ARM = 2.0
"""Half the thickness of an arm of the axle's cross (LDU)."""
_OVERCUT = 0.01
"""Cutters stick out of the faces they open by this (LDU), so that no film of material remains."""


def area_radius(segments: int) -> float:
    """Return the radius of the regular polygon whose area is that of the unit circle."""
    return sqrt(2.0 * pi / (segments * sin(2.0 * pi / segments)))


def circle_points(radius: float, segments: int, centre: Sequence[float] = (0.0, 0.0)) -> Array:
    """Return the corners of a regular polygon with the area of the circle, (segments, 2)."""
    angles = 2.0 * pi * np.arange(segments) / segments
    r = radius * area_radius(segments)
    return np.column_stack([centre[0] + r * np.cos(angles), centre[1] + r * np.sin(angles)])


def polygon(*outlines: ArrayLike) -> CrossSection:
    """Return the plane figure bounded by closed outlines, (n, 2) each, of either winding."""
    figure = CrossSection()
    for outline in outlines:
        points = np.asarray(outline, dtype=float)
        x, y = points.T
        if np.dot(x, np.roll(y, -1)) < np.dot(y, np.roll(x, -1)):
            points = points[::-1]
        figure = figure + CrossSection([points])
    return figure


def axle_outline(radius: float = AXLE_RADIUS, arm: float = AXLE_ARM) -> Array:
    """Return the outline of an axle's cross section, (12, 2); arms end in two shallow facets.

    Source: LDraw primitive ``axlehol8`` (arm 4 LDU thick, tip at 6 LDU, edge of the tip at 5.6).
    """
    edge = sqrt(radius**2 - arm**2) * 0.9904
    quarter = [(radius, 0.0), (edge, arm), (arm, arm), (arm, edge)]
    return _four(quarter)


def bore_outline(radius: float = AXLE_RADIUS, arm: float = AXLE_ARM) -> Array:
    """Return the outline of an axle hole, (n, 2): the cross with eased inner corners.

    Source: LDraw primitive ``axl5hol8`` (corner points (4, 2), (2.5, 2.5), (2, 4)).
    """
    edge = sqrt(radius**2 - arm**2) * 0.9904
    ease, inner = (arm + 2.0, arm), (arm + 0.5, arm + 0.5)
    return _four([(radius, 0.0), (edge, arm), ease, inner, ease[::-1], (arm, edge)])


def _four(quarter: Sequence[tuple[float, float]]) -> Array:
    points = []
    for turn in range(4):
        c, s = round(cos(turn * pi / 2)), round(sin(turn * pi / 2))
        points += [(c * x - s * y, s * x + c * y) for x, y in quarter]
    return np.array(points, dtype=float)


def place(solid: Manifold, origin: ArrayLike, rotation: ArrayLike) -> Manifold:
    """Return `solid` moved so that its axes point along the columns of `rotation`."""
    matrix = np.column_stack([np.asarray(rotation, dtype=float), np.asarray(origin, dtype=float)])
    return solid.transform(matrix)


def _standing(direction: ArrayLike, across: ArrayLike | None = None) -> Array:
    """Return a rotation whose third column is `direction`; the first lies along `across`."""
    if across is None:
        axis, first, second = axes_from(direction)
        return np.column_stack([first, second, axis])
    axis = np.asarray(direction, dtype=float) / np.linalg.norm(direction)
    first = np.asarray(across, dtype=float)
    first = first - axis * (axis @ first)
    first = first / np.linalg.norm(first)
    return np.column_stack([first, np.cross(axis, first), axis])


def prism(
    figure: CrossSection, start: ArrayLike, end: ArrayLike, across: ArrayLike | None = None
) -> Manifold:
    """Return `figure` swept from `start` to `end`; its first axis points along `across`."""
    a, b = np.asarray(start, dtype=float), np.asarray(end, dtype=float)
    length = float(np.linalg.norm(b - a))
    return place(Manifold.extrude(figure, length), a, _standing(b - a, across))


def extrude(figure: CrossSection, axis: int, low: float, high: float) -> Manifold:
    """Return `figure`, drawn in the two other coordinates in x, y, z order, swept along an axis."""
    first, second = (i for i in range(3) if i != axis)
    columns = np.zeros((3, 3))
    columns[first, 0] = columns[second, 1] = columns[axis, 2] = 1.0
    origin = np.zeros(3)
    origin[axis] = low
    return place(Manifold.extrude(figure, high - low), origin, columns)


def box(low: ArrayLike, high: ArrayLike) -> Manifold:
    """Return the box between two opposite corners."""
    a, b = np.minimum(low, high), np.maximum(low, high)
    return Manifold.cube(tuple((b - a).tolist())).translate(tuple(a.tolist()))


def cylinder(
    start: ArrayLike, end: ArrayLike, radius: float, segments: int, top: float | None = None
) -> Manifold:
    """Return a cylinder, or a cone with radius `top` at its end."""
    a, b = np.asarray(start, dtype=float), np.asarray(end, dtype=float)
    k = area_radius(segments)
    length = float(np.linalg.norm(b - a))
    upper = radius if top is None else top
    return place(Manifold.cylinder(length, radius * k, upper * k, segments), a, _standing(b - a))


def sphere(centre: ArrayLike, radius: float, segments: int) -> Manifold:
    """Return a ball whose polyhedron has about the ball's volume."""
    count = max(8, segments - segments % 4)
    ball = Manifold.sphere(radius, count)
    grown = (4.0 / 3.0 * pi * radius**3 / ball.volume()) ** (1.0 / 3.0)
    c = np.asarray(centre, dtype=float)
    return ball.scale((grown, grown, grown)).translate(tuple(c.tolist()))


def revolve(profile: ArrayLike, origin: ArrayLike, direction: ArrayLike, segments: int) -> Manifold:
    """Return the body swept by a profile of (radius, height) points turning about a line."""
    points = np.asarray(profile, dtype=float) * (area_radius(segments), 1.0)
    return place(Manifold.revolve(polygon(points), segments), origin, _standing(direction))


def union(solids: Iterable[Manifold]) -> Manifold:
    """Return the union of solids."""
    return Manifold.batch_boolean(list(solids), OpType.Add)


def difference(body: Manifold, cutters: Iterable[Manifold]) -> Manifold:
    """Return `body` without the cutters."""
    return Manifold.batch_boolean([body, *cutters], OpType.Subtract)


def pin_bore(
    start: ArrayLike,
    end: ArrayLike,
    segments: int,
    counterbores: tuple[bool, bool] = (True, True),
    radius: float = PIN_RADIUS,
) -> Manifold:
    """Return the cutter of a pin hole from face to face, wider by the counterbore at its ends."""
    a, b = np.asarray(start, dtype=float), np.asarray(end, dtype=float)
    length = float(np.linalg.norm(b - a))
    low = COUNTERBORE_DEPTH if counterbores[0] else -_OVERCUT
    high = length - COUNTERBORE_DEPTH if counterbores[1] else length + _OVERCUT
    profile: list[tuple[float, float]] = [(0.0, -_OVERCUT)]
    if counterbores[0]:
        profile += [(COUNTERBORE_RADIUS, -_OVERCUT), (COUNTERBORE_RADIUS, low)]
    profile += [(radius, low), (radius, high)]
    if counterbores[1]:
        profile += [(COUNTERBORE_RADIUS, high), (COUNTERBORE_RADIUS, length + _OVERCUT)]
    profile += [(0.0, length + _OVERCUT)]
    return revolve(profile, a, b - a, segments)


def cross_bore(start: ArrayLike, end: ArrayLike, across: ArrayLike | None = None) -> Manifold:
    """Return the cutter of an axle hole from face to face, one arm along `across`."""
    a, b = np.asarray(start, dtype=float), np.asarray(end, dtype=float)
    over = _OVERCUT * (b - a) / np.linalg.norm(b - a)
    return prism(polygon(bore_outline()), a - over, b + over, across)
