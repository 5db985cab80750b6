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


def _hollow(low: Array, high: Array, wall: float, top: float) -> Manifold:
    """Return a box that is open below."""
    inner, outer = np.array([wall, top, wall]), np.array([-wall, 1.0, -wall])
    return kernel.box(low, high) - kernel.box(low + inner, high + outer)


@feature("shell")
def _shell(_bench: Bench, table: Mapping[str, Any]) -> Manifold:
    """A box ``min`` ``max``, open below: ``wall`` thick at the sides, ``top`` thick above (y is down)."""
    low, high = np.array(table["min"], float), np.array(table["max"], float)
    wall, top = table.get("wall", 4.0), table.get("top", 4.0)
    return _hollow(low, high, wall, top)


@feature("rail")
def _rail(_bench: Bench, table: Mapping[str, Any]) -> Manifold:
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
def _casing(_bench: Bench, table: Mapping[str, Any]) -> Manifold:
    """A closed hollow box ``min`` ``max`` with walls ``wall`` thick."""
    low, high, wall = np.array(table["min"], float), np.array(table["max"], float), table["wall"]
    return kernel.box(low, high) - kernel.box(low + wall, high - wall)


@feature("block")
def _block(bench: Bench, table: Mapping[str, Any]) -> Manifold:
    """A System brick, plate or tile from its receptors: hollow, with tubes between four studs.

    ``wall`` (default 4) and ``top`` (4): thickness; ``studs``: false for none.
    """
    cells = [p for p in bench.definition.ports if p.kind is PortKind.TUBE]
    places = np.array([p.position for p in cells]) / LDU
    height = float((places[0] + cells[0].axis * cells[0].length / LDU / 2)[1])
    low, high = places.min(axis=0) - 10.0, places.max(axis=0) + 10.0
    low[1], high[1] = 0.0, height
    wall, top = table.get("wall", 4.0), table.get("top", 4.0)
    solids = [_hollow(low, high, wall, top)]
    grid = {(round(float(x)), round(float(z))) for x, _, z in places}
    for x, z in sorted(grid):
        foot, head = (x + 10.0, high[1], z + 10.0), (x + 10.0, top, z + 10.0)
        if {(x + 20, z), (x, z + 20), (x + 20, z + 20)} <= grid:
            tube = kernel.cylinder(head, foot, 8.0, bench.segments)
            solids.append(tube - kernel.cylinder(head, foot, 6.0, bench.segments))
        elif (x + 20, z) in grid and (x, z + 20) not in grid and (x, z - 20) not in grid:
            middle = (0.0, 0.0, 10.0)
            post = np.subtract(head, middle), np.subtract(foot, middle)
            solids.append(kernel.cylinder(post[0], post[1], 4.0, bench.segments))
    if table.get("studs", True):
        solids.append(_studs(bench, {}))
    return kernel.union(solids)
