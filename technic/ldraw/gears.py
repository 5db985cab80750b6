"""Which gears of a model mesh: found from their teeth and where they stand.

Two gears on parallel shafts mesh when their rolling circles touch, a gear in a ring when they touch
from inside; bevel gears when their shafts meet at a right angle and each circle reaches the other's; a
worm when its own circle touches that of a gear on a crossing shaft; a rack when its rolling line does.

A mesh holds one motion: the two sets of teeth cannot move through each other where they touch. That
is one row of the joint matrix, whatever carries the gears, so planetary gears come out right, too.
A worm pushes the teeth along its shaft, and cannot be turned by them: the gear is locked. The worm's
own shaft is as free as before.
"""

from __future__ import annotations

from collections import Counter
from collections.abc import Sequence
from dataclasses import dataclass
from itertools import combinations
from typing import Final

import numpy as np

from technic.assembly.joint_types import HELD, JointType
from technic.assembly.model import Finding, FindingKind, Joint, Part
from technic.assembly.stiffness import StiffnessTable
from technic.geometry import Array, axes_from
from technic.groups import connected_groups
from technic.ldraw.teeth import Gear, gears_of
from technic.parts.teeth import Toothing
from technic.units import LDU

__all__ = ["CONNECTION", "Mesh", "coupled", "find_meshes", "mesh_findings", "mesh_joints"]

CONNECTION: Final = "gear/gear"
"""Key of the stiffness table."""

RADIAL: Final = 1.25 * LDU
"""Largest gap or overlap of rolling circles: half a tooth's share of the radius. Sums of teeth that
occur differ by four teeth, 5 LDU. Gears whose shafts stand at a diagonal of the grid are placed up to
half a millimetre off."""

LOOSE: Final = 3.0 * LDU
"""Largest gap where the grid leaves one: racks and crowns that stand 2.5 LDU from the circle that
they roll on. Teeth are 5 LDU deep."""

CONE_LOW, CONE_HIGH = -3.0 * LDU, 5.0 * LDU
"""How far beside its place along the shaft a bevel gear may stand: less than half a grid step either
way."""

COMMON: Final = 2.0 * LDU
"""Least width that teeth have in common."""

SQUARE: Final = 0.02
"""Sine of the largest angle by which shafts may miss parallel or square (1.1 degrees)."""

RACK_WIDTH: Final = 10.0 * LDU
"""Half the width of a rack's teeth."""

_CROSSING: Final = ("bevel", "double bevel", "crown", "knob")
_ROUND: Final = ("spur", "double bevel", "crown")


@dataclass(frozen=True, slots=True, eq=False)
class Mesh:
    """Two gears whose teeth are in each other.

    Parameters
    ----------
    kind : str
        ``"spur"``, ``"ring"``, ``"bevel"``, ``"worm"`` or ``"rack"``.
    gears : (Gear, Gear)
        In the order of their parts.
    point : (3,) ndarray
        Where the rolling circles touch (m).
    direction : (3,) ndarray
        In which the teeth push.
    """

    kind: str
    gears: tuple[Gear, Gear]
    point: Array
    direction: Array

    @property
    def parts(self) -> tuple[int, int]:
        """Indices of the two parts, ascending."""
        return self.gears[0].part, self.gears[1].part


def find_meshes(parts: Sequence[Part]) -> tuple[Mesh, ...]:
    """Return the gears in mesh, in the order of their parts."""
    gears = [gear for k, part in enumerate(parts) for gear in gears_of(part, k)]
    found = []
    for first, second in combinations(gears, 2):
        if first.part == second.part:
            continue
        one, other = first.teeth, second.teeth
        reach = one.radius + other.radius + one.half + other.half + 40.0 * LDU
        if float(np.linalg.norm(one.center - other.center)) > reach:
            continue
        mesh = _mesh(one, other)
        if mesh is not None:
            kind, point, direction = mesh
            found.append(Mesh(kind, (first, second), point, direction))
    return tuple(found)


_Touch = tuple[Array, Array]
"""Where teeth touch, and in which direction they push."""


