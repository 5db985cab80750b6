"""Gears: teeth drawn as trapezoids on a pitch circle. They are rigid bodies: the volume matters."""

from __future__ import annotations

from collections.abc import Mapping
from math import cos, pi, sin
from typing import Any

from manifold3d import Manifold

from technic.parts.shapes import kernel
from technic.parts.shapes.bench import Bench, feature

__all__: list[str] = []


@feature("gear")
def _gear(_bench: Bench, table: Mapping[str, Any]) -> Manifold:
    """A toothed disc about ``axis`` (default z): ``teeth``, ``outer``, ``root`` radius, ``span``.

    ``land``: share of the pitch that a tooth takes at its tip (default 0.2); ``foot``: at its root
    (default 0.6); ``scale``: size of the far face, for bevel gears.
    """
    count, outer, root = table["teeth"], table["outer"], table["root"]
    land, foot = table.get("land", 0.2), table.get("foot", 0.6)
    outline = []
    for k in range(count):
        middle = 2.0 * pi * k / count
        for radius, share in ((root, -foot), (outer, -land), (outer, land), (root, foot)):
            angle = middle + share * pi / count
            outline.append((radius * cos(angle), radius * sin(angle)))
    low, high = table["span"]
    scale = table.get("scale", 1.0)
    body = Manifold.extrude(kernel.polygon(outline), high - low, scale_top=(scale, scale))
    body = body.translate((0.0, 0.0, low))
    turn = {"x": (0.0, 90.0, 0.0), "y": (-90.0, 0.0, 0.0), "z": (0.0, 0.0, 0.0)}
    return body.rotate(turn[table.get("axis", "z")])
