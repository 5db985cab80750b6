"""Joint stiffnesses from readings: weighted nonlinear least squares in the logarithms.

The error of a reading has two parts: rounding to the ruler's steps, known from its resolution, and a
scatter in proportion to what is read (friction, seating, how the pin was pushed in), which is found from
the readings themselves so that the weighted residuals have the variance they should have: one scatter for
displacements, one for frequencies. The mechanics comes in as a callable; this module knows none.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Final, Literal

import numpy as np
from numpy.typing import NDArray
from scipy import optimize, stats

from calibration.dataset import Reading
from calibration.errors import FitError
from calibration.model import Array, Design, Forward, Offset, design, weighted_matrix
from calibration.scatter import HUBER, TAP_SHARE, Loss, scatters

__all__ = ["Fit", "Loss", "Switch", "fit"]

Switch = Literal["auto", "off"]

WIDEST: Final = 1.0
"""A stiffness is identifiable when the standard deviation of its logarithm is below this: the 95 %
interval then spans less than a factor of fifty, not orders of magnitude."""

REACH: Final = np.log(1e4)
"""Stiffnesses are sought within this factor of where the search starts."""

CONTRADICTION: Final = 0.5
"""Readings that scatter by more than this share of their size contradict each other or the rig."""

OFFSET_P: Final = 1e-3
"""An offset is kept when chance would show one as large this rarely: a needless one costs precision."""

_OUTER = 30


@dataclass(frozen=True, slots=True, eq=False)
class Fit:
    """The estimate.

    Parameters
    ----------
    log_stiffness : (k,) ndarray
        All parameters; those that could not be identified keep their start.
    active : tuple of int
        The identified ones.
    offsets : tuple of Offset
        Those that were kept.
    offset_values : (q,) ndarray
        (m)
    covariance : (a + q, a + q) ndarray
        Of the logarithms of the active stiffnesses, then of the offsets (m).
    quantile : float
        How many standard deviations reach to the ends of the 95 % interval.
    scatter, tap_scatter : float
        Standard deviation in proportion to the displacement, and to the frequency in tap tests.
    sigma, predicted, residuals, leverage : (n,) ndarray
        Standard deviation (m or Hz), prediction (m or Hz), weighted residual and leverage of each
        reading.
    chi2 : float
    dof : int
    singular_values : (a,) ndarray
        Of the weighted Jacobian of the active stiffnesses: one over the standard deviation along each
        principal direction.
    clustered : bool
        True when specimens differ, so that they, not readings, were counted as independent.
    """

    log_stiffness: Array
    active: tuple[int, ...]
    offsets: tuple[Offset, ...]
    offset_values: Array
    covariance: Array
    quantile: float
    scatter: float
    tap_scatter: float
    sigma: Array
    predicted: Array
    residuals: Array
    leverage: Array
    chi2: float
    dof: int
    singular_values: Array
    clustered: bool

    @property
    def deviations(self) -> Array:
        """Standard deviations of the active logarithms, then of the offsets."""
        return np.asarray(np.sqrt(np.diag(self.covariance)))

    def interval(self, k: int) -> tuple[float, float]:
        """Return the 95 % interval of the k-th active stiffness."""
        centre = self.log_stiffness[self.active[k]]
        half = self.quantile * self.deviations[k]
        return float(np.exp(centre - half)), float(np.exp(centre + half))


def fit(
    readings: Sequence[Reading],
    forward: Forward,
    start: Array,
    *,
    loss: Loss = "linear",
    offsets: Switch = "auto",
) -> Fit:
    """Return the stiffnesses that explain the readings best.

    Parameters
    ----------
    readings : sequence of Reading
    forward : callable
    start : (k,) array_like
        Stiffnesses to start from, the most wanted first: when the data allow only some, these are
        fitted and the others stay at their start.
    loss : {"linear", "huber"}
        Huber's loss gives outliers less weight.
    offsets : {"auto", "off"}
        Whether free play and hysteresis are looked for.

    Raises
    ------
    FitError
        Too few readings, none that tells a stiffness, or readings that contradict each other.
    """
    if not readings:
        raise FitError("there are no readings")
    data = design(readings)
    begin = np.log(np.asarray(start, dtype=float))
    every = tuple(range(len(data.offsets))) if offsets == "auto" else ()
    state = _converge(data, forward, begin, every, loss)
    if every and state.active:
        size = len(state.active)
        covariance, dof = _covariance(state), max(1, len(data.read) - size - len(every))
        t = np.abs(state.shift) / np.sqrt(np.diag(covariance))[size:]
        limit = stats.t.ppf(1.0 - OFFSET_P / 2.0, dof)
        kept = tuple(k for k, value in zip(every, t, strict=True) if value > limit)
        if kept != every:
            state = _converge(data, forward, begin, kept, loss)
    _refuse_contradiction(state, readings, begin)
    if not state.active:
        raise FitError("no stiffness shows in these readings: the loads hardly move the rigs")
    return _result(data, state, readings)


@dataclass(slots=True, eq=False)
class _State:
    """Where the iteration stands."""

    log_stiffness: Array
    shift: Array
    offsets: tuple[int, ...]
    active: tuple[int, ...]
    scatter: tuple[float, float]
    sigma: Array
    predicted: Array
    matrix: Array
    residuals: Array
    weights: Array


def _converge(
    data: Design, forward: Forward, begin: Array, offsets: tuple[int, ...], loss: Loss
) -> _State:
    """Alternate between the stiffnesses, the scatter and what can be identified."""
    columns = data.columns[:, list(offsets)]
    log_s, shift = begin.copy(), np.zeros(len(offsets))
    value, slope = data.predict(forward, log_s)
    # to begin with; found from the residuals from the first round on
    scatter = (0.05, 0.05 * TAP_SHARE)

    def deviations(scatter: tuple[float, float], size: Array) -> Array:
        return np.hypot(data.rounding, np.where(data.tapped, scatter[1], scatter[0]) * size)

    size = np.abs(value)
    active = _identifiable(slope, columns, deviations(scatter, size))
    for turn in range(_OUTER):
        sigma = deviations(scatter, size)
        log_s, shift = _minimise(data, forward, log_s, shift, active, columns, sigma, loss)
        value, slope = data.predict(forward, log_s)
        size, before = np.abs(value), scatter
        misfit = data.read - value - columns @ shift
        matrix = weighted_matrix(slope[:, list(active)], columns, sigma)
        scatter = scatters(data, misfit, size, matrix, loss)
        # at the start every stiffness is a guess: what shows is decided where the fit ends up
        # (readings that contradict each other are refused at the end, not called silent)
        spread = (min(scatter[0], CONTRADICTION), min(scatter[1], CONTRADICTION * TAP_SHARE))
        found = _identifiable(slope, columns, deviations(spread, size))
        if found != active and turn < _OUTER // 2:
            active = found
            log_s = np.where(np.isin(np.arange(len(begin)), active), log_s, begin)
        elif all(abs(x - y) <= 1e-9 * (x + 1e-9) for x, y in zip(scatter, before, strict=True)):
            break
    sigma = deviations(scatter, size)
    residuals = misfit / sigma
    weights = np.ones(len(residuals))
    if loss == "huber":
        weights = np.minimum(1.0, HUBER / np.maximum(np.abs(residuals), 1e-12))
    matrix = weighted_matrix(slope[:, list(active)], columns, sigma)
    predicted = value + columns @ shift
    return _State(
        log_s, shift, offsets, active, scatter, sigma, predicted, matrix, residuals, weights
    )


def _minimise(
    data: Design,
    forward: Forward,
    log_s: Array,
    shift: Array,
    active: tuple[int, ...],
    columns: Array,
    sigma: Array,
    loss: Loss,
) -> tuple[Array, Array]:
    """Return the best active stiffnesses and offsets for given weights."""
    chosen, count = list(active), len(active)
    # offsets in the size of the errors, so that all unknowns are of one order
    unit = float(np.median(sigma[~data.tapped])) if len(shift) else 1.0

    def unpack(z: Array) -> tuple[Array, Array]:
        out = log_s.copy()
        out[chosen] = z[:count]
        return out, z[count:] * unit

    def residuals(z: Array) -> Array:
        s, c = unpack(z)
        return np.asarray((data.predict(forward, s)[0] + columns @ c - data.read) / sigma)

    def jacobian(z: Array) -> Array:
        slope = data.predict(forward, unpack(z)[0])[1][:, chosen]
        return weighted_matrix(slope, unit * columns, sigma)

    begin = np.concatenate([log_s[chosen], shift / unit])
    if not len(begin):
        return log_s, shift
    low, high = np.full(len(begin), -np.inf), np.full(len(begin), np.inf)
    low[:count], high[:count] = begin[:count] - REACH, begin[:count] + REACH
    answer = optimize.least_squares(
        residuals,
        begin,
        jacobian,
        bounds=(low, high),
        loss=loss,
        f_scale=HUBER if loss == "huber" else 1.0,
        xtol=1e-13,
        ftol=1e-14,
        gtol=1e-14,
        max_nfev=200,
    )
    return unpack(answer.x)


def _identifiable(slope: Array, columns: Array, sigma: Array) -> tuple[int, ...]:
    """Return the stiffnesses that the readings can tell, the most wanted first.

    A stiffness joins when, with it, the smallest singular value of the weighted Jacobian (offsets taken
    out) still means a standard deviation below `WIDEST` in every direction.
    """
    j = slope / sigma[:, None]
    if columns.shape[1]:
        c, _ = np.linalg.qr(columns / sigma[:, None])
        j = j - c @ (c.T @ j)
    chosen: list[int] = []
    for k in range(j.shape[1]):
        trial = [*chosen, k]
        if len(trial) <= len(j) and np.linalg.svd(j[:, trial], compute_uv=False)[-1] >= 1 / WIDEST:
            chosen = trial
    return tuple(chosen)


def _covariance(state: _State) -> Array:
    weighted = state.matrix * np.sqrt(state.weights)[:, None]
    return np.asarray(np.linalg.pinv(weighted.T @ weighted, hermitian=True))


def _refuse_contradiction(state: _State, readings: Sequence[Reading], begin: Array) -> None:
    scatter = max(state.scatter[0], state.scatter[1] / TAP_SHARE)
    if scatter > CONTRADICTION:
        worst = np.argsort(-np.abs(state.residuals))[:5]
        rows = ", ".join(str(readings[k].row) for k in sorted(worst))
        raise FitError(
            "the readings contradict each other or the rig: beside the best fit they scatter by "
            f"{100 * scatter:.0f} % of their size. Look at rows {rows} first, then at rig, pose, "
            "span and units"
        )
    edge = np.abs(state.log_stiffness - begin) > REACH - 1e-6
    if np.any(edge) or not np.all(np.isfinite(state.log_stiffness)):
        raise FitError(
            "the readings ask for a stiffness ten thousand times off what such joints have: the rig "
            "moved far less or far more than it can. Look at rig, pose, span and units"
        )


def _result(data: Design, state: _State, readings: Sequence[Reading]) -> Fit:
    count = len(state.active)
    dof = max(1, len(readings) - count - len(state.shift))
    covariance = _covariance(state)
    leverage = np.einsum("ij,jk,ik->i", state.matrix, covariance, state.matrix) * state.weights
    quantile, clustered = float(stats.t.ppf(0.975, dof)), False
    groups = _specimens(readings)
    if _specimens_differ(state.residuals, groups):
        # readings of one specimen share its error: specimens are what is independent
        score = np.zeros((len(groups), state.matrix.shape[1]))
        np.add.at(score, _group_of(groups, len(readings)), state.matrix * state.residuals[:, None])
        shared = covariance @ (score.T @ score) @ covariance * len(groups) / (len(groups) - 1)
        if np.trace(shared[:count, :count]) > np.trace(covariance[:count, :count]):
            covariance, clustered = shared, True
            quantile = float(stats.t.ppf(0.975, max(1, len(groups) - 1)))
    return Fit(
        log_stiffness=state.log_stiffness,
        active=state.active,
        offsets=tuple(data.offsets[k] for k in state.offsets),
        offset_values=state.shift,
        covariance=covariance,
        quantile=quantile,
        scatter=state.scatter[0],
        tap_scatter=state.scatter[1],
        sigma=state.sigma,
        predicted=state.predicted,
        residuals=state.residuals,
        leverage=leverage,
        chi2=float(state.residuals @ state.residuals),
        dof=dof,
        singular_values=np.asarray(np.linalg.svd(state.matrix[:, :count], compute_uv=False), float),
        clustered=clustered,
    )


def _specimens(readings: Sequence[Reading]) -> list[list[int]]:
    groups: dict[tuple[str, str], list[int]] = {}
    for k, reading in enumerate(readings):
        groups.setdefault((reading.joint_type, reading.specimen), []).append(k)
    return list(groups.values())


def _group_of(groups: list[list[int]], n: int) -> NDArray[np.int64]:
    out = np.zeros(n, dtype=np.int64)
    for g, members in enumerate(groups):
        out[members] = g
    return out


def _specimens_differ(residuals: Array, groups: list[list[int]]) -> bool:
    """Analysis of variance: are the specimens' mean residuals further apart than chance allows?"""
    groups = [group for group in groups if len(group) >= 2]
    n = sum(len(group) for group in groups)
    if len(groups) < 3 or n <= len(groups) + 2 or np.abs(residuals).max() < 1e-6:
        return False
    _, p = stats.f_oneway(*(residuals[group] for group in groups))
    return bool(p < OFFSET_P)
