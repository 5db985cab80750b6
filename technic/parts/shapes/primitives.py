"""Features that any part may use: boxes, cylinders, prisms, bodies of revolution, hulls, bores.

Each takes the parameters of one entry of a shape table (LDU). The entries ``mirror``, ``repeat``,
``around`` and ``at`` of `technic.parts.shapes.tables` apply to all of them.
"""

from __future__ import annotations

from collections.abc import Mapping
from itertools import pairwise
from typing import Any

import numpy as np
from manifold3d import CrossSection, JoinType, Manifold, OpType

from technic.geometry import Array
from technic.parts.shapes import kernel
from technic.parts.shapes.bench import Bench, feature

__all__ = ["AXES", "outline_figure"]

AXES = {"x": 0, "y": 1, "z": 2}
Table = Mapping[str, Any]


@feature("box")
def _box(_bench: Bench, table: Table) -> Manifold:
    """``min``, ``max``: opposite corners."""
    return kernel.box(table["min"], table["max"])


@feature("cylinder")
def _cylinder(bench: Bench, table: Table) -> Manifold:
    """``from``, ``to``, ``r``; ``top``: radius at the end; ``inner``: radius of the hole of a tube."""
    start, end = table["from"], table["to"]
    body = kernel.cylinder(start, end, table["r"], bench.segments, table.get("top"))
    if "inner" in table:
        body -= kernel.cylinder(start, end, table["inner"], bench.segments)
    return body


@feature("sphere")
def _sphere(bench: Bench, table: Table) -> Manifold:
    """``centre``, ``r``."""
    return kernel.sphere(table["centre"], table["r"], bench.segments)


def outline_figure(bench: Bench, table: Table) -> CrossSection:
    """Return the plane figure of ``outline`` points (or ``circle`` [u, v, r], or ``path`` with ``r``),
    grown by ``round``.
    """
    if "circle" in table:
        u, v, r = table["circle"]
        return kernel.polygon(kernel.circle_points(r, bench.segments, (u, v)))
    if "path" in table:
        points = np.asarray(table["path"], dtype=float)
        discs = [CrossSection.circle(table["r"], bench.segments).translate(p) for p in points]
        pieces = [CrossSection.batch_hull([a, b]) for a, b in pairwise(discs)] or discs
        return CrossSection.batch_boolean(pieces, OpType.Add)
    figure = kernel.polygon(table["outline"])
    grow = table.get("round", 0.0)
    if grow:
        figure = figure.offset(grow, JoinType.Round, 2.0, bench.segments)
    return figure


@feature("prism")
def _prism(bench: Bench, table: Table) -> Manifold:
    """``axis``, ``span`` [low, high], and a plane figure in the two other coordinates."""
    figure = outline_figure(bench, table)
    low, high = table["span"]
    return kernel.extrude(figure, AXES[table["axis"]], low, high)


@feature("revolve")
def _revolve(bench: Bench, table: Table) -> Manifold:
    """``from``: a point of the line, ``along``: its direction, ``profile``: (radius, height) points."""
    return kernel.revolve(
        table["profile"], table.get("from", (0, 0, 0)), table["along"], bench.segments
    )


@feature("cross")
def _cross(_bench: Bench, table: Table) -> Manifold:
    """An axle's cross section swept ``from`` ``to``; ``across``: where an arm points."""
    figure = kernel.polygon(kernel.axle_outline(table.get("r", 6.0), table.get("arm", 2.0)))
    return kernel.prism(figure, table["from"], table["to"], table.get("across"))


@feature("pin_bore")
def _pin_bore(bench: Bench, table: Table) -> Manifold:
    """The cutter of a pin hole ``from`` ``to``; ``counterbores``: at the start, at the end."""
    both = table.get("counterbores", (True, True))
    return kernel.pin_bore(
        table["from"], table["to"], bench.segments, (both[0], both[1]), table.get("r", 6.0)
    )


@feature("axle_bore")
def _axle_bore(_bench: Bench, table: Table) -> Manifold:
    """The cutter of an axle hole ``from`` ``to``; ``across``: where an arm points."""
    return kernel.cross_bore(table["from"], table["to"], table.get("across"))


@feature("stud")
def _stud(bench: Bench, table: Table) -> Manifold:
    """A stud standing on ``base`` (r 6, 4 high, towards -y); ``hollow``: radius of its hole."""
    x, y, z = table["base"]
    top = (x, y - 4.0, z)
    body = kernel.cylinder((x, y, z), top, 6.0, bench.segments)
    if "hollow" in table:
        body -= kernel.cylinder((x, y, z), top, table["hollow"], bench.segments)
    return body


_DIRECTIONS = np.array(
    [
        (x, y, z)
        for x in (-1, 0, 1)
        for y in (-1, 0, 1)
        for z in (-1, 0, 1)
        if (x, y, z) != (0, 0, 0)
    ],
    dtype=float,
)
_DIRECTIONS /= np.linalg.norm(_DIRECTIONS, axis=1)[:, None]


@feature("extents")
def _extents(_bench: Bench, table: Table) -> Manifold:
    """A shell with flat faces: ``reach``, its extents in 26 directions, ``wall``, its thickness.

    The directions are those of the neighbours of a cube in a grid of cubes, x slowest.
    """
    reach = np.asarray(table["reach"], dtype=float)
    outer = _trimmed(reach)
    inner = _trimmed(reach - table["wall"])
    return outer if inner.is_empty() else outer - inner


def _trimmed(reach: Array) -> Manifold:
    """Return what lies within `reach` of the origin in every direction."""
    size = 10.0 * (1.0 + float(np.abs(reach).max()))
    body = kernel.box((-size,) * 3, (size,) * 3)
    for direction, distance in zip(_DIRECTIONS, reach, strict=True):
        body = body.trim_by_plane(tuple((-direction).tolist()), -float(distance))
    return body
