"""A calibration as JSON (``technic-calibration/1``), as a stiffness table (TOML) and as text."""

from __future__ import annotations

import json
from collections.abc import Mapping
from typing import Any

import numpy as np

from calibration.dataset import GRAVITY
from technic.assembly.stiffness import SCHEMA as TABLE_SCHEMA
from technic.assembly.stiffness import ConnectionStiffness
from technic.report.style import Style
from technic.report.wording import count, number
from technic.statics.calibration import Calibration, Measured
from technic.units import MM

__all__ = [
    "SCHEMA",
    "calibration_dict",
    "calibration_text",
    "calibration_toml",
    "offset_words",
    "scatter_words",
]

SCHEMA = "technic-calibration/1"

_GROUPS_SHOWN = 20
"""The rest is in the JSON report."""


def _parameter(measured: Measured) -> dict[str, Any]:
    return {
        "joint_type": measured.parameter.connection,
        "motion": measured.parameter.motion,
        "value": measured.value,
        "unit": measured.unit,
        "interval_95": None if measured.interval_95 is None else list(measured.interval_95),
        "identifiable": measured.identifiable,
    }


def _names(result: Calibration) -> list[str]:
    return [f"{m.parameter.connection} {m.parameter.motion}" for m in result.identified]


def _offsets(result: Calibration) -> list[dict[str, Any]]:
    fit = result.fit
    deviations = fit.deviations[len(fit.active) :]
    return [
        {
            "kind": offset.kind,
            "rig": offset.rig,
            "pose": offset.pose,
            "value_mm": float(value) / MM,
            "interval_95": [
                float(value - fit.quantile * deviation) / MM,
                float(value + fit.quantile * deviation) / MM,
            ],
        }
        for offset, value, deviation in zip(fit.offsets, fit.offset_values, deviations, strict=True)
    ]


def _read(result: Calibration, k: int) -> dict[str, float | None]:
    """Return what was read, what the fit says, and the standard deviation, of a sag or a tap."""
    reading, fit = result.dataset.readings[k], result.fit
    found = (reading.value, float(fit.predicted[k]), float(fit.sigma[k]))
    names = ("measured", "predicted", "sigma")
    sag, tap = (None, 1.0) if reading.tap else (1.0 / MM, None)
    return {
        f"{name}_{unit}": None if scale is None else scale * value
        for unit, scale in (("mm", sag), ("hz", tap))
        for name, value in zip(names, found, strict=True)
    }


def calibration_dict(result: Calibration) -> dict[str, Any]:
    """Return the calibration as plain values, ready for JSON."""
    from technic import __version__

    fit, readings = result.fit, result.dataset.readings
    return {
        "schema": SCHEMA,
        "source": {"name": result.dataset.name, "sha256": result.dataset.sha256},
        "readings": len(readings),
        "rigs": sorted({r.condition.rig for r in readings}),
        "parts": result.parts,
        "parameters": [_parameter(m) for m in result.measured],
        "correlation": {"parameters": _names(result), "matrix": result.correlation.tolist()},
        "log_covariance": result.log_covariance.tolist(),
        "singular_values": fit.singular_values.tolist(),
        "scatter": fit.scatter,
        "tap_scatter": fit.tap_scatter if any(r.tap for r in readings) else None,
        "chi2": fit.chi2,
        "degrees_of_freedom": fit.dof,
        "offsets": _offsets(result),
        "grid_search": {
            "values": {
                f"{result.measured[k].parameter.connection} {result.measured[k].parameter.motion}": float(
                    np.exp(result.grid.log_stiffness[k])
                )
                for k in result.grid.parameters
            },
            "distance_in_deviations": result.grid.distance,
            "agrees": result.grid.agrees,
        },
        "residuals": [
            {
                "row": reading.row,
                "rig": reading.condition.rig,
                "pose": reading.condition.pose,
                "load_n": reading.force,
                "kind": "tap" if reading.tap else "sag",
                **_read(result, k),
                "residual": float(fit.residuals[k]),
                "leverage": float(fit.leverage[k]),
            }
            for k, reading in enumerate(readings)
        ],
        "warnings": list(result.warnings),
        "technic_version": __version__,
    }


def _text(value: str) -> str:
    """Return a TOML basic string: JSON's escapes are valid in it."""
    return json.dumps(value, ensure_ascii=False)


def _values(entry: ConnectionStiffness, found: Mapping[str, Measured]) -> list[str]:
    lines = []
    for motion, value in entry.values.items():
        measured = found.get(motion)
        if measured is not None and measured.interval_95 is not None:
            low, high = measured.interval_95
            lines.append(
                f'{motion} = {{ value = {measured.value!r}, provenance = "calibrated", '
                f"interval_95 = [{low!r}, {high!r}] }}"
            )
            continue
        note = f", note = {_text(value.note)}" if value.note else ""
        size = "inf" if value.value == float("inf") else repr(value.value)
        lines.append(
            f"{motion} = {{ value = {size}, provenance = {_text(value.provenance)}{note} }}"
        )
    return lines


