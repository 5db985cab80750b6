"""A positive definite matrix in a space of symmetric matrices, or none that could be found.

Small semidefinite problems: the smallest eigenvalue is a concave function of the matrix, so that its
largest value over the unit ball of combinations has one maximum, which ascent on a smoothed function finds.
"""

from __future__ import annotations

import numpy as np
from scipy import optimize

from technic.geometry import Array

__all__ = ["positive_combination"]

SOFTNESS = (0.1, 0.03, 0.01, 0.003)
"""Widths of the soft minimum of the eigenvalues, in units of the largest; each starts where the
last ended."""

POSITIVE = 1e-6
"""Smallest eigenvalue of a matrix called positive definite, its largest being one: well above rounding, which
leaves 1e-10 where forms come out as zero."""


def positive_combination(forms: Array) -> Array | None:
    """Return the combination of symmetric matrices that is positive definite, or None.

    Parameters
    ----------
    forms : (w, k, k) ndarray
        Independent.

    Returns
    -------
    (w,) ndarray or None
        Unit length. None is not a proof that there is none when ``k > 1`` and ``w > 1``.

    Examples
    --------
    >>> positive_combination(np.array([[[-2.0]]]))
    array([-1.])
    >>> positive_combination(np.array([np.diag([1.0, -1.0])])) is None
    True
    """
    count, size = forms.shape[:2]
    flat = forms.reshape(count, -1)
    scale = float(np.abs(np.linalg.eigvalsh(forms)).max(initial=0.0))
    if scale == 0.0:
        return None
    # a positive definite matrix has a positive trace, so one form has one possible sign
    nearest, *_ = np.linalg.lstsq(flat.T, np.eye(size).ravel(), rcond=None)
    if np.linalg.norm(nearest) == 0.0:
        return None
    found = nearest / np.linalg.norm(nearest)
    if count > 1 and not _definite(found, forms):
        for width in SOFTNESS:
            found = _ascend(found, forms, width * scale)
            if _definite(found, forms):
                break
    return found if _definite(found, forms) else None


def _definite(share: Array, forms: Array) -> bool:
    values = np.linalg.eigvalsh(np.tensordot(share, forms, 1))
    return bool(values[0] > POSITIVE * np.abs(values).max())


def _ascend(share: Array, forms: Array, width: float) -> Array:
    """Return the direction with the largest soft minimum of the eigenvalues, from a start."""

    def target(point: Array) -> tuple[float, Array]:
        length = float(np.linalg.norm(point))
        unit = point / length
        values, vectors = np.linalg.eigh(np.tensordot(unit, forms, 1))
        weights = np.exp(-(values - values[0]) / width)
        soft = float(values[0]) - width * float(np.log(weights.sum()))
        weights /= weights.sum()
        slope = np.einsum("wij,ia,ja,a->w", forms, vectors, vectors, weights, optimize=True)
        return -soft, -(slope - (slope @ unit) * unit) / length

    result = optimize.minimize(target, share, jac=True, method="L-BFGS-B")
    return np.asarray(result.x / np.linalg.norm(result.x))
