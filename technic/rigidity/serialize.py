"""The report as the JSON object of the contract ``technic-report/1``.

Numbers carry their unit in the key, or are SI. Vectors are in the axes of the model file (LDraw: x to the
right, -y up).

The worst-case load is given for a size of 1 N. The size of a load is measured in the norm that belongs
to the rigidity: the load ``f`` has the size ``sqrt(f^T M^-1 f)``, so that a load of 1 N in its worst
pattern displaces the model by exactly ``compliance_mm_per_n`` (RMS over all material), and every
displacement listed is that of the same load. The sizes of the forces on the parts add up to 1 N when
all material moves equally far, and to a little less otherwise (`sum_of_forces_n` says how much).
"""

from __future__ import annotations

from math import isfinite
from typing import Any

import numpy as np

from technic.assembly.joint_types import MOTION_NAMES
from technic.assembly.materials import material_rows
from technic.assembly.model import Assembly, FindingKind, Joint, Part
from technic.geometry import Array
from technic.parts.definition import PortKind, outline
from technic.rigidity.provenance import stability_dict, table_dict
from technic.rigidity.result import (
    Component,
    Mobility,
    Motion,
    Rigidity,
    RigidityReport,
    WeakSpot,
)
from technic.rigidity.sentences import import_effects
from technic.units import LDU, MM

__all__ = ["SCHEMA", "joint_stiffness", "size_mm", "spot_place", "to_dict", "unit_load"]

SCHEMA = "technic-report/1"

_HOLE_MARGIN = 9 * LDU
"""Material around the axis of a bore: a liftarm is 18 LDU wide."""

_SHAFT_RADIUS = 6 * LDU


def _number(value: float) -> float | None:
    """Return a float that JSON can hold: null stands for "there is none"."""
    value = float(value)
    return value if isfinite(value) else None


def _vector(values: Array) -> list[float]:
    return [float(v) + 0.0 for v in values]  # + 0.0 turns -0.0 into 0.0


def unit_load(report: RigidityReport) -> tuple[Array, Array] | None:
    """Return the worst-case load of 1 N and what it does.

    Parameters
    ----------
    report : RigidityReport

    Returns
    -------
    forces : (p, 6) ndarray
        Force (N) and moment about the centroid (N m) on every part.
    twists : (p, 6) ndarray
        Translation of the centroid (m) and rotation (rad) of every part.

    None when the model has no elastic mode.
    """
    if not report.modes or report.modes[0].value <= 0.0:
        return None
    worst = report.modes[0]
    # The mode is scaled to an RMS displacement of 1 m, which takes a load of size lambda.
    return worst.forces / worst.value, worst.twists / worst.value


def size_mm(assembly: Assembly) -> list[float]:
    """Return the extents (mm) of the box around all connection features, along the model's axes.

    The material around a bore is counted, outlines beyond the last feature (a wheel's rim, a panel)
    are not. Shapes of an assembly file have no such features: their members, corners or nodes count.
    """
    low, high = np.full(3, np.inf), np.full(3, -np.inf)
    for part in assembly.parts:
        shown = outline(part.body) if part.shape else np.zeros((0, 3))
        corners = part.pose.points(shown)
        points, margins = [part.centroid, *corners], [np.zeros(3)] * (1 + len(corners))
        for port in part.ports:
            axis = part.pose.directions(port.axis)
            ball = port.kind in (PortKind.BALL, PortKind.SOCKET)
            hole = port.kind in (PortKind.PIN_HOLE, PortKind.AXLE_HOLE)
            radius = _HOLE_MARGIN if hole else _SHAFT_RADIUS
            across = np.sqrt(np.clip(1.0 - axis**2, 0.0, None))
            points.append(part.pose.points(port.position))
            margins.append(
                np.full(3, radius) if ball else 0.5 * port.length * np.abs(axis) + radius * across
            )
        low = np.minimum(low, np.min(np.array(points) - margins, axis=0))
        high = np.maximum(high, np.max(np.array(points) + margins, axis=0))
    return _vector((high - low) / MM) if assembly.parts else [0.0, 0.0, 0.0]


def _mobility(mobility: Mobility) -> dict[str, Any]:
    return {
        "total": mobility.total,
        "structural": mobility.structural,
        "spinning": mobility.spinning,
        "sliding": mobility.sliding,
        "idle": mobility.idle,
        "proof": mobility.proof,
        "singular_value_gap": [_number(mobility.smallest_kept), _number(mobility.largest_dropped)],
    }


