"""Pins: hollow barrels with a collar, a lip at the tip and slots.

Source: LDraw ``connect``, ``confric5`` and the parts that use them (2780, 3673, 6558): barrel radius 6,
hole radius 4, collar radius 8 and 2 thick, lip radius 6.3 over the last 2 LDU, slots 2 wide.
"""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

import numpy as np
from manifold3d import Manifold

from technic.parts.shapes import kernel
from technic.parts.shapes.bench import Bench, feature

__all__: list[str] = []

# LDraw draws the barrel with 16 sides: their area is that of a circle 1.3 % smaller than its corners.
_BARREL = 5.95
_HOLE = 3.95
_LIP = 6.42
_LIP_LENGTH = 2.0
_COLLAR = 8.0
_COLLAR_LENGTH = 2.0
_SLOT = 2.0


@feature("pin")
def _pin(bench: Bench, table: Mapping[str, Any]) -> Manifold:
    """A hollow barrel ``from`` one end ``to`` the other.

    ``collar``: its thickness at the start, or [start, end] (0 for none); ``lips``: length of the lip at
    the start and at the end; ``inner``: radius of the hole (0 for none); ``r``: radius of the barrel;
    ``slots``: [[across, start, end], ...], each cut 2 LDU wide through both walls. Places along the
    pin are distances from its start.
    """
    start, end = np.array(table["from"], float), np.array(table["to"], float)
    length = float(np.linalg.norm(end - start))
    along = (end - start) / length
    inner = table.get("inner", _HOLE)
    collar = table.get("collar", _COLLAR_LENGTH)
    low, high = collar if isinstance(collar, list) else (0.0, collar)
    first, last = table.get("lips", (0.0, _LIP_LENGTH))
    barrel = table.get("r", _BARREL)
    pieces = [kernel.cylinder(start, end, barrel, bench.segments)]
    for a, b, radius in ((low, high, _COLLAR), (0.0, first, _LIP), (length - last, length, _LIP)):
        if b > a:
            pieces.append(
                kernel.cylinder(start + a * along, start + b * along, radius, bench.segments)
            )
    body = kernel.union(pieces)
    if inner:
        body -= kernel.cylinder(start - along, end + along, inner, bench.segments)
    slots = []
    for across, low, high in table.get("slots", ()):
        side = np.asarray(across, dtype=float)
        flat = np.cross(along, side)
        high = high + 1.0 if high >= length else high
        low = low - 1.0 if low <= 0.0 else low
        corners = [
            start + along * t + side * s + flat * w
            for t in (low, high)
            for s in (-10.0, 10.0)
            for w in (-_SLOT / 2, _SLOT / 2)
        ]
        slots.append(Manifold.hull_points(np.array(corners)))
    return kernel.difference(body, slots) if slots else body
