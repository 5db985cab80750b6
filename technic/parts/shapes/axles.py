"""Axles: the cross section between two bevelled ends. Source: LDraw ``axlehol8``, ``axleend2``."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

import numpy as np
from manifold3d import Manifold

from technic.geometry import Array
from technic.parts.definition import PortKind
from technic.parts.shapes import kernel
from technic.parts.shapes.bench import Bench, feature
from technic.units import LDU

__all__ = ["axle_solid"]

_BEVEL = ((0.5, 3.2), (1.1, 5.28), (2.5, 6.05))
"""Distance from the end and radius of the bevel there (LDU); the outermost 0.5 is left off."""


def axle_solid(start: Array, end: Array, bevels: tuple[bool, bool], segments: int) -> Manifold:
    """Return an axle from `start` to `end` (LDU) with bevelled ends where asked for."""
    body = kernel.prism(kernel.polygon(kernel.axle_outline()), start, end)
    if not any(bevels):
        return body
    length = float(np.linalg.norm(end - start))
    near = [(r, d) for d, r in _BEVEL] if bevels[0] else [(6.05, 0.0)]
    far = [(r, length - d) for d, r in reversed(_BEVEL)] if bevels[1] else [(6.05, length)]
    profile = [(0.0, near[0][1]), *near, *far, (0.0, far[-1][1])]
    return body ^ kernel.revolve(profile, start, end - start, segments)


@feature("axle")
def _axle(bench: Bench, table: Mapping[str, Any]) -> Manifold:
    """``from``, ``to`` (default: the part's only axle port); ``bevels``: at the start, at the end.

    An end that a stop covers, or that runs into the part, is not bevelled.
    """
    if "from" in table:
        start, end = np.array(table["from"], float), np.array(table["to"], float)
    else:
        (port,) = (p for p in bench.definition.ports if p.kind is PortKind.AXLE)
        half = port.axis * port.length / 2
        start, end = (port.position - half) / LDU, (port.position + half) / LDU
    near, far = table.get("bevels", (True, True))
    return axle_solid(start, end, (near, far), bench.segments)


@feature("axle_with_stops")
def _axle_with_stops(bench: Bench, table: Mapping[str, Any]) -> Manifold:
    """The part's axle ports, which lie on one line, and its stop ports: discs of radius ``r``."""
    axles = [p for p in bench.definition.ports if p.kind is PortKind.AXLE]
    stops = [p for p in bench.definition.ports if p.kind is PortKind.STOP]
    ends = [(p.position + side * p.axis * p.length / 2) / LDU for p in axles for side in (-1, 1)]
    along = axles[0].axis
    places = [float(end @ along) for end in ends]
    start, end = ends[int(np.argmin(places))], ends[int(np.argmax(places))]
    bevels = [
        all(np.linalg.norm(s.position / LDU - tip) > s.length / LDU + 0.1 for s in stops)
        for tip in (start, end)
    ]
    solids = [axle_solid(start, end, (bevels[0], bevels[1]), bench.segments)]
    for stop in stops:
        middle, arm = stop.position / LDU, stop.axis * stop.length / LDU / 2
        solids.append(
            kernel.cylinder(middle - arm, middle + arm, table.get("r", 8.0), bench.segments)
        )
    return kernel.union(solids)
