"""Lowest modes at one geometry after another: each starts from the modes of the one before.

A block Krylov step on the shifted inverse (G. H. Golub and R. Underwood, *The block Lanczos method*,
1977), from the last modes and a few fixed random vectors that catch what comes in from above. Where its
residual is too large, the solver of the analysis takes over.
"""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import Final

import numpy as np
from scipy import linalg, sparse
from scipy.sparse import linalg as sparse_linalg

from technic.design.optimize.pieces import Matrices
from technic.geometry import Array
from technic.rigidity.eigen import elastic_modes
from technic.system.inverse import orthonormal
from technic.tolerances import CONSTRAINT_COMPLIANCE

__all__ = ["Tracker"]

SHIFT: Final = 0.1
"""Shift in units of the lowest eigenvalue of the geometry before."""

POWERS: Final = 5
"""Applications of the inverse to the block."""

NEW: Final = 3
"""Random vectors beside the modes of the geometry before."""

ROUNDS: Final = 4
"""Restarts of the block from what it found, before the solver of the analysis takes over."""

SOUND: Final = 1e-7
"""Largest relative residual of the modes that matter; eigenvalues are as exact as its square."""


@dataclass(slots=True, eq=False)
class Tracker:
    """Finds the lowest modes; remembers the last ones.

    Parameters
    ----------
    count : int
        Modes wanted.
    """

    count: int
    last: Array | None = None
    lowest: float = 0.0
    fresh: int = field(default=0)

    def modes(self, matrices: Matrices, motions: sparse.csc_array) -> tuple[Array, Array]:
        """Return eigenvalues (k,) and M-orthonormal modes (n, k).

        Raises
        ------
        NumericalError
            A factorisation failed or the lowest mode is not sound.
        """
        found = None
        if self.last is not None and self.last.shape[1] == self.count:
            found = self._block(matrices, motions, self.last)
        if found is None:
            pairs = elastic_modes(
                matrices.stiffness, matrices.measure, matrices.constraints, motions, self.count
            )
            found = pairs.values, pairs.vectors
            self.fresh += 1
        if len(found[0]):
            self.lowest, self.last = float(found[0][0]), found[1]
        return found

    def _block(
        self, matrices: Matrices, motions: sparse.csc_array, start: Array
    ) -> tuple[Array, Array] | None:
        measure, stiffness = matrices.measure, matrices.stiffness
        rigid = matrices.constraints
        n, c = stiffness.shape[0], rigid.shape[0]
        shift = SHIFT * self.lowest
        matrix = sparse.csc_array(stiffness + shift * measure)
        try:
            if c:
                soft = CONSTRAINT_COMPLIANCE / float(abs(matrix.diagonal()).max())
                corner = -sparse.diags_array(np.full(c, soft))
                saddle = sparse.block_array([[matrix, rigid.T], [rigid, corner]], format="csc")
                factor = sparse_linalg.splu(saddle)
            else:
                factor = sparse_linalg.splu(
                    matrix,
                    permc_spec="MMD_AT_PLUS_A",
                    diag_pivot_thresh=0.0,
                    options={"SymmetricMode": True},
                )
        except RuntimeError:
            return None
        free = orthonormal(measure, motions.toarray())
        weighted = measure @ free

        def inverse(loads: Array) -> Array:
            answer = factor.solve(np.vstack([loads, np.zeros((c, loads.shape[1]))]))[:n]
            # motions are eigenvectors of this operator: taking them away commutes with it
            return np.asarray(answer - free @ (weighted.T @ answer))

        random = np.random.default_rng(n).standard_normal((n, NEW))
        for _ in range(ROUNDS):
            block = inverse(measure @ np.hstack([start, random]))
            blocks = [block]
            for _ in range(POWERS - 1):
                scale = np.sqrt(np.einsum("nk,nk->k", block, measure @ block))
                block = inverse(measure @ (block / scale))
                blocks.append(block)
            basis = np.hstack(blocks)
            basis /= np.linalg.norm(basis, axis=0)
            basis, triangle, _ = linalg.qr(basis, mode="economic", pivoting=True)
            basis = basis[:, np.abs(np.diag(triangle)) > 1e-11 * abs(triangle[0, 0])]
            small = basis.T @ (stiffness @ basis)
            weight = basis.T @ (measure @ basis)
            try:
                values, inner = linalg.eigh(
                    (small + small.T) / 2.0,
                    (weight + weight.T) / 2.0,
                    subset_by_index=[0, min(self.count + NEW, basis.shape[1]) - 1],
                )
            except linalg.LinAlgError:
                return None
            vectors = basis @ inner
            checked = min(3, self.count)
            rest = inverse(measure @ vectors[:, :checked]) * (values[:checked] + shift)
            rest -= vectors[:, :checked]
            size = np.sqrt(np.einsum("nk,nk->k", rest, measure @ rest))
            if values[0] <= 0.0:
                return None
            if size.max() <= SOUND:
                return values[: self.count], vectors[:, : self.count]
            start, random = vectors[:, : self.count], vectors[:, self.count :]
        return None
