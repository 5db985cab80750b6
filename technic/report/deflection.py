"""The static answer as the JSON object of the contract ``technic-deflection/1``, and as text.

Vectors are in the axes of the model file. Forces of a joint are those that its first part exerts on its
second, at the joint's point; reactions are those that the ground exerts on the model.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import Any

import numpy as np

from technic.assembly.model import Assembly, Support
from technic.assembly.stiffness import StiffnessTable
from technic.geometry import Array
from technic.report.style import Style
from technic.report.wording import count, direction_of, direction_words, number, part_name
from technic.rigidity.provenance import table_dict, table_sentences
from technic.rigidity.sentences import not_modelled
from technic.rigidity.serialize import joint_stiffness
from technic.statics.solve import Deflection, Load
from technic.system.assemble import Probe
from technic.system.part_models import PlainPart
from technic.tolerances import LARGE_TURN
from technic.units import MM

__all__ = ["SCHEMA", "StaticCase", "deflection_dict", "deflection_text"]

SCHEMA = "technic-deflection/1"

_SHOWN = 12
"""Rows of a table: a person acts on the first few, the JSON object has all."""

_ROUNDING = 1e-6
"""Beside the largest value of its kind a value this small is printed as 0: it shows in no digit."""


@dataclass(frozen=True, slots=True, eq=False)
class StaticCase:
    """What was asked and what came out.

    Parameters
    ----------
    deflection : Deflection
    loads : tuple of Load
    probes : tuple of Probe
        Further points asked for.
    gravity : (3,) ndarray or None
        Acceleration on all material (m/s2); None when the model's own weight is left out.
    intervals : tuple of ((float, float) or None)
        95 % interval (m) of how far each loaded or probed point goes; empty when nothing was measured.
    part_models : mapping of str to int
        How many parts were modelled as "solid", "frame" and "rigid".
    plain_parts : tuple of PlainPart
        The kinds of part without a solid model, when solid models were asked for.
    rigid_walls : Deflection or None
        The same with bores that keep their shape, the least that it can sag; None when not asked for.
    table : StiffnessTable or None
        Stiffness table in force; None when it is the shipped one.
    """

    deflection: Deflection
    loads: tuple[Load, ...]
    probes: tuple[Probe, ...] = ()
    gravity: Array | None = None
    intervals: tuple[tuple[float, float] | None, ...] = ()
    part_models: Mapping[str, int] = field(default_factory=dict)
    plain_parts: tuple[PlainPart, ...] = ()
    rigid_walls: Deflection | None = None
    table: StiffnessTable | None = None

    @property
    def assembly(self) -> Assembly:
        """The assembly under load."""
        return self.deflection.system.assembly

    def stiffest_mm(self, k: int) -> float | None:
        """Return how far the k-th point goes (mm) when bores keep their shape; None if not asked for."""
        if self.rigid_walls is None:
            return None
        return float(np.linalg.norm(self.rigid_walls.probe_twists[k, :3])) / MM

    def interval_mm(self, k: int) -> list[float] | None:
        """Return the 95 % interval (mm) of how far the k-th point goes; None when it is not known."""
        found = self.intervals[k] if self.intervals else None
        return None if found is None else [found[0] / MM, found[1] / MM]


def _warnings(case: StaticCase) -> list[str]:
    """Return why the numbers are not to be believed, one sentence each."""
    turn = float(np.linalg.norm(case.deflection.part_twists[:, 3:], axis=1).max(initial=0.0))
    if turn <= LARGE_TURN:
        return []
    degrees = number(float(np.degrees(turn)))
    said = f"parts turn by up to {degrees} degrees: the answer is for small movements only"
    return [said + "; with these loads it is a sign, not a number"]


def _vector(values: Array) -> list[float]:
    return [float(v) + 0.0 for v in values]  # + 0.0 turns -0.0 into 0.0


def _support_point(assembly: Assembly, support: Support) -> Array:
    return assembly.parts[support.part].centroid if support.point is None else support.point


def deflection_dict(case: StaticCase) -> dict[str, Any]:
    """Return the answer as plain values, ready for JSON; every list is in the order of the model."""
    from technic import __version__

    assembly, answer = case.assembly, case.deflection
    parts = assembly.parts
    points: list[Load | Probe] = [*case.loads, *case.probes]
    return {
        "schema": SCHEMA,
        "source": {key: assembly.source.get(key) for key in ("path", "sha256", "format")},
        "model": {
            "name": assembly.name,
            "parts": len(parts),
            "joints": len(assembly.joints),
            "dof": answer.system.size,
            "mass_kg": answer.system.mass,
            "part_models": dict(case.part_models),
            "plain_parts": [plain.to_dict() for plain in case.plain_parts],
            "unknown_parts": [
                {"id": u.number, "count": u.count, "lines": list(u.lines)} for u in assembly.unknown
            ],
        },
        "stiffness_table": table_dict(case.table),
        "loads": [
            {
                "part": parts[load.part].id,
                "port": load.port,
                "point_mm": _vector(load.point / MM),
                "force_n": _vector(load.force),
            }
            for load in case.loads
        ],
        "gravity_m_per_s2": None if case.gravity is None else _vector(case.gravity),
        "parts": [
            {
                "id": part.id,
                "part_number": part.number,
                "displacement_mm": _vector(answer.part_twists[k, :3] / MM),
                "rotation_rad": _vector(answer.part_twists[k, 3:]),
            }
            for k, part in enumerate(parts)
        ],
        "ports": [
            {
                "part": parts[point.part].id,
                "port": point.port,
                "loaded": k < len(case.loads),
                "point_mm": _vector(point.point / MM),
                "displacement_mm": _vector(answer.probe_twists[k, :3] / MM),
                "rotation_rad": _vector(answer.probe_twists[k, 3:]),
                "distance_mm": float(np.linalg.norm(answer.probe_twists[k, :3])) / MM,
                "distance_interval_95_mm": case.interval_mm(k),
                "distance_rigid_walls_mm": case.stiffest_mm(k),
            }
            for k, point in enumerate(points)
        ],
        "joints": [
            {
                "id": joint.id,
                "parts": [parts[i].id for i in joint.parts],
                "point_mm": _vector(joint.point / MM),
                "force_n": _vector(answer.joint_forces[k, :3]),
                "moment_nm": _vector(answer.joint_forces[k, 3:]),
            }
            for k, joint in enumerate(assembly.joints)
        ],
        "reactions": [
            {
                "part": parts[support.part].id,
                "point_mm": _vector(_support_point(assembly, support) / MM),
                "force_n": _vector(answer.reactions[k, :3]),
                "moment_nm": _vector(answer.reactions[k, 3:]),
            }
            for k, support in enumerate(assembly.supports)
        ],
        "work_j": answer.work,
        "warnings": _warnings(case),
        "joint_stiffness": joint_stiffness(assembly),
        "not_modelled": list(not_modelled(assembly)),
        "technic_version": __version__,
    }


def _way(assembly: Assembly, vector: Array) -> str:
    """Return size and main direction of a displacement given in metres."""
    size = float(np.linalg.norm(vector))
    if size == 0.0:
        return "0 mm"
    return f"{number(size / MM)} mm {direction_words(assembly)[direction_of(vector)]}"


def _triple(vector: Array) -> str:
    """Return three numbers, what is rounding beside the largest of them as 0."""
    largest = float(np.abs(vector).max(initial=0.0))
    shown = np.where(np.abs(vector) > _ROUNDING * largest, vector, 0.0)
    return ", ".join(number(float(value)) for value in shown)


def _norms(vectors: Array) -> Array:
    """Return the lengths of rows, what is rounding beside the largest as 0."""
    sizes = np.asarray(np.linalg.norm(vectors, axis=1))
    return np.where(sizes > _ROUNDING * sizes.max(initial=0.0), sizes, 0.0)


def _order(sizes: Array) -> list[int]:
    """Return the indices, largest first, equal ones in the order of the model."""
    largest = float(sizes.max(initial=0.0)) or 1.0
    return sorted(range(len(sizes)), key=lambda k: (-round(float(sizes[k]) / largest, 9), k))


def _more(total: int) -> list[str]:
    return [f"     and {total - _SHOWN} more, see --json"] if total > _SHOWN else []


def _sure(case: StaticCase, k: int) -> str:
    interval, stiffest = case.interval_mm(k), case.stiffest_mm(k)
    if stiffest is not None:
        return f" ({number(stiffest)} mm if bores kept their shape)"
    if interval is None:
        return ""
    low, high = (number(value) for value in interval)
    return f"; the measured joints alone leave {low} to {high} mm with 95 % confidence"


def _loads(case: StaticCase, style: Style) -> list[str]:
    assembly, answer = case.assembly, case.deflection
    lines: list[str] = []
    for k, load in enumerate(case.loads):
        lines += style.wrap(
            f"{_triple(load.force)} N on {part_name(assembly.parts[load.part], line=True)}"
            f"{' at ' + load.port if load.port else ''}: this point moves "
            f"{_way(assembly, answer.probe_twists[k, :3])}{_sure(case, k)}.",
            " - ",
            "   ",
        )
    if case.gravity is not None:
        weight = answer.system.mass * float(np.linalg.norm(case.gravity))
        lines.append(f" - The model's own weight, {number(weight)} N.")
    for k, probe in enumerate(case.probes, len(case.loads)):
        lines += style.wrap(
            f"Asked for: {part_name(assembly.parts[probe.part], line=True)}"
            f"{' at ' + probe.port if probe.port else ''} moves "
            f"{_way(assembly, answer.probe_twists[k, :3])}{_sure(case, k)}.",
            " - ",
            "   ",
        )
    return lines


def deflection_text(case: StaticCase, style: Style | None = None) -> str:
    """Return the answer in the builders' language, with a final newline."""
    style = Style() if style is None else style
    assembly, answer = case.assembly, case.deflection
    parts = assembly.parts
    title = f"{assembly.name}: {count(len(parts), 'part')}, {count(len(assembly.joints), 'joint')}"
    lines = [style("bold", title), "", style("bold", "Loads"), *_loads(case, style)]

    plain = assembly.source.get("format") == "assembly"
    axes = "x, y, z" if plain else "x right, y down, z back"
    lines += ["", style("bold", f"How far each part goes (its centre; {axes})")]
    sizes = _norms(answer.part_twists[:, :3])
    for k in _order(sizes)[:_SHOWN]:
        move = answer.part_twists[k, :3]
        lines.append(
            f"   {number(float(sizes[k]) / MM):>8} mm  "
            f"({_triple(move / MM)})  {part_name(parts[k], line=True)}"
        )
    lines += _more(len(parts))

    if assembly.joints:
        lines += ["", style("bold", "What the joints carry")]
    forces, moments = _norms(answer.joint_forces[:, :3]), _norms(answer.joint_forces[:, 3:])
    for k in _order(forces)[:_SHOWN]:
        first, second = (part_name(parts[i], line=True) for i in assembly.joints[k].parts)
        lines += style.wrap(
            f"{number(float(forces[k]))} N and {number(float(moments[k]) / MM)} N mm: "
            f"{first} with {second}",
            "   ",
            "      ",
        )
    lines += _more(len(assembly.joints))

    if assembly.supports:
        lines += ["", style("bold", "What the ground gives")]
    for k, support in enumerate(assembly.supports):
        lines += style.wrap(
            f"({_triple(answer.reactions[k, :3])}) N and "
            f"({_triple(answer.reactions[k, 3:] / MM)}) N mm on "
            f"{part_name(parts[support.part], line=True)}",
            "   ",
            "      ",
        )
    for sentence in _warnings(case):
        lines += ["", *style.wrap(f"Too far: {sentence}.", "", "   ")]
    known = table_sentences(assembly, case.table, case.part_models)
    if known:
        lines += ["", style("bold", "Where the joints' stiffness comes from")]
    for sentence in known:
        lines += style.wrap(sentence, "   ", "      ")
    missing = not_modelled(assembly)
    if missing:
        lines += ["", style("bold", "Not modelled")]
        for item in missing:
            lines += style.wrap(item, "   - ", "     ")
    return "\n".join(lines) + "\n"
