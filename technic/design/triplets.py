"""Sparse matrices as triplets: cut out what stays, renumber it, and put the pieces together."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from scipy import sparse

from technic.geometry import Array

__all__ = ["Triplets", "joined", "renumbered"]


@dataclass(frozen=True, slots=True, eq=False)
class Triplets:
    """A sparse matrix as rows, columns and values, to be cut and put together again."""

    row: NDArray[np.intp]
    column: NDArray[np.intp]
    value: Array

    @staticmethod
    def of(matrix: sparse.sparray) -> Triplets:
        """Return the entries of a matrix."""
        coo = sparse.coo_array(matrix)
        return Triplets(coo.coords[0], coo.coords[1], coo.data)

    def only(self, kept: NDArray[np.bool_]) -> Triplets:
        """Return some of the entries."""
        return Triplets(self.row[kept], self.column[kept], self.value[kept])

    def moved(self, rows: NDArray[np.intp], columns: NDArray[np.intp]) -> Triplets:
        """Return the entries whose new row and column (-1: gone) are given."""
        row, column = rows[self.row], columns[self.column]
        kept = (row >= 0) & (column >= 0)
        return Triplets(row[kept], column[kept], self.value[kept])


def joined(pieces: Sequence[Triplets], shape: tuple[int, int]) -> sparse.csr_array:
    """Return the sum of pieces as one matrix."""
    data = np.concatenate([p.value for p in pieces])
    rows = np.concatenate([p.row for p in pieces])
    columns = np.concatenate([p.column for p in pieces])
    return sparse.csr_array((data, (rows, columns)), shape=shape)


def renumbered(stays: NDArray[np.bool_], first: int) -> NDArray[np.intp]:
    """Return new numbers, counted from `first`, for what stays; -1 for the rest."""
    return np.where(stays, first + np.cumsum(stays) - 1, -1)
