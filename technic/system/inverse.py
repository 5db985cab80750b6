"""The inverse of a stiffness that is singular: on what is M-orthogonal to the motions.

A motion w of few parts that costs nothing is lifted: ``k M w w^T M`` is as local as w and changes nothing
that is M-orthogonal to w. Motions of many parts, and motions that cost a little because joints do not line
up exactly, are held by Lagrange multipliers, and so are motions that joints hold rigidly.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator
from contextlib import contextmanager
from dataclasses import dataclass

import numpy as np
from scipy import linalg, sparse
from scipy.sparse import linalg as sparse_linalg

from technic.errors import NumericalError
from technic.geometry import Array
from technic.tolerances import CONSTRAINT_COMPLIANCE

__all__ = [
    "SHIFT",
    "SHIFT_SHARE",
    "ShiftedInverse",
    "bordered_inverse",
    "orthonormal",
    "shifted_inverse",
    "single_thread",
]

SHIFT = 1e-8
"""Shift in units of the stiffest spring: 1 N/m beside the axial 1e8 N/m of a pin, the order of a model's
softest mode, and a hundred million times above rounding."""

SHIFT_SHARE = 1e-3
"""A motion costs nothing when its energy is this far below the shift."""

LOCAL = 100
"""A motion with at most this many unknowns is lifted rather than held."""

Inverse = Callable[[Array], Array]


@dataclass(frozen=True, slots=True, eq=False)
class ShiftedInverse:
    """Inverse of ``K + shift M`` on what is M-orthogonal to the motions and obeys the constraints.

    Parameters
    ----------
    matrix : (n, n) sparse
        ``K + shift M`` with local motions lifted.
    solve : callable
        From a load to the displacement.
    shift : float
    """

    matrix: sparse.csc_array
    solve: Inverse
    shift: float


@contextmanager
def single_thread() -> Iterator[None]:
    """Limit BLAS to one thread: on these sizes two threads make the eigen step 2 to 5 times slower."""
    from threadpoolctl import threadpool_limits

    with threadpool_limits(limits=1, user_api="blas"):
        yield


def shifted_inverse(
    stiffness: sparse.csr_array,
    measure: sparse.csr_array,
    constraints: sparse.csr_array,
    motions: sparse.csc_array,
    shift: float,
) -> ShiftedInverse:
    """Return the inverse.

    Parameters
    ----------
    stiffness : (n, n) sparse
        ``K + J``, positive semi-definite.
    measure : (n, n) sparse
        ``M``, positive definite.
    constraints : (c, n) sparse
        Rows held rigidly; they may depend on each other.
    motions : (n, k) sparse
        Basis of all unknowns that cost no energy and break no constraint.
    shift : float
        Positive.

    Raises
    ------
    NumericalError
        The factorisation failed.
    """
    biggest = float(abs(stiffness.diagonal()).max(initial=0.0))
    lift, held = _lift(stiffness, measure, motions, SHIFT_SHARE * shift)
    matrix = sparse.csc_array(stiffness + lift + shift * measure)
    solve = bordered_inverse(matrix, constraints, measure @ held, biggest)
    return ShiftedInverse(matrix, solve, shift)


def bordered_inverse(
    matrix: sparse.csc_array, constraints: sparse.csr_array, border: Array, biggest: float
) -> Inverse:
    """Return the inverse of a regular matrix on what obeys constraints.

    Parameters
    ----------
    matrix : (n, n) sparse
    constraints : (c, n) sparse
        Rows that may depend on each other.
    border : (n, b) ndarray
        Columns that what comes out is orthogonal to; independent of each other.
    biggest : float
        Stiffest spring on the diagonal.
    """
    return _bordered(_factor(matrix, constraints, biggest), border)


def _lift(
    stiffness: sparse.csr_array, measure: sparse.csr_array, motions: sparse.csc_array, free: float
) -> tuple[sparse.csr_array, Array]:
    """Return the stiffness that lifts local motions, and the other motions, M-orthonormal.

    `free` is the energy per unit measure below which a motion costs nothing.
    """
    gram = np.asarray((motions.multiply(measure @ motions)).sum(axis=0)).ravel()
    energy = np.asarray((motions.multiply(stiffness @ motions)).sum(axis=0)).ravel()
    local = (np.diff(motions.indptr) <= LOCAL) & (energy <= free * gram)
    w = sparse.csc_array(motions[:, local])
    held = motions[:, ~local].toarray()
    if w.shape[1] == 0:
        return sparse.csr_array(stiffness.shape), orthonormal(measure, held)
    weighted = sparse.csc_array(measure @ w)
    products = sparse.csc_array(w.T @ weighted)
    if held.shape[1]:
        held = held - w @ sparse_linalg.splu(products).solve(np.asarray(weighted.T @ held))
    # an eigenvalue of the size of the stiffest spring, far above every mode worth a report
    size = float(abs(stiffness.diagonal()).max()) / gram[local]
    lift = sparse.csr_array(weighted @ sparse.diags_array(size) @ weighted.T)
    return lift, orthonormal(measure, held)


def _bordered(solve: Inverse, border: Array) -> Inverse:
    """Return the inverse under the constraints ``border^T x = 0`` (Schur complement)."""
    if border.shape[1] == 0:
        return lambda load: solve(np.ravel(load))
    carried = solve(border)
    schur = linalg.cho_factor(border.T @ carried)

    def inverse(load: Array) -> Array:
        answer = solve(np.ravel(load))
        answer = answer - carried @ linalg.cho_solve(schur, border.T @ answer)
        # once more: the first pass leaves rounding of the size of what it took away
        return np.asarray(answer - carried @ linalg.cho_solve(schur, border.T @ answer))

    return inverse


def orthonormal(measure: sparse.csr_array, vectors: Array) -> Array:
    """Return an M-orthonormal basis of the same space."""
    if vectors.shape[1] == 0:
        return vectors
    vectors, _ = np.linalg.qr(vectors)
    for _ in range(2):  # twice, because one pass loses digits when M weighs vectors unequally
        gram = vectors.T @ (measure @ vectors)
        vectors = linalg.solve_triangular(
            np.linalg.cholesky((gram + gram.T) / 2), vectors.T, lower=True
        ).T
    return vectors


def _factor(matrix: sparse.csc_array, constraints: sparse.csr_array, biggest: float) -> Inverse:
    """Return a function that solves with the matrix, under the constraints if there are any."""
    n, c = matrix.shape[0], constraints.shape[0]
    try:
        if c == 0:
            factor = sparse_linalg.splu(
                matrix,
                permc_spec="MMD_AT_PLUS_A",
                diag_pivot_thresh=0.0,
                options={"SymmetricMode": True},
            )
            solve: Inverse = factor.solve
            return solve
        # A compliance this far below the stiffest spring also settles rows that depend on each other.
        soft = sparse.diags_array(np.full(c, CONSTRAINT_COMPLIANCE / biggest))
        saddle = sparse.block_array([[matrix, constraints.T], [constraints, -soft]], format="csc")
        factor = sparse_linalg.splu(saddle, permc_spec="COLAMD")
    except RuntimeError as error:
        raise NumericalError(f"the stiffness matrix could not be factorised: {error}") from error

    def padded(load: Array) -> Array:
        nothing = np.zeros((c, *load.shape[1:]))
        return np.asarray(factor.solve(np.concatenate([load, nothing]))[:n])

    return padded
