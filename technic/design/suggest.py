"""Which real part makes a model more rigid: find places, forecast, check what is in the way, prove.

The forecast puts all candidates in order; from the top of that order those that can be built get a
refined forecast; the best of these are re-analysed exactly, joints found anew as if the written model
were read again.
"""

from __future__ import annotations

from collections import Counter
from collections.abc import Callable, Sequence
from dataclasses import dataclass, field, replace
from typing import Final, Literal

import numpy as np

from technic.assembly.model import Assembly, Joint, Part
from technic.assembly.stiffness import StiffnessTable
from technic.design.apply import HIGHLIGHT, Change, change_of, extend
from technic.design.candidates import Candidate, candidates
from technic.design.collide import Surroundings
from technic.design.filters import Filters, allowed
from technic.design.fit import fit, still_apart
from technic.design.screen import Forecast, Screen
from technic.errors import UsageError
from technic.ldraw.connect import AxleSlide
from technic.rigidity.analyze import analyze
from technic.rigidity.result import MotionKind, RigidityReport, WeakSpot

__all__ = ["Pair", "Progress", "Rank", "Suggestion", "Suggestions", "freedom", "merit", "suggest"]

Rank = Literal["ritz", "paper"]

SHORTLIST: Final = 50
"""How many of the best buildable candidates get a refined forecast."""

_RESISTED: Final = 1e-3
"""A motion is stopped when the beam resists it at least this much beside the one it resists most."""

_TWIN: Final = 5e-3
"""Candidates of one part number whose refined forecasts differ by less than this share are twins:
mirror images of each other in a model that is not quite symmetric."""

Progress = Callable[[str, int, int], None]
"""Told the stage, how much of it is done, and how much there is."""


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
    refined : Forecast
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
    """

    rank: int
    candidate: Candidate
    change: Change
    forecast: Forecast
    refined: Forecast
    report: RigidityReport
    factor: float | None
    stops: tuple[int, ...]
    relieves: tuple[WeakSpot, float] | None
    sides: tuple[str, ...]
    twins: int = 0
    pair: Pair | None = None


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
    """

    before: RigidityReport
    suggestions: tuple[Suggestion, ...]
    places: int
    refused: Counter[str] = field(default_factory=Counter)
    unseen: tuple[int, ...] = ()


@dataclass(frozen=True, slots=True, eq=False)
class _Place:
    """A candidate that can be built, on its way to the proof, and its twins."""

    candidate: Candidate
    change: Change
    forecast: Forecast
    refined: Forecast
    sides: tuple[str, ...]
    twins: tuple[_Place, ...] = ()


def suggest(
    assembly: Assembly,
    *,
    count: int = 5,
    shortlist: int = SHORTLIST,
    rank: Rank = "ritz",
    filters: Filters | None = None,
    pairs: bool = True,
    color: int = HIGHLIGHT,
    axle_slide: AxleSlide = "held",
    table: StiffnessTable | None = None,
    before: RigidityReport | None = None,
    progress: Progress | None = None,
) -> Suggestions:
    """Return the beams that make a model most rigid, best first.

    Parameters
    ----------
    assembly : Assembly
        Read from an LDraw model.
    count : int
        Suggestions wanted.
    shortlist : int
        Buildable candidates whose forecast is refined, at least `count`; the best of them are
        re-analysed exactly.
    rank : {"ritz", "paper"}
        How candidates are put in order before: by Rayleigh-Ritz, or by the paper's projection.
    filters : Filters, optional
    pairs : bool
        Offer a suggestion and its twin together as well.
    color : int
        LDraw colour of new parts.
    axle_slide : {"held", "free"}
        As the model was read.
    table : StiffnessTable, optional
        As the model was read.
    before : RigidityReport, optional
        Of the model, when there is one already.
    progress : callable, optional

    Raises
    ------
    UsageError
        The assembly was not read from an LDraw model, or has supports.
    """
    _check(assembly)
    filters = filters or Filters()
    tell = progress or _silent
    before = before or analyze(assembly, modes=1)
    found = candidates(
        assembly,
        lengths=filters.lengths,
        bent=filters.bent,
        snug=filters.snug,
        exclude=filters.keep_out,
        stock=None if filters.inventory is None else _stock(filters),
    )
    found = allowed(found, filters)
    refused: Counter[str] = Counter()
    if not found:
        return Suggestions(before, (), 0, refused)
    tell("forecast", 0, len(found))
    screen = Screen(assembly, found, table=table)
    forecasts = screen.forecasts(found)
    tell("forecast", len(found), len(found))
    surroundings = Surroundings(assembly.parts)
    wanted = max(shortlist, count)
    places: list[_Place] = []
    for k in _order(screen, found, forecasts, rank):
        if len(places) == wanted:
            break
        change = change_of(assembly, found[k], color=color)
        fits = fit(surroundings, found[k], change)
        if not fits:
            refused[fits.reason] += 1
            continue
        places.append(_Place(found[k], change, forecasts[k], screen.refine(found[k]), fits.sides))
        tell("check", len(places), wanted)
    proven: list[Suggestion] = []
    for place in _grouped(places):
        if len(proven) == count:
            break
        made = extend(assembly, [place.change], axle_slide=axle_slide, table=table)
        report, why = _prove(before, made, len(place.change.added))
        if report is None:
            refused[why] += 1
            continue
        pair = _pair(assembly, before, place, axle_slide, table) if pairs else None
        proven.append(_suggestion(screen, before, place, report, pair))
        tell("prove", len(proven), count)
    proven.sort(key=lambda s: merit(s.report), reverse=True)
    best = tuple(replace(s, rank=n) for n, s in enumerate(proven, start=1))
    return Suggestions(before, best, len(found), refused, tuple(surroundings.shapeless))


