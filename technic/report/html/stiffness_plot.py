"""Calibrated stiffnesses as a drawing: value and 95 % interval of each, on a logarithmic scale."""

from __future__ import annotations

from html import escape

import numpy as np

from technic.assembly.stiffness import StiffnessTable, StiffnessValue, default_table
from technic.report.wording import number
from technic.rigidity.result import RigidityReport

__all__ = ["calibrated", "stiffness_plots"]

_WIDE, _ROW, _LEFT, _RIGHT, _TOP, _BOTTOM = 720, 30, 220, 48, 12, 40

_UNITS = {"axial": "N/m", "shear": "N/m", "spin": "N m/rad", "tilt": "N m/rad"}

Row = tuple[str, str, StiffnessValue, float | None]
"""Connection, motion, calibrated value, value of the shipped table."""


def calibrated(report: RigidityReport) -> list[Row]:
    """Return the calibrated stiffnesses of the connections that the model has."""
    joining = report.assembly.joining
    if joining is None:
        return []
    table = joining.table
    present = {joint.connection for joint in report.assembly.joints}
    shipped = default_table().connections
    rows: list[Row] = []
    for connection, motion in table.measured:
        if connection not in present:
            continue
        value = table.connections[connection].values[motion]
        before = shipped[connection].values.get(motion) if connection in shipped else None
        if value.interval_95 is not None:
            rows.append((connection, motion, value, None if before is None else before.value))
    return rows


def _plot(rows: list[Row], unit: str) -> str:
    """Return one SVG for the stiffnesses of one unit; colours are those of the page."""
    reach = [
        v for _, _, value, old in rows for v in (*(value.interval_95 or ()), old or value.value)
    ]
    low, high = np.floor(np.log10(min(reach))), np.ceil(np.log10(max(reach)))
    high = max(high, low + 1)
    height = _TOP + _ROW * len(rows) + _BOTTOM

    def across(value: float) -> float:
        share = (np.log10(value) - low) / (high - low)
        return float(_LEFT + share * (_WIDE - _LEFT - _RIGHT))

    words = f"Calibrated stiffnesses in {unit} with their 95 % intervals"
    out = [f'<svg class="plot" viewBox="0 0 {_WIDE} {height}" role="img" aria-label="{words}">']
    foot = height - _BOTTOM + 4
    for power in np.arange(low, high + 1):
        x = across(10.0**power)
        out.append(
            f'<path class="grid" d="M{x:.1f} {_TOP}V{foot}"/>'
            f'<text x="{x:.1f}" y="{foot + 16}" text-anchor="middle">{10.0**power:g}</text>'
        )
    out.append(
        f'<text x="{(_LEFT + _WIDE - _RIGHT) / 2:.0f}" y="{height - 4}" '
        f'text-anchor="middle">{unit}</text>'
    )
    for k, (connection, motion, value, old) in enumerate(rows):
        y = _TOP + _ROW * (k + 0.5)
        a, b = value.interval_95 or (value.value, value.value)
        said = f"{number(value.value)} {unit}, 95 %: {number(a)} to {number(b)}"
        out.append(
            f'<text x="{_LEFT - 12}" y="{y + 4:.1f}" text-anchor="end">'
            f"{escape(connection)}, {escape(motion)}</text>"
        )
        if old is not None and np.isfinite(old):
            out.append(
                f'<circle class="hollow" cx="{across(old):.1f}" cy="{y:.1f}" r="5">'
                f"<title>shipped table: {number(old)} {unit}</title></circle>"
            )
        out.append(
            f'<path class="whisker" d="M{across(a):.1f} {y:.1f}H{across(b):.1f}'
            f'M{across(a):.1f} {y - 5:.1f}v10M{across(b):.1f} {y - 5:.1f}v10"/>'
            f'<circle class="dot" cx="{across(value.value):.1f}" cy="{y:.1f}" r="5">'
            f"<title>{said}</title></circle>"
        )
    out.append("</svg>")
    return "".join(out)


def _origin(table: StiffnessTable) -> str:
    """Return where a calibrated table came from, in words."""
    said = table.calibration
    words = [f"Table {table.name}"]
    if said.get("file"):
        words.append(f"from {said['file']}")
    if said.get("readings"):
        words.append(f"{said['readings']} readings")
    if said.get("date"):
        words.append(str(said["date"]))
    return ", ".join(words) + "."


def stiffness_plots(report: RigidityReport) -> tuple[str, list[str]]:
    """Return where the calibration came from, and its plots (SVG); ("", []) without one.

    Parameters
    ----------
    report : RigidityReport
        Its assembly knows the stiffness table that joined it.
    """
    rows = calibrated(report)
    joining = report.assembly.joining
    if not rows or joining is None:
        return "", []
    units = dict.fromkeys(_UNITS[motion] for _, motion, _, _ in rows)
    plots = [_plot([row for row in rows if _UNITS[row[1]] == unit], unit) for unit in units]
    return _origin(joining.table), plots
