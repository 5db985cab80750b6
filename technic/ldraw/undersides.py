"""Places for studs under parts that are drawn without tubes: curved slopes, hinges, small tiles.

A part of the System stands on a grid of 20 LDU. Where its underside is open, a stud fits between its
walls, whether or not a tube is drawn there. The surface tells: seen from below, the middle of such a
cell is at least as deep as a stud is high, and has a roof; its walls reach down to the bottom.
"""

from __future__ import annotations

from typing import Final

import numpy as np

from technic.geometry import Array
from technic.ldraw.triangles import Surface
from technic.parts.definition import Port, PortKind
from technic.units import LDU

__all__ = ["stud_places"]

CELL: Final = 20.0
"""Pitch of studs (LDU)."""

STUD: Final = 4.0
"""Height of a stud (LDU)."""

GRID: Final = 0.6
"""How far the footprint may be from whole cells (LDU): draughts and rounded edges."""

LOWEST: Final = 4.0
"""A thinner part has no room for a stud (LDU)."""

WALL: Final = 4.5
"""Thickness of walls (LDU), with some room."""

MAX_CELLS: Final = 64
"""More cells than any part without tubes has: a big footprint is no such part."""

_PROBES: Final = np.array([(0.0, 0.0), (3.7, 1.3), (-3.7, -1.3), (1.3, -3.7), (-1.3, 3.7)])
"""Where a stud (radius 6 LDU) is looked for, off the lines along which surfaces are divided."""


def stud_places(surface: Surface) -> tuple[Port, ...]:
    """Return the places for studs under a part, as `TUBE` ports that point down.

    Parameters
    ----------
    surface : Surface
        Of the whole part (m), LDraw axes: -y is up.

    Returns
    -------
    tuple of Port
        Empty when the footprint is no rectangle of whole cells or the underside is closed.
    """
    if not len(surface.triangles):
        return ()
    triangles = surface.triangles / LDU
    low, high = surface.bounds / LDU
    size = (high - low)[[0, 2]]
    cells = np.rint(size / CELL).astype(int)
    if (cells < 1).any() or cells.prod() > MAX_CELLS or high[1] - low[1] < LOWEST:
        return ()
    if (np.abs(size - CELL * cells) > GRID).any():
        return ()
    bottom = high[1]
    middle = (low + high)[[0, 2]] / 2.0
    ports: list[Port] = []
    for i, k in np.ndindex(*cells):
        center = middle + CELL * (np.array([i, k]) - (cells - 1) / 2.0)
        depth = _depths(triangles, center + _PROBES, bottom)
        # without a roof it is a hole or a bare edge; a shallow one is the bottom itself
        if (
            np.isfinite(depth).all()
            and depth.min() >= STUD - 0.1
            and _walled(triangles, center, bottom)
        ):
            ports.append(
                Port(
                    f"place{len(ports) + 1}",
                    PortKind.TUBE,
                    np.array([center[0], bottom - STUD / 2.0, center[1]]) * LDU,
                    np.array([0.0, 1.0, 0.0]),
                    STUD * LDU,
                )
            )
    return tuple(ports)


def _depths(triangles: Array, points: Array, bottom: float) -> Array:
    """Return how far above the bottom plane the surface is over each point, (n,); inf: nothing."""
    flat = triangles[:, :, [0, 2]]
    a, b, c = flat[:, 0], flat[:, 1], flat[:, 2]
    area = (b - a)[:, 0] * (c - a)[:, 1] - (b - a)[:, 1] * (c - a)[:, 0]
    solid = np.abs(area) > 1e-9
    a, b, c, area, heights = a[solid], b[solid], c[solid], area[solid], triangles[solid, :, 1]
    found = np.full(len(points), np.inf)
    for n, p in enumerate(points):
        u = ((b - p)[:, 0] * (c - p)[:, 1] - (b - p)[:, 1] * (c - p)[:, 0]) / area
        v = ((c - p)[:, 0] * (a - p)[:, 1] - (c - p)[:, 1] * (a - p)[:, 0]) / area
        inside = (u >= 0.0) & (v >= 0.0) & (u + v <= 1.0)
        if inside.any():
            w = np.column_stack([u, v, 1.0 - u - v])[inside]
            found[n] = float((bottom - (w * heights[inside]).sum(axis=1)).min())
    return found


def _walled(triangles: Array, center: Array, bottom: float) -> bool:
    """Tell whether two walls or more stand around the cell, down to the bottom plane.

    Walls are 4 LDU thick; one that two cells share may be missing, so two of the four are enough.
    """
    spans = triangles[(np.abs(triangles[:, :, 1] - bottom) < 0.1).sum(axis=1) >= 2]
    low = spans[:, :, [0, 2]].min(axis=1) - center
    high = spans[:, :, [0, 2]].max(axis=1) - center
    half = CELL / 2.0
    walls = 0
    for axis in (0, 1):
        over = (low[:, 1 - axis] <= 2.0) & (high[:, 1 - axis] >= -2.0)
        reach = np.minimum(np.abs(low[:, axis]), np.abs(high[:, axis])) <= half + GRID
        for side in (-half, half):
            at = (low[:, axis] <= side + WALL) & (high[:, axis] >= side - WALL)
            walls += bool((at & over & reach).any())
    return walls >= 2
