"""Rank without a tolerance: whole numbers modulo a large prime.

Most Technic models stand on a lattice: holes at whole LDU, axes along the coordinate axes or on a 3-4-5
triangle. The joint rows are then rational, and their rank modulo a prime never exceeds the true rank. So
when the rank modulo the prime is as high as the numerical one, no motion has been overlooked: the mobility
is proved to be at most what is reported, and a rigid verdict is proved.
"""

from __future__ import annotations

import heapq

import numpy as np
from numpy.typing import NDArray

from technic.geometry import Array
from technic.rigidity.kinematics import Kinematics
from technic.tolerances import LATTICE_DIRECTION, LATTICE_POINT
from technic.units import LDU

__all__ = ["PRIME", "lattice_rows", "modular_rank"]

PRIME = 2**31 - 1
"""Products of two residues fit into 64 bits."""

DENOMINATORS = (1, 2, 5, 10, 13, 17, 25, 65)
"""Denominators of directions on the grid, on 3-4-5, 5-12-13 and 8-15-17 triangles and their combinations."""

POINT_SCALE = 130
"""Points are whole multiples of 1/130 LDU: tenths, and thirteenths of a 5-12-13 triangle."""

Rows = tuple[tuple[int, ...], NDArray[np.int64]]
"""Bodies and rows with six columns for each of them, residues modulo `PRIME`."""


def _whole(values: Array, tolerance: float) -> NDArray[np.int64] | None:
    nearest = np.rint(values)
    if np.abs(values - nearest).max(initial=0.0) > tolerance:
        return None
    return nearest.astype(np.int64)


def _directions(axes: Array) -> tuple[NDArray[np.int64], NDArray[np.bool_]]:
    """Return whole numbers in the direction of unit vectors, (n, 3), and which of them are on a lattice."""
    out = np.zeros(axes.shape, dtype=np.int64)
    found = np.zeros(len(axes), dtype=bool)
    for denominator in DENOMINATORS:
        scaled = axes * denominator
        whole = np.rint(scaled).astype(np.int64)
        near = np.abs(scaled - whole).max(axis=1) <= LATTICE_DIRECTION * denominator
        fits = near & (np.sum(whole * whole, axis=1) == denominator**2) & ~found
        out[fits] = whole[fits]
        found |= fits
    return out, found


def lattice_rows(kin: Kinematics, links: list[int]) -> list[Rows] | None:
    """Return the rows of joints and supports as whole numbers, or None when one is off the lattice.

    Twists are taken about the world's origin, where a force along e through p does work with the moment
    ``p x e``; scaling a row changes no rank.
    """
    joints, supports = kin.assembly.joints, kin.assembly.supports
    points = np.zeros((len(links), 3))
    axes = np.tile(np.eye(3), (len(links), 1, 1))
    for row, k in enumerate(links):
        if k < len(joints):
            points[row], axes[row] = joints[k].point, joints[k].axes
        else:
            support = supports[k - len(joints)]
            points[row] = kin.origins[support.part] if support.point is None else support.point
    held = kin.held[links]
    places = _whole(points / LDU * POINT_SCALE, LATTICE_POINT * POINT_SCALE)
    frames = _frames(axes, held)
    if places is None or frames is None:
        return None
    rows = np.zeros((len(links), 6, 6), dtype=np.int64)
    rows[:, :3, :3] = frames * POINT_SCALE
    rows[:, :3, 3:] = np.cross(places[:, None], frames)
    rows[:, 3:, 3:] = frames
    rows %= PRIME
    out: list[Rows] = []
    for k, block, own in zip(links, rows, held, strict=True):
        owner = kin.owners[k]
        both = [block[own], (-block[own]) % PRIME][: len(owner)]
        out.append((owner, np.hstack(both)))
    return out


