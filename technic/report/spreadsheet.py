"""The report as CSV tables, one file each, for spreadsheets and statistics."""

from __future__ import annotations

import csv
import io
from collections.abc import Sequence
from pathlib import Path
from typing import Any

from technic.errors import UsageError
from technic.report.energy import energy_shares
from technic.report.files import write_bytes
from technic.report.palette import color_name
from technic.report.phrases import motion_words
from technic.report.wording import spot_words
from technic.rigidity.result import RigidityReport
from technic.rigidity.serialize import joint_stiffness, spot_place, unit_load
from technic.units import MM

__all__ = ["csv_text", "tables", "write_tables"]

Table = list[list[Any]]

_FORMULA = ("=", "+", "-", "@", "\t", "\r")
"""Text that starts so is a formula to a spreadsheet; names in model files are anybody's."""


def _plain(value: Any) -> Any:
    if isinstance(value, str) and value.startswith(_FORMULA):
        return "'" + value
    return value


def _summary(report: RigidityReport) -> Table:
    rigidity, mobility = report.rigidity, report.mobility
    rows: Table = [
        ["quantity", "value", "unit"],
        ["model", report.assembly.name, ""],
        ["verdict", report.verdict.value, ""],
        ["parts", len(report.assembly.parts), ""],
        ["joints", len(report.assembly.joints), ""],
        ["mass", report.mass, "kg"],
    ]
    for name in ("structural", "spinning", "sliding", "idle"):
        rows.append([f"motions, {name}", getattr(mobility, name), ""])
    if rigidity is not None:
        rows.append(["rigidity", rigidity.value, "N/m" if rigidity.measure != "nodal" else ""])
        if rigidity.frequency_hz is not None:
            rows.append(["lowest natural frequency", rigidity.frequency_hz, "Hz"])
        if rigidity.interval_95 is not None:
            for name, value in zip(("low", "high"), rigidity.interval_95, strict=True):
                rows.append([f"rigidity, 95 % interval, {name}", value, "N/m"])
    return rows


def _parts(report: RigidityReport) -> Table:
    load = unit_load(report)
    energy = energy_shares(report)
    rows: Table = [
        [
            "id",
            "part_number",
            "name",
            "color",
            "submodel",
            "step",
            "line",
            "mass_kg",
            "energy_share",
            *(f"force_{axis}_n" for axis in "xyz"),
            *(f"moment_{axis}_nm" for axis in "xyz"),
            *(f"displacement_{axis}_mm" for axis in "xyz"),
            *(f"rotation_{axis}_rad" for axis in "xyz"),
        ]
    ]
    for k, part in enumerate(report.assembly.parts):
        source = part.source
        place = ["", "", ""] if source is None else [source.submodel, source.step, source.line]
        row = [part.id, part.number, part.name, color_name(part.color), *place]
        row += [part.mass_properties.mass, float(energy[k])]
        if load is None:
            row += [""] * 12
        else:
            forces, twists = load
            row += [float(v) for v in forces[k]]
            row += [float(v) / MM for v in twists[k, :3]] + [float(v) for v in twists[k, 3:]]
        rows.append(row)
    return rows


def _weak_spots(report: RigidityReport) -> Table:
    rows: Table = [["rank", "kind", "energy_share", "what", "parts", "submodel", "step", "line"]]
    for spot in report.weak_spots:
        source = spot_place(report.assembly, spot).source
        place = ["", "", ""] if source is None else [source.submodel, source.step, source.line]
        ids = " | ".join(report.assembly.parts[k].id for k in spot.parts)
        words = spot_words(report.assembly, spot)
        rows.append([spot.rank, spot.kind, spot.energy_share, words, ids, *place])
    return rows


def _motions(report: RigidityReport) -> Table:
    rows: Table = [["number", "kind", "type", "order", "what", "parts"]]
    for n, motion in enumerate(report.motions, 1):
        ids = " | ".join(report.assembly.parts[k].id for k in motion.parts)
        words = motion_words(report, motion)
        row = [n, motion.kind.value, motion.type.value, motion.order or "", words, ids]
        rows.append(row)
    return rows


def _joint_stiffness(report: RigidityReport) -> Table:
    rows: Table = [["connection", "type", "count", "motion", "unit", "value", "provenance"]]
    units = {"n_per_m": "N/m", "nm_per_rad": "N m/rad"}
    for entry in joint_stiffness(report.assembly):
        for key, value in entry["values"].items():
            motion, _, unit = key.partition("_")
            for one in value if isinstance(value, list) else [value]:
                kind = [entry["connection"], entry["type"], entry["count"]]
                rows.append([*kind, motion, units[unit], one, entry["provenance"]])
    return rows


def _findings(report: RigidityReport) -> Table:
    rows: Table = [["kind", "what", "distance_mm", "parts"]]
    for finding in report.assembly.findings:
        distance = "" if finding.distance is None else finding.distance / MM
        ids = " | ".join(report.assembly.parts[k].id for k in finding.parts)
        rows.append([finding.kind.value, finding.message, distance, ids])
    for unknown in report.assembly.unknown:
        lines = ", ".join(str(line) for line in unknown.lines)
        what = f"{unknown.count} x {unknown.number}: {unknown.reason}; lines {lines}"
        rows.append(["unknown_part", what, "", ""])
    return rows


def tables(report: RigidityReport) -> dict[str, Table]:
    """Return all tables by file name (without ``.csv``), the first row of each its heading."""
    return {
        "summary": _summary(report),
        "parts": _parts(report),
        "weak_spots": _weak_spots(report),
        "motions": _motions(report),
        "joint_stiffness": _joint_stiffness(report),
        "findings": _findings(report),
    }


def csv_text(table: Sequence[Sequence[Any]]) -> str:
    """Return a table as CSV; text that a spreadsheet would take for a formula is marked as text."""
    stream = io.StringIO()
    writer = csv.writer(stream)
    writer.writerows([_plain(value) for value in row] for row in table)
    return stream.getvalue()


def write_tables(report: RigidityReport, directory: Path) -> None:
    """Write every table into a directory, which is made when it is not there.

    Raises
    ------
    UsageError
        When the system refuses.
    """
    try:
        directory.mkdir(exist_ok=True)
    except OSError as error:
        raise UsageError(f"{directory} cannot be made a directory: {error.strerror}") from error
    for name, table in tables(report).items():
        # The mark at the start tells spreadsheets that it is UTF-8.
        write_bytes(directory / f"{name}.csv", csv_text(table).encode("utf-8-sig"))
