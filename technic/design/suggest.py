"""Which real part makes a model more rigid: find places, forecast, check what is in the way, prove.

The forecast puts all candidates in order; from the top of that order those that can be built are
re-analysed exactly, joints found anew as if the written model were read again.
"""

from __future__ import annotations

from collections import Counter
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field, replace
from typing import Final, Literal

import numpy as np

from technic.assembly.model import Assembly, Joint, Part
from technic.design.apply import HIGHLIGHT, Change, change_of, extend
from technic.design.candidates import Candidate, candidates
from technic.design.collide import LENGTH, Surroundings, push_side
from technic.design.screen import Forecast, Screen
from technic.errors import UsageError
from technic.geometry import Array
from technic.ldraw.connect import AxleSlide
from technic.parts.catalogue import catalogue
from technic.rigidity.analyze import analyze
from technic.rigidity.result import MotionKind, RigidityReport, WeakSpot
from technic.units import LDU

__all__ = [
    "Filters",
    "Rank",
    "Suggestion",
    "Suggestions",
    "needs",
    "reinforce",
    "suggest",
]

Rank = Literal["ritz", "paper"]

SHORTLIST: Final = 50
"""How many of the best buildable candidates get a refined forecast."""

_RESISTED: Final = 1e-3
"""A motion is stopped when the beam resists it at least this much beside the one it resists most."""

Progress = Callable[[str, int, int], None]
"""Told the stage, how much of it is done, and how much there is."""


@dataclass(frozen=True, slots=True)
class Filters:
    """What may be suggested.

    Parameters
    ----------
    between : (int, int) or None
        Parts that the new beam must tie together.
    box : (2, 3) sequence or None
        Opposite corners of the space that the beam must stay in (m).
    lengths : tuple of int or None
        Lengths of straight beams.
    bent : bool
        Offer bent beams.
    snug : float
        Largest mismatch of holes (m).
    inventory : mapping of str to int or None
        How many of each part there are; parts that it does not name are not there.
    max_parts : int or None
        Most new parts of one suggestion, pins included.
    keep_out : frozenset of int
        Parts that nothing may be tied to (wheels, steering).
    """

    between: tuple[int, int] | None = None
    box: tuple[tuple[float, float, float], tuple[float, float, float]] | None = None
    lengths: tuple[int, ...] | None = None
    bent: bool = True
    snug: float = 0.0
    inventory: Mapping[str, int] | None = None
    max_parts: int | None = None
    keep_out: frozenset[int] = frozenset()


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
    report : RigidityReport
        Of the reinforced model.
    factor : float or None
        Rigidity after by before; None when one of them is missing, or when motions went, for then the
        two numbers do not tell of the same thing.
    stops : tuple of int
        Structural motions of the model before, counted from 1, that the beam resists.
    relieves : (WeakSpot, float) or None
        The weak spot of the model before whose share of the strain energy falls most, and the share
        that it keeps; None when motions are stopped.
    sides : tuple of str
        For each new pin, from where it can be pushed in.
    """

    rank: int
    candidate: Candidate
    change: Change
    forecast: Forecast
    report: RigidityReport
    factor: float | None
    stops: tuple[int, ...]
    relieves: tuple[WeakSpot, float] | None
    sides: tuple[str, ...]


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
    """

    before: RigidityReport
    suggestions: tuple[Suggestion, ...]
    places: int
    refused: Counter[str] = field(default_factory=Counter)