def _silent(_stage: str, _done: int, _total: int) -> None:
    """Tell nobody."""


def _check(assembly: Assembly) -> None:
    if assembly.source.get("format") != "ldraw" or any(
        p.definition is None for p in assembly.parts
    ):
        raise UsageError("suggestions are made of LEGO parts: give an LDraw model (.ldr, .mpd)")
    if assembly.supports:
        raise UsageError("suggestions are made for a model that nothing holds")


def _stock(filters: Filters) -> frozenset[str]:
    return frozenset(number for number, n in (filters.inventory or {}).items() if n > 0)


def _order(
    screen: Screen, found: Sequence[Candidate], forecasts: Sequence[Forecast], rank: Rank
) -> list[int]:
    if rank == "paper":
        speeds = screen.projections(found)
        return sorted(range(len(found)), key=lambda k: (-round(speeds[k], 9), k))
    # rounded, so that rounding does not decide between twins
    return sorted(
        range(len(found)),
        key=lambda k: (-forecasts[k].removed, -float(f"{forecasts[k].rigidity:.9g}"), k),
    )


def _grouped(places: list[_Place]) -> list[_Place]:
    """Return the places in the order of their refined forecasts, twins under the first of them."""
    order = sorted(places, key=lambda p: (-p.refined.removed, -float(f"{p.refined.rigidity:.6g}")))
    groups: list[_Place] = []
    for place in order:
        for n, first in enumerate(groups):
            if _alike(first, place):
                groups[n] = replace(first, twins=(*first.twins, place))
                break
        else:
            groups.append(place)
    return groups


def _alike(a: _Place, b: _Place) -> bool:
    kinds_a, kinds_b = (
        sorted(x.fastening.kind for x in place.candidate.attachments) for place in (a, b)
    )
    return (
        a.candidate.number == b.candidate.number
        and kinds_a == kinds_b
        and a.refined.removed == b.refined.removed
        and abs(a.refined.rigidity - b.refined.rigidity) <= _TWIN * a.refined.rigidity
    )


def _prove(before: RigidityReport, made: Assembly, added: int) -> tuple[RigidityReport | None, str]:
    """Return the exact analysis of a reinforced model, or None and what is wrong with it."""
    if not still_apart(made, added):
        return None, "parts would share space"
    report = analyze(made, modes=1)
    why = _harm(before, report)
    return (None, why) if why else (report, "")


def _harm(before: RigidityReport, after: RigidityReport) -> str:
    """Return what a beam would spoil: something that is meant to turn or slide stops."""
    if after.mobility.spinning < before.mobility.spinning:
        return "it would stop something that spins"
    if after.mobility.sliding < before.mobility.sliding:
        return "it would stop something that slides"
    if len(after.components) > len(before.components):
        return "something would come loose"
    return ""


def _pair(
    assembly: Assembly,
    before: RigidityReport,
    place: _Place,
    axle_slide: AxleSlide,
    table: StiffnessTable | None,
) -> Pair | None:
    """Return a place together with the first twin that can be built beside it."""
    for twin in place.twins:
        if set(twin.change.removed) & set(place.change.removed):
            continue
        made = extend(assembly, [place.change, twin.change], axle_slide=axle_slide, table=table)
        report, _ = _prove(before, made, len(place.change.added) + len(twin.change.added))
        if report is not None:
            return Pair(twin.candidate, twin.change, report)
    return None


def _suggestion(
    screen: Screen, before: RigidityReport, place: _Place, report: RigidityReport, pair: Pair | None
) -> Suggestion:
    return Suggestion(
        rank=0,
        candidate=place.candidate,
        change=place.change,
        forecast=place.forecast,
        refined=place.refined,
        report=report,
        factor=_factor(before, report),
        stops=_stops(screen, place.candidate, before, report),
        relieves=_relieves(before, report),
        sides=place.sides,
        twins=len(place.twins),
        pair=pair,
    )


def freedom(report: RigidityReport) -> int:
    """Return how many ways structure can move: its motions, and six for each separate piece."""
    return report.mobility.structural + 6 * (len(report.components) - 1)


def merit(report: RigidityReport) -> tuple[float, float]:
    """Return what models are compared by: less freedom first, then the rigidity."""
    return (
        -float(freedom(report)),
        report.rigidity.value if report.rigidity is not None else np.inf,
    )


def _factor(before: RigidityReport, after: RigidityReport) -> float | None:
    if before.rigidity is None or after.rigidity is None:
        return None
    if freedom(before) != freedom(after):
        return None
    return after.rigidity.value / before.rigidity.value


def _stops(
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


def _relieves(before: RigidityReport, after: RigidityReport) -> tuple[WeakSpot, float] | None:
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
