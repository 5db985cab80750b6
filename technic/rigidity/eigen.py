"""Lowest elastic modes of one component: the smallest positive eigenvalues of (K + J) x = lambda M x.

The motions of the component are known from kinematics before the solver starts, so they are projected
out and exactly `count` elastic pairs are asked for. Motions held rigidly enter as constraints through
Lagrange multipliers, not as large numbers.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator
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

LOCAL = 100
"""A motion with at most this many unknowns is lifted rather than projected out."""

SHIFT = 1e-8
"""Shift in units of the stiffest spring: 1 N/m beside the axial 1e8 N/m of a pin, the order of a model's
softest mode, and a hundred million times above rounding."""

SHIFT_SHARE = 1e-3
"""A mode this far below the shift would converge slowly: the shift is lowered and the step repeated. A
motion costs nothing when its energy is this far below the shift."""

Inverse = Callable[[Array], Array]

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
    motions: sparse.csc_array,
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
    motions : (n, k) sparse
        Basis of all unknowns that cost no energy and break no constraint.
    count : int
        Pairs wanted; fewer are returned when there are fewer, or when rounding drowns the higher
        ones (eigenvalues a billion times the lowest).

    Returns
    -------
    EigenPairs
        Values are Rayleigh quotients of the vectors. The residual is that of the inverse problem,
        ``|lambda G M x - x|_M`` with ``G`` the inverse of ``K + J`` on what is elastic: unlike
        ``K x - lambda M x`` it is not drowned by rounding in the stiffest springs.

    Raises
    ------
    NumericalError
        A factorisation failed or the lowest pair's residual is too large.
    """
    n = stiffness.shape[0]
    with single_thread():
        if n <= DENSE:
            inverse, shift, vectors = _dense(stiffness, measure, constraints, motions, count)
        else:
            inverse, shift, vectors = _sparse(stiffness, measure, constraints, motions, count)
        vectors = vectors * _signs(vectors)
        energies = np.einsum("nk,nk->k", vectors, stiffness @ vectors)
        values = energies / np.einsum("nk,nk->k", vectors, measure @ vectors)
        residuals = np.zeros(len(values))
        for k, value in enumerate(values):
            rest = (value + shift) * inverse(measure @ vectors[:, k]) - vectors[:, k]
            residuals[k] = np.sqrt(max(rest @ (measure @ rest), 0.0))
    if len(residuals) and residuals[0] > EIGEN_RESIDUAL:
        raise NumericalError(
            f"the lowest eigenpair has a relative residual of {residuals[0]:.1e}, "
            f"above {EIGEN_RESIDUAL:.0e}"
        )
    sound = int(np.argmax(np.append(residuals > EIGEN_RESIDUAL, True)))
    return EigenPairs(values[:sound], vectors[:, :sound], residuals[:sound])


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
    motions: sparse.csc_array,
    count: int,
) -> tuple[Inverse, float, Array]:
    """Solve on the space that obeys the constraints and is M-orthogonal to the motions."""
    m = measure.toarray()
    rows = np.vstack([constraints.toarray(), (m @ motions.toarray()).T])
    rows = rows / np.maximum(np.linalg.norm(rows, axis=1, keepdims=True), 1e-300)
    space = linalg.null_space(rows, rcond=1e-10) if len(rows) else np.eye(len(m))
    if space.shape[1] == 0:
        return (lambda load: load), 0.0, np.zeros((len(m), 0))
    k = space.T @ (stiffness @ space)
    try:
        factor = linalg.cho_factor((k + k.T) / 2)
        _, vectors = linalg.eigh((k + k.T) / 2, space.T @ m @ space)
    except linalg.LinAlgError as error:
        raise NumericalError(f"the stiffness matrix could not be factorised: {error}") from error
    return (
        lambda load: space @ linalg.cho_solve(factor, space.T @ load),
        0.0,
        (space @ vectors)[:, :count],
    )


def _sparse(
    stiffness: sparse.csr_array,
    measure: sparse.csr_array,
    constraints: sparse.csr_array,
    motions: sparse.csc_array,
    count: int,
) -> tuple[Inverse, float, Array]:
    """Shift and invert on the space that is M-orthogonal to the motions.

    A motion w of few parts that costs nothing is lifted: ``k M w w^T M`` is as local as w and moves no
    elastic mode, because those are M-orthogonal to w. Motions of many parts, and motions that cost a
    little because joints do not line up exactly, are held by Lagrange multipliers.

    The shift decides how fast the iteration converges, not what it converges to; it is lowered once
    when the softest mode turns out to be far below it.
    """
    n, c = stiffness.shape[0], constraints.shape[0]
    count = min(count, n - motions.shape[1] - c - 1)
    if count <= 0:
        return (lambda load: load), 0.0, np.zeros((n, 0))
    biggest = float(abs(stiffness.diagonal()).max())
    shift = SHIFT * biggest
    lift, held = _lift(stiffness, measure, motions, SHIFT_SHARE * shift)
    border = measure @ held
    for last in (False, True):
        matrix = sparse.csc_array(stiffness + lift + shift * measure)
        inverse = _bordered(_factor(matrix, constraints, biggest), border)
        operator: Any = sparse_linalg.LinearOperator((n, n), matvec=inverse, dtype=np.float64)
        start = inverse(measure @ np.cos(np.arange(n) * 1.2345 + 0.5))
        try:
            values, vectors = sparse_linalg.eigsh(
                matrix, k=count, M=measure, sigma=0.0, OPinv=operator, v0=start, tol=1e-12
            )
        except sparse_linalg.ArpackError as error:
            raise NumericalError(f"the eigen solver did not converge: {error}") from error
        lowest = float(values.min()) - shift
        if last or lowest > SHIFT_SHARE * shift:
            break
        shift = max(abs(lowest), SHIFT**2 * biggest)
    return inverse, shift, vectors[:, np.argsort(values)]


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
        return sparse.csr_array(stiffness.shape), _orthonormal(measure, held)
    weighted = sparse.csc_array(measure @ w)
    products = sparse.csc_array(w.T @ weighted)
    if held.shape[1]:
        held = held - w @ sparse_linalg.splu(products).solve(np.asarray(weighted.T @ held))
    # as stiff as the material, so that lifted motions lie among the highest modes
    size = float(np.median(stiffness.diagonal())) / gram[local]
    lift = sparse.csr_array(weighted @ sparse.diags_array(size) @ weighted.T)
    return lift, _orthonormal(measure, held)


def _bordered(solve: Inverse, border: Array) -> Inverse:
    """Return the inverse under the constraints ``border^T x = 0`` (Schur complement)."""
    if border.shape[1] == 0:
        return lambda load: solve(np.ravel(load))
    carried = np.column_stack([solve(column) for column in border.T])
    schur = linalg.cho_factor(border.T @ carried)

    def inverse(load: Array) -> Array:
        answer = solve(np.ravel(load))
        answer = answer - carried @ linalg.cho_solve(schur, border.T @ answer)
        # once more: the first pass leaves rounding of the size of what it took away
        return np.asarray(answer - carried @ linalg.cho_solve(schur, border.T @ answer))

    return inverse


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
    return np.asarray(np.sign(vectors[first, np.arange(vectors.shape[1])]))
