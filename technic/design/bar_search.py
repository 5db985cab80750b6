"""Which new bar makes a linkage more rigid: places on a grid, forecast, continuous search, proof.

The forecast puts bars between points of a grid in order. From the best of each pair of parts, both ends
slide along their parts until the rigidity is highest (J. A. Nelder and R. Mead, 1965), every step being an
exact analysis. What comes out is analysed once more as a whole.
"""

from __future__ import annotations

from collections import Counter
from collections.abc import Callable, Sequence
from dataclasses import dataclass, field, replace
from itertools import combinations
from typing import Any, Final, Literal

import numpy as np
from scipy import optimize

from technic.assembly.model import Assembly
from technic.assembly.stiffness import default_table
from technic.design.answer import factor_of, merit, relieved
from technic.design.bar_answer import BarSuggestion, BarSuggestions
from technic.design.bar_screen import BarScreen
from technic.design.bars import (
    Bar,
    Pattern,
    Rules,
    Track,
    cuts,
    end_at,
    legal,
    made_of,
    pattern_of,
    tracks,
)
from technic.design.confidence import confidences
from technic.design.reanalysis import Reanalysis
from technic.design.screen import Forecast
from technic.errors import UsageError
from technic.geometry import Array
from technic.rigidity.analyze import analyze
from technic.rigidity.result import MotionKind, RigidityReport
from technic.system.inverse import single_thread

__all__ = ["suggest_bars"]

GRID: Final = 12
"""Places on the longest stretch of a part where the search may start."""

MOST_PLACES: Final = 260
"""Most ends on the grid; it is made coarser until there are no more."""

STARTS: Final = 12
"""Places from which ends slide."""

PER_PAIR: Final = 3
"""Most of them between the same two parts."""

STEPS: Final = 45
"""Exact analyses of one slide."""

_SAME: Final = 5e-3
"""Bars whose rigidities differ by less than this share and whose lengths by less are twins."""

_RESISTED: Final = 1e-3
"""A motion is stopped when the bar stretches in it at least this much beside the one where it does most."""

Progress = Callable[[str, int, int], None]


@dataclass(frozen=True, slots=True, eq=False)
class _Start:
    """A bar on the grid: its tracks, where on them, and the forecast."""

    tracks: tuple[Track, Track]
    stations: tuple[float, float]
    bar: Bar
    forecast: Forecast = field(default_factory=lambda: Forecast(0, 0.0))


@dataclass(frozen=True, slots=True, eq=False)
class _Found:
    """A bar at the end of its slide."""

    bar: Bar
    forecast: Forecast
    exact: Forecast
    twins: int = 0


_Kind = tuple[int, str, str]
"""What mirror images share: motions removed, rigidity, length."""


def suggest_bars(
    assembly: Assembly,
    *,
    count: int = 5,
    rules: Rules | None = None,
    rank: Literal["ritz", "paper"] = "ritz",
    starts: int = STARTS,
    before: RigidityReport | None = None,
    progress: Progress | None = None,
) -> BarSuggestions:
    """Return the bars that make a linkage most rigid, best first.

    Parameters
    ----------
    assembly : Assembly
        Of shapes of an assembly file.
    count : int
        Suggestions wanted.
    rules : Rules, optional
    rank : {"ritz", "paper"}
        What chooses the places where slides begin.
    starts : int
        Slides.
    before : RigidityReport, optional
        Of the model, when there is one already.
    progress : callable, optional

    Raises
    ------
    UsageError
        The model is made of LEGO parts, or has no bar.
    """
    if any(part.definition is not None for part in assembly.parts):
        raise UsageError("new bars are for linkages of an assembly file")
    rules = rules or Rules()
    tell = progress or (lambda _stage, _done, _total: None)
    pattern = pattern_of(assembly)
    before = before or analyze(assembly, modes=1)
    refused: Counter[str] = Counter()
    tell("places", 0, 1)
    places = _places(assembly, pattern, rules, refused)
    tell("places", 1, 1)
    if not places:
        return BarSuggestions(before, (), pattern, 0, refused)
    places = _forecast(assembly, pattern, places, rank)
    model = Reanalysis(assembly)
    name = _free_name(assembly)
    found = []
    chosen = _chosen(places, max(starts, count))
    with single_thread():
        kinds: dict[_Kind, list[_Start]] = {}
        for start in chosen:
            kinds.setdefault(_kind(model, pattern, start, name), []).append(start)
        for n, alike in enumerate(kinds.values(), start=1):
            end = _slide(model, pattern, rules, alike[0], name)
            found.append(replace(end, twins=len(alike) - 1))
            tell("slide", n, len(kinds))
    proven: list[BarSuggestion] = []
    for one in _distinct(found, pattern.size):
        if len(proven) == count:
            break
        index = len(assembly.parts)
        part, joints, rows = made_of(assembly, one.bar, pattern, name, index)
        made = replace(
            assembly, parts=(*assembly.parts, part), joints=(*assembly.joints, *joints), findings=()
        )
        report = analyze(made, modes=1)
        if merit(report) <= merit(before):
            refused["it would not make the model more rigid"] += 1
            continue
        proven.append(
            BarSuggestion(
                rank=0,
                bar=one.bar,
                name=name,
                rows=tuple(rows),
                forecast=one.forecast,
                exact=one.exact,
                report=report,
                factor=factor_of(before, report),
                stops=_stopped(one.bar, before, report),
                relieves=relieved(before, report),
                twins=one.twins,
            )
        )
        tell("prove", len(proven), count)
    proven.sort(key=lambda s: merit(s.report), reverse=True)
    sure = confidences(
        before,
        [s.report for s in proven],
        [s.factor is not None for s in proven],
        default_table(),
        "solid",
    )
    best = tuple(
        replace(s, rank=n, confidence=c)
        for n, (s, c) in enumerate(zip(proven, sure, strict=True), start=1)
    )
    return BarSuggestions(before, best, pattern, len(places), refused)


