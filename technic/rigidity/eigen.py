"""Lowest elastic modes of one component: the smallest positive eigenvalues of (K + J) x = lambda M x.

The motions of the component are known from kinematics before the solver starts, so they are projected
out and exactly `count` elastic pairs are asked for. Motions held rigidly enter as constraints through
Lagrange multipliers, not as large numbers.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from typing import Any

import numpy as np
from scipy import linalg, sparse
from scipy.sparse import linalg as sparse_linalg

from technic.errors import NumericalError
from technic.geometry import Array
from technic.system.inverse import SHIFT, shifted_inverse, single_thread
from technic.tolerances import EIGEN_RESIDUAL

__all__ = ["EigenPairs", "elastic_modes"]

Inverse = Callable[[Array], Array]

SLOW = 1e-3
"""A mode this far below the shift converges slowly: the shift is lowered and the step repeated."""

UNSEEN = 1e-13
"""Inverse eigenvalues below this share of the largest are rounding: what moves there, the measure does not
see."""

DENSE = 400
"""Number of unknowns up to which a dense solver is as fast and simpler."""


@dataclass(frozen=True, slots=True, eq=False)
class EigenPairs:
    """Eigenvalues, ascending, and M-orthonormal eigenvectors with relative residuals."""

    values: Array
    vectors: Array
    residuals: Array


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
    stiffness, measure, constraints, motions : sparse
        As for `technic.system.inverse.shifted_inverse`.
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


def _dense(
    stiffness: sparse.csr_array,
    measure: sparse.csr_array,
    constraints: sparse.csr_array,
    motions: sparse.csc_array,
    count: int,
) -> tuple[Inverse, float, Array]:
    """Solve on the space that obeys the constraints and is M-orthogonal to the motions.

    There the stiffness is positive definite; the measure need not be (nodes that turn do not show in the
    unweighted one), so ``M x = (1 / lambda) K x`` is solved, largest value first.
    """
    m = measure.toarray()
    rows = np.vstack([constraints.toarray(), (m @ motions.toarray()).T])
    rows = rows / np.maximum(np.linalg.norm(rows, axis=1, keepdims=True), 1e-300)
    space = linalg.null_space(rows, rcond=1e-10) if len(rows) else np.eye(len(m))
    if space.shape[1] == 0:
        return (lambda load: load), 0.0, np.zeros((len(m), 0))
    k = space.T @ (stiffness @ space)
    try:
        factor = linalg.cho_factor((k + k.T) / 2)
        inverse, vectors = linalg.eigh(space.T @ m @ space, (k + k.T) / 2)
    except linalg.LinAlgError as error:
        raise NumericalError(f"the stiffness matrix could not be factorised: {error}") from error
    count = min(count, int(np.sum(inverse > UNSEEN * inverse[-1])))
    vectors = (vectors / np.sqrt(np.maximum(inverse, 1e-300)))[:, ::-1]
    return (
        lambda load: space @ linalg.cho_solve(factor, space.T @ load),
        0.0,
        (space @ vectors[:, :count]),
    )


def _sparse(
    stiffness: sparse.csr_array,
    measure: sparse.csr_array,
    constraints: sparse.csr_array,
    motions: sparse.csc_array,
    count: int,
) -> tuple[Inverse, float, Array]:
    """Shift and invert on the space that is M-orthogonal to the motions.

    The shift decides how fast the iteration converges, not what it converges to; it is lowered once
    when the softest mode turns out to be far below it.
    """
    n = stiffness.shape[0]
    count = min(count, n - motions.shape[1] - constraints.shape[0] - 1)
    if count <= 0:
        return (lambda load: load), 0.0, np.zeros((n, 0))
    biggest = float(abs(stiffness.diagonal()).max())
    shift = SHIFT * biggest
    for last in (False, True):
        inverse = shifted_inverse(stiffness, measure, constraints, motions, shift)
        operator: Any = sparse_linalg.LinearOperator((n, n), matvec=inverse.solve, dtype=np.float64)
        start = inverse.solve(measure @ np.cos(np.arange(n) * 1.2345 + 0.5))
        try:
            values, vectors = sparse_linalg.eigsh(
                inverse.matrix, k=count, M=measure, sigma=0.0, OPinv=operator, v0=start, tol=1e-12
            )
        except sparse_linalg.ArpackError as error:
            raise NumericalError(f"the eigen solver did not converge: {error}") from error
        lowest = float(values.min()) - shift
        if last or lowest > SLOW * shift:
            break
        shift = max(abs(lowest), SHIFT**2 * biggest)
    return inverse.solve, shift, vectors[:, np.argsort(values)]


def _signs(vectors: Array) -> Array:
    """Return the signs that make each vector's largest entry positive (the first among equals)."""
    if vectors.size == 0:
        return np.ones(vectors.shape[1])
    size = np.abs(vectors)
    near = size >= 0.999 * size.max(axis=0)
    first = near.argmax(axis=0)
    return np.asarray(np.sign(vectors[first, np.arange(vectors.shape[1])]))
