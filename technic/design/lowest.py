"""The lowest elastic eigenvalue alone, in a dozen solves."""

from __future__ import annotations

from collections.abc import Callable
from typing import Final

import numpy as np
from scipy import linalg, sparse

from technic.geometry import Array

__all__ = ["lowest_eigenvalue"]

STEPS: Final = 60
"""Lanczos steps after which the search gives up; usual are 8 to 20."""

CLOSE: Final = 1e-8
"""Relative residual of the vector at which it stops: the eigenvalue errs by less than that, by its square
when it stands alone."""

_SPENT: Final = 1e-12
"""A new direction this small beside the last adds nothing: the space is exhausted."""


def lowest_eigenvalue(
    inverse: Callable[[Array], Array],
    stiffness: sparse.csr_array,
    measure: sparse.csr_array,
    start: Array,
) -> float | None:
    """Return the smallest eigenvalue of ``K x = lambda M x`` on the range of the inverse.

    Lanczos steps of the inverse in the inner product of ``M``, each new vector made orthogonal to all
    before it (B. N. Parlett, *The Symmetric Eigenvalue Problem*, 1998, chapters 13 and 15).

    Parameters
    ----------
    inverse : callable
        Symmetric with ``M``; from a load to the displacement, without what costs nothing.
    stiffness, measure : (n, n) sparse
    start : (n,) ndarray
        A load.

    Returns
    -------
    float or None
        None when it has not converged.
    """
    vector = inverse(start)
    size = float(np.sqrt(max(vector @ (measure @ vector), 0.0)))
    if size == 0.0:
        return None
    basis = [vector / size]
    weighted = [measure @ basis[0]]
    diagonal: list[float] = []
    beside: list[float] = []
    for _ in range(STEPS):
        step = inverse(weighted[-1])
        diagonal.append(float(step @ weighted[-1]))
        known, loads = np.array(basis), np.array(weighted)
        for _ in range(2):  # twice is enough
            step = step - (loads @ step) @ known
        load = measure @ step
        beta = float(np.sqrt(max(step @ load, 0.0)))
        values, turns = linalg.eigh_tridiagonal(diagonal, beside)
        if beta * abs(turns[-1, -1]) < CLOSE * values[-1] or beta < _SPENT * values[-1]:
            best = turns[:, -1] @ known
            return float(best @ (stiffness @ best) / (best @ (measure @ best)))
        beside.append(beta)
        basis.append(step / beta)
        weighted.append(load / beta)
    return None
