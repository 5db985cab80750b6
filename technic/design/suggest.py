"""Which real part makes a model more rigid: find places, forecast, check what is in the way, prove.

The forecast puts all candidates in order; from the top of that order those that can be built are
re-analysed exactly (`reanalysis`); the best of these are proven: joints found anew as if the written
model were read again, and everything analysed.
"""

from __future__ import annotations

from collections import Counter
from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from typing import Final, Literal

from technic.assembly.model import Assembly
from technic.assembly.stiffness import StiffnessTable, default_table
from technic.design.answer import (
    Pair,
    Suggestion,
    Suggestions,
    factor_of,
    freedom,
    merit,
    relieved,
    stopped,
)
from technic.design.apply import HIGHLIGHT, Change, change_of, extend
from technic.design.candidates import Candidate, candidates
from technic.design.collide import Surroundings
from technic.design.confidence import confidences
from technic.design.filters import Filters, allowed
from technic.design.fit import fit, still_apart
from technic.design.reanalysis import Reanalysis
from technic.design.screen import Forecast, Screen
from technic.errors import UsageError
from technic.rigidity.analyze import analyze
from technic.rigidity.result import RigidityReport
from technic.system.inverse import single_thread
from technic.system.part_models import PartModel

__all__ = [
    "SHORTLIST",
    "Pair",
    "Progress",
    "Rank",
    "Suggestion",
    "Suggestions",
    "freedom",
    "merit",
    "suggest",
    "table_of",
]

Rank = Literal["ritz", "paper"]

SHORTLIST: Final = 50
"""How many of the best buildable candidates are re-analysed exactly."""

MORE: Final = 4
"""So many times the shortlist is looked at when it holds fewer different suggestions than were asked for."""

_TWIN: Final = 5e-3
"""Candidates of one part number whose rigidities differ by less than this share are twins: mirror
images of each other in a model that is not quite symmetric."""

Progress = Callable[[str, int, int], None]
"""Told the stage, how much of it is done, and how much there is."""

BLOCK: Final = 200
"""Forecasts between two words about the progress."""


@dataclass(frozen=True, slots=True, eq=False)
class _Place:
    """A candidate that can be built, on its way to the proof, and its twins."""

    candidate: Candidate
    change: Change
    forecast: Forecast
    exact: Forecast
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
    parts: PartModel = "solid",
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
        Buildable candidates that are re-analysed, at least `count`; the best of them are proven.
    rank : {"ritz", "paper"}
        How candidates are put in order before: by Rayleigh-Ritz, or by the paper's projection.
    filters : Filters, optional
    pairs : bool
        Offer a suggestion and its twin together as well.
    color : int
        LDraw colour of new parts.
    parts : {"solid", "frame", "rigid"}
        What parts are made of, new ones as well.
    before : RigidityReport, optional
        Of the model, when there is one already; with the same `parts`.
    progress : callable, optional

    Raises
    ------
    UsageError
        The assembly was not read from an LDraw model, or has supports.
    """
    _check(assembly)
    filters = filters or Filters()
    tell = progress or _silent
    table = table_of(assembly)
    before = before or analyze(assembly, modes=1, parts=parts, table=table)
    tell("places", 0, 1)
    every = _candidates(assembly, filters)
    found = allowed(every, filters)
    tell("places", 1, 1)
    refused: Counter[str] = Counter()
    if not found:
        if filters.inventory is not None and not every:
            every = _candidates(assembly, replace(filters, inventory=None))
        if every:
            refused["ruled out by what was asked for"] = len(every)
    if not found:
        return Suggestions(before, (), 0, refused, parts=parts)
    tell("forecast", 0, len(found))
    screen = Screen(assembly, found, parts=parts, table=table)
    forecasts: list[Forecast] = []
    for first in range(0, len(found), BLOCK):
        forecasts += screen.forecasts(found[first : first + BLOCK])
        tell("forecast", len(forecasts), len(found))
    surroundings = Surroundings(assembly.parts)
    wanted = min(max(shortlist, count), len(found))
    model = Reanalysis(assembly, parts=parts)
    places: list[_Place] = []
    with single_thread():
        for k in _order(screen, found, forecasts, rank):
            if len(places) >= wanted:
                if _enough(places, wanted, count):
                    break
                if any(_forecast_alike(found[k], forecasts[k], place) for place in places):
                    continue  # one more twin says nothing new
            change = change_of(assembly, found[k], color=color)
            fits = fit(surroundings, found[k], change)
            if not fits:
                refused[fits.reason] += 1
                continue
            exact = model.exact(change)
            places.append(_Place(found[k], change, forecasts[k], exact, fits.sides))
            tell("re-analyse", len(places), max(wanted, len(places)))
    proven: list[Suggestion] = []
    for place in _grouped(places):
        if len(proven) == count:
            break
        made = extend(assembly, [place.change])
        report, why = _prove(before, made, len(place.change.added), parts)
        if report is None:
            refused[why] += 1
            continue
        pair = _pair(assembly, before, place, parts) if pairs else None
        proven.append(_suggestion(screen, before, place, report, pair))
        tell("prove", len(proven), count)
    proven.sort(key=lambda s: merit(s.report), reverse=True)
    sure = confidences(
        before,
        [s.report for s in proven],
        [s.factor is not None for s in proven],
        table,
        parts,
    )
    best = tuple(
        replace(s, rank=n, confidence=c)
        for n, (s, c) in enumerate(zip(proven, sure, strict=True), start=1)
    )
    unseen = tuple(surroundings.shapeless)
    return Suggestions(before, best, len(found), refused, unseen=unseen, parts=parts)


def table_of(assembly: Assembly) -> StiffnessTable:
    """Return the stiffnesses that a model's joints were made with."""
    return default_table() if assembly.joining is None else assembly.joining.table