def _rigidity(rigidity: Rigidity | None) -> dict[str, Any] | None:
    if rigidity is None:
        return None
    return {
        "value_n_per_m": rigidity.value,
        "compliance_mm_per_n": rigidity.compliance_mm_per_n,
        "frequency_hz": rigidity.frequency_hz,
        "interval_95": None if rigidity.interval_95 is None else list(rigidity.interval_95),
        "log_slopes": list(rigidity.log_slopes),
        "measure": rigidity.measure,
        "residual": rigidity.residual,
        "port_walls": None
        if rigidity.rigid_walls is None
        else {"mean_n_per_m": rigidity.value, "rigid_n_per_m": rigidity.rigid_walls},
    }


def _motion(assembly: Assembly, motion: Motion) -> dict[str, Any]:
    axis = None
    if motion.axis_direction is not None:
        point = motion.axis_point
        axis = {
            "point": None if point is None else _vector(point),
            "point_mm": None if point is None else _vector(point / MM),
            "direction": _vector(motion.axis_direction),
        }
    return {
        "kind": motion.kind.value,
        "order": motion.order,
        "second_order": motion.second_order,
        "type": motion.type.value,
        "axis": axis,
        "pitch_mm_per_rad": motion.pitch / MM,
        "parts": [assembly.parts[k].id for k in motion.parts],
        "freed_by": [assembly.joints[k].id for k in motion.freed_by],
        "component": motion.component,
        "sentence": motion.sentence,
    }


def _component(assembly: Assembly, component: Component) -> dict[str, Any]:
    return {
        "parts": [assembly.parts[k].id for k in component.parts],
        "mass_kg": component.mass,
        "verdict": component.verdict.value,
        "mobility": _mobility(component.mobility),
        "rigidity": _rigidity(component.rigidity),
    }


def _worst_case(report: RigidityReport) -> dict[str, Any]:
    load = unit_load(report)
    if load is None:
        return {"load_n": None, "parts": []}
    forces, twists = load
    assembly = report.assembly
    moved = [k for k in range(len(assembly.parts)) if np.any(twists[k]) or np.any(forces[k])]
    return {
        "load_n": 1.0,
        "rms_displacement_mm": 1.0 / report.modes[0].value / MM,
        "sum_of_forces_n": float(np.linalg.norm(forces[:, :3], axis=1).sum()),
        "parts": [
            {
                "id": assembly.parts[k].id,
                "part_number": assembly.parts[k].number,
                "force_n": _vector(forces[k, :3]),
                "moment_nm": _vector(forces[k, 3:]),
                "displacement_mm": _vector(twists[k, :3] / MM),
                "rotation_rad": _vector(twists[k, 3:]),
            }
            for k in moved
        ],
    }


def spot_place(assembly: Assembly, spot: WeakSpot) -> Part:
    """Return the part whose place in the file stands for a weak spot.

    Of a joint: the fastener, because that is what a builder looks for; else the part placed later,
    because its step is the one in which the joint was made.
    """
    parts = [assembly.parts[k] for k in spot.parts]
    fasteners = [part for part in parts if part.fastener]
    return fasteners[0] if len(fasteners) == 1 else parts[-1]


def _weak_spot(assembly: Assembly, spot: WeakSpot) -> dict[str, Any]:
    parts = [assembly.parts[k] for k in spot.parts]
    place = spot_place(assembly, spot)
    source = place.source
    ident = assembly.joints[spot.index].id if spot.kind == "joint" else place.id
    return {
        "rank": spot.rank,
        "kind": spot.kind,
        "id": ident,
        "energy_share": spot.energy_share,
        "parts": [part.id for part in parts],
        "part_numbers": [part.number for part in parts],
        "colors": [part.color for part in parts],
        "submodel": None if source is None else source.submodel,
        "step": None if source is None else source.step,
        "line": None if source is None else source.line,
    }


def _spot_range(report: RigidityReport, k: int) -> dict[str, Any]:
    """Return where a weak spot may stand under the calibration's uncertainty; null: not examined."""
    ranges = () if report.stability is None else report.stability.spots
    known = ranges[k] if k < len(ranges) else None
    return {
        "rank_interval_95": None if known is None else list(known.ranks),
        "energy_share_interval_95": None if known is None else list(known.energy_shares),
    }


def _stiffness_values(joint: Joint) -> dict[str, Any]:
    values: dict[str, Any] = {}
    for name in dict.fromkeys(MOTION_NAMES):
        rows = [k for k, other in enumerate(MOTION_NAMES) if other == name and joint.held[k]]
        if not rows:
            continue
        unit = "n_per_m" if rows[0] < 3 else "nm_per_rad"
        found = sorted({float(joint.stiffness[k]) for k in rows})
        said = ["rigid" if not isfinite(value) else value for value in found]
        values[f"{name}_{unit}"] = said[0] if len(said) == 1 else said
    return values


