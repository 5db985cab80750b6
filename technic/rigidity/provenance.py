"""Which stiffness table is in force, where it came from, and what its uncertainty leaves open."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

from technic.assembly.model import Assembly
from technic.assembly.stiffness import StiffnessTable, default_table
from technic.rigidity.result import RigidityReport

__all__ = ["spots_sentence", "stability_dict", "table_dict", "table_sentences", "verdict_sentence"]


def table_dict(table: StiffnessTable | None) -> dict[str, Any]:
    """Return the stiffness table in force as plain values; None stands for the shipped one."""
    table = table or default_table()
    return {
        "name": table.name,
        "path": table.path or None,
        "found": table.found,
        "measured": [{"joint_type": name, "motion": motion} for name, motion in table.measured],
        "calibration": dict(table.calibration) or None,
    }


def table_sentences(
    assembly: Assembly, table: StiffnessTable | None, part_models: Mapping[str, int]
) -> list[str]:
    """Return which table the stiffnesses come from; nothing when no joint takes its stiffness from one.

    Parameters
    ----------
    assembly : Assembly
    table : StiffnessTable or None
        None stands for the shipped one.
    part_models : mapping of str to int
        How many parts are solid models, frame members, rigid bodies.
    """
    used = table or default_table()
    if not any(joint.connection in used.connections for joint in assembly.joints):
        return []
    if used.found == "shipped":
        return ["table: the shipped one; `technic calibrate` measures your own bricks"]
    how = {"given": "--calibration"}.get(used.found, used.found)
    said = [f"table: {used.name} ({how}: {used.path})"]
    told = used.calibration
    if "readings" in told:
        rigs = told.get("rigs")
        where = f" on {', '.join(map(str, rigs))}" if isinstance(rigs, list) and rigs else ""
        date = f", {told['date']}" if "date" in told else ""
        said.append(f"measured: {told['readings']} readings{where}{date}")
    elif not used.measured:
        said.append("measured: nothing, as far as the table says")
    parts = told.get("parts")
    if parts and parts != "solid" and "solid" in part_models:
        said.append(
            f"take care: it was measured with parts taken as {parts}, here they are solid models; "
            "what the parts themselves give way is counted differently"
        )
    return said


def verdict_sentence(report: RigidityReport) -> str:
    """Return why the verdict is as sure as without a calibration; empty when nothing was measured."""
    if report.stability is None:
        return ""
    return (
        "The verdict does not depend on the calibration: it rests on what joints hold, not on how "
        "stiff they are."
    )


def spots_sentence(report: RigidityReport) -> str:
    """Return whether the order of the weak spots is sure; empty when nothing was measured."""
    stability = report.stability
    if stability is None or not stability.spots:
        return ""
    count, rank = len(stability.spots), stability.first_open
    if rank is None:
        first = "The first weak spot is" if count == 1 else f"The first {count} weak spots are"
        return f"{first} the same whatever the measured stiffnesses are within their uncertainty."
    low, high = stability.spots[rank - 1].ranks
    before = "" if rank == 1 else f"Rank 1 to {rank - 1} hold. " if rank > 2 else "Rank 1 holds. "
    return (
        f"{before}From rank {rank} on the order is not sure: within the uncertainty of the measured "
        f"stiffnesses number {rank} stands anywhere from rank {low} to {high}."
    )


def stability_dict(report: RigidityReport) -> dict[str, Any] | None:
    """Return what the calibration leaves open as plain values; None when nothing was measured."""
    if report.stability is None:
        return None
    return {
        "draws": report.stability.draws,
        "verdict": {"stable": True, "sentence": verdict_sentence(report)},
        "weak_spots": {
            "stable": report.stability.first_open is None,
            "examined": len(report.stability.spots),
            "first_open_rank": report.stability.first_open,
            "sentence": spots_sentence(report),
        },
    }