def _mesh(first: Toothing, second: Toothing) -> tuple[str, Array, Array] | None:
    """Return the kind of mesh, where the teeth touch and in which direction they push."""
    if first.kind in ("rack", "worm") or second.kind in ("rack", "worm"):
        special, gear = (first, second) if first.kind in ("rack", "worm") else (second, first)
        if gear.kind not in _ROUND or gear.inner:
            return None
        found = _rack(special, gear) if special.kind == "rack" else _worm(special, gear)
        name = special.kind
    elif (first.kind == "knob") != (second.kind == "knob"):
        return None
    elif float(np.linalg.norm(np.cross(first.axis, second.axis))) < SQUARE:
        found, name = _parallel(first, second)
    elif abs(float(first.axis @ second.axis)) < SQUARE:
        found, name = _crossing(first, second), "bevel"
    else:
        return None
    return None if found is None else (name, *found)


def _common(first: Toothing, second: Toothing, along: float) -> bool:
    """Tell whether teeth have some width in common, their middles being `along` apart."""
    return first.half + second.half - abs(along) >= COMMON


def _toothed(teeth: Toothing, out: Array) -> bool:
    """Tell whether there are teeth in a direction from the middle."""
    if teeth.sector is None:
        return True
    return all(float(out @ end) > -SQUARE for end in teeth.sector)


def _parallel(first: Toothing, second: Toothing) -> tuple[_Touch | None, str]:
    if "bevel" in (first.kind, second.kind) or (first.inner and second.inner):
        return None, ""  # teeth on one side only, for crossing shafts
    # the ring is the first one, if there is one
    if second.inner:
        first, second = second, first
    between = second.center - first.center
    along = float(between @ first.axis)
    across = between - along * first.axis
    distance = float(np.linalg.norm(across))
    if distance < RADIAL or not _common(first, second, along):
        return None, ""
    out = across / distance
    rolling = first.radius - second.radius if first.inner else first.radius + second.radius
    if abs(distance - rolling) > RADIAL:
        return None, ""
    if not _toothed(first, out) or not _toothed(second, out if first.inner else -out):
        return None, ""
    # where the circles touch; a gap between them is shared in the ratio of the radii
    share = first.radius / rolling * distance
    point = first.center + along / 2.0 * first.axis + share * out
    return (point, np.cross(first.axis, out)), "ring" if first.inner else "spur"


def _crossing(first: Toothing, second: Toothing) -> _Touch | None:
    kinds = (first.kind, second.kind)
    if first.inner or second.inner:
        return None
    # Where the shafts meet, seen from each gear: s1 and s2 along its own shaft.
    between = second.center - first.center
    normal = np.cross(first.axis, second.axis)
    if abs(float(between @ normal)) > RADIAL:
        return None
    s1, s2 = float(between @ first.axis), -float(between @ second.axis)
    if "crown" in kinds:
        crown = kinds.index("crown")
        if kinds[1 - crown] not in _ROUND:
            return None
        pair = ((first, s1), (second, s2))
        if not _crown(*pair[crown], *pair[1 - crown]):
            return None
    elif not all(kind in _CROSSING for kind in kinds) or not (
        _reaches(first, s1, second) and _reaches(second, s2, first)
    ):
        return None
    meet = first.center + s1 * first.axis
    # On the cone of each: as far from a shaft as that gear's rolling circle is wide.
    point = (
        meet - np.sign(s1) * second.radius * first.axis - np.sign(s2) * first.radius * second.axis
    )
    return point, normal / np.linalg.norm(normal)


def _reaches(gear: Toothing, crossing: float, other: Toothing) -> bool:
    """Tell whether a bevel stands so that its rolling circle touches the other's."""
    low, high = (-RADIAL, RADIAL) if other.kind == "knob" else (CONE_LOW, CONE_HIGH)
    return any(low <= (crossing - at) * way - other.radius <= high for at, way in gear.faces)


def _crown(crown: Toothing, crossing: float, gear: Toothing, other: float) -> bool:
    """Tell whether a gear's teeth stand in those of a crown: over them, and as far out."""
    over = any(-RADIAL <= (crossing - at) * way - gear.radius <= LOOSE for at, way in crown.faces)
    return over and _common(crown, gear, abs(other) - crown.radius)


def _worm(worm: Toothing, gear: Toothing) -> _Touch | None:
    if abs(float(worm.axis @ gear.axis)) > SQUARE:
        return None
    between = gear.center - worm.center
    normal = np.cross(worm.axis, gear.axis)
    normal = normal / np.linalg.norm(normal)
    height = float(between @ normal)
    if abs(abs(height) - worm.radius - gear.radius) > RADIAL:
        return None
    # A thread is as wide as its own circle lets it be where the gear's teeth pass.
    if abs(float(between @ gear.axis)) > gear.half + worm.radius - COMMON:
        return None
    if abs(float(between @ worm.axis)) > worm.half:
        return None
    # Where the thread pushes along the shaft, a worm's own turning has no speed.
    return gear.center - np.sign(height) * gear.radius * normal, worm.axis


