"""Lowest elastic modes of one component: the smallest positive eigenvalues of (K + J) x = lambda M x.

The motions of the component are known from kinematics before the solver starts, so they are projected
out and exactly `count` elastic pairs are asked for. Motions held rigidly enter as constraints through
Lagrange multipliers, not as large numbers.
"""

from __future__ import annotations

from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import dataclass
from typing import Any

import numpy as np
from scipy import linalg, sparse
from scipy.sparse import linalg as sparse_linalg

from technic.errors import NumericalError
from technic.geometry import Array
from technic.tolerances import CONSTRAINT_COMPLIANCE, EIGEN_RESIDUAL

__all__ = ["EigenPairs", "elastic_modes", "single_thread"]

DENSE = 400
"""Number of unknowns up to which a dense solver is as fast and simpler."""


@dataclass(frozen=True, slots=True, eq=False)
class EigenPairs:
    """Eigenvalues, ascending, and M-orthonormal eigenvectors with relative residuals."""

    values: Array
    vectors: Array
    residuals: Array


@contextmanager
def single_thread() -> Iterator[None]:
    """Limit BLAS to one thread: on these sizes two threads make the eigen step 2 to 5 times slower."""
    from threadpoolctl import threadpool_limits

    with threadpool_limits(limits=1, user_api="blas"):
        yield


def elastic_modes(
    stiffness: sparse.csr_array,
    measure: sparse.csr_array,
    constraints: sparse.csr_array,
    motions: Array,
    count: int,
) -> EigenPairs:
    """Return the lowest elastic modes.

    Parameters
    ----------
    stiffness : (n, n) sparse
        ``K + J``, positive semi-definite.
    measure : (n, n) sparse
        ``M``, positive definite.
    constraints : (c, n) sparse
        Rows held rigidly; they may depend on each other.
    motions : (n, k) ndarray
        Basis of all unknowns that cost no energy and break no constraint.
    count : int
        Pairs wanted; fewer are returned when there are fewer.

    Raises
    ------
    NumericalError
        A factorisation failed or a residual is too large.
    """
    n = stiffness.shape[0]
    motions = _orthonormal(measure, motions)
    if n <= DENSE:
        values, vectors = _dense(stiffness, measure, constraints, motions, count)
    else:
        with single_thread():
            values, vectors = _sparse(stiffness, measure, constraints, motions, count)
    vectors = vectors * _signs(vectors)
    residuals = _residuals(stiffness, measure, constraints, values, vectors)
    if len(residuals) and residuals.max() > EIGEN_RESIDUAL:
        raise NumericalError(
            f"an eigenpair has a relative residual of {residuals.max():.1e}, "
            f"above {EIGEN_RESIDUAL:.0e}"
        )
    return EigenPairs(values, vectors, residuals)


def _orthonormal(measure: sparse.csr_array, vectors: Array) -> Array:
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


def _dense(
    stiffness: sparse.csr_array,
    measure: sparse.csr_array,
    constraints: sparse.csr_array,
    motions: Array,
    count: int,
) -> tuple[Array, Array]:
    """Solve on the space that obeys the constraints and is M-orthogonal to the motions."""
    m = measure.toarray()
    rows = np.vstack([constraints.toarray(), (m @ motions).T])
    rows = rows / np.maximum(np.linalg.norm(rows, axis=1, keepdims=True), 1e-300)
    space = linalg.null_space(rows, rcond=1e-10) if len(rows) else np.eye(len(m))
    if space.shape[1] == 0:
        return np.zeros(0), np.zeros((len(m), 0))
    k = space.T @ (stiffness @ space)
    values, vectors = linalg.eigh((k + k.T) / 2, space.T @ m @ space)
    return values[:count], (space @ vectors)[:, :count]


def _sparse(
    stiffness: sparse.csr_array,
    measure: sparse.csr_array,
    constraints: sparse.csr_array,
    motions: Array,
    count: int,
) -> tuple[Array, Array]:
    """Shift and invert, with the motions projected out of every step."""
    n, c = stiffness.shape[0], constraints.shape[0]
    count = min(count, n - motions.shape[1] - c - 1)
    if count <= 0:
        return np.zeros(0), np.zeros((n, 0))
    biggest = float(abs(stiffness.diagonal()).max())
    # A shift of this size keeps the factor well inside rounding and far below any elastic mode worth
    # a report; the motions that it would lift are projected out anyway.
    shift = 1e-11 * biggest / max(float(measure.diagonal().max()), 1e-300)
    matrix = sparse.csc_array(stiffness + shift * measure)
    solve = _factor(matrix, constraints, biggest)
    weighted = measure @ motions

    def apply(load: Array) -> Array:
        load = np.ravel(load)
        answer = solve(load - weighted @ (motions.T @ load))
        answer -= motions @ (weighted.T @ answer)
        return np.asarray(answer)

    operator: Any = sparse_linalg.LinearOperator((n, n), matvec=apply, dtype=np.float64)
    start = apply(measure @ np.cos(np.arange(n) * 1.2345 + 0.5))
    try:
        values, vectors = sparse_linalg.eigsh(
            matrix, k=count, M=measure, sigma=0.0, OPinv=operator, v0=start, tol=1e-12
        )
    except sparse_linalg.ArpackError as error:
        raise NumericalError(f"the eigen solver did not converge: {error}") from error
    order = np.argsort(values)
    vectors = vectors[:, order]
    energies = np.einsum("nk,nk->k", vectors, stiffness @ vectors)
    return energies / np.einsum("nk,nk->k", vectors, measure @ vectors), vectors


def _factor(matrix: sparse.csc_array, constraints: sparse.csr_array, biggest: float) -> Any:
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
            return factor.solve
        # A compliance this far below the stiffest spring also settles rows that depend on each other.
        soft = sparse.diags_array(np.full(c, CONSTRAINT_COMPLIANCE / biggest))
        saddle = sparse.block_array([[matrix, constraints.T], [constraints, -soft]], format="csc")
        factor = sparse_linalg.splu(saddle, permc_spec="COLAMD")
    except RuntimeError as error:
        raise NumericalError(f"the stiffness matrix could not be factorised: {error}") from error
    zeros = np.zeros(c)
    return lambda load: factor.solve(np.concatenate([load, zeros]))[:n]


def _signs(vectors: Array) -> Array:
    """Return the signs that make each vector's largest entry positive (the first among equals)."""
    if vectors.size == 0:
        return np.ones(vectors.shape[1])
    size = np.abs(vectors)
    near = size >= 0.999 * size.max(axis=0)
    first = near.argmax(axis=0)
    return np.sign(vectors[first, np.arange(vectors.shape[1])])


def _residuals(
    stiffness: sparse.csr_array,
    measure: sparse.csr_array,
    constraints: sparse.csr_array,
    values: Array,
    vectors: Array,
) -> Array:
    """Return ``|K x - lambda M x| / | |K| |x| |``, the reactions of the constraints taken out.

    The size in the denominator is that of the terms which cancel in ``K x``, so that rounding in a
    model with very stiff joints is not mistaken for an error.
    """
    if not len(values):
        return np.zeros(0)
    rest = stiffness @ vectors - (measure @ vectors) * values
    if constraints.shape[0]:
        reactions = sparse_linalg.lsqr
        ct = sparse.csc_array(constraints.T)
        rest = np.column_stack([r - ct @ reactions(ct, r, atol=1e-14, btol=1e-14)[0] for r in rest.T])
    size = abs(stiffness) @ np.abs(vectors) + (measure @ np.abs(vectors)) * np.abs(values)
    return np.linalg.norm(rest, axis=0) / np.linalg.norm(size, axis=0)
