"""Liftarms: straight, bent, T-shaped, thick and thin, all from the places of their holes.

A liftarm is 18 LDU wide, its ends are round, and between neighbouring holes it has pockets from both
faces that leave a web of 4 LDU. A pocket next to an axle hole goes right through, and the arm of the
cross that points at the pocket opens into it. Source: LDraw ``npeghole`` and ``npeghol4`` and the
parts that use them (32524, 32140, 6632, 41677).
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from typing import Any

import numpy as np
from manifold3d import CrossSection, JoinType, Manifold, OpType

from technic.geometry import Array
from technic.parts.shapes import kernel
from technic.parts.shapes.bench import Bench, Bore, feature

__all__ = ["HALF_WIDTH"]

HALF_WIDTH = 9.0
"""Half the width of a liftarm and the radius of its ends (LDU)."""
_RIM = 9.0
"""Radius of the material left standing around a hole (LDU)."""
_POCKET_HALF_WIDTH = 6.364
"""Half the width of a pocket (LDU)."""
_FILLET = 0.97
"""Radius of the corners of a pocket (LDU)."""
_WEB = 4.0
"""Thickness of the web between two pockets (LDU)."""
_ARM = 2.0
"""Half the thickness of an arm of the cross (LDU)."""
_WALL = 2.0
"""Wall between the open arms of two neighbouring axle holes (LDU)."""
_REACH = 20.5
"""Holes nearer than this are neighbours (LDU)."""


def _neighbours(holes: list[Bore], plane: list[int]) -> Iterator[tuple[Bore, Bore]]:
    """Yield the pairs of holes one pitch apart."""
    for k, a in enumerate(holes):
        for b in holes[k + 1 :]:
            if np.linalg.norm(a.middle[plane] - b.middle[plane]) < _REACH:
                yield a, b


def _strip(a: Array, b: Array, half_width: float, start: float, end: float) -> CrossSection:
    """Return the rectangle along the line from a to b, from `start` to `end` (LDU from a)."""
    along = (b - a) / np.linalg.norm(b - a)
    side = half_width * np.array([-along[1], along[0]])
    p, q = a + start * along, a + end * along
    return kernel.polygon([p - side, q - side, q + side, p + side])


def _disc(centre: Array, radius: float, segments: int) -> CrossSection:
    return kernel.polygon(kernel.circle_points(radius, segments, (centre[0], centre[1])))


def _gap(a: Bore, b: Bore, plane: list[int], segments: int) -> CrossSection:
    """Return the outline of what is taken away between two neighbours."""
    p, q = a.middle[plane], b.middle[plane]
    distance = float(np.linalg.norm(q - p))
    if a.cross and b.cross:
        reach = (distance - _WALL) / 2
        return _strip(p, q, _ARM, 0.0, reach) + _strip(q, p, _ARM, 0.0, reach)
    figure = _strip(p, q, _POCKET_HALF_WIDTH, 0.0, distance)
    figure = figure - _disc(p, _RIM, segments) - _disc(q, _RIM, segments)
    sides = max(8, segments // 3)
    figure = figure.offset(-_FILLET, JoinType.Round, 2.0, sides)
    figure = figure.offset(_FILLET, JoinType.Round, 2.0, sides).simplify(25.0 / segments**2)
    if a.cross:
        figure = figure + _strip(p, q, _ARM, 0.0, distance - _RIM)
    if b.cross:
        figure = figure + _strip(q, p, _ARM, 0.0, distance - _RIM)
    return figure


@feature("beam")
def _beam(bench: Bench, table: Mapping[str, Any]) -> Manifold:
    """The liftarm around the bores along ``axis`` (default y), without the bores themselves.

    ``only``: names of the bores that take part; ``links``: further straight pieces, each two points;
    ``closed``: pairs of bores whose pocket keeps its web; ``pockets``: false for none; ``width``.
    """
    axis = {"x": 0, "y": 1, "z": 2}[table.get("axis", "y")]
    plane = [i for i in range(3) if i != axis]
    only = table.get("only")
    holes = [
        b for b in bench.bores if abs(b.axis[axis]) > 0.99 and (only is None or b.name in only)
    ]
    if not holes:
        raise ValueError("a beam needs a bore")
    half_width = table.get("width", 2 * HALF_WIDTH) / 2
    ends = np.array([[b.start[axis], b.end[axis]] for b in holes])
    low, high = table.get("span", (ends.min(), ends.max()))
    discs = {b.name: _round_end(b.middle[plane], half_width, bench.segments) for b in holes}
    pairs = list(_neighbours(holes, plane))
    pieces = list(discs.values())
    pieces += [CrossSection.batch_hull([discs[a.name], discs[b.name]]) for a, b in pairs]
    for link in table.get("links", ()):
        tips = [_round_end(np.array(p, dtype=float), half_width, bench.segments) for p in link]
        pieces.append(CrossSection.batch_hull(tips))
    body = kernel.extrude(CrossSection.batch_boolean(pieces, OpType.Add), axis, low, high)
    if not table.get("pockets", True):
        return body
    closed = {frozenset(pair) for pair in table.get("closed", ())}
    through, deep = [], []
    for a, b in pairs:
        shut = frozenset((a.name, b.name)) in closed
        if (a.cross or b.cross) and not shut:
            through.append(_gap(a, b, plane, bench.segments))
        else:
            plain_a, plain_b = (Bore(h.name, False, h.start, h.end) for h in (a, b))
            deep.append(_gap(plain_a, plain_b, plane, bench.segments))
    web = table.get("web", _WEB)
    cutters = []
    if through:
        figure = CrossSection.batch_boolean(through, OpType.Add)
        cutters.append(kernel.extrude(figure, axis, low - 1.0, high + 1.0))
    if deep:
        figure = CrossSection.batch_boolean(deep, OpType.Add)
        middle = (low + high) / 2
        cutters.append(kernel.extrude(figure, axis, low - 1.0, middle - web / 2))
        cutters.append(kernel.extrude(figure, axis, middle + web / 2, high + 1.0))
    return kernel.difference(body, cutters)


def _round_end(centre: Array, radius: float, segments: int) -> CrossSection:
    """Return a disc whose corners lie on the circle, so that straight sides keep their place."""
    return CrossSection.circle(radius, segments).translate((float(centre[0]), float(centre[1])))
