"""How far readings scatter beside the rounding of the ruler: in proportion to what is read."""

from __future__ import annotations

from typing import Final, Literal

import numpy as np
from scipy import optimize

from calibration.model import Array, Design

__all__ = ["HUBER", "TAP_SHARE", "Loss", "scatters"]

Loss = Literal["linear", "huber"]

HUBER: Final = 1.345
"""Huber's constant: 95 % of the efficiency of least squares when errors are normal."""

TAP_SHARE: Final = 0.5
"""Scatter of a frequency in that of a displacement: a frequency goes with the root of the stiffness."""

_FEW: Final = 3.0
"""With fewer degrees of freedom than this, readings of one kind do not tell their own scatter."""


def scatters(
    data: Design, misfit: Array, size: Array, matrix: Array, loss: Loss
) -> tuple[float, float]:
    """Return the proportional scatter of displacements and of frequencies.

    The unknowns are shared out between the two kinds by leverage. Where one kind is too rare to tell, the
    other lends its scatter: joints whose stiffness scatters move a frequency half as much as a sag.
    """
    if not data.tapped.any() or data.tapped.all():
        one = _scatter(misfit, data.rounding, size, matrix.shape[1], loss)
        return (one / TAP_SHARE, one) if data.tapped.any() else (one, one * TAP_SHARE)
    basis, _ = np.linalg.qr(matrix)
    leverage = np.einsum("ij,ij->i", basis, basis)
    out: list[float | None] = []
    for kind in (~data.tapped, data.tapped):
        used = float(leverage[kind].sum())
        few = np.count_nonzero(kind) - used < _FEW
        found = None if few else _scatter(misfit[kind], data.rounding[kind], size[kind], used, loss)
        out.append(found)
    sag, tap = out
    if sag is None and tap is None:
        # few of either: what is left over is told together
        weight = np.where(data.tapped, TAP_SHARE, 1.0)
        sag = _scatter(misfit, data.rounding, weight * size, matrix.shape[1], loss)
    if sag is None:
        assert tap is not None  # the other case stands above
        sag = tap / TAP_SHARE
    return sag, sag * TAP_SHARE if tap is None else tap


def _scatter(misfit: Array, rounding: Array, size: Array, used: float, loss: Loss) -> float:
    """Return the proportional scatter that makes the weighted residuals as large as they should be."""
    dof = len(misfit) - used
    if dof <= 0:
        return 0.0

    def excess(b: float) -> float:
        z = misfit / np.hypot(rounding, b * size)
        if loss == "huber":
            # the median does not see outliers; 0.6745 is that of a standard normal's size
            return float(np.median(np.abs(z)) / 0.6745 * np.sqrt(len(z) / dof)) - 1.0
        return float(z @ z) / dof - 1.0

    if excess(0.0) <= 0.0:
        return 0.0
    high = 0.1
    while excess(high) > 0.0 and high < 1e3:
        high *= 4.0
    return float(optimize.brentq(excess, 0.0, high, xtol=1e-14)) if high < 1e3 else high
