"""`technic suggest LINKAGE.json`: which new bar makes a linkage more rigid."""

from __future__ import annotations

import sys
from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Any, Literal

from technic.commands.progress import progress_bar
from technic.errors import UsageError

if TYPE_CHECKING:
    from technic.assembly.model import Assembly
    from technic.design.bar_answer import BarSuggestion, BarSuggestions
    from technic.design.bars import Rules

__all__ = ["BarWishes", "box_in", "parts_between", "suggest_for_linkage"]

Point = tuple[float, float, float]
Box = tuple[float, float, float, float, float, float]


@dataclass(frozen=True, slots=True)
class BarWishes:
    """What was asked for, as it was typed."""

    between: tuple[str, str] | None
    box: Box | None
    shortest: float
    longest: float | None
    keep_out: tuple[str, ...]
    top: int
    count: int | None
    target: float | None
    rank: Literal["ritz", "paper"]
    apply: int | None
    out: Path | None
    picture: Path | None
    json: str | None
    quiet: bool

    @property
    def sequence(self) -> bool:
        """Whether bars are added one after another."""
        return self.count is not None or self.target is not None


def parts_between(assembly: Assembly, names: tuple[str, str] | None) -> tuple[int, int] | None:
    """Return the two parts that `--between` names.

    Raises
    ------
    UsageError
        They are one part, or one of them does not exist.
    """
    from technic.assembly.select import find_part

    if names is None:
        return None
    first, second = (find_part(assembly, text) for text in names)
    if first == second:
        raise UsageError("--between needs two different parts")
    return first, second


def box_in(box: Box | None, unit: float) -> tuple[Point, Point] | None:
    """Return the corners of `--box` in metres."""
    if box is None:
        return None
    x = [v * unit for v in box]
    return (x[0], x[1], x[2]), (x[3], x[4], x[5])


def _rules(assembly: Assembly, wishes: BarWishes) -> Rules:
    from technic.assembly.select import find_part
    from technic.design.bars import Rules
    from technic.units import MM

    between, box = parts_between(assembly, wishes.between), box_in(wishes.box, MM)
    longest = float("inf") if wishes.longest is None else wishes.longest * MM
    keep_out = frozenset(find_part(assembly, text) for text in wishes.keep_out)
    return Rules(between, box, wishes.shortest * MM, longest, keep_out)


def _taken(answers: list[BarSuggestions], wishes: BarWishes) -> list[BarSuggestion]:
    if wishes.apply is None:
        return []
    every = [s for a in answers for s in a.suggestions]
    if wishes.apply > len(every):
        raise UsageError(f"there is no suggestion {wishes.apply}; there are {len(every)}")
    return every[: wishes.apply] if wishes.sequence else [every[wishes.apply - 1]]


def suggest_for_linkage(model: Path, options: Mapping[str, Any], wishes: BarWishes) -> None:
    """Say which bars help a linkage, and write what was asked for; `options` are the reader's."""
    from technic.design.bar_file import write_with_bars
    from technic.design.bar_search import suggest_bars
    from technic.design.reinforce import reinforce_bars
    from technic.loading import load
    from technic.report.json import STDOUT, write_json
    from technic.report.suggest_bars import bars_dict, bars_text

    assembly = load(model, **options)
    rules = _rules(assembly, wishes)
    with progress_bar(shown=not wishes.quiet) as tell:
        if wishes.sequence:
            answers = reinforce_bars(
                assembly,
                steps=wishes.count or 100,
                target=wishes.target,
                rules=rules,
                rank=wishes.rank,
                progress=tell,
            )
        else:
            answers = [
                suggest_bars(
                    assembly, count=wishes.top, rules=rules, rank=wishes.rank, progress=tell
                )
            ]
    chosen = _taken(answers, wishes)
    if wishes.json is not None:
        write_json(bars_dict(answers, sequence=wishes.sequence), wishes.json)
    if not wishes.quiet and wishes.json != STDOUT:
        from technic.report.style import style_for

        sys.stdout.write(bars_text(answers, style_for(sys.stdout), sequence=wishes.sequence))
        sys.stdout.flush()
    if wishes.out is not None:
        write_with_bars(model, wishes.out, chosen)
    if wishes.picture is not None:
        _draw(answers, chosen, wishes)


def _draw(answers: list[BarSuggestions], chosen: list[BarSuggestion], wishes: BarWishes) -> None:
    """Draw the linkage before and after what is applied, or after the best suggestion."""
    from technic.report.render import Painter
    from technic.report.suggest_picture import before_after_scene

    every = [s for a in answers for s in a.suggestions]
    if not every:
        raise UsageError("there is no suggestion to draw")
    last = chosen[-1] if chosen else every[-1 if wishes.sequence else 0]
    assert wishes.picture is not None
    painter = Painter()
    try:
        painter.draw(before_after_scene(answers[0].before, last.report), wishes.picture)
    finally:
        painter.close()
