"""Motions and verdicts in the builders' words."""

from __future__ import annotations

from collections import Counter

import numpy as np

from technic.assembly.model import Assembly, FindingKind, Part
from technic.geometry import Array, cross
from technic.parts.definition import PortKind
from technic.rigidity.result import Mobility, Motion, MotionKind, MotionType, Verdict
from technic.rigidity.screw import describe_twists
from technic.system.library_models import LibraryModels
from technic.tolerances import MOBILITY_LENGTH, MOTION_KIND_CUT, SAME_LINE
from technic.units import MM

__all__ = ["import_effects", "motion_sentence", "not_modelled", "part_label", "reason"]

_TEETH = "gear/gear"
"""Connection of two gears in mesh; threads inside of actuators are meshes, too."""

GROUPS_SHOWN = 4
"""A sentence names at most this many bodies and parts; the report lists all."""


def part_label(part: Part) -> str:
    """Return what a person finds the part by, e.g. ``"Beam 5 (line 3)"``."""
    where = f"line {part.source.line}" if part.source is not None else part.id
    return f"{part.name} ({where})" if part.name else part.id


def motion_sentence(assembly: Assembly, motion: Motion) -> str:
    """Say which parts move, how, and about what."""
    alone = len(motion.parts) == 1
    groups = [(list(motion.parts), motion.twists)] if alone else _groups(assembly, motion)
    said = [
        f"{_who(assembly, parts)} {_how(assembly, motion, parts, twists)}"
        for parts, twists in groups[:GROUPS_SHOWN]
    ]
    if len(groups) > GROUPS_SHOWN:
        rest = sum(len(parts) for parts, _ in groups[GROUPS_SHOWN:])
        said.append(f"{_parts(rest)} more in {len(groups) - GROUPS_SHOWN} other groups follow")
    return "; ".join(said)


def _groups(assembly: Assembly, motion: Motion) -> list[tuple[list[int], Array]]:
    """Return parts that move as one, those with structure first, then the largest group."""
    origins = np.array([assembly.parts[p].centroid for p in motion.parts])
    # the twist of each part's field at the model's origin is the same for parts that move as one
    moved = motion.twists.copy()
    moved[:, :3] -= cross(motion.twists[:, 3:], origins)
    reach = max(float(np.abs(origins).max()), MOBILITY_LENGTH)
    size = MOTION_KIND_CUT * np.array([reach / MOBILITY_LENGTH] * 3 + [1 / MOBILITY_LENGTH] * 3)
    groups: list[list[int]] = []
    for k in range(len(motion.parts)):
        for group in groups:
            if np.all(np.abs(moved[k] - moved[group[0]]) < size):
                group.append(k)
                break
        else:
            groups.append([k])
    solid = [[k for k in g if not assembly.parts[motion.parts[k]].fastener] or g for g in groups]
    keep = [g for g in solid if not assembly.parts[motion.parts[g[0]]].fastener] or solid
    keep.sort(key=lambda g: (-len(g), g[0]))
    return [([motion.parts[k] for k in g], motion.twists[g]) for g in keep]


def _parts(count: int) -> str:
    return "1 part" if count == 1 else f"{count} parts"


def _are(count: int) -> str:
    return "is" if count == 1 else "are"


def _who(assembly: Assembly, parts: list[int]) -> str:
    names = [part_label(assembly.parts[p]) for p in parts]
    if len(names) > 3:
        return f"{names[0]}, {names[1]} and {_parts(len(names) - 2)} fixed to them, as one,"
    return names[0] if len(names) == 1 else f"{', '.join(names[:-1])} and {names[-1]}, as one,"


def _how(assembly: Assembly, motion: Motion, parts: list[int], twists: Array) -> str:
    points = np.array([assembly.parts[p].centroid for p in parts])
    shape = describe_twists(points, twists, MOBILITY_LENGTH)
    many = len(parts) > 1
    if shape.type is MotionType.TRANSLATION and shape.direction is not None:
        verb = (
            ("slide" if many else "slides")
            if motion.kind is MotionKind.SLIDING
            else ("shift" if many else "shifts")
        )
        return f"{verb} along {_direction(shape.direction)}{_missing_stop(assembly, motion)}"
    if shape.point is None or shape.direction is None:
        return "move in several ways at once"
    verb = "turn" if many else "turns"
    if motion.kind is MotionKind.SPINNING:
        verb = "spin" if many else "spins"
    pin = _axis_part(assembly, motion, set(parts), shape.point, shape.direction)
    about = (
        f"about {part_label(assembly.parts[pin])}"
        if pin is not None
        else f"about {_direction(shape.direction)} through {_place(shape.point)}"
    )
    along = f", advancing {abs(shape.pitch) * 2 * np.pi / MM:.1f} mm a turn" if shape.pitch else ""
    return f"{verb} {about}{along}"


def _missing_stop(assembly: Assembly, motion: Motion) -> str:
    """Say on which side a stop would hold a sliding axle."""
    sides: set[str] = set()
    for k in motion.freed_by:
        joint = assembly.joints[k]
        signs = {"+": (1,), "-": (-1,), "both": (1, -1)}.get(joint.missing_stop, ())
        for sign in signs:
            axis = int(np.argmax(np.abs(joint.axes[0])))
            positive = sign * joint.axes[0][axis] > 0.0
            sides.add(f"{'+' if positive else '-'}{'xyz'[axis]}")
    if not sides:
        return ""
    if len(sides) > 1:
        return ": no stop holds it on either side"
    return f": a stop is missing on its {sides.pop()} side"