def _frames(axes: Array, held: NDArray[np.bool_]) -> NDArray[np.int64] | None:
    """Return three whole vectors per joint, (n, 3, 3), that span what its held motions span."""
    axis, found = _directions(axes[:, 0])
    if not found.all():
        return None
    # Where both motions across the axis are held alike, any two directions across it do: take them from
    # the coordinate axes.
    alike = (held[:, 1] == held[:, 2]) & (held[:, 4] == held[:, 5])
    across = np.cross(axis, np.eye(3, dtype=np.int64)[np.argmin(np.abs(axis), axis=1)])
    out = np.stack([axis, across, np.cross(axis, across)], axis=1)
    for side in (1, 2):
        own, found = _directions(axes[~alike, side])
        if not found.all():
            return None
        out[~alike, side] = own
    return out


def modular_rank(rows: list[Rows]) -> int:
    """Return the rank of block rows modulo `PRIME`, eliminating body by body.

    Parameters
    ----------
    rows : list of (bodies, (m, 6 * len(bodies)) ndarray)
        Residues.
    """
    store = dict(enumerate(rows))
    fresh = len(store)
    touching: dict[int, set[int]] = {}
    for key, (bodies, _) in store.items():
        for b in bodies:
            touching.setdefault(b, set()).add(key)
    degree = {b: len({o for k in keys for o in store[k][0]}) for b, keys in touching.items()}
    queue = [(d, b) for b, d in degree.items()]
    heapq.heapify(queue)
    rank = 0
    while queue:
        d, body = heapq.heappop(queue)
        if body not in touching or d != degree[body]:
            continue
        keys = sorted(touching.pop(body))
        others = sorted({o for k in keys for o in store[k][0]} - {body})
        matrix = _gather([store[k] for k in keys], [body, *others])
        pivots, rest = _eliminate(matrix, 6)
        rank += pivots
        for k in keys:
            for o in store.pop(k)[0]:
                if o != body:
                    touching[o].discard(k)
        if others and len(rest):
            store[fresh] = (tuple(others), rest)
            for o in others:
                touching[o].add(fresh)
            fresh += 1
        for o in others:
            degree[o] = len({x for k in touching[o] for x in store[k][0]} | {o})
            heapq.heappush(queue, (degree[o], o))
    return rank


def _gather(blocks: list[Rows], order: list[int]) -> NDArray[np.int64]:
    place = {b: 6 * k for k, b in enumerate(order)}
    out = np.zeros((sum(len(m) for _, m in blocks), 6 * len(order)), dtype=np.int64)
    row = 0
    for bodies, block in blocks:
        for k, b in enumerate(bodies):
            out[row : row + len(block), place[b] : place[b] + 6] = block[:, 6 * k : 6 * k + 6]
        row += len(block)
    return out


def _eliminate(matrix: NDArray[np.int64], columns: int) -> tuple[int, NDArray[np.int64]]:
    """Eliminate the first columns; return the number of pivots and the rows without these columns."""
    pivots = 0
    for c in range(columns):
        found = np.flatnonzero(matrix[:, c])
        if not len(found):
            continue
        pivot = matrix[found[0]].copy()
        pivot = pivot * pow(int(pivot[c]), -1, PRIME) % PRIME
        matrix = np.delete(matrix, found[0], axis=0)
        matrix = (matrix - matrix[:, c : c + 1] * pivot) % PRIME
        pivots += 1
    rest = matrix[:, columns:]
    rest = rest[rest.any(axis=1)]
    if len(rest) > rest.shape[1]:
        rest = _independent(rest)
    return pivots, rest


def _independent(rows: NDArray[np.int64]) -> NDArray[np.int64]:
    """Return as many rows as the rank, spanning the same space."""
    kept = []
    for c in range(rows.shape[1]):
        found = np.flatnonzero(rows[:, c])
        if not len(found):
            continue
        pivot = rows[found[0]]
        pivot = pivot * pow(int(pivot[c]), -1, PRIME) % PRIME
        kept.append(pivot)
        rows = np.delete(rows, found[0], axis=0)
        rows = (rows - rows[:, c : c + 1] * pivot) % PRIME
    return np.array(kept, dtype=np.int64).reshape(-1, rows.shape[1])
