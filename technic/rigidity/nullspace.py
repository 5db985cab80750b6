"""Null space of a kinematic matrix whose rows each touch few bodies.

Bodies are eliminated one at a time, those with fewest neighbours first: the rows that touch a body are
turned by an orthogonal matrix (a singular value decomposition of the body's own columns) so that some
rows determine the body from its neighbours and the rest no longer touch it. Columns that no row
determines are motions of that body alone. What cannot be eliminated safely stays in a dense core.

Rank is thus decided body by body. That matters for long slender models: the smallest singular value of
the whole matrix falls with the square of a chain's length, although every link of it is rigid.
"""

from __future__ import annotations

import heapq
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from scipy import sparse

from technic.geometry import Array
from technic.tolerances import MOBILITY_CUT, PIVOT_CLEAR, PIVOT_ZERO

__all__ = ["NullSpace", "null_space"]

CORE = 24
"""Number of bodies below which a dense decomposition is cheaper than further elimination."""

Block = tuple[tuple[int, ...], Array]
"""Bodies and rows: the rows have ``width`` columns for each of the bodies, in that order."""


@dataclass(frozen=True, slots=True, eq=False)
class NullSpace:
    """Basis of a null space with the singular values on either side of the cut.

    Parameters
    ----------
    basis : (width * bodies, k) sparse
        Columns of unit length; each moves few bodies where elimination found it.
    smallest_kept : float
        Smallest singular value that counted as held, of the core or of an eliminated body's own
        columns; infinite when there is none.
    largest_dropped : float
        Largest length of the rows on a column of the basis: how far motions are from breaking no joint.
    """

    basis: sparse.csc_array
    smallest_kept: float
    largest_dropped: float


@dataclass(frozen=True, slots=True, eq=False)
class _Pivot:
    """How an eliminated body follows its neighbours, and its own free motions."""

    body: int
    neighbors: tuple[int, ...]
    follow: Array
    free: Array
    smallest: float


def null_space(
    blocks: list[Block], bodies: int, width: int, cut: float = MOBILITY_CUT
) -> NullSpace:
    """Return the null space of the rows in `blocks`.

    Parameters
    ----------
    blocks : list of (tuple of int, (m, width * len(bodies)) ndarray)
    bodies : int
        Number of bodies.
    width : int
        Unknowns per body (6 in space, 3 in the plane).
    cut : float
        Singular values below it are motions.
    """
    matrix = _stack(blocks, bodies, width)
    if bodies <= CORE:
        return _dense(matrix.toarray(), bodies * width, cut)
    pivots, core, rest = _eliminate(blocks, bodies, width, min(cut, PIVOT_ZERO))
    vectors, kept = _vectors(pivots, core, rest, bodies, width, cut)
    lengths = np.sqrt(np.asarray(vectors.multiply(vectors).sum(axis=0)).ravel())
    basis = sparse.csc_array(vectors @ sparse.diags_array(1.0 / lengths))
    image = matrix @ basis
    residues = np.sqrt(np.asarray(image.multiply(image).sum(axis=0)).ravel())
    return NullSpace(
        basis, min([kept, *(p.smallest for p in pivots)]), float(residues.max(initial=0.0))
    )


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


def _dense(matrix: Array, columns: int, cut: float) -> NullSpace:
    if len(matrix) == 0:
        return NullSpace(sparse.csc_array(np.eye(columns)), float("inf"), 0.0)
    _, values, vt = np.linalg.svd(matrix, full_matrices=True)
    values = np.concatenate([values, np.zeros(columns - len(values))])
    dropped = values < cut
    kept = values[~dropped]
    return NullSpace(
        sparse.csc_array(vt[dropped].T),
        float(kept.min()) if len(kept) else float("inf"),
        float(values[dropped].max()) if dropped.any() else 0.0,
    )


def _eliminate(
    blocks: list[Block], bodies: int, width: int, zero: float
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
        if np.any((values > zero) & (values < PIVOT_CLEAR)):
            stuck[body] = degree
            continue
        rank = int(np.sum(values >= PIVOT_CLEAR))
        follow = -(vt[:rank].T / values[:rank]) @ (u[:, :rank].T @ rest)
        smallest = float(values[rank - 1]) if rank else float("inf")
        pivots.append(_Pivot(body, tuple(others), follow, vt[rank:].T, smallest))
        alive.discard(body)
        reduced = u[:, rank:].T @ rest
        if len(reduced) > reduced.shape[1]:
            reduced = np.asarray(np.linalg.qr(reduced, mode="r"))
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


def _vectors(
    pivots: list[_Pivot],
    core: list[int],
    rest: list[Block],
    bodies: int,
    width: int,
    cut: float,
) -> tuple[sparse.csc_array, float]:
    """Return a basis of the null space as sparse columns, and the smallest value kept in the core."""
    dense = _gather(rest, core, width) if core else np.zeros((0, 0))
    if len(dense) > dense.shape[1]:
        dense = np.asarray(np.linalg.qr(dense, mode="r"))
    _, values, vt = np.linalg.svd(dense, full_matrices=True)
    values = np.concatenate([values, np.zeros(dense.shape[1] - len(values))])
    count = int(np.sum(values < cut))
    kept = float(values[: len(values) - count].min(initial=np.inf))
    start = vt[len(values) - count :].T
    entries: dict[int, tuple[NDArray[np.int64], Array]] = {
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
    vectors = sparse.csc_array((np.concatenate(data), coordinates), shape=(width * bodies, column))
    return vectors, kept