def _free_name(assembly: Assembly) -> str:
    taken = {part.id for part in assembly.parts}
    return next(f"brace-{n}" for n in range(1, len(taken) + 2) if f"brace-{n}" not in taken)


def _places(
    assembly: Assembly, pattern: Pattern, rules: Rules, refused: Counter[str]
) -> list[_Start]:
    """Return every bar between two points of the grid that the rules allow."""
    every = tracks(assembly, rules.keep_out)
    divisions = GRID
    grid = [_grid(track, divisions, pattern.size) for track in every]
    while sum(map(len, grid)) > MOST_PLACES and divisions > 1:
        divisions -= 1
        grid = [_grid(track, divisions, pattern.size) for track in every]
    ends = [
        [(station, end_at(assembly, track, station, pattern.size)) for station in stations]
        for track, stations in zip(every, grid, strict=True)
    ]
    found: dict[tuple[Any, Any], _Start] = {}
    for i, j in combinations(range(len(every)), 2):
        for s, first in ends[i]:
            for t, second in ends[j]:
                bar = Bar(first, second)
                key = (first, second) if first.point <= second.point else (second, first)
                if key in found or not legal(bar, rules, pattern.size):
                    continue
                if cuts(assembly, bar, pattern.size):
                    refused["another bar is in the way"] += 1
                    continue
                found[key] = _Start((every[i], every[j]), (s, t), bar)
    return list(found.values())


def _grid(track: Track, divisions: int, clear: float) -> list[float]:
    """Return places on a track: its corners, its pins, and others between them."""
    if not track.continuous:
        return [float(s) for s in track.stations]
    steps = np.diff(track.stations)
    longest = float(steps.max())
    out = [float(s) for s in track.stations]
    for start, step in zip(track.stations, steps, strict=False):
        pieces = max(1, round(divisions * float(step) / longest))
        out += [float(start + step * k / pieces) for k in range(1, pieces)]
    if not len(track.pins):
        return sorted(out)
    pinned = [_station(track, pin) for pin in track.pins]
    free = [s for s in out if np.linalg.norm(track.pins - track.at(s), axis=1).min() >= clear]
    return sorted({*free, *pinned})


def _station(track: Track, point: Array) -> float:
    """Return where on a track a point lies."""
    a, u = track.points[:-1], np.diff(track.points, axis=0)
    t = np.clip(
        np.einsum("ni,ni->n", point - a, u) / np.maximum(np.einsum("ni,ni->n", u, u), 1e-300), 0, 1
    )
    gaps = np.linalg.norm(a + t[:, None] * u - point, axis=1)
    k = int(np.argmin(gaps))
    return float(track.stations[k] + t[k] * (track.stations[k + 1] - track.stations[k]))


def _forecast(
    assembly: Assembly, pattern: Pattern, places: Sequence[_Start], rank: str
) -> list[_Start]:
    """Return the places in order, best first."""
    bars = [start.bar for start in places]
    spots = [(end.parts[0], end.point) for bar in bars for end in (bar.first, bar.second)]
    screen = BarScreen(assembly, pattern, spots)
    forecasts = screen.forecasts(bars)
    order = range(len(bars))
    if rank == "paper":
        speeds = screen.projections(bars)
        order_of = sorted(order, key=lambda k: (-round(speeds[k], 9), k))
    else:
        order_of = sorted(
            order,
            key=lambda k: (-forecasts[k].removed, -float(f"{forecasts[k].rigidity:.9g}"), k),
        )
    return [replace(places[k], forecast=forecasts[k]) for k in order_of]


