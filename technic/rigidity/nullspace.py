"""Null space of a kinematic matrix whose rows each touch few bodies.

Bodies are eliminated one at a time, those with fewest neighbours first: the rows that touch a body are
turned by an orthogonal matrix (a singular value decomposition of the body's own columns) so that some
rows determine the body from its neighbours and the rest no longer touch it. Columns that no row
determines are motions of that body alone. What cannot be eliminated safely stays in a dense core. A
Rayleigh-Ritz step on the untouched matrix ends it, so that the singular values that decide are those of
the whole matrix.
"""

from __future__ import annotations

import heapq
from dataclasses import dataclass

import numpy as np
from scipy import sparse

from technic.geometry import Array
from technic.tolerances import (
    MOBILITY_CUT,
    PIVOT_CLEAR,
    PIVOT_ZERO,
    RITZ_EXTRA,
    RITZ_LIMIT,
)

__all__ = ["NullSpace", "null_space"]

CORE = 24
"""Number of bodies below which a dense decomposition is cheaper than further elimination."""

Block = tuple[tuple[int, ...], Array]
"""Bodies and rows: the rows have ``width`` columns for each of the bodies, in that order."""


@dataclass(frozen=True, slots=True, eq=False)
class NullSpace:
    """Orthonormal null space with the singular values on either side of the cut.

    Parameters
    ----------
    basis : (width * bodies, k) ndarray
    smallest_kept : float
        Smallest singular value above the cut (a Ritz value, hence never below the true one by more
        than rounding); infinite when there is none.
    largest_dropped : float
        Largest singular value below the cut; 0 when there is none.
    """

    basis: Array
    smallest_kept: float
    largest_dropped: float


@dataclass(frozen=True, slots=True, eq=False)
class _Pivot:
    """How an eliminated body follows its neighbours, and its own free motions."""

    body: int
    neighbors: tuple[int, ...]
    follow: Array
    free: Array


def null_space(blocks: list[Block], bodies: int, width: int) -> NullSpace:
    """Return the null space of the rows in `blocks`.

    Parameters
    ----------
    blocks : list of (tuple of int, (m, width * len(bodies)) ndarray)
    bodies : int
        Number of bodies.
    width : int
        Unknowns per body (6 in space, 3 in the plane).
    """
    matrix = _stack(blocks, bodies, width)
    if bodies <= CORE:
        return _dense(matrix.toarray(), bodies * width)
    pivots, core, rest = _eliminate(blocks, bodies, width)
    candidates = _candidates(pivots, core, rest, bodies, width)
    return _ritz(matrix, candidates)


def _stack(blocks: list[Block], bodies: int, width: int) -> sparse.csr_array:
    data, rows, columns = [], [], []
    row = 0
    for members, block in blocks:
        m = len(block)
        index = np.concatenate([np.arange(width * b, width * b + width) for b in members])
        data.append(block.ravel())
        rows.append(np.repeat(np.arange(row, row + m), len(index)))
        columns.append(np.tile(index, m))
        row += m
    if not data:
        return sparse.csr_array((0, bodies * width))
    coordinates = (np.concatenate(rows), np.concatenate(columns))
    return sparse.csr_array((np.concatenate(data), coordinates), shape=(row, bodies * width))


def _dense(matrix: Array, columns: int) -> NullSpace:
    if len(matrix) == 0:
        return NullSpace(np.eye(columns), float("inf"), 0.0)
    _, values, vt = np.linalg.svd(matrix, full_matrices=True)
    values = np.concatenate([values, np.zeros(columns - len(values))])
    dropped = values < MOBILITY_CUT
    kept = values[~dropped]
    return NullSpace(
        vt[dropped].T,
        float(kept.min()) if len(kept) else float("inf"),
        float(values[dropped].max()) if dropped.any() else 0.0,
    )