def _axis_part(
    assembly: Assembly, motion: Motion, moving: set[int], point: Array, direction: Array
) -> int | None:
    """Return the pin or axle on the axis of rotation through which the motion is freed."""
    best: tuple[bool, int] | None = None
    for k in motion.freed_by:
        joint = assembly.joints[k]
        if not any(assembly.parts[p].fastener for p in joint.parts):
            continue
        arm = joint.point - point
        if np.linalg.norm(arm - (arm @ direction) * direction) > 4 * SAME_LINE:
            continue
        if not moving.intersection(joint.parts) and not all(
            assembly.parts[p].fastener for p in joint.parts
        ):
            continue
        for p in joint.parts:
            kinds = {port.kind for port in assembly.parts[p].ports}
            if assembly.parts[p].fastener and kinds & {PortKind.PIN, PortKind.AXLE}:
                choice = (p in moving, p)
                best = choice if best is None else min(best, choice)
    return None if best is None else best[1]


def _direction(direction: Array) -> str:
    axis = int(np.argmax(np.abs(direction)))
    if abs(direction[axis]) > 1.0 - MOTION_KIND_CUT**2:
        return f"the {'xyz'[axis]} axis"
    d = direction if direction[axis] > 0 else -direction
    return f"the direction ({d[0]:.2f}, {d[1]:.2f}, {d[2]:.2f})"


def _place(point: Array) -> str:
    x, y, z = (round(float(v)) for v in point / MM)
    return f"({x}, {y}, {z}) mm"


def reason(
    assembly: Assembly,
    components: tuple[tuple[int, ...], ...],
    verdict: Verdict,
    mobility: Mobility,
) -> str:
    """Say in one sentence why the verdict is what it is."""
    if verdict is Verdict.UNDETERMINED:
        return (
            "The joints do not line up well enough to tell motion from stiffness: the smallest "
            f"singular value kept is {mobility.smallest_kept:.1e}, the largest dropped "
            f"{mobility.largest_dropped:.1e}."
        )
    if verdict is Verdict.DISCONNECTED:
        structure = [not p.fastener for p in assembly.parts]
        biggest = max(sum(structure[p] for p in c) for c in components)
        return (
            f"The model falls into {len(components)} pieces; the biggest holds {biggest} of its "
            f"{sum(structure)} structural parts."
        )
    if mobility.structural == 0:
        return "Nothing that carries structure can move against the rest."
    ways = "1 way" if mobility.structural == 1 else f"{mobility.structural} independent ways"
    return f"Parts that carry structure can move against the rest in {ways}."


def import_effects(assembly: Assembly, models: LibraryModels | None = None) -> tuple[str, ...]:
    """Say what the origin of a model's parts means for the answer, one sentence each.

    Parameters
    ----------
    assembly : Assembly
    models : LibraryModels, optional
        What the parts from a library are; None: not said.
    """
    imported, out = assembly.imported, []
    if imported is None:
        return ()
    missing = sum(u.count for u in assembly.unknown)
    if missing:
        out.append(
            f"{_parts(missing)} left out may join what seems loose here, and may move themselves: "
            "the motions counted are those of the rest."
        )
        if not imported.library:
            out.append(
                "With an LDraw parts library their connectors, mass and stiffness would be read from "
                "their drawings: "
                "`technic parts fetch` downloads it"
                + ("." if imported.searched else ", or leave --no-library out.")
            )
    if models is not None and models.solid:
        out.append(
            f"{_parts(models.solid)} from the library {_are(models.solid)} meshed from the drawing, "
            f"with cells of {models.cell / MM:.3g} mm."
        )
    if models is not None and models.rigid:
        why: Counter[str] = Counter()
        for kind in models.rigid:
            why[kind.reason] += kind.count
        said = "; ".join(f"{reason} ({count})" for reason, count in why.most_common())
        rigid = models.rigid_count
        out.append(
            f"{_parts(rigid)} from the library {_are(rigid)} taken as rigid: there the rigidity counts "
            f"the joints, not the part's own bending. Why: {said}."
        )
    return tuple(out)


def not_modelled(assembly: Assembly) -> tuple[str, ...]:
    """List what the analysis leaves out of this model."""
    out = []
    if assembly.unknown:
        count = sum(u.count for u in assembly.unknown)
        out.append(f"{_parts(count)} with no definition")
    flexible = sum(f.kind is FindingKind.FLEXIBLE for f in assembly.findings)
    if flexible:
        out.append(f"{flexible} flexible {'item' if flexible == 1 else 'items'}")
    meshed = any(joint.connection == _TEETH for joint in assembly.joints)
    geared = any("gear" in (p.definition.family if p.definition else "") for p in assembly.parts)
    if geared and not meshed:
        pairs = sum(f.kind is FindingKind.GEARS for f in assembly.findings)
        known = f" ({pairs} in mesh; --gears on couples them)" if pairs else ""
        out.append(f"meshing of gears: each gear turns by itself{known}")
    if assembly.joints and assembly.source.get("format") == "assembly":
        out += ["friction in joints", "play that the file does not give", "contact between parts"]
    elif assembly.joints:
        out += ["friction that keeps pins from turning", "play of pins in their holes", "contact"]
    return tuple(out)
