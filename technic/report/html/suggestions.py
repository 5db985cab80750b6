"""The page of `technic suggest`: before and after side by side, which parts, where, how many."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np

from technic.design.candidates import describe_fit
from technic.design.filters import needs
from technic.design.suggest import Suggestion, Suggestions
from technic.geometry import Array
from technic.parts.catalogue import catalogue
from technic.report.camera import model_axes, sight
from technic.report.comparison import common_scale
from technic.report.drawing import Drawing, drawing_of
from technic.report.energy import energy_shares
from technic.report.files import write_bytes
from technic.report.html.pack import Block, corners_of, extremes, pack
from technic.report.html.page import TONES
from technic.report.html.shell import embedded, render
from technic.report.phrases import state_words
from technic.report.suggest_text import (
    basis_words,
    cure_words,
    hole_words,
    nothing_words,
    parts_words,
    sure_words,
    unseen_words,
)
from technic.report.wording import count, number
from technic.report.worst_field import worst_field
from technic.rigidity.result import RigidityReport, Verdict
from technic.units import MM

__all__ = ["suggestions_page", "write_suggestions_page"]


@dataclass(frozen=True, slots=True, eq=False)
class _Step:
    """A suggestion with the model that it stands on."""

    before: RigidityReport
    suggestion: Suggestion


def _steps(answers: Sequence[Suggestions], *, sequence: bool) -> list[_Step]:
    if sequence:
        return [_Step(a.before, a.suggestions[0]) for a in answers if a.suggestions]
    return [_Step(answers[0].before, s) for s in answers[0].suggestions]


def _row(step: _Step) -> dict[str, Any]:
    """Return what the tables say of one suggestion."""
    after, suggestion = step.suggestion.report, step.suggestion
    parts = parts_words(suggestion)
    forecast = suggestion.forecast.rigidity
    fit = [f"It {describe_fit(suggestion.candidate)}."]
    if np.isfinite(forecast):
        fit.append(f"Forecast {number(forecast)} N/m before re-analysis.")
    if suggestion.twins:
        fit.append(f"{count(suggestion.twins, 'other place')} would do about as well.")
    if sure := sure_words(suggestion):
        fit.append(sure)
    return {
        "parts": parts,
        "option": f"{suggestion.rank}: {parts}",
        "state": state_words(after),
        "rigidity": "" if after.rigidity is None else number(after.rigidity.value),
        "factor": "" if suggestion.factor is None else number(suggestion.factor),
        "cures": cure_words(step.before, suggestion),
        "holes": [
            hole_words(step.before.assembly, attachment)
            for attachment in suggestion.candidate.attachments
        ],
        "fit": " ".join(fit),
    }


def _needed(steps: Sequence[_Step]) -> list[dict[str, Any]]:
    """Return the parts to buy: number, name, how many for each suggestion."""
    wanted = [needs(step.suggestion.candidate) for step in steps]
    rows = []
    for part in sorted({part for each in wanted for part in each}):
        definition = catalogue().get(part)
        rows.append(
            {
                "number": part,
                "name": "" if definition is None else definition.title,
                "counts": [each[part] for each in wanted],
            }
        )
    return rows


def _work(report: RigidityReport) -> float:
    """Return the strain energy under the worst load of 1 N (µJ)."""
    return 0.0 if report.rigidity is None else 0.5e6 / report.rigidity.value


def _contents(
    reports: Sequence[RigidityReport],
    drawings: Sequence[Drawing],
    captions: Sequence[str],
    block: Block,
) -> dict[str, Any]:
    """Return what the viewer reads: models that share camera, colours, arrows and their range."""
    first = reports[0]
    corners: Array = np.concatenate([corners_of(drawing.points) for drawing in drawings])
    low, high = corners.min(axis=0), corners.max(axis=0)
    middle = 0.5 * (low + high)
    fields = [worst_field(report) for report in reports]
    movement = None if fields[0] is None else fields[0].displacements
    toward, _ = sight(first.assembly, corners, movement=movement, aspect=0.8)
    strongest = max((field.strongest for field in fields if field is not None), default=0.0)
    known = {part.id for part in first.assembly.parts}
    models = []
    for report, drawing, caption in zip(reports, drawings, captions, strict=True):
        model = pack(report, drawing, block, middle=middle, strongest=strongest or None)
        # The comparison shows the worst mode and the first motion.
        model["modes"], model["motions"] = model["modes"][:1], model["motions"][:1]
        model["caption"] = caption
        model["work"] = _work(report)
        model["added"] = [k for k, p in enumerate(report.assembly.parts) if p.id not in known]
        models.append(model)
    moves = first.mobility.structural > 0
    return {
        "models": models,
        "frame": {
            "half": [float(v) for v in 0.5 * (high - low) / MM],
            "extremes": extremes(corners - middle),
            "toward": [float(v) for v in toward],
            "axes": model_axes(first.assembly).ravel().tolist(),
        },
        "scale": common_scale(reports, drawings),
        "most": max(_work(r) * float(energy_shares(r).max(initial=0.0)) for r in reports),
        "begin": "motion" if moves or first.rigidity is None else "mode",
    }


def _sure(answers: Sequence[Suggestions], steps: Sequence[_Step]) -> list[str]:
    lines = [basis_words([step.suggestion for step in steps]), unseen_words(answers[0])]
    return [line for line in lines if line]


def _facts(steps: Sequence[_Step], before: RigidityReport) -> list[tuple[str, str, str]]:
    def rigidity(report: RigidityReport) -> str:
        return "none" if report.rigidity is None else f"{number(report.rigidity.value)} N/m"

    found = [("Now", rigidity(before), state_words(before))]
    if steps:
        last = steps[0].suggestion if steps[0].before is steps[-1].before else steps[-1].suggestion
        found.append(("Then", rigidity(last.report), state_words(last.report)))
        # A model that moves has another rigidity when it is held: the two do not compare.
        rigid = before.verdict is Verdict.RIGID
        if rigid and before.rigidity is not None and last.report.rigidity is not None:
            times = last.report.rigidity.value / before.rigidity.value
            found.append(("That is", f"{number(times)} times", "as rigid"))
    found.append(("Model", count(len(before.assembly.parts), "part"), before.assembly.name))
    return found


def suggestions_page(
    answers: Sequence[Suggestions], *, sequence: bool, picture: bytes | None = None
) -> str:
    """Return the page of suggestions.

    Parameters
    ----------
    answers : sequence of Suggestions
        One, with its alternatives; or one for each beam of a sequence. At least one.
    sequence : bool
        Whether each suggestion stands on those before it.
    picture : bytes, optional
        PNG of before and after; without it the page prints what its halves show.
    """
    before = answers[0].before
    steps = _steps(answers, sequence=sequence)
    block = Block()
    contents = None
    if steps:
        reports = [before, *(step.suggestion.report for step in steps)]
        captions = [
            f"before: {state_words(before)}",
            *(
                f"after {'step ' if sequence else ''}{n}: {state_words(step.suggestion.report)}"
                for n, step in enumerate(steps, start=1)
            ),
        ]
        drawings = [drawing_of(report.assembly) for report in reports]
        contents = _contents(reports, drawings, captions, block)
    places = sum(answer.places for answer in answers)
    return render(
        "suggest.html.j2",
        contents,
        block.text(),
        title=f"{before.assembly.name}: suggestions",
        name=before.assembly.name,
        tone=TONES[before.verdict],
        verdict=before.verdict.value,
        lead=before.reason,
        facts=_facts(steps, before),
        picture=None if picture is None else embedded(picture),
        rows=[_row(step) for step in steps],
        needed=_needed(steps),
        sequence=sequence,
        moves=contents is not None and any(model["motions"] for model in contents["models"]),
        nothing=nothing_words(answers[-1]),
        sure=_sure(answers, steps),
        places=f"{count(places, 'place')} for a beam looked at",
        not_modelled=before.not_modelled,
        source=before.assembly.source,
    )


def write_suggestions_page(
    answers: Sequence[Suggestions], path: Path, *, sequence: bool, picture: bytes | None = None
) -> None:
    """Write `suggestions_page` into a file.

    Raises
    ------
    UsageError
        When the file cannot be written.
    """
    text = suggestions_page(answers, sequence=sequence, picture=picture)
    write_bytes(path, text.encode("utf-8"))
