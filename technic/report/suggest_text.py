"""Suggestions as a builder reads them: which part, where, pinned to what, and what it brings."""

from __future__ import annotations

from collections import Counter
from collections.abc import Sequence

from technic.assembly.model import Assembly
from technic.design.bar_answer import BarSuggestion
from technic.design.candidates import Attachment, describe_fit
from technic.design.confidence import FACTOR, RANK_SURE
from technic.design.filters import needs
from technic.design.suggest import Suggestion, Suggestions
from technic.parts.catalogue import catalogue
from technic.report.phrases import state_words
from technic.report.style import Style
from technic.report.wording import count, joined, number, part_name, place, spot_words
from technic.rigidity.result import RigidityReport, Verdict
from technic.units import LDU

__all__ = [
    "alternatives_text",
    "basis_words",
    "cure_words",
    "hole_words",
    "nothing_words",
    "parts_words",
    "sequence_text",
    "sure_words",
    "unseen_words",
    "unstopped_words",
]

_SIDES = {
    "+x": "from the right",
    "-x": "from the left",
    "+y": "from below",
    "-y": "from above",
    "+z": "from behind",
    "-z": "from the front",
}


def parts_words(suggestion: Suggestion) -> str:
    """Return the new parts: ``"Beam 7 (32524), 2 x Pin with friction (2780)"``."""
    said = []
    for part, n in needs(suggestion.candidate).items():
        definition = catalogue().get(part)
        name = f"{definition.title} ({part})" if definition is not None else part
        said.append(name if n == 1 else f"{n} x {name}")
    return joined(said)


def _coordinates(point: Sequence[float]) -> str:
    return "(" + ", ".join(number(round(v / LDU, 2) + 0.0, 4) for v in point) + ")"


def hole_words(assembly: Assembly, attachment: Attachment) -> str:
    """Return how one hole of the new beam is fastened."""
    fastening = attachment.fastening
    held = joined([part_name(assembly.parts[p], line=True) for p in fastening.parts])
    where = f"hole at {_coordinates(attachment.point)}"
    if fastening.kind == "pin":
        return f"{where}: new pin {fastening.pin} into {held}"
    old = assembly.parts[fastening.old_pin]
    if fastening.kind == "present":
        return f"{where}: on the open end of {part_name(old, line=True)} in {held}"
    return (
        f"{where}: pin {fastening.pin} in place of {part_name(old)} ({place(old)}), through {held}"
    )


def cure_words(before: RigidityReport, suggestion: Suggestion | BarSuggestion) -> str:
    """Return what gets better."""
    joined_now = len(before.components) - len(suggestion.report.components)
    if joined_now > 0:
        return f"joins {count(joined_now, 'separate piece')} to the rest"
    went = before.mobility.structural - suggestion.report.mobility.structural
    if went > 0:
        if not suggestion.stops:
            return f"takes away {count(went, 'motion')}"
        names = joined([str(n) for n in suggestion.stops])
        word = "motion" if len(suggestion.stops) == 1 else "motions"
        left = suggestion.report.mobility.structural
        return f"works against {word} {names}; {went} of {went + left} gone"
    if suggestion.relieves is None:
        return "relieves no single weak spot"
    spot, left_share = suggestion.relieves
    return (
        f"relieves weak spot {spot.rank}, {spot_words(before.assembly, spot)}: "
        f"{100 * spot.energy_share:.1f} % of the strain energy before, {100 * left_share:.1f} % after"
    )


def _suggestion(before: RigidityReport, suggestion: Suggestion, style: Style) -> list[str]:
    assembly = before.assembly
    candidate = suggestion.candidate
    after = suggestion.report
    factor = "" if suggestion.factor is None else f" ({number(suggestion.factor)} times)"
    lines = style.wrap(f"{suggestion.rank}. {parts_words(suggestion)}", "", "   ")
    lines[0] = style("bold", lines[0])
    lines += style.wrap(
        f"Then: {state_words(after)}{factor}. It {cure_words(before, suggestion)}.", "   "
    )
    for attachment in candidate.attachments:
        lines += style.wrap(hole_words(assembly, attachment), "   - ", "     ")
    sides = Counter(_SIDES[side] for side in suggestion.sides)
    pushed = f"pins go in {joined(list(sides))}" if sides else "no new pin is needed"
    forecast = number(suggestion.forecast.rigidity)
    lines += style.wrap(
        f"It {describe_fit(candidate)}; {pushed}. Forecast {forecast} N/m before re-analysis.",
        "   ",
    )
    if suggestion.twins:
        said = f"{count(suggestion.twins, 'other place')} for the same part would do about as well"
        if suggestion.pair is not None:
            twin = joined([_coordinates(a.point) for a in suggestion.pair.candidate.attachments])
            said += f"; with a second one, holes at {twin}: {state_words(suggestion.pair.report)}"
        lines += style.wrap(f"{said}.", "   ")
    if sure := sure_words(suggestion):
        lines += style.wrap(sure, "   ")
    return lines


def _head(answer: Suggestions, style: Style) -> list[str]:
    before = answer.before
    return [
        style("bold", f"{before.assembly.name}: {count(len(before.assembly.parts), 'part')}"),
        f"Now: {state_words(before)}",
    ]