def _eliminate(
    blocks: list[Block], bodies: int, width: int
) -> tuple[list[_Pivot], list[int], list[Block]]:
    """Eliminate bodies, least neighbours first, until the rest is small or no pivot is clear."""
    store: dict[int, Block] = dict(enumerate(blocks))
    fresh = len(store)
    touching: list[set[int]] = [set() for _ in range(bodies)]
    neighbors: list[set[int]] = [set() for _ in range(bodies)]
    for key, (members, _) in store.items():
        for b in members:
            touching[b].add(key)
            neighbors[b].update(members)
    queue = [(len(neighbors[b]), b) for b in range(bodies)]
    heapq.heapify(queue)
    alive = set(range(bodies))
    stuck: dict[int, int] = {}
    pivots: list[_Pivot] = []
    while queue and len(alive) > CORE:
        degree, body = heapq.heappop(queue)
        if body not in alive or degree != len(neighbors[body]) or stuck.get(body) == degree:
            continue
        keys = sorted(touching[body])
        others = sorted(neighbors[body] - {body})
        rows = _gather([store[k] for k in keys], [body, *others], width)
        own, rest = rows[:, :width], rows[:, width:]
        u, values, vt = np.linalg.svd(own, full_matrices=True)
        values = np.concatenate([values, np.zeros(width - len(values))])
        if np.any((values > PIVOT_ZERO) & (values < PIVOT_CLEAR)):
            stuck[body] = degree
            continue
        rank = int(np.sum(values >= PIVOT_CLEAR))
        follow = -(vt[:rank].T / values[:rank]) @ (u[:, :rank].T @ rest)
        pivots.append(_Pivot(body, tuple(others), follow, vt[rank:].T))
        alive.discard(body)
        reduced = u[:, rank:].T @ rest
        if len(reduced) > reduced.shape[1]:
            reduced = np.linalg.qr(reduced, mode="r")
        for k in keys:
            for b in store.pop(k)[0]:
                touching[b].discard(k)
        if others and len(reduced):
            store[fresh] = (tuple(others), reduced)
            for b in others:
                touching[b].add(fresh)
            fresh += 1
        for b in others:
            neighbors[b] = set().union({b}, *(store[k][0] for k in touching[b]))
            heapq.heappush(queue, (len(neighbors[b]), b))
    return pivots, sorted(alive), list(store.values())


def _gather(blocks: list[Block], order: list[int], width: int) -> Array:
    """Stack blocks over the bodies in `order`."""
    place = {b: width * k for k, b in enumerate(order)}
    total = sum(len(m) for _, m in blocks)
    out = np.zeros((max(total, 0), width * len(order)))
    row = 0
    for members, block in blocks:
        for k, b in enumerate(members):
            out[row : row + len(block), place[b] : place[b] + width] = block[
                :, width * k : width * k + width
            ]
        row += len(block)
    return out


def _candidates(
    pivots: list[_Pivot], core: list[int], rest: list[Block], bodies: int, width: int
) -> sparse.csc_array:
    """Return vectors that span the null space and its nearest neighbourhood, as sparse columns."""
    dense = _gather(rest, core, width) if core else np.zeros((0, 0))
    if len(dense) > dense.shape[1]:
        dense = np.linalg.qr(dense, mode="r")
    _, values, vt = np.linalg.svd(dense, full_matrices=True)
    values = np.concatenate([values, np.zeros(dense.shape[1] - len(values))])
    count = min(int(np.sum(values < RITZ_LIMIT)) + RITZ_EXTRA, len(values))
    start = vt[len(values) - count :].T
    entries: dict[int, tuple[Array, Array]] = {
        b: (np.arange(count), start[width * k : width * k + width]) for k, b in enumerate(core)
    }
    column = count
    for pivot in reversed(pivots):
        columns = [entries[b][0] for b in pivot.neighbors]
        used = np.unique(np.concatenate([*columns, np.zeros(0, dtype=np.int64)])).astype(np.int64)
        stacked = np.zeros((width * len(pivot.neighbors), len(used)))
        for k, b in enumerate(pivot.neighbors):
            where, values_b = entries[b]
            stacked[width * k : width * k + width, np.searchsorted(used, where)] = values_b
        own = pivot.free.shape[1]
        block = np.hstack([pivot.follow @ stacked, pivot.free])
        entries[pivot.body] = (np.concatenate([used, np.arange(column, column + own)]), block)
        column += own
    data, rows, index = [], [], []
    for b, (where, block) in entries.items():
        data.append(block.ravel())
        rows.append(np.repeat(np.arange(width * b, width * b + width), len(where)))
        index.append(np.tile(where, width))
    coordinates = (np.concatenate(rows), np.concatenate(index))
    return sparse.csc_array((np.concatenate(data), coordinates), shape=(width * bodies, column))


def _ritz(matrix: sparse.csr_array, candidates: sparse.csc_array) -> NullSpace:
    """Return the null space inside the span of `candidates`, judged by the whole matrix."""
    gram = (candidates.T @ candidates).toarray()
    image = matrix @ candidates
    energy = (image.T @ image).toarray()
    scale = 1.0 / np.sqrt(np.diag(gram))
    lengths, q = np.linalg.eigh(gram * np.outer(scale, scale))
    good = lengths > 1e-12 * lengths[-1]
    to_orthonormal = (scale[:, None] * q[:, good]) / np.sqrt(lengths[good])
    squares, v = np.linalg.eigh(to_orthonormal.T @ energy @ to_orthonormal)
    values = np.sqrt(np.clip(squares, 0.0, None))
    dropped = values < MOBILITY_CUT
    basis = np.asarray(candidates @ (to_orthonormal @ v[:, dropped]))
    # the squares above lose half the digits; the image of the basis itself does not
    residue = np.linalg.norm(np.asarray(matrix @ basis), 2) if dropped.any() else 0.0
    return NullSpace(
        basis,
        float(values[~dropped].min()) if (~dropped).any() else float("inf"),
        float(residue),
    )
