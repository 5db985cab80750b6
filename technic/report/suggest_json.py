"""Suggestions as JSON: ``technic-suggestions/1`` (DESIGN, section 5)."""

from __future__ import annotations

from collections.abc import Sequence
from math import isfinite
from typing import Any

from technic.design.confidence import RANK_SURE, Confidence
from technic.design.filters import needs
from technic.design.suggest import Suggestion, Suggestions
from technic.ldraw.write import NewPart
from technic.parts.catalogue import catalogue
from technic.report.palette import color_name
from technic.report.suggest_text import cure_words
from technic.rigidity.provenance import table_dict
from technic.rigidity.result import RigidityReport
from technic.units import LDU, MM

__all__ = ["SCHEMA", "confidence_dict", "state_dict", "suggestions_dict"]

SCHEMA = "technic-suggestions/1"


def suggestions_dict(answers: Sequence[Suggestions], *, sequence: bool) -> dict[str, Any]:
    """Return suggestions as plain values.

    Parameters
    ----------
    answers : sequence of Suggestions
        One, with its alternatives; or one for each beam of a sequence.
    sequence : bool
        Whether each suggestion stands on those before it.
    """
    from technic import __version__

    if sequence:
        pairs = [(a.before, a.suggestions[0]) for a in answers if a.suggestions]
    else:
        pairs = [(a.before, s) for a in answers for s in a.suggestions]
    before = answers[0].before if answers else None
    source = {} if before is None else before.assembly.source
    return {
        "schema": SCHEMA,
        "source": {key: source.get(key) for key in ("path", "sha256", "format")},
        "kind": "sequence" if sequence else "alternatives",
        "before": None if before is None else state_dict(before),
        "stiffness_table": None if before is None else table_dict(before.table),
        "places": sum(a.places for a in answers),
        "refused": {
            reason: sum(a.refused[reason] for a in answers)
            for reason in sorted({r for a in answers for r in a.refused})
        },
        "not_checked": []
        if before is None
        else [before.assembly.parts[k].id for k in answers[0].unseen],
        "suggestions": [
            _suggestion(own_before, suggestion, rank)
            for rank, (own_before, suggestion) in enumerate(pairs, start=1)
        ],
        "technic_version": __version__,
    }


def state_dict(report: RigidityReport) -> dict[str, Any]:
    """Return what a state of the model is told by."""
    full = report.to_dict()
    return {key: full[key] for key in ("verdict", "mobility", "rigidity")}


def _new_part(part: NewPart) -> dict[str, Any]:
    definition = catalogue().get(part.number)
    return {
        "part_number": part.number,
        "name": part.number if definition is None else definition.title,
        "color": part.color,
        "color_name": color_name(part.color),
        "position_ldu": [float(v) + 0.0 for v in (part.pose.translation / LDU).round(6)],
        "rotation": [float(v) + 0.0 for v in part.pose.rotation.ravel()],
    }


def confidence_dict(sure: Confidence | None) -> dict[str, Any] | None:
    """Return how sure a suggestion is as plain values."""
    if sure is None:
        return None
    return {
        "basis": sure.basis,
        "interval_95": list(sure.interval_95),
        "factor_95": None if sure.factor_95 is None else list(sure.factor_95),
        "probability_it_helps": sure.helps,
        "probability_it_beats_the_next": sure.beats_next,
        "rank_stable": None if sure.beats_next is None else sure.beats_next >= RANK_SURE,
    }


def _suggestion(before: RigidityReport, suggestion: Suggestion, rank: int) -> dict[str, Any]:
    parts = before.assembly.parts
    candidate = suggestion.candidate
    after = suggestion.report
    forecast = suggestion.forecast.rigidity
    return {
        "rank": rank,
        "new_parts": [_new_part(part) for part in suggestion.change.added],
        "removed_parts": list(suggestion.change.removed),
        "connects": [parts[p].id for p in candidate.parts],
        "holes": [
            {
                "position_ldu": [round(v / LDU, 6) + 0.0 for v in a.point],
                "fastened_by": a.fastening.kind,
                "pin": a.fastening.pin or None,
                "old_pin": parts[a.fastening.old_pin].id if a.fastening.old_pin >= 0 else None,
                "parts": [parts[p].id for p in a.fastening.parts],
            }
            for a in candidate.attachments
        ],
        "pushed_in_from": list(suggestion.sides),
        "mismatch_mm": candidate.mismatch / MM,
        "needs": dict(needs(candidate)),
        "cures": cure_words(before, suggestion),
        "predicted_n_per_m": forecast if isfinite(forecast) else None,
        "predicted_motions_removed": suggestion.forecast.removed,
        "reanalyzed_n_per_m": None if after.rigidity is None else after.rigidity.value,
        "confidence": confidence_dict(suggestion.confidence),
        "factor": suggestion.factor,
        "after": state_dict(after),
        "twins": suggestion.twins,
        "pair": None
        if suggestion.pair is None
        else {
            "new_parts": [_new_part(part) for part in suggestion.pair.change.added],
            "removed_parts": list(suggestion.pair.change.removed),
            "after": state_dict(suggestion.pair.report),
        },
    }