def _chosen(places: Sequence[_Start], starts: int) -> list[_Start]:
    """Return the places where slides begin: the best, not all between the same parts."""
    seen: Counter[tuple[int, int]] = Counter()
    out: list[_Start] = []
    for start in places:
        pair = (start.tracks[0].part, start.tracks[1].part)
        if seen[pair] < PER_PAIR:
            seen[pair] += 1
            out.append(start)
        if len(out) == starts:
            break
    return out


def _kind(model: Reanalysis, pattern: Pattern, start: _Start, name: str) -> _Kind:
    """Return what a bar shares with its mirror images: they need not slide as well."""
    assembly = model.assembly
    part, joints, _ = made_of(assembly, start.bar, pattern, name, len(assembly.parts))
    exact = model.exact_with([part], joints)
    return exact.removed, f"{exact.rigidity:.6g}", f"{start.bar.length:.6g}"


def _slide(model: Reanalysis, pattern: Pattern, rules: Rules, start: _Start, name: str) -> _Found:
    """Let both ends of a bar slide to where the rigidity is highest."""
    assembly, (one, two) = model.assembly, start.tracks
    known: dict[Bar, Forecast] = {}

    def exact(bar: Bar) -> Forecast | None:
        if not legal(bar, rules, pattern.size) or cuts(assembly, bar, pattern.size):
            return None
        if bar not in known:
            part, joints, _ = made_of(assembly, bar, pattern, name, len(assembly.parts))
            known[bar] = model.exact_with([part], joints)
        return known[bar]

    begin = exact(start.bar)
    assert begin is not None  # the grid has legal bars only
    lengths = np.array([one.length, two.length])

    def bar_at(x: Array) -> Bar:
        s, t = np.clip(x, 0.0, 1.0) * lengths
        return Bar(end_at(assembly, one, s, pattern.size), end_at(assembly, two, t, pattern.size))

    def loss(x: Array) -> float:
        answer = exact(bar_at(x))
        if answer is None or answer.removed < begin.removed or not np.isfinite(answer.rigidity):
            return 0.0
        return -answer.rigidity / begin.rigidity

    if (one.continuous or two.continuous) and np.isfinite(begin.rigidity):
        x = np.array(start.stations) / lengths
        # a step of half the grid, inwards
        corners = np.array([x, x, x])
        for k in range(2):
            corners[k + 1, k] += -0.04 if x[k] > 0.5 else 0.04
        optimize.minimize(
            loss,
            x,
            method="Nelder-Mead",
            bounds=[(0.0, 1.0)] * 2,
            options={
                "initial_simplex": corners,
                "maxfev": STEPS,
                "xatol": 1e-4,
                "fatol": 1e-6,
            },
        )
    best = max(known, key=lambda bar: (known[bar].removed, known[bar].rigidity))
    return _Found(best, start.forecast, known[best])


def _distinct(found: Sequence[_Found], size: float) -> list[_Found]:
    """Return bars in order, best first; the same bar once, twins counted at the first of them."""
    order = sorted(found, key=lambda f: (-f.exact.removed, -float(f"{f.exact.rigidity:.6g}")))
    out: list[_Found] = []
    for one in order:
        if any(_apart(one.bar, other.bar) < size for other in out):
            continue
        for n, first in enumerate(out):
            near = abs(first.exact.rigidity - one.exact.rigidity) <= _SAME * first.exact.rigidity
            if near and abs(first.bar.length - one.bar.length) <= _SAME * first.bar.length:
                out[n] = replace(first, twins=first.twins + one.twins + 1)
                break
        else:
            out.append(one)
    return out


def _apart(a: Bar, b: Bar) -> float:
    """Return how far the ends of two bars lie apart (m)."""
    ends_a = np.array([a.first.point, a.second.point])
    ends_b = np.array([b.first.point, b.second.point])
    return float(
        min(
            np.linalg.norm(ends_a - ends_b, axis=1).max(),
            np.linalg.norm(ends_a - ends_b[::-1], axis=1).max(),
        )
    )


def _stopped(bar: Bar, before: RigidityReport, after: RigidityReport) -> tuple[int, ...]:
    """Return the structural motions of the model before that a bar stretches in."""
    if after.mobility.structural >= before.mobility.structural:
        return ()
    along = bar.span / bar.length
    parts = before.assembly.parts
    speeds = []
    for motion in before.motions:
        if motion.kind is not MotionKind.STRUCTURAL:
            continue
        twists = dict(zip(motion.parts, motion.twists, strict=True))
        ends = []
        for end in (bar.first, bar.second):
            twist = twists.get(end.parts[0], np.zeros(6))
            arm = np.subtract(end.point, parts[end.parts[0]].centroid)
            ends.append(twist[:3] + np.cross(twist[3:], arm))
        speeds.append(abs(float(along @ (ends[1] - ends[0]))))
    most = max(speeds)
    return tuple(n for n, speed in enumerate(speeds, start=1) if speed > _RESISTED * most)
