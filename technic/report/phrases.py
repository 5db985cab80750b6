"""Phrases that the terminal and the page share: motions, findings, stiffnesses of joints."""

from __future__ import annotations

from math import inf
from typing import Any

from technic.assembly.model import FindingKind
from technic.report.wording import count, number, part_names
from technic.rigidity.result import Motion, MotionKind, RigidityReport

__all__ = ["FINDING_WORDS", "merged_stiffness", "motion_words", "state_words"]

_SENTENCE = 320
"""Letters of a motion's sentence: in a big mechanism dozens of parts follow one another."""

_ORDERS = {
    ("finite", None): "A real mechanism: it keeps moving",
    ("first-order", None): "Shaky: moves a little through pin play, not a mechanism",
    ("first-order", "stiffens"): (
        "Shaky: moves a little through pin play and stiffens at once, not a mechanism"
    ),
    ("first-order", "undecided"): (
        "Shaky: moves a little through pin play, not a mechanism (the second-order test does not decide)"
    ),
}

FINDING_WORDS = {
    FindingKind.OFF_GRID: ("joint placed off the grid", "joints placed off the grid"),
    FindingKind.NEAR_MISS: ("near miss", "near misses"),
    FindingKind.OPEN_PORT: ("open pin or axle end", "open pin or axle ends"),
    FindingKind.SINGLE_PIN: ("part on a single pin", "parts on a single pin"),
    FindingKind.ONE_PART_PIN: ("pin in one part only", "pins in one part only"),
    FindingKind.NO_PIN: ("pair of aligned holes with no pin", "pairs of aligned holes with no pin"),
    FindingKind.LOOSE: ("loose part", "loose parts"),
    FindingKind.FLEXIBLE: ("flexible item, not modelled", "flexible items, not modelled"),
    FindingKind.INNER: ("part with inner motion", "parts with inner motion"),
    FindingKind.OVERRIDE: ("correction of yours", "corrections of yours"),
    FindingKind.MATERIAL: ("material that you chose", "materials that you chose"),
    FindingKind.GEARS: ("pair of gears in mesh", "pairs of gears in mesh"),
    FindingKind.WARNING: ("warning", "warnings"),
}


def motion_words(report: RigidityReport, motion: Motion) -> str:
    """Return a motion in words, shortened where dozens of parts follow one another."""
    said = motion.sentence or (
        f"{part_names(report.assembly, motion.parts)} can move ({motion.type.value})"
    )
    clauses = said.rstrip(".").split("; ")
    kept = 1
    while kept < len(clauses) and len("; ".join(clauses[: kept + 1])) <= _SENTENCE:
        kept += 1
    if kept < len(clauses):
        clauses[kept:] = ["and others with them, see --json"]
    # That a wheel keeps spinning goes without saying.
    order = None
    if motion.kind is MotionKind.STRUCTURAL:
        order = _ORDERS.get((motion.order or "", motion.second_order))
    return "; ".join(clauses) + (f". {order}." if order else ".")


def merged_stiffness(
    entries: list[dict[str, Any]],
) -> dict[tuple[str, str, str], tuple[int, dict[str, list[float]]]]:
    """Return the joints by connection, type and source, with all values that occur.

    Joints of several studs have a stiffness each; a reader wants the range.
    """
    merged: dict[tuple[str, str, str], tuple[int, dict[str, list[float]]]] = {}
    for entry in entries:
        key = (
            entry["connection"] or entry["type"],
            entry["type"],
            entry["provenance"] or "not stated",
        )
        total, values = merged.get(key, (0, {}))
        for motion, value in entry["values"].items():
            found = value if isinstance(value, list) else [value]
            values.setdefault(motion, []).extend(inf if v == "rigid" else v for v in found)
        merged[key] = (total + entry["count"], values)
    return merged


def state_words(report: RigidityReport) -> str:
    """Return verdict, motions and rigidity in a few words: ``"flexible, 1 motion, 3230 N/m"``."""
    said = report.verdict.value
    if report.mobility.structural:
        said += f", {count(report.mobility.structural, 'motion')}"
    if report.rigidity is not None:
        said += f", {number(report.rigidity.value)} N/m"
    return said
