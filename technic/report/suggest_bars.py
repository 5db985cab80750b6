"""New bars of a linkage as text and as JSON: from where to where, and what each brings."""

from __future__ import annotations

from collections.abc import Sequence
from math import isfinite
from typing import Any

from technic.assembly.model import Assembly
from technic.design.bar_answer import BarSuggestion, BarSuggestions
from technic.design.bars import End, Pattern
from technic.report.phrases import state_words
from technic.report.style import Style
from technic.report.suggest_json import SCHEMA, confidence_dict, state_dict
from technic.report.suggest_text import basis_words, cure_words, sure_words
from technic.report.wording import count, joined, number
from technic.units import MM

__all__ = ["bars_dict", "bars_text", "pattern_words"]


def pattern_words(pattern: Pattern) -> str:
    """Return what a new bar is made of: ``"3 x 3 mm, ABS"``."""
    section = pattern.shape.get("section")
    if section is None:
        said = f"{number(pattern.area / MM**2)} mm2"
    elif section["kind"] == "rectangle":
        said = f"{number(section['width'] / MM)} x {number(section['height'] / MM)} mm"
    else:
        said = f"{number(section['diameter'] / MM)} mm round"
    return f"{said}, {pattern.material.name}"


def _place(end: End, assembly: Assembly) -> str:
    numbers = [f"{round(v / MM, 2) + 0.0:g}" for v in end.point[: assembly.dimension]]
    names = joined([assembly.parts[p].id for p in end.parts])
    return f"({', '.join(numbers)}) mm on {names}"


def _one(answer: BarSuggestions, suggestion: BarSuggestion, style: Style) -> list[str]:
    before = answer.before
    bar = suggestion.bar
    what = f"{suggestion.rank}. Bar of {number(bar.length / MM, 4)} mm"
    lines = style.wrap(f"{what} ({pattern_words(answer.pattern)})", "", "   ")
    lines[0] = style("bold", lines[0])
    for word, end in (("from", bar.first), ("to", bar.second)):
        lines += style.wrap(f"{word} {_place(end, before.assembly)}", "   - ", "     ")
    factor = "" if suggestion.factor is None else f" ({number(suggestion.factor)} times)"
    said = f"Then: {state_words(suggestion.report)}{factor}. It {cure_words(before, suggestion)}."
    lines += style.wrap(said, "   ")
    forecast = number(suggestion.forecast.rigidity)
    said = f"Forecast {forecast} N/m where the search began."
    if suggestion.twins:
        said += f" {count(suggestion.twins, 'other place')} would do about as well."
    lines += style.wrap(said, "   ")
    if sure := sure_words(suggestion):
        lines += style.wrap(sure, "   ")
    return lines


def bars_text(
    answers: Sequence[BarSuggestions], style: Style | None = None, *, sequence: bool
) -> str:
    """Return new bars, alternatives or one after another, with a final newline."""
    style = Style() if style is None else style
    if not answers:
        return "The model is as rigid as demanded: nothing to add.\n"
    first = answers[0]
    name = first.before.assembly.name
    lines = [
        style("bold", f"{name}: {count(len(first.before.assembly.parts), 'part')}"),
        f"Now: {state_words(first.before)}",
    ]
    taken = [(a, s) for a in answers for s in a.suggestions]
    if taken and not sequence:
        lines += ["", f"One bar, best first (of {count(first.places, 'place')} on a grid):"]
    for answer, suggestion in taken:
        lines += ["", *_one(answer, suggestion, style)]
    if not answers[-1].suggestions:
        lines += ["", *_nothing(answers[-1], style)]
    if taken:
        if sequence:
            lines += ["", f"In the end: {state_words(taken[-1][1].report)}."]
        lines += ["", *style.wrap(basis_words([s for _, s in taken]))]
        if first.before.assembly.dimension == 2:
            lines += style.wrap(
                "Bars lie in layers, side by side: that they cross is no hindrance."
            )
    return "\n".join(lines) + "\n"


def _nothing(answer: BarSuggestions, style: Style) -> list[str]:
    why = "; ".join(f"{n} x {reason}" for reason, n in answer.refused.most_common())
    if not answer.places and not why:
        why = "no two parts have places that a bar within the limits would tie together"
    elif not answer.places:
        why = f"no bar has a place: {why}"
    else:
        why = f"none of {count(answer.places, 'place')} helps" + (f": {why}" if why else "")
    return style.wrap(f"Nothing fits: {why}.")


def bars_dict(answers: Sequence[BarSuggestions], *, sequence: bool) -> dict[str, Any]:
    """Return new bars as plain values; keys as for LEGO parts where they mean the same."""
    from technic import __version__

    before = answers[0].before if answers else None
    source = {} if before is None else before.assembly.source
    taken = [(a, s) for a in answers for s in a.suggestions]
    return {
        "schema": SCHEMA,
        "source": {key: source.get(key) for key in ("path", "sha256", "format")},
        "kind": "sequence" if sequence else "alternatives",
        "before": None if before is None else state_dict(before),
        "places": sum(a.places for a in answers),
        "refused": {
            reason: sum(a.refused[reason] for a in answers)
            for reason in sorted({r for a in answers for r in a.refused})
        },
        "not_checked": [],
        "suggestions": [_suggestion(a, s, rank) for rank, (a, s) in enumerate(taken, start=1)],
        "technic_version": __version__,
    }


def _suggestion(answer: BarSuggestions, suggestion: BarSuggestion, rank: int) -> dict[str, Any]:
    before, after = answer.before, suggestion.report
    parts = before.assembly.parts
    forecast = suggestion.forecast.rigidity
    return {
        "rank": rank,
        "new_parts": [suggestion.rows[0]],
        "new_joints": list(suggestion.rows[1:]),
        "length_mm": suggestion.bar.length / MM,
        "connects": [parts[p].id for p in suggestion.bar.parts],
        "cures": cure_words(before, suggestion),
        "predicted_n_per_m": forecast if isfinite(forecast) else None,
        "predicted_motions_removed": suggestion.forecast.removed,
        "reanalyzed_n_per_m": None if after.rigidity is None else after.rigidity.value,
        "confidence": confidence_dict(suggestion.confidence),
        "factor": suggestion.factor,
        "after": state_dict(after),
        "twins": suggestion.twins,
    }
