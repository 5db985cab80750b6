"""Pieces of connectors: bosses around pin holes, sleeves and bushes around axle holes.

Source: LDraw 32013 to 32016, 6536, 3713 (boss radius 9, bush radius 7 with flanges of radius 9).
"""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

import numpy as np
from manifold3d import Manifold

from technic.parts.shapes import kernel
from technic.parts.shapes.bench import Bench, Bore, feature

__all__: list[str] = []

_BOSS = 9.0
_BUSH = 7.0
_FLANGE = 9.0
_FLANGE_LENGTH = 3.0
_SLEEVE = ((8.55, 2.7), (6.9, 4.0), (5.35, 5.35), (4.0, 6.9), (2.7, 8.55))
"""One corner of the outline of a smooth sleeve around an axle (LDU)."""


def _chosen(bench: Bench, table: Mapping[str, Any], cross: bool) -> list[Bore]:
    """Return the bores of a kind, or those that ``only`` names."""
    only = table.get("only")
    bores = [b for b in bench.bores if b.cross == cross]
    chosen = [bench.bore(name) for name in only] if only else bores
    if not chosen:
        raise ValueError("no bore to build around")
    return chosen


@feature("bosses")
def _bosses(bench: Bench, table: Mapping[str, Any]) -> Manifold:
    """A cylinder of radius ``r`` (default 9) around each pin hole, or around those in ``only``."""
    r = table.get("r", _BOSS)
    return kernel.union(
        kernel.cylinder(b.start, b.end, r, bench.segments) for b in _chosen(bench, table, False)
    )


@feature("sleeves")
def _sleeves(bench: Bench, table: Mapping[str, Any]) -> Manifold:
    """A sleeve around each axle hole (or ``only``), ``extra`` longer at its inner end (default 10).

    The inner end is the one nearer to the part's origin.
    """
    extra = table.get("extra", 10.0)
    corners = np.array(_SLEEVE) * table.get("scale", 1.0)
    turns = [np.array([[0, -1], [1, 0]]) for _ in range(4)]
    outline = np.vstack(
        [corners @ np.linalg.matrix_power(turn, k).T for k, turn in enumerate(turns)]
    )
    solids = []
    for bore in _chosen(bench, table, True):
        near, far = bore.start, bore.end
        if np.linalg.norm(near) > np.linalg.norm(far):
            near, far = far, near
        inner = near - extra * (far - near) / np.linalg.norm(far - near)
        across = bench.across(bore)
        solids.append(kernel.prism(kernel.polygon(outline), far, inner, across))
    return kernel.union(solids)


@feature("bushes")
def _bushes(bench: Bench, table: Mapping[str, Any]) -> Manifold:
    """A bush around each axle hole (or ``only``): a tube of radius ``r`` (7) between two flanges."""
    solids = []
    radius, flange = table.get("r", _BUSH), table.get("flange", _FLANGE)
    for bore in _chosen(bench, table, True):
        step = _FLANGE_LENGTH * bore.axis
        solids.append(kernel.cylinder(bore.start, bore.end, radius, bench.segments))
        solids.append(kernel.cylinder(bore.start, bore.start + step, flange, bench.segments))
        solids.append(kernel.cylinder(bore.end - step, bore.end, flange, bench.segments))
    return kernel.union(solids)