def nothing_words(answer: Suggestions) -> str:
    """Return why nothing was suggested."""
    if not answer.places and answer.refused:
        why = "; ".join(f"{n} x {reason}" for reason, n in answer.refused.most_common())
        why = f"no place is left: {why}"
    elif not answer.places:
        why = (
            "no two free holes, or pins that a longer one could replace, lie so that a beam would tie "
            "two parts together"
        )
    elif answer.refused:
        why = "; ".join(f"{n} x {reason}" for reason, n in answer.refused.most_common())
        why = f"none of {count(answer.places, 'place')} can be built: {why}"
    else:
        why = f"none of {count(answer.places, 'place')} makes the model more rigid"
    return f"Nothing fits: {why}."


def unstopped_words(answer: Suggestions) -> str:
    """Say that no suggestion stops a motion of a flexible model; "" when one does, or none is there."""
    motions = answer.before.mobility.structural
    if not motions or any(s.report.mobility.structural < motions for s in answer.suggestions):
        return ""
    which = "the motion" if motions == 1 else "any of the motions"
    return (
        f"None of them stops {which}: they stiffen what bends once that stands still. A motion needs a "
        "diagonal, or one more pin between the parts that move; --also frames and --snug look further."
    )


def unseen_words(answer: Suggestions) -> str:
    """Say what the search for collisions did not see; "" when it saw all."""
    parts = answer.before.assembly.parts
    said = []
    if answer.unseen:
        names = sorted({parts[k].number for k in answer.unseen})
        shown = ", ".join(names[:6]) + (", ..." if len(names) > 6 else "")
        said.append(f"{count(len(answer.unseen), 'part')} of unknown shape ({shown})")
    unknown = sum(part.count for part in answer.before.assembly.unknown)
    if unknown:
        said.append(f"{count(unknown, 'unknown part')}")
    return f"Not checked: whether {joined(said)} would be in the way." if said else ""


def _unseen(answer: Suggestions, style: Style) -> list[str]:
    said = unseen_words(answer)
    return style.wrap(said) if said else []


def sure_words(suggestion: Suggestion | BarSuggestion) -> str:
    """Return how sure the numbers of a suggestion are, in words."""
    sure = suggestion.confidence
    if sure is None:
        return ""
    low, high = (number(v) for v in sure.interval_95)
    said = f"95 %: {low} to {high} N/m"
    if sure.factor_95 is not None:
        low, high = (number(v) for v in sure.factor_95)
        said += f", {low} to {high} times as rigid as now"
    if sure.beats_next is not None:
        said += f"; better than the next one with a probability of {100 * sure.beats_next:.0f} %"
        if sure.beats_next < RANK_SURE:
            said += ", so their order is not sure"
    return f"How sure: {said}."


def basis_words(suggestions: Sequence[Suggestion | BarSuggestion]) -> str:
    """Say what the intervals rest on."""
    bases = {s.confidence.basis for s in suggestions if s.confidence is not None}
    if "calibration" in bases:
        return (
            "Verdicts and motions do not depend on stiffnesses. The intervals are those of the "
            "calibrated joint stiffnesses; parts, and joints that were not measured, are taken as exact."
        )
    said = "Verdicts and motions do not depend on stiffnesses; N/m do."
    if bases:
        said += (
            " The joints' stiffnesses are not calibrated: the intervals assume that each is known "
            f"within a factor of {FACTOR:g}."
        )
    return said


def alternatives_text(answer: Suggestions, style: Style | None = None) -> str:
    """Return alternatives, best first, with a final newline."""
    style = Style() if style is None else style
    lines = _head(answer, style)
    if not answer.suggestions:
        lines += ["", *style.wrap(nothing_words(answer))]
        return "\n".join(lines) + "\n"
    lines += ["", f"One part, best first (of {count(answer.places, 'place')}):"]
    if said := unstopped_words(answer):
        lines += style.wrap(said)
    for suggestion in answer.suggestions:
        lines += ["", *_suggestion(answer.before, suggestion, style)]
    lines += ["", *_unseen(answer, style), *style.wrap(basis_words(answer.suggestions))]
    return "\n".join(lines) + "\n"


def sequence_text(answers: Sequence[Suggestions], style: Style | None = None) -> str:
    """Return beams added one after another, with a final newline."""
    style = Style() if style is None else style
    if not answers:
        return "The model is as rigid as demanded: nothing to add.\n"
    lines = _head(answers[0], style)
    taken = [answer for answer in answers if answer.suggestions]
    total: Counter[str] = Counter()
    for answer in taken:
        lines += ["", *_suggestion(answer.before, answer.suggestions[0], style)]
        total.update(needs(answer.suggestions[0].candidate))
    if len(taken) < len(answers):
        lines += ["", *style.wrap(nothing_words(answers[-1]))]
    if taken:
        last = taken[-1].suggestions[0].report
        lines += [
            "",
            *style.wrap(f"In the end: {state_words(last)}.{_gain(answers[0].before, last)}"),
        ]
        said = joined([f"{n} x {part}" for part, n in sorted(total.items())])
        lines += [*style.wrap(f"Parts: {said}."), *_unseen(answers[0], style)]
        lines += style.wrap(basis_words([a.suggestions[0] for a in taken]))
    return "\n".join(lines) + "\n"


def _gain(before: RigidityReport, after: RigidityReport) -> str:
    if before.rigidity is None or after.rigidity is None or before.verdict is not Verdict.RIGID:
        return ""
    return f" That is {number(after.rigidity.value / before.rigidity.value)} times as rigid."