def calibration_toml(result: Calibration, date: str) -> str:
    """Return the stiffness table ``technic-stiffness/1`` of the calibrated connections.

    Parameters
    ----------
    result : Calibration
    date : str
        ISO date of the calibration.
    """
    from technic import __version__

    readings = result.dataset.readings
    rigs = sorted({r.condition.rig for r in readings})
    told = (
        f"{count(len(readings), 'reading')} in {result.dataset.name} on {', '.join(rigs)}, {date}"
    )
    names = dict.fromkeys(m.parameter.connection for m in result.measured)
    used = {value.provenance for name in names for value in result.table.get(name).values.values()}
    sources = {key: text for key, text in result.table.sources.items() if key in used}
    lines = [
        "# Joint stiffness measured by `technic calibrate`; use it with",
        "# `technic analyze MODEL --calibration THIS_FILE`.",
        f"schema = {_text(TABLE_SCHEMA)}",
        f"name = {_text(result.dataset.name.rsplit('.', 1)[0])}",
        "",
        "[sources]",
        f"calibrated = {_text(told)}",
        *(f"{key} = {_text(text)}" for key, text in sources.items() if key != "calibrated"),
        "",
        "[calibration]",
        f"file = {_text(result.dataset.name)}",
        f"sha256 = {_text(result.dataset.sha256)}",
        f"date = {_text(date)}",
        f"rigs = {json.dumps(rigs)}",
        f"readings = {len(readings)}",
        f"parts = {_text(result.parts)}",
        f"technic_version = {_text(__version__)}",
        "# covariance of the natural logarithms of these stiffnesses; with it intervals of models follow",
        f"parameters = {json.dumps(_names(result))}",
        f"log_covariance = {json.dumps(result.log_covariance.tolist())}",
    ]
    for name in names:
        entry = result.table.get(name)
        found = {m.parameter.motion: m for m in result.measured if m.parameter.connection == name}
        lines += ["", f"[connection.{_text(name)}]", f"type = {_text(entry.type.value)}"]
        lines += _values(entry, found)
    return "\n".join(lines) + "\n"


def offset_words(result: Calibration) -> list[str]:
    """Return free play and hysteresis that were found, one line each."""
    out = []
    for entry in _offsets(result):
        word = "free play" if entry["kind"] == "free_play" else "hysteresis"
        low, high = (number(x) for x in entry["interval_95"])
        out.append(
            f"{word} of {entry['rig']} in pose {entry['pose']}: {number(entry['value_mm'])} mm "
            f"(95 % sure: {low} to {high})"
        )
    return out


def scatter_words(result: Calibration) -> str:
    """Return how far readings scatter, one sentence."""
    fit, readings = result.fit, result.dataset.readings
    said = []
    if not all(r.tap for r in readings):
        said.append(
            f"Readings scatter by {100 * fit.scatter:.1f} % beside the rounding of the ruler."
        )
    if any(r.tap for r in readings):
        said.append(f"Frequencies scatter by {100 * fit.tap_scatter:.1f} %.")
    return " ".join(said)


def calibration_text(result: Calibration, style: Style | None = None) -> str:
    """Return the calibration in plain words, with a final newline."""
    style = Style() if style is None else style
    fit, readings = result.fit, result.dataset.readings
    conditions = {(r.condition.rig, r.condition.pose) for r in readings}
    lines = [
        style("bold", f"{result.dataset.name}: {count(len(readings), 'reading')}")
        + f" in {count(len(conditions), 'pose')}",
        "",
        style("bold", "Stiffness of joints"),
    ]
    for m in result.measured:
        if m.interval_95 is None:
            lines.append(
                f"   {m.parameter}: not identifiable, {number(m.value)} {m.unit} of the table taken"
            )
            continue
        low, high = (number(x) for x in m.interval_95)
        lines.append(
            f"   {m.parameter}: {style('number', number(m.value))} {m.unit} "
            f"(95 % sure: {low} to {high})"
        )
    lines += [f"   {said}" for said in offset_words(result)]
    lines += [
        "",
        scatter_words(result),
        f"Grid search: {'the same values' if result.grid.agrees else 'another point, see below'}.",
    ]
    lines += ["", style("bold", "How well it fits (mean of each pose and weight)")]
    groups: dict[tuple[bool, str, str, str, float], list[int]] = {}
    for k, r in enumerate(readings):
        place = r.condition.place
        groups.setdefault((r.tap, r.condition.rig, r.condition.pose, place, r.force), []).append(k)
    for (tap, rig, pose, place, force), members in sorted(groups.items())[:_GROUPS_SHOWN]:
        seen = float(np.mean([readings[k].value for k in members]))
        said = float(np.mean(fit.predicted[members]))
        if tap:
            weight, values = (
                f"{number(1e3 * force / GRAVITY)} g",
                (f"{x:.1f} Hz" for x in (seen, said)),
            )
            where = f"tapped with {weight} on {place}"
        else:
            where, values = (
                f"{number(force)} N at {place}",
                (f"{x / MM:.2f} mm" for x in (seen, said)),
            )
        measured, fitted = values
        lines.append(
            f"   {rig} {pose}, {where}: measured {measured}, fitted {fitted} ({len(members)} x)"
        )
    if len(groups) > _GROUPS_SHOWN:
        lines.append(f"   and {len(groups) - _GROUPS_SHOWN} more, see --json")
    if result.warnings:
        lines += ["", style("warn", "Take care")]
        for warning in result.warnings:
            lines += style.wrap(warning, " - ", "   ")
    return "\n".join(lines) + "\n"
