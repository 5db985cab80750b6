"""How sure a suggestion is when stiffnesses of joints are known only so well.

The derivative of the logarithm of an eigenvalue with respect to that of a stiffness is its share of the
strain energy (`technic.rigidity.uncertainty`). So the rigidities before and after, and after different
beams, vary together, and their ratios are surer than themselves. Uncertainties are those of the
calibration where stiffnesses were measured. Where none was, each is taken as known within a factor of
two: an assumption, said to be one, that tells whether the advice hangs on these numbers.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from math import erf, exp, log, sqrt
from typing import Final

import numpy as np

from technic.assembly.stiffness import SLOTS, StiffnessTable
from technic.geometry import Array
from technic.rigidity.result import RigidityReport
from technic.rigidity.uncertainty import NORMAL_95, energy_shares
from technic.system.assemble import assemble
from technic.system.parameters import Parameter
from technic.system.part_models import FACTORIES, PartModel

__all__ = ["FACTOR", "RANK_SURE", "Confidence", "Uncertainty", "confidences", "uncertainty_of"]

FACTOR: Final = 2.0
"""Assumed 95 % bounds of a stiffness that nobody measured: half and double."""

RANK_SURE: Final = 0.95
"""A suggestion's rank is stable when it beats the next one with at least this probability."""


@dataclass(frozen=True, slots=True)
class Confidence:
    """How sure the rigidity of a reinforced model is.

    Parameters
    ----------
    basis : {"calibration", "assumed"}
        Whether the uncertainties of the stiffnesses were measured.
    interval_95 : (float, float)
        Of the rigidity after (N/m).
    factor_95 : (float, float) or None
        Of the rigidity after by before, when the two can be compared.
    helps : float or None
        Probability that it raises the rigidity, when the two can be compared.
    beats_next : float or None
        Probability that it is more rigid than the next suggestion, when the two can be compared.
    """

    basis: str
    interval_95: tuple[float, float]
    factor_95: tuple[float, float] | None
    helps: float | None
    beats_next: float | None


@dataclass(frozen=True, slots=True, eq=False)
class Uncertainty:
    """Stiffnesses of joints and how well their logarithms are known.

    Parameters
    ----------
    basis : {"calibration", "assumed"}
    parameters : tuple of Parameter
    covariance : (k, k) ndarray
    """

    basis: str
    parameters: tuple[Parameter, ...]
    covariance: Array

    def deviation(self, shares: Array) -> float:
        """Return the standard deviation of a logarithm with these derivatives."""
        return sqrt(max(float(shares @ self.covariance @ shares), 0.0))


def uncertainty_of(table: StiffnessTable, connections: Sequence[str]) -> Uncertainty:
    """Return what is known about the stiffnesses of some connections.

    Parameters
    ----------
    table : StiffnessTable
    connections : sequence of str
        What the joints of the model are called, keys of the table or not.
    """
    known = set(connections)
    if any(connection in known for connection, _ in table.measured):
        names = tuple(Parameter(*name) for name in table.measured)
        return Uncertainty("calibration", names, table.log_covariance)
    names = tuple(Parameter(c, motion) for c in sorted(known) for motion in SLOTS)
    deviation = log(FACTOR) / NORMAL_95
    return Uncertainty("assumed", names, deviation**2 * np.eye(len(names)))


def confidences(
    before: RigidityReport,
    reports: Sequence[RigidityReport],
    comparable: Sequence[bool],
    table: StiffnessTable,
    parts: PartModel,
) -> list[Confidence | None]:
    """Return how sure each of some reinforced models is.

    Parameters
    ----------
    before : RigidityReport
    reports : sequence of RigidityReport
        After, best first.
    comparable : sequence of bool
        Whether each can be compared with the model before: motions neither went nor came.
    table : StiffnessTable
    parts : {"solid", "frame", "rigid"}
        What parts were made of.
    """
    names = {joint.connection for r in (before, *reports) for joint in r.assembly.joints}
    uncertain = uncertainty_of(table, sorted(names))
    if not uncertain.parameters:
        return [None] * len(reports)
    old = _shares(before, uncertain, parts)
    new = [_shares(report, uncertain, parts) for report in reports]
    out: list[Confidence | None] = []
    for k, (report, shares) in enumerate(zip(reports, new, strict=True)):
        if shares is None or report.rigidity is None:
            out.append(None)
            continue
        factor, helps = None, None
        if comparable[k] and old is not None and before.rigidity is not None:
            ratio = report.rigidity.value / before.rigidity.value
            factor = _interval(ratio, uncertain.deviation(shares - old))
            helps = _above(log(ratio), uncertain.deviation(shares - old))
        beats = None
        following = reports[k + 1] if k + 1 < len(reports) else None
        if following is not None and following.rigidity is not None:
            other = new[k + 1]
            same = following.mobility.structural == report.mobility.structural
            if other is not None and same:
                ahead = log(report.rigidity.value / following.rigidity.value)
                beats = _above(ahead, uncertain.deviation(shares - other))
        interval = _interval(report.rigidity.value, uncertain.deviation(shares))
        out.append(Confidence(uncertain.basis, interval, factor, helps, beats))
    return out


def _shares(report: RigidityReport, uncertain: Uncertainty, parts: PartModel) -> Array | None:
    if not report.modes:
        return None
    system = assemble(report.assembly, element=FACTORIES[parts])
    return energy_shares(system, report.modes[0].unknowns, uncertain.parameters)


def _interval(value: float, deviation: float) -> tuple[float, float]:
    spread = exp(NORMAL_95 * deviation)
    return value / spread, value * spread


def _above(mean: float, deviation: float) -> float:
    """Return the probability that a normal variable is positive."""
    if deviation < 1e-12:
        return 1.0 if mean > 0.0 else 0.0 if mean < 0.0 else 0.5
    return 0.5 * (1.0 + erf(mean / (deviation * sqrt(2.0))))