def _rack(rack: Toothing, gear: Toothing) -> _Touch | None:
    assert rack.out is not None  # every rack of the table has it
    across = np.cross(rack.axis, rack.out)
    if abs(float(across @ gear.axis)) < 1.0 - SQUARE**2:
        return None
    between = gear.center - rack.center
    gap = float(between @ rack.out) - gear.radius
    if not -RADIAL <= gap <= LOOSE or abs(float(between @ rack.axis)) > rack.half:
        return None
    if abs(float(between @ across)) > RACK_WIDTH + gear.half - COMMON:
        return None
    # On the gear's rolling circle, which rolls on the rack's line whatever the gap.
    return gear.center - gear.radius * rack.out, rack.axis


def mesh_joints(
    parts: Sequence[Part], meshes: Sequence[Mesh], table: StiffnessTable
) -> tuple[Joint, ...]:
    """Return one joint for each mesh; `coupled` says which of them hold."""
    entry = table.get(CONNECTION)
    held = np.array(HELD[JointType.MESH])
    stiffness = np.where(held, entry.vector(), 0.0)
    names = [f"{parts[m.parts[0]].id}~{parts[m.parts[1]].id}@{m.kind}" for m in meshes]
    again = Counter[str]()
    for k, name in enumerate(names):
        again[name] += 1
        names[k] += str(again[name]) if again[name] > 1 else ""
    return tuple(
        Joint(
            id=name,
            type=JointType.MESH,
            parts=mesh.parts,
            point=mesh.point,
            axes=axes_from(mesh.direction),
            held=held,
            stiffness=stiffness,
            connection=CONNECTION,
            provenance=entry.provenance(held),
        )
        for name, mesh in zip(names, meshes, strict=True)
    )


def coupled(joints: Sequence[Joint]) -> tuple[Joint, ...]:
    """Return the meshes among the joints of a model that hold: of gears that hang together already.

    Teeth hold gears in one direction only as long as something else keeps them at their distance: a
    mesh between pieces that nothing else joins is left out, and so is one inside a rigid piece.
    """
    meshes = [joint for joint in joints if joint.connection == CONNECTION]
    others = [joint for joint in joints if joint.connection != CONNECTION]
    ends = sorted({part for joint in joints for part in joint.parts})
    piece = _pieces(ends, others)
    fixed = _pieces(ends, [joint for joint in others if joint.held.all()])
    return tuple(
        mesh
        for mesh in meshes
        if piece[mesh.parts[0]] == piece[mesh.parts[1]]
        and fixed[mesh.parts[0]] != fixed[mesh.parts[1]]
    )


def _pieces(members: Sequence[int], joints: Sequence[Joint]) -> dict[int, int]:
    """Return for each part the number of the piece that these joints make it part of."""
    groups = connected_groups(members, (joint.parts for joint in joints))
    return {part: n for n, group in enumerate(groups) for part in group}


def mesh_findings(
    parts: Sequence[Part], meshes: Sequence[Mesh], holding: Sequence[Joint] | None
) -> tuple[Finding, ...]:
    """Return a sentence for each mesh; `holding` are the joints, None when gears turn freely."""
    joined = None if holding is None else {joint.parts for joint in holding}
    return tuple(
        Finding(FindingKind.GEARS, _sentence(parts, mesh, joined), mesh.parts) for mesh in meshes
    )


def _sentence(parts: Sequence[Part], mesh: Mesh, joined: set[tuple[int, int]] | None) -> str:
    names = []
    for gear in mesh.gears:
        part = parts[gear.part]
        where = "" if part.source is None else f", line {part.source.line}"
        names.append(f"{part.name} ({part.number}{where})")
    first, second = (gear.teeth for gear in mesh.gears)
    ratio = f", {first.teeth} : {second.teeth} teeth" if first.teeth and second.teeth else ""
    end = (
        ""
        if joined is None or mesh.parts in joined
        else "; nothing keeps them together: not coupled"
    )
    if mesh.kind == "worm":
        ratio = ", which locks the gear; the worm's own shaft turns it by a tooth a turn"
    word = {
        "spur": "meshes with",
        "ring": "meshes inside with",
        "bevel": "meshes at a right angle with",
    }.get(mesh.kind, "is in the teeth of")
    return f"{names[0]} {word} {names[1]}{ratio}{end}"
