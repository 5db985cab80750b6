"""Bricks and plates: a hollow box with studs on top, tubes or posts below, bores with their bosses.

Source: LDraw 3700 to 3703, 6541, 32000, 3709b (walls 4 LDU, top 4 LDU, stud radius 6 and 4 high).
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from typing import Any

import numpy as np
from manifold3d import Manifold

from technic.geometry import Array
from technic.parts.definition import PortKind
from technic.parts.shapes import kernel
from technic.parts.shapes.bench import Bench, feature
from technic.units import LDU

__all__: list[str] = []


def _stud_bases(bench: Bench) -> Iterator[Array]:
    """Yield the middle of each stud's foot (LDU)."""
    for port in bench.definition.ports:
        if port.kind is PortKind.STUD:
            yield (port.position - port.axis * port.length / 2) / LDU


@feature("studs")
def _studs(bench: Bench, table: Mapping[str, Any]) -> Manifold:
    """A stud on each stud port; ``hollow``: radius of its hole."""
    solids = []
    for base in _stud_bases(bench):
        top = base - (0.0, 4.0, 0.0)
        stud = kernel.cylinder(base, top, 6.0, bench.segments)
        if "hollow" in table:
            stud -= kernel.cylinder(base, top, table["hollow"], bench.segments)
        solids.append(stud)
    return kernel.union(solids)


@feature("shell")
def _shell(bench: Bench, table: Mapping[str, Any]) -> Manifold:
    """A box ``min`` ``max``, open below: ``wall`` thick at the sides, ``top`` thick above (y is down)."""
    low, high = np.array(table["min"], float), np.array(table["max"], float)
    wall, top = table.get("wall", 4.0), table.get("top", 4.0)
    inside = kernel.box(low + (wall, top, wall), high + (-wall, 1.0, -wall))
    return kernel.box(low, high) - inside


@feature("rail")
def _rail(bench: Bench, table: Mapping[str, Any]) -> Manifold:
    """An I-shaped rail ``from`` ``to``: two plates square to ``normal``, joined by a web.

    ``half``: distance of the outer faces from the middle (default 10); ``plate``: thickness of the
    plates (3); ``depth``: half their depth (10); ``web``: thickness of the web (2).
    """
    start, end = np.array(table["from"], float), np.array(table["to"], float)
    normal = np.array([float(letter == table["normal"]) for letter in "xyz"])
    side = np.cross(normal, end - start) / np.linalg.norm(end - start)
    half, plate = table.get("half", 10.0), table.get("plate", 3.0)
    depth, web = table.get("depth", 10.0), table.get("web", 2.0)
    solids = [
        kernel.box(start - half * normal - web / 2 * side, end + half * normal + web / 2 * side)
    ]
    for sign in (-1.0, 1.0):
        outer, inner = sign * half * normal, sign * (half - plate) * normal
        solids.append(kernel.box(start + outer - depth * side, end + inner + depth * side))
    return kernel.union(solids)


@feature("casing")
def _casing(bench: Bench, table: Mapping[str, Any]) -> Manifold:
    """A closed hollow box ``min`` ``max`` with walls ``wall`` thick."""
    low, high, wall = np.array(table["min"], float), np.array(table["max"], float), table["wall"]
    return kernel.box(low, high) - kernel.box(low + wall, high - wall)
