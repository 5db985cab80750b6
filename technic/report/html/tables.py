"""The tables of the page: plain texts and numbers, which the template escapes and sets."""

from __future__ import annotations

from collections import Counter
from math import inf
from typing import Any

from technic.assembly.model import FindingKind
from technic.report.palette import color_name
from technic.report.phrases import FINDING_WORDS, merged_stiffness, motion_words
from technic.report.wording import count, number, spot_words
from technic.rigidity.result import MotionKind, RigidityReport
from technic.rigidity.serialize import joint_stiffness, spot_place
from technic.units import MM

__all__ = [
    "SPOT_ROWS",
    "finding_groups",
    "model_words",
    "motion_rows",
    "plain_rows",
    "spot_rows",
    "stiffness_rows",
    "unknown_rows",
]

SPOT_ROWS = 40
"""Weak spots in the table; all are in the JSON and CSV reports."""

_FINDING_ROWS = 60
_MOTION_ROWS = 200

_KIND_WORDS = {
    MotionKind.STRUCTURAL: "moves",
    MotionKind.SPINNING: "spins",
    MotionKind.SLIDING: "slides",
    MotionKind.IDLE: "turns in place",
}


def spot_rows(report: RigidityReport) -> list[dict[str, Any]]:
    """Return the first weak spots: rank, share, words, place."""
    rows = []
    for n, spot in enumerate(report.weak_spots[:SPOT_ROWS]):
        part = spot_place(report.assembly, spot)
        source = part.source
        rows.append(
            {
                "index": n,
                "rank": spot.rank,
                "share": f"{100.0 * spot.energy_share:.1f}",
                "bar": max(1, round(100.0 * spot.energy_share / report.weak_spots[0].energy_share)),
                "words": spot_words(report.assembly, spot),
                "color": color_name(part.color),
                "submodel": part.id if source is None else source.submodel,
                "step": "" if source is None else source.step,
                "line": "" if source is None else source.line,
            }
        )
    return rows


def motion_rows(report: RigidityReport, played: dict[int, int]) -> list[dict[str, Any]]:
    """Return the motions that are not idle.

    Parameters
    ----------
    report : RigidityReport
    played : dict of int to int
        Number of a motion in the viewer, by its number in the report.
    """
    rows = []
    for n, motion in enumerate(report.motions):
        if motion.kind is MotionKind.IDLE:
            continue
        rows.append(
            {
                "number": n + 1,
                "kind": _KIND_WORDS[motion.kind],
                "words": motion_words(report, motion),
                "parts": len(motion.parts),
                "played": played.get(n),
            }
        )
        if len(rows) == _MOTION_ROWS:
            break
    return rows


_MODEL_WORDS = {"solid": "solid", "frame": "frame", "rigid": "rigid body"}


def model_words(report: RigidityReport) -> str:
    """Return how many parts are modelled how."""
    said = [f"{n} as {_MODEL_WORDS.get(kind, kind)}" for kind, n in report.part_models.items() if n]
    return f"Parts: {', '.join(said)}." if said else "The model has no parts."


def plain_rows(report: RigidityReport) -> list[dict[str, Any]]:
    """Return the kinds of part without a solid model, with the reason."""
    return [
        {
            "part": f"{plain.name} ({plain.number})" if plain.number else plain.name,
            "count": plain.count,
            "model": _MODEL_WORDS.get(plain.model, plain.model),
            "why": plain.reason,
        }
        for plain in report.plain_parts
    ]


def unknown_rows(report: RigidityReport) -> list[dict[str, Any]]:
    """Return the parts that were not understood, the most frequent first."""
    entries = sorted(report.assembly.unknown, key=lambda entry: (-entry.count, entry.number))
    return [
        {
            "number": entry.number,
            "count": entry.count,
            "reason": entry.reason,
            "lines": ", ".join(str(line) for line in entry.lines[:8])
            + (", ..." if len(entry.lines) > 8 else ""),
        }
        for entry in entries
    ]


def finding_groups(report: RigidityReport) -> list[dict[str, Any]]:
    """Return what reading the model found, by kind: a heading and the messages with distances."""
    findings = report.assembly.findings
    numbers = Counter(finding.kind for finding in findings)
    groups = []
    for kind in FindingKind:
        if not numbers[kind]:
            continue
        # Most open ends are meant to be open: they are counted only.
        found = [] if kind is FindingKind.OPEN_PORT else [f for f in findings if f.kind is kind]
        groups.append(
            {
                "title": count(numbers[kind], *FINDING_WORDS[kind]),
                "rows": [
                    {
                        "words": finding.message,
                        "distance": ""
                        if finding.distance is None
                        else f"{number(finding.distance / MM)} mm",
                    }
                    for finding in found[:_FINDING_ROWS]
                ],
                "rest": max(0, len(found) - _FINDING_ROWS),
            }
        )
    return groups


def _amount(values: list[float]) -> str:
    low, high = min(values), max(values)
    if low == inf:
        return "rigid"
    upper = "rigid" if high == inf else number(high)
    return number(low) if low == high else f"{number(low)} to {upper}"


def stiffness_rows(report: RigidityReport) -> list[dict[str, Any]]:
    """Return the joints by connection with stiffness and where it comes from."""
    rows = []
    for (name, kind, source), (total, values) in merged_stiffness(
        joint_stiffness(report.assembly)
    ).items():
        said = {key.partition("_")[0]: _amount(found) for key, found in values.items()}
        rows.append(
            {
                "name": name,
                "kind": kind,
                "count": total,
                "source": source,
                **{key: said.get(key, "free") for key in ("axial", "shear", "spin", "tilt")},
            }
        )
    return rows
