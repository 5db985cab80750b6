"""Several beams, one after another: each is the best for the model that those before it made."""

from __future__ import annotations

from dataclasses import replace

from technic.assembly.model import Assembly
from technic.design.answer import reached
from technic.design.apply import HIGHLIGHT
from technic.design.bar_answer import BarSuggestions
from technic.design.bar_search import suggest_bars
from technic.design.bars import Rules
from technic.design.filters import Filters, carried_over
from technic.design.suggest import (
    SHORTLIST,
    Progress,
    Rank,
    Suggestions,
    merit,
    suggest,
    table_of,
)
from technic.rigidity.analyze import analyze
from technic.system.part_models import PartModel

__all__ = ["reinforce", "reinforce_bars"]


def reinforce(
    assembly: Assembly,
    *,
    steps: int,
    target: float | None = None,
    filters: Filters | None = None,
    shortlist: int = SHORTLIST,
    rank: Rank = "ritz",
    color: int = HIGHLIGHT,
    parts: PartModel = "solid",
    progress: Progress | None = None,
) -> list[Suggestions]:
    """Add the best beam again and again, the model analysed anew each time.

    Parameters
    ----------
    assembly : Assembly
    steps : int
        Most beams to add.
    target : float, optional
        Stop when the model is rigid, of one piece, and this stiff (N/m).
    filters, shortlist, rank, color, parts, progress
        As for `suggest`; the inventory is used up on the way.

    Returns
    -------
    list of Suggestions
        One for each beam, its first suggestion the one taken; the last has none when nothing more
        helps.

    Raises
    ------
    UsageError
        As for `suggest`.
    """
    filters = filters or Filters()
    before = analyze(assembly, modes=1, parts=parts, table=table_of(assembly))
    current = assembly
    done: list[Suggestions] = []
    for _ in range(steps):
        if target is not None and reached(before, target):
            break
        answer = suggest(
            current,
            count=1,
            shortlist=shortlist,
            rank=rank,
            filters=filters,
            pairs=False,
            color=color,
            parts=parts,
            before=before,
            progress=progress,
        )
        taken = answer.suggestions[0] if answer.suggestions else None
        if taken is None or merit(taken.report) <= merit(before):
            done.append(replace(answer, suggestions=()))
            break
        done.append(replace(answer, suggestions=(replace(taken, rank=len(done) + 1),)))
        new = taken.report.assembly
        filters = carried_over(filters, current, new, taken.candidate, taken.change)
        current, before = new, taken.report
    return done


def reinforce_bars(
    assembly: Assembly,
    *,
    steps: int,
    target: float | None = None,
    rules: Rules | None = None,
    rank: Rank = "ritz",
    progress: Progress | None = None,
) -> list[BarSuggestions]:
    """Add the best bar again and again, the model analysed anew each time.

    Parameters
    ----------
    assembly : Assembly
    steps : int
        Most bars to add.
    target : float, optional
        Stop when the model is rigid, of one piece, and this stiff (N/m).
    rules, rank, progress
        As for `suggest_bars`.

    Returns
    -------
    list of BarSuggestions
        One for each bar, its first suggestion the one taken; the last has none when nothing more
        helps.
    """
    before = analyze(assembly, modes=1)
    done: list[BarSuggestions] = []
    for _ in range(steps):
        if target is not None and reached(before, target):
            break
        answer = suggest_bars(
            assembly, count=1, rules=rules, rank=rank, before=before, progress=progress
        )
        if not answer.suggestions:
            done.append(answer)
            break
        taken = replace(answer.suggestions[0], rank=len(done) + 1)
        done.append(replace(answer, suggestions=(taken,)))
        assembly, before = taken.report.assembly, taken.report
    return done
