"""Second looks at a fit: a grid search beside it, what the data lack, and what looks wrong."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Final

import numpy as np
from scipy import stats

from calibration.dataset import Reading
from calibration.fit import WIDEST, Fit
from calibration.model import Array, Forward, design
from calibration.rigs import Condition

__all__ = ["GridCheck", "cure", "grid_check", "warnings"]

RARE: Final = 1e-3
"""Tests warn when chance alone would do this so rarely: a dozen of them still warn wrongly once in a
hundred files."""

FAR: Final = 4.0
"""Studentised residuals beyond this are outliers: among 10,000 normal ones there is none or one."""

_FINER: Final = "record for longer, or fix less weight"

_POINTS = 15
_ZOOMS = 7
_ROWS_SHOWN = 10


@dataclass(frozen=True, slots=True, eq=False)
class GridCheck:
    """The best point of a grid that was refined around its best point again and again.

    Parameters
    ----------
    parameters : tuple of int
        Stiffnesses that were searched (two at most, the others stood at the optimum).
    log_stiffness : (k,) ndarray
        The best point.
    distance : float
        Largest distance from the fit in standard deviations.
    chi2 : float
        At the best point, with the weights of the fit.
    """

    parameters: tuple[int, ...]
    log_stiffness: Array
    distance: float
    chi2: float

    @property
    def agrees(self) -> bool:
        """Whether grid and fit found the same point, to a tenth of a standard deviation."""
        return self.distance < 0.1


def grid_check(
    readings: Sequence[Reading], forward: Forward, found: Fit, start: Array
) -> GridCheck:
    """Search the stiffnesses on a grid, as Liu et al. 2022 did: no derivative, no start near the answer.

    The grid spans a factor of thirty to either side of `start`, then narrows around its best point.
    """
    data = design(readings)
    chosen = found.active[:2]
    kept = [data.offsets.index(offset) for offset in found.offsets]
    moved = data.read - data.columns[:, kept] @ found.offset_values
    weight = 1.0 / found.sigma**2
    count = len(data.conditions)

    def total(values: Array) -> Array:
        return np.asarray(np.bincount(data.which, weight * values, minlength=count))

    # what a sum over all readings needs to know of the readings of one condition
    ff, fo, oo = (
        total(a * b)
        for a, b in ((data.force, data.force), (data.force, data.own), (data.own, data.own))
    )
    yf, yo, yy = total(moved * data.force), total(moved * data.own), float(weight @ moved**2)
    yt, tt = total(moved * data.tapped), total(data.tapped.astype(float))

    def chi2(point: Array) -> float:
        a = forward(data.conditions, point)
        c, o, f = a.per_newton, a.own_weight, a.frequency
        sags = -2 * (yf @ c + yo @ o) + ff @ c**2 + 2 * fo @ (c * o) + oo @ o**2
        return float(yy + sags - 2 * yt @ f + tt @ f**2)

    best = found.log_stiffness.copy()
    best[list(chosen)] = np.log(start)[list(chosen)]
    reach, least = np.log(30.0), np.inf
    for _ in range(_ZOOMS):
        middle = best.copy()
        axes = [middle[k] + np.linspace(-reach, reach, _POINTS) for k in chosen]
        for point in np.stack(np.meshgrid(*axes, indexing="ij"), -1).reshape(-1, len(chosen)):
            trial = middle.copy()
            trial[list(chosen)] = point
            value = chi2(trial)
            if value < least:
                best, least = trial, value
        # twice the spacing to either side, so that a narrow valley is not lost
        reach *= 4.0 / (_POINTS - 1)
    apart = np.abs(best - found.log_stiffness)[list(chosen)]
    # on data without noise the spacing of the last grid is the finest that can be told
    spacing = reach * (_POINTS - 1) / 4.0 * 2.0 / (_POINTS - 1)
    scale = np.maximum(found.deviations[: len(chosen)], 10.0 * spacing)
    return GridCheck(chosen, best, float((apart / scale).max()), least)


def cure(
    parameter: int, candidates: Sequence[Condition], forward: Forward, found: Fit
) -> tuple[Condition, float] | None:
    """Return the condition whose readings would identify a stiffness, and the deviation then.

    Ten readings at half a newton with 0.1 mm steps and 5 % scatter are imagined at each candidate.
    """
    wanted = sorted({*found.active, parameter})
    count = len(found.active)
    known = np.zeros((len(wanted), len(wanted)))
    places = [wanted.index(k) for k in found.active]
    known[np.ix_(places, places)] = np.linalg.pinv(found.covariance[:count, :count])
    best: tuple[Condition, float] | None = None
    answer = forward(candidates, found.log_stiffness)
    for k, candidate in enumerate(candidates):
        sag = 0.5 * answer.per_newton[k]
        sigma = np.hypot(1e-4 * np.sqrt(2.0 / 12.0), 0.05 * sag) / np.sqrt(10.0)
        row = 0.5 * answer.d_per_newton[k][wanted] / sigma
        information = known + np.outer(row, row)
        if np.linalg.eigvalsh(information)[0] <= 1e-9:
            continue
        deviation = float(np.sqrt(np.diag(np.linalg.inv(information))[wanted.index(parameter)]))
        if deviation < WIDEST and (best is None or deviation < best[1]):
            best = (candidate, deviation)
    return best


def warnings(readings: Sequence[Reading], found: Fit) -> list[str]:
    """Return what a careful person would say about these data, one sentence each."""
    out = []
    for tap, cure_words in ((False, "hang more weight or read more finely"), (True, _FINER)):
        small = [
            r.row
            for r in readings
            if r.tap is tap and (tap or r.force > 0) and abs(r.value) < 3.0 * r.resolution
        ]
        if small:
            out.append(
                f"{_readings(len(small))} below three times the resolution ({_rows(small)}): "
                f"{cure_words}"
            )
    for joint in sorted({r.joint_type for r in readings}):
        poses = sorted(
            {(r.condition.rig, r.condition.pose) for r in readings if r.joint_type == joint}
        )
        if len(poses) == 1:
            out.append(f"{joint}: one pose only ({poses[0][1]} of {poses[0][0]})")
    if len(readings) < 10:
        out.append(f"only {_readings(len(readings))}: the intervals are wide guesses")
    student = found.residuals / np.sqrt(np.clip(1.0 - found.leverage, 1e-3, None))
    far = [r.row for r, size in zip(readings, np.abs(student), strict=True) if size > FAR]
    if far and max(found.scatter, found.tap_scatter) > 0.0:
        out.append(
            f"{_readings(len(far))} far from the rest ({_rows(far)}): look for slips; "
            "--robust gives them less weight"
        )
    if found.clustered:
        out.append(
            "the specimens differ by more than the readings scatter: the intervals count specimens, "
            "not readings"
        )
    out += _creep(readings, found) + _lack_of_fit(readings, found)
    return out


def _readings(n: int) -> str:
    return f"{n} reading{'' if n == 1 else 's'}"


def _rows(rows: Sequence[int]) -> str:
    shown = ", ".join(str(row) for row in rows[:_ROWS_SHOWN])
    word = "row" if len(rows) == 1 else "rows"
    return f"{word} {shown}{', ...' if len(rows) > _ROWS_SHOWN else ''}"


def _creep(readings: Sequence[Reading], found: Fit) -> list[str]:
    """Readings that grow from repeat to repeat: the plastic gives way slowly, or the clamp slips."""
    repeats = np.array([r.repeat for r in readings])
    if len(np.unique(repeats)) < 3 or len(readings) < 12 or np.ptp(found.residuals) < 1e-6:
        return []
    rho, p = stats.spearmanr(repeats, found.residuals)
    if p >= RARE:
        return []
    way = "grow" if rho > 0 else "shrink"
    return [f"readings {way} from repeat to repeat: the joints creep or settle, or the clamp slips"]


def _lack_of_fit(readings: Sequence[Reading], found: Fit) -> list[str]:
    """Readings taken the same way agree better with each other than with the fit: F test."""
    cells: dict[tuple[Condition, float, bool, int], list[int]] = {}
    for k, r in enumerate(readings):
        cells.setdefault((r.condition, r.force, r.own_weight, r.direction), []).append(k)
    pure = sum(
        float(np.sum((found.residuals[c] - found.residuals[c].mean()) ** 2)) for c in cells.values()
    )
    inside = len(readings) - len(cells)
    between = len(cells) - (len(readings) - found.dof)
    if inside < 5 or between < 1 or pure < 1e-9:
        return []
    ratio = (found.chi2 - pure) / between / (pure / inside)
    if stats.f.sf(ratio, between, inside) >= RARE:
        return []
    said = (
        "readings under different conditions contradict each other by more than repeats scatter "
        f"(F = {ratio:.1f}): the rig was not what the model says in some pose, or a joint is not linear"
    )
    return [said]
