"""Shapes in few bytes: corners numbered by first use, triangles as steps back, edges as flags.

Most corners of a triangle were new or used a moment ago. Written as "how many corners before the newest
one" their numbers are small and compress to a third; an edge is then a flag at a side of a triangle.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from technic.geometry import Array
from technic.report.solids import Solid

__all__ = ["compact"]


def _keys(pairs: NDArray[np.int64], count: int) -> NDArray[np.int64]:
    """Return one number per unordered pair of corners."""
    return np.asarray(pairs.min(axis=-1) * count + pairs.max(axis=-1))


def compact(solid: Solid) -> tuple[Array, NDArray[np.int64], NDArray[np.int64]]:
    """Return a shape ready for packing.

    Returns
    -------
    points : (n, 3) ndarray
        The corners that triangles use, in the order of first use.
    codes : (3 m,) ndarray of int
        Corner after corner: number of corners used so far less the corner's own number; 0 for a new
        one.
    flags : (m,) ndarray of int
        Bit c is set where the side from corner c to the next is a sharp edge not flagged before;
        empty when the shape has no edges.
    """
    flat = solid.faces.ravel()
    used, first = np.unique(flat, return_index=True)
    used = used[np.argsort(first, kind="stable")]
    number = np.full(len(solid.points), -1, dtype=np.int64)
    number[used] = np.arange(len(used))
    numbers = number[flat]
    seen = np.concatenate([[0], np.maximum.accumulate(numbers)[:-1] + 1])
    codes = seen - numbers
    if not len(solid.edges):
        return solid.points[used], codes, np.zeros(0, dtype=np.int64)
    sides = np.stack([solid.faces, np.roll(solid.faces, -1, axis=1)], axis=-1).reshape(-1, 2)
    keys = _keys(sides, len(solid.points))
    sharp = np.isin(keys, _keys(solid.edges, len(solid.points)))
    fresh = np.zeros(len(keys), dtype=bool)
    fresh[np.unique(keys, return_index=True)[1]] = True
    flags = (sharp & fresh).reshape(-1, 3) @ np.array([1, 2, 4])
    return solid.points[used], codes, flags