def joint_stiffness(assembly: Assembly) -> list[dict[str, Any]]:
    """Return one entry per distinct kind of joint: type, values, provenance and how many there are."""
    entries: dict[tuple[Any, ...], dict[str, Any]] = {}
    for joint in assembly.joints:
        values = _stiffness_values(joint)
        key = (joint.connection, joint.type.value, str(values), joint.provenance)
        entry = entries.setdefault(
            key,
            {
                "type": joint.type.value,
                "connection": joint.connection,
                "values": values,
                "provenance": joint.provenance,
                "count": 0,
            },
        )
        entry["count"] += 1
    return [entries[key] for key in sorted(entries)]


def _model(report: RigidityReport) -> dict[str, Any]:
    assembly = report.assembly

    def details(*kinds: FindingKind) -> list[dict[str, Any]]:
        return [
            {
                "kind": finding.kind.value,
                "message": finding.message,
                "parts": [assembly.parts[k].id for k in finding.parts],
                "distance_mm": None if finding.distance is None else finding.distance / MM,
            }
            for finding in assembly.findings
            if finding.kind in kinds
        ]

    apart = (
        FindingKind.NEAR_MISS,
        FindingKind.OPEN_PORT,
        FindingKind.GEARS,
        FindingKind.INNER,
    )
    return {
        "name": assembly.name,
        "parts": len(assembly.parts),
        "joints": len(assembly.joints),
        "components": len(report.components),
        "dof": report.unknowns,
        "part_models": dict(report.part_models),
        "plain_parts": [plain.to_dict() for plain in report.plain_parts],
        "materials": material_rows(assembly),
        "mass_kg": report.mass,
        "size_mm": size_mm(assembly),
        "unknown_parts": [
            {
                "id": unknown.number,
                "count": unknown.count,
                "lines": list(unknown.lines),
                "reason": unknown.reason,
            }
            for unknown in assembly.unknown
        ],
        "import": _imported(report),
        "near_misses": details(FindingKind.NEAR_MISS),
        "gear_meshes": details(FindingKind.GEARS),
        "inner_motion": details(FindingKind.INNER),
        "open_ports": len(details(FindingKind.OPEN_PORT)),
        "open_port_list": details(FindingKind.OPEN_PORT),
        "warnings": details(*(kind for kind in FindingKind if kind not in apart)),
    }


def _imported(report: RigidityReport) -> dict[str, Any] | None:
    """Return where the parts came from, and what that means for the verdict."""
    imported = report.assembly.imported
    if imported is None:
        return None
    return {
        "library": imported.library or None,
        "release": imported.release or None,
        "shadow": imported.shadow or None,
        "known": imported.catalogue,
        "from_library": sum(part.count for part in imported.from_library),
        "solid_models": report.library_models.solid,
        "rigid_by_choice": report.library_models.rigid_count,
        "rigid_parts": [kind.to_dict() for kind in report.library_models.rigid],
        "unknown": sum(part.count for part in report.assembly.unknown),
        "library_parts": [
            {
                "id": part.number,
                "title": part.title,
                "count": part.count,
                "source": part.source,
            }
            for part in imported.from_library
        ],
        "effect": list(import_effects(report.assembly, report.library_models)),
    }


def to_dict(report: RigidityReport) -> dict[str, Any]:
    """Return the report as plain dicts, lists, strings and finite numbers, ready for JSON.

    Parameters
    ----------
    report : RigidityReport

    Returns
    -------
    dict
        All keys of the contract ``technic-report/1`` (DESIGN section 5), parts and joints by their
        ids, and a few more keys (`reason`, `qualifier`, `supports`) that a reader may ignore.
    """
    from technic import __version__

    assembly = report.assembly
    source = assembly.source
    return {
        "schema": SCHEMA,
        "source": {key: source.get(key) for key in ("path", "sha256", "format")},
        "model": _model(report),
        "verdict": report.verdict.value,
        "reason": report.reason,
        "qualifier": report.qualifier,
        "supports": [
            {
                "part": assembly.parts[support.part].id,
                "point_mm": None if support.point is None else _vector(support.point / MM),
                "held": [
                    name
                    for name, held in zip(
                        ("x", "y", "z", "rx", "ry", "rz"), support.held, strict=True
                    )
                    if held
                ],
            }
            for support in assembly.supports
        ],
        "mobility": _mobility(report.mobility),
        "motions": [_motion(assembly, motion) for motion in report.motions],
        "rigidity": _rigidity(report.rigidity),
        "spectrum_n_per_m": [mode.value for mode in report.modes],
        "worst_case": _worst_case(report),
        "weak_spots": [
            {**_weak_spot(assembly, spot), **_spot_range(report, k)}
            for k, spot in enumerate(report.weak_spots)
        ],
        "stability": stability_dict(report),
        "components": [_component(assembly, component) for component in report.components],
        "joint_stiffness": joint_stiffness(assembly),
        "stiffness_table": table_dict(report.table),
        "not_modelled": list(report.not_modelled),
        "timings_s": {name: float(seconds) for name, seconds in report.timings.items()},
        "technic_version": __version__,
    }
