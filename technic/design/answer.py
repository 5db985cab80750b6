"""What the search for beams answers, and how models are compared."""

from __future__ import annotations

from collections import Counter
from collections.abc import Sequence
from dataclasses import dataclass, field
from typing import Final

import numpy as np

from technic.assembly.model import Joint, Part
from technic.design.apply import Change
from technic.design.candidates import Candidate
from technic.design.confidence import Confidence
from technic.design.screen import Forecast, Screen
from technic.rigidity.result import MotionKind, RigidityReport, WeakSpot
from technic.system.part_models import PartModel

__all__ = [
    "Pair",
    "Suggestion",
    "Suggestions",
    "factor_of",
    "freedom",
    "merit",
    "reached",
    "relieved",
    "stopped",
]

_RESISTED: Final = 1e-3
"""A motion is stopped when the beam resists it at least this much beside the one it resists most."""


@dataclass(frozen=True, slots=True, eq=False)
class Pair:
    """A suggestion together with its twin, the same part where it helps as much.

    Parameters
    ----------
    candidate : Candidate
        The twin.
    change : Change
        Of the twin alone.
    report : RigidityReport
        Of the model with both.
    """

    candidate: Candidate
    change: Change
    report: RigidityReport


@dataclass(frozen=True, slots=True, eq=False)
class Suggestion:
    """A beam that can be built, and what it brings.

    Parameters
    ----------
    rank : int
    candidate : Candidate
        Its parts are indices into the assembly that was asked about.
    change : Change
    forecast : Forecast
        Of the screen.
    exact : Forecast
        Of the re-analysis of what the beam touches, which put it in order.
    report : RigidityReport
        Of the reinforced model.
    factor : float or None
        Rigidity after by before; None when one of them is missing, or when motions went or pieces were
        joined, for then the two numbers do not tell of the same thing.
    stops : tuple of int
        Structural motions of the model before, counted from 1, that the beam resists.
    relieves : (WeakSpot, float) or None
        The weak spot of the model before whose share of the strain energy falls most, and the share
        that it keeps; None when motions are stopped.
    sides : tuple of str
        For each new pin, from where it can be pushed in.
    twins : int
        How many other places take the same part and help as much.
    pair : Pair or None
        With the first twin that can be built beside it.
    confidence : Confidence or None
        How sure the numbers are; None when nothing about them is uncertain.
    """

    rank: int
    candidate: Candidate
    change: Change
    forecast: Forecast
    exact: Forecast
    report: RigidityReport
    factor: float | None
    stops: tuple[int, ...]
    relieves: tuple[WeakSpot, float] | None
    sides: tuple[str, ...]
    twins: int = 0
    pair: Pair | None = None
    confidence: Confidence | None = None


@dataclass(frozen=True, slots=True, eq=False)
class Suggestions:
    """The answer of `suggest`.

    Parameters
    ----------
    before : RigidityReport
    suggestions : tuple of Suggestion
        Best first.
    places : int
        Places for beams that were forecast.
    refused : Counter
        Why places at the top of the order were not taken, and how often.
    unseen : tuple of int
        Parts without a known shape: what they are in the way of was not found out.
    parts : {"solid", "frame", "rigid"}
        What parts were made of.
    """

    before: RigidityReport
    suggestions: tuple[Suggestion, ...]
    places: int
    refused: Counter[str] = field(default_factory=Counter)
    unseen: tuple[int, ...] = ()
    parts: PartModel = "solid"


def freedom(report: RigidityReport) -> int:
    """Return how many ways structure can move: its motions, and six for each separate piece."""
    return report.mobility.structural + 6 * (len(report.components) - 1)


def merit(report: RigidityReport) -> tuple[float, float]:
    """Return what models are compared by: less freedom first, then the rigidity."""
    return (
        -float(freedom(report)),
        report.rigidity.value if report.rigidity is not None else np.inf,
    )


def reached(report: RigidityReport, target: float) -> bool:
    """Return whether a model is rigid, of one piece, and this stiff (N/m)."""
    if freedom(report) or report.rigidity is None:
        return False
    return report.rigidity.value >= target


def factor_of(before: RigidityReport, after: RigidityReport) -> float | None:
    """Return rigidity after by before; None when the two do not tell of the same thing."""
    if before.rigidity is None or after.rigidity is None:
        return None
    if freedom(before) != freedom(after):
        return None
    return after.rigidity.value / before.rigidity.value


def stopped(
    screen: Screen, candidate: Candidate, before: RigidityReport, after: RigidityReport
) -> tuple[int, ...]:
    """Return the structural motions that a beam resists."""
    if after.mobility.structural >= before.mobility.structural:
        return ()
    centroids = np.array([p.centroid for p in before.assembly.parts])
    energies = [
        screen.resists(candidate, dict(zip(m.parts, m.twists, strict=True)), centroids)
        for m in before.motions
        if m.kind is MotionKind.STRUCTURAL
    ]
    most = max(energies)
    return tuple(n for n, energy in enumerate(energies, start=1) if energy > _RESISTED * most)


def relieved(before: RigidityReport, after: RigidityReport) -> tuple[WeakSpot, float] | None:
    """Return the weak spot that loses most of its share in the strain energy."""
    if freedom(after) != freedom(before):
        return None
    shares = {_spot_id(after, s): s.energy_share for s in after.weak_spots}
    best: tuple[WeakSpot, float] | None = None
    most = 0.0
    for spot in before.weak_spots:
        left = shares.get(_spot_id(before, spot), 0.0)
        if spot.energy_share - left > most + 1e-9:
            best, most = (spot, left), spot.energy_share - left
    return best


def _spot_id(report: RigidityReport, spot: WeakSpot) -> tuple[str, str]:
    items: Sequence[Joint | Part] = (
        report.assembly.joints if spot.kind == "joint" else report.assembly.parts
    )
    return spot.kind, items[spot.index].id