def suggest(
    assembly: Assembly,
    *,
    count: int = 10,
    shortlist: int = SHORTLIST,
    rank: Rank = "ritz",
    filters: Filters | None = None,
    color: int = HIGHLIGHT,
    axle_slide: AxleSlide = "held",
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
    color : int
        LDraw colour of new parts.
    axle_slide : {"held", "free"}
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
    found = _filtered(
        candidates(
            assembly,
            lengths=filters.lengths,
            bent=filters.bent,
            snug=filters.snug,
            exclude=filters.keep_out,
        ),
        filters,
    )
    refused: Counter[str] = Counter()
    if not found:
        return Suggestions(before, (), 0, refused)
    tell("forecast", 0, len(found))
    screen = Screen(assembly, found)
    forecasts = screen.forecasts(found)
    order = _order(screen, found, forecasts, rank)
    surroundings = Surroundings(assembly.parts)
    wanted = max(shortlist, count)
    fitting: list[_Fitting] = []
    for k in order:
        if len(fitting) == wanted:
            break
        change = change_of(assembly, found[k], color=color)
        fit = _fit(surroundings, found[k], change)
        if isinstance(fit, str):
            refused[fit] += 1
            continue
        tell("check", len(fitting), wanted)
        fitting.append(_Fitting(found[k], change, forecasts[k], screen.refine(found[k]), fit))
    fitting.sort(key=lambda f: (-f.refined.removed, -f.refined.rigidity))
    proven: list[Suggestion] = []
    for place in fitting:
        if len(proven) == count:
            break
        tell("prove", len(proven), count)
        report = analyze(extend(assembly, [place.change], axle_slide=axle_slide), modes=1)
        why = _harm(before, report)
        if why:
            refused[why] += 1
            continue
        proven.append(
            Suggestion(
                rank=0,
                candidate=place.candidate,
                change=place.change,
                forecast=place.forecast,
                report=report,
                factor=_factor(before, report),
                stops=_stops(screen, place.candidate, before, report),
                relieves=_relieves(before, report),
                sides=place.sides,
            )
        )
    tell("prove", count, count)
    proven.sort(key=lambda s: _merit(s.report), reverse=True)
    best = tuple(replace(s, rank=n) for n, s in enumerate(proven, start=1))
    return Suggestions(before, best, len(found), refused)


@dataclass(frozen=True, slots=True, eq=False)
class _Fitting:
    """A candidate that can be built, on its way to the proof."""

    candidate: Candidate
    change: Change
    forecast: Forecast
    refined: Forecast
    sides: tuple[str, ...]


def reinforce(
    assembly: Assembly,
    *,
    steps: int,
    target: float | None = None,
    filters: Filters | None = None,
    shortlist: int = SHORTLIST,
    rank: Rank = "ritz",
    color: int = HIGHLIGHT,
    axle_slide: AxleSlide = "held",
    progress: Progress | None = None,
) -> list[Suggestions]:
    """Add the best beam again and again, the model analysed anew each time.

    Parameters
    ----------
    assembly : Assembly
    steps : int
        Most beams to add.
    target : float, optional
        Stop when the model is rigid and this stiff (N/m).
    filters, shortlist, rank, color, axle_slide, progress
        As for `suggest`; the inventory is used up on the way.

    Returns
    -------
    list of Suggestions
        One for each beam, its first suggestion the one taken; the last has none when nothing more
        helps.
    """
    filters = filters or Filters()
    before = analyze(assembly, modes=1)
    current = assembly
    done: list[Suggestions] = []
    for _ in range(steps):
        if target is not None and _reached(before, target):
            break
        answer = suggest(
            current,
            count=1,
            shortlist=shortlist,
            rank=rank,
            filters=filters,
            color=color,
            axle_slide=axle_slide,
            before=before,
            progress=progress,
        )
        done.append(answer)
        if not answer.suggestions or _merit(answer.suggestions[0].report) <= _merit(before):
            done[-1] = replace(answer, suggestions=())
            break
        taken = answer.suggestions[0]
        previous, before = current, taken.report
        current = taken.report.assembly
        filters = _used_up(previous, current, filters, taken)
    return done


def _silent(_stage: str, _done: int, _total: int) -> None:
    """Tell nobody."""


def _check(assembly: Assembly) -> None:
    if assembly.source.get("format") != "ldraw" or any(
        p.definition is None for p in assembly.parts
    ):
        raise UsageError("suggestions are made of LEGO parts: give an LDraw model (.ldr, .mpd)")
    if assembly.supports:
        raise UsageError("suggestions are made for a free model: leave --fix out")


def _filtered(found: Sequence[Candidate], filters: Filters) -> list[Candidate]:
    kept = []
    for candidate in found:
        parts = candidate.parts
        if filters.between is not None and not set(filters.between) <= set(parts):
            continue
        if filters.max_parts is not None and 1 + candidate.fasteners > filters.max_parts:
            continue
        if filters.inventory is not None and not _in_stock(candidate, filters.inventory):
            continue
        if filters.box is not None and not _inside(candidate, filters.box):
            continue
        kept.append(candidate)
    return kept


def needs(candidate: Candidate) -> Counter[str]:
    """Return the new parts of a candidate by number."""
    need = Counter([candidate.number])
    need.update(a.fastening.pin for a in candidate.attachments if a.fastening.pin)
    return need


def _in_stock(candidate: Candidate, inventory: Mapping[str, int]) -> bool:
    return all(inventory.get(number, 0) >= n for number, n in needs(candidate).items())


def _inside(candidate: Candidate, box: Sequence[Sequence[float]]) -> bool:
    low, high = np.minimum(*np.array(box)), np.maximum(*np.array(box))
    holes = np.array([p.position for p in candidate.definition.ports])
    world = candidate.pose.points(holes)
    return bool((world >= low - LDU).all() and (world <= high + LDU).all())


def _used_up(start: Assembly, current: Assembly, filters: Filters, taken: Suggestion) -> Filters:
    """Return the filters for the next step: parts by their index in the changed assembly."""
    place = {part.id: k for k, part in enumerate(current.parts)}
    ids = [part.id for part in start.parts]
    inventory = filters.inventory
    if inventory is not None:
        left = Counter(inventory)
        left.subtract(needs(taken.candidate))
        left.update(_plain(old) for old in start.parts if old.id in taken.change.removed)
        inventory = dict(left)
    between = filters.between
    if between is not None:
        between = (place[ids[between[0]]], place[ids[between[1]]])
    keep_out = frozenset(place[ids[k]] for k in filters.keep_out if ids[k] in place)
    return replace(filters, inventory=inventory, between=between, keep_out=keep_out)


def _plain(part: Part) -> str:
    """Return the number that the catalogue knows a part by."""
    return part.number if part.definition is None else part.definition.id


def _order(
    screen: Screen, found: Sequence[Candidate], forecasts: Sequence[Forecast], rank: Rank
) -> list[int]:
    if rank == "paper":
        speeds = screen.projections(found)
        return sorted(range(len(found)), key=lambda k: (-round(speeds[k], 9), k))
    return sorted(
        range(len(found)),
        # rounded, so that rounding does not decide between twins
        key=lambda k: (-forecasts[k].removed, -float(f"{forecasts[k].rigidity:.9g}"), k),
    )


def _fit(surroundings: Surroundings, candidate: Candidate, change: Change) -> tuple[str, ...] | str:
    """Return from where each new pin goes in, or why the candidate cannot be built."""
    old = {a.fastening.old_pin for a in candidate.attachments} - {-1}
    hits = surroundings.hits(candidate.definition, change.added[0].pose, old)
    if hits:
        return "a part is in the way of the beam"
    sides = []
    new_pins = iter(change.added[1:])
    for attachment in candidate.attachments:
        fastening = attachment.fastening
        if fastening.kind == "present":
            continue
        pin = next(new_pins)
        definition = catalogue().get(pin.number)
        assert definition is not None
        ignore = {*fastening.parts, *old}
        if surroundings.hits(definition, pin.pose, ignore):
            return "a part is in the way of a pin"
        side = push_side(
            surroundings, pin.pose.translation, candidate.axis, LENGTH[pin.number], ignore & old
        )
        if side == 0:
            return "a pin cannot be pushed in from either side"
        sides.append(_side_words(side * candidate.axis))
    return tuple(sides)


def _side_words(direction: Array) -> str:
    axis = int(np.argmax(np.abs(direction).round(9)))
    return f"{'+' if direction[axis] > 0 else '-'}{'xyz'[axis]}"


def _merit(report: RigidityReport) -> tuple[float, float]:
    """Return what is compared: fewer structural motions first, then the rigidity."""
    return (
        -report.mobility.structural,
        report.rigidity.value if report.rigidity is not None else np.inf,
    )


def _harm(before: RigidityReport, after: RigidityReport) -> str:
    """Return what a beam would spoil: something that is meant to turn or slide stops."""
    if after.mobility.spinning < before.mobility.spinning:
        return "it would stop something that spins"
    if after.mobility.sliding < before.mobility.sliding:
        return "it would stop something that slides"
    if len(after.components) > len(before.components):
        return "something would come loose"
    return ""


def _factor(before: RigidityReport, after: RigidityReport) -> float | None:
    if before.rigidity is None or after.rigidity is None:
        return None
    if before.mobility.structural != after.mobility.structural:
        return None
    return after.rigidity.value / before.rigidity.value


def _reached(report: RigidityReport, target: float) -> bool:
    if report.mobility.structural or report.rigidity is None:
        return False
    return report.rigidity.value >= target


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
    if after.mobility.structural < before.mobility.structural:
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