def _candidates(assembly: Assembly, filters: Filters) -> list[Candidate]:
    return candidates(
        assembly,
        lengths=filters.lengths,
        bent=filters.bent,
        thin=filters.thin,
        frames=filters.frames,
        snug=filters.snug,
        exclude=filters.keep_out,
        stock=None if filters.inventory is None else _stock(filters),
    )


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


def _enough(places: list[_Place], wanted: int, count: int) -> bool:
    """Return whether the shortlist is as long as it should be: longer when most of it are twins."""
    return len(places) >= MORE * wanted or len(_grouped(places)) >= count


def _grouped(places: list[_Place]) -> list[_Place]:
    """Return the places in the order of their exact rigidity, twins under the first of them."""
    order = sorted(places, key=lambda p: (-p.exact.removed, -float(f"{p.exact.rigidity:.6g}")))
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
    return (
        _same_parts(a.candidate, b.candidate)
        and a.exact.removed == b.exact.removed
        and abs(a.exact.rigidity - b.exact.rigidity) <= _TWIN * a.exact.rigidity
    )


def _forecast_alike(candidate: Candidate, forecast: Forecast, place: _Place) -> bool:
    """Return whether a candidate promises to be a twin of a place, as far as the forecasts tell."""
    return (
        _same_parts(candidate, place.candidate)
        and forecast.removed == place.forecast.removed
        and abs(forecast.rigidity - place.forecast.rigidity) <= _TWIN * forecast.rigidity
    )


def _same_parts(a: Candidate, b: Candidate) -> bool:
    """Return whether two candidates are the same part, fastened in the same ways."""
    kinds_a, kinds_b = (sorted(x.fastening.kind for x in own.attachments) for own in (a, b))
    return a.number == b.number and kinds_a == kinds_b


def _prove(
    before: RigidityReport, made: Assembly, added: int, parts: PartModel
) -> tuple[RigidityReport | None, str]:
    """Return the whole analysis of a reinforced model, or None and what is wrong with it."""
    if not still_apart(made, added):
        return None, "parts would share space"
    report = analyze(made, modes=1, parts=parts, table=table_of(made))
    if merit(report) <= merit(before):
        return None, "it would not make the model more rigid"
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
    assembly: Assembly, before: RigidityReport, place: _Place, parts: PartModel
) -> Pair | None:
    """Return a place together with the first twin that can be built beside it."""
    for twin in place.twins:
        if set(twin.change.removed) & set(place.change.removed):
            continue
        made = extend(assembly, [place.change, twin.change])
        added = len(place.change.added) + len(twin.change.added)
        report, _ = _prove(before, made, added, parts)
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
        exact=place.exact,
        report=report,
        factor=factor_of(before, report),
        stops=stopped(screen, place.candidate, before, report),
        relieves=relieved(before, report),
        sides=place.sides,
        twins=len(place.twins),
        pair=pair,
    )
