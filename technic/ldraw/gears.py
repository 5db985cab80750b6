"""Which gears of a model mesh: found from their teeth and where they stand.

LEGO gears have a module of 1 mm: a gear of n teeth rolls on a circle of n / 2 mm. Two gears on
parallel shafts mesh when these circles touch; bevel gears when their shafts meet at a right angle and
each circle reaches the other's; a worm when its own circle touches that of a gear on a crossing
shaft; a rack when its teeth are at the height of the circle.

A mesh holds one motion: the two sets of teeth cannot move through each other where they touch. That
is one row of the joint matrix, whatever carries the gears, so planetary gears come out right, too.
A worm pushes the teeth along its shaft, and cannot be turned by them: the gear is locked.
"""

from __future__ import annotations

import re
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
from technic.parts.definition import Port, PortKind
from technic.units import LDU, MM

__all__ = [
    "Gear",
    "Mesh",
    "coupled",
    "find_meshes",
    "gear_of",
    "mesh_findings",
    "mesh_joints",
]

CONNECTION: Final = "gear/gear"
"""Key of the stiffness table."""

MODULE: Final = 1.0 * MM
"""Diameter per tooth (m)."""

WORM_RADIUS: Final = 10.0 * LDU
"""Rolling circle of the worm: it stands 20 LDU from an 8 tooth gear, 40 LDU from a 24 tooth gear."""

KNOB_RADIUS: Final = 20.0 * LDU
"""Knob wheels stand 40 LDU apart."""

RADIAL: Final = 1.25 * LDU
"""Largest gap or overlap of rolling circles: half a tooth's share of the radius. Sums of teeth that
occur differ by four teeth, 5 LDU. Gears whose shafts stand at a diagonal of the grid are placed up to
half a millimetre off."""

FACE: Final = 12.0 * LDU
"""Furthest apart that the middles of two meshing gears are along their shafts: teeth are up to 20 LDU
wide, and a half-stud shift leaves them 10 LDU of common width."""

BEVEL_LOW, BEVEL_HIGH = -2.0 * LDU, 12.0 * LDU
"""Bevel gears: how much further than the other's rolling circle the middle of a gear stands. Teeth
end up to half a module before the middle of a gear 20 LDU wide; on the grid it is 5 LDU."""

SQUARE: Final = 0.02
"""Sine of the largest angle by which shafts may miss parallel or square (1.1 degrees)."""

_TEETH: Final = re.compile(r"(\d+) tooth")


@dataclass(frozen=True, slots=True, eq=False)
class Gear:
    """Teeth in their place.

    Parameters
    ----------
    part : int
    kind : str
        ``"spur"``, ``"bevel"``, ``"double bevel"``, ``"crown"``, ``"knob"``, ``"worm"`` or ``"rack"``.
    teeth : int
        0 for worms and racks.
    center, axis : (3,) ndarray
        Middle of the gear on its shaft (m) and the shaft's direction; of a rack the middle of its
        box and the direction in which it moves.
    radius : float
        Of the rolling circle (m); 0 for a rack.
    reach : float
        Half the length of a worm or rack (m); 0 for others.
    """

    part: int
    kind: str
    teeth: int
    center: Array
    axis: Array
    radius: float
    reach: float = 0.0


@dataclass(frozen=True, slots=True, eq=False)
class Mesh:
    """Two gears whose teeth are in each other.

    Parameters
    ----------
    kind : str
        ``"spur"``, ``"bevel"``, ``"worm"`` or ``"rack"``.
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


def gear_of(part: Part, index: int) -> Gear | None:
    """Return the teeth of a part, or None when it has none; told by its title."""
    if part.definition is None or part.fastener:
        return None
    title = part.definition.title.lower()
    middle = part.mass_properties.centroid
    if "rack" in title and "gear" in title:
        moments, axes = np.linalg.eigh(part.mass_properties.inertia)
        # of a uniform rod: I = m l^2 / 12
        length = float(np.sqrt(12.0 * moments[1] / part.mass_properties.mass))
        direction = part.pose.directions(axes[:, 0])
        return Gear(index, "rack", 0, part.centroid, direction, 0.0, length / 2.0)
    bore = _bore(part.ports, middle)
    if bore is None:
        return None
    along = float((middle - bore.position) @ bore.axis)
    if "worm" in title:
        center = part.pose.points(bore.position + along * bore.axis)
        ports = [p for p in part.ports if abs(float(p.axis @ bore.axis)) > 0.99]
        ends = [float((p.position - bore.position) @ bore.axis) for p in ports]
        reach = (max(ends) - min(ends)) / 2.0 + bore.length / 2.0
        axis = part.pose.directions(bore.axis)
        return Gear(index, "worm", 0, center, axis, WORM_RADIUS, reach)
    kind, teeth, radius = "spur", 0, 0.0
    if match := _TEETH.search(title):
        if "gear" not in title and "differential" not in title:
            return None
        teeth = int(match[1])
        radius = teeth * MODULE / 2.0
        kind = next((k for k in ("double bevel", "bevel", "crown") if k in title), "spur")
    elif "knob" in title and "gear" in title:
        kind, teeth, radius = "knob", 4, KNOB_RADIUS
    else:
        return None
    center = part.pose.points(bore.position + along * bore.axis)
    return Gear(index, kind, teeth, center, part.pose.directions(bore.axis), radius)


def _bore(ports: Sequence[Port], middle: Array) -> Port | None:
    """Return the bore through the middle of a gear: an axle hole before a round one."""
    best: tuple[float, int, Port] | None = None
    for port in ports:
        if port.kind not in (PortKind.AXLE_HOLE, PortKind.PIN_HOLE):
            continue
        off = float(np.linalg.norm(np.cross(middle - port.position, port.axis)))
        if off > 2.0 * LDU:
            continue
        rank = (float(port.kind is PortKind.PIN_HOLE), len(ports))
        if best is None or rank[0] < best[0]:
            best = (rank[0], rank[1], port)
    return None if best is None else best[2]


def find_meshes(parts: Sequence[Part]) -> tuple[Mesh, ...]:
    """Return the gears in mesh, in the order of their parts."""
    gears = [gear for k, part in enumerate(parts) if (gear := gear_of(part, k)) is not None]
    found = []
    for first, second in combinations(gears, 2):
        reach = first.radius + second.radius + first.reach + second.reach + 40.0 * LDU
        if float(np.linalg.norm(first.center - second.center)) > reach:
            continue
        mesh = _mesh(first, second)
        if mesh is not None:
            found.append(mesh)
    return tuple(found)


def _mesh(first: Gear, second: Gear) -> Mesh | None:
    kinds = {first.kind, second.kind}
    if "rack" in kinds or "worm" in kinds:
        special, gear = (first, second) if first.kind in ("rack", "worm") else (second, first)
        if gear.kind in ("rack", "worm", "knob", "bevel"):
            return None
        found = _rack(special, gear) if special.kind == "rack" else _worm(special, gear)
        name = special.kind
    elif len(kinds) > 1 and "knob" in kinds:
        return None
    elif float(np.linalg.norm(np.cross(first.axis, second.axis))) < SQUARE:
        found, name = _parallel(first, second), "spur"
    elif abs(float(first.axis @ second.axis)) < SQUARE:
        found, name = _crossing(first, second), "bevel"
    else:
        return None
    return None if found is None else Mesh(name, (first, second), *found)


_Touch = tuple[Array, Array]
"""Where teeth touch, and in which direction they push."""


def _parallel(first: Gear, second: Gear) -> _Touch | None:
    if "bevel" in (first.kind, second.kind):
        return None  # teeth on one side only, for crossing shafts
    between = second.center - first.center
    along = float(between @ first.axis)
    across = between - along * first.axis
    distance = float(np.linalg.norm(across))
    if abs(along) > FACE or abs(distance - first.radius - second.radius) > RADIAL:
        return None
    out = across / distance
    share = first.radius / (first.radius + second.radius)
    point = first.center + along / 2.0 * first.axis + share * distance * out
    return point, np.cross(first.axis, out)


def _crossing(first: Gear, second: Gear) -> _Touch | None:
    if not all(g.kind in ("bevel", "double bevel", "crown", "knob") for g in (first, second)) and (
        "crown" not in (first.kind, second.kind)
    ):
        return None
    # Where the shafts meet, seen from each gear: s1 and s2 along its own shaft.
    between = second.center - first.center
    normal = np.cross(first.axis, second.axis)
    if abs(float(between @ normal)) > RADIAL:
        return None
    s1, s2 = float(between @ first.axis), -float(between @ second.axis)
    for distance, other in ((abs(s1), second), (abs(s2), first)):
        low, high = (-RADIAL, RADIAL) if other.kind == "knob" else (BEVEL_LOW, BEVEL_HIGH)
        if not low <= distance - other.radius <= high:
            return None
    meet = first.center + s1 * first.axis
    # On the cone of each: as far from a shaft as that gear's rolling circle is wide.
    point = (
        meet - np.sign(s1) * second.radius * first.axis - np.sign(s2) * first.radius * second.axis
    )
    return point, normal / np.linalg.norm(normal)


def _worm(worm: Gear, gear: Gear) -> _Touch | None:
    if abs(float(worm.axis @ gear.axis)) > SQUARE:
        return None
    between = gear.center - worm.center
    normal = np.cross(worm.axis, gear.axis)
    normal = normal / np.linalg.norm(normal)
    height = float(between @ normal)
    if abs(abs(height) - worm.radius - gear.radius) > RADIAL:
        return None
    if abs(float(between @ gear.axis)) > FACE or abs(float(between @ worm.axis)) > worm.reach:
        return None
    # On the worm's own axis: turning the worm does not count, only where it stands.
    return gear.center - height * normal, worm.axis


def _rack(rack: Gear, gear: Gear) -> _Touch | None:
    if abs(float(rack.axis @ gear.axis)) > SQUARE:
        return None
    between = gear.center - rack.center
    normal = np.cross(rack.axis, gear.axis)
    normal = normal / np.linalg.norm(normal)
    height = float(between @ normal)
    if not BEVEL_LOW <= abs(height) - gear.radius <= BEVEL_HIGH:
        return None
    if abs(float(between @ gear.axis)) > FACE or abs(float(between @ rack.axis)) > rack.reach:
        return None
    return gear.center - np.sign(height) * gear.radius * normal, rack.axis


def mesh_joints(
    parts: Sequence[Part], meshes: Sequence[Mesh], table: StiffnessTable
) -> tuple[Joint, ...]:
    """Return one joint for each mesh; `coupled` says which of them hold."""
    entry = table.get(CONNECTION)
    held = np.array(HELD[JointType.MESH])
    stiffness = np.where(held, entry.vector(), 0.0)
    return tuple(
        Joint(
            id=f"{parts[mesh.parts[0]].id}~{parts[mesh.parts[1]].id}@{mesh.kind}",
            type=JointType.MESH,
            parts=mesh.parts,
            point=mesh.point,
            axes=axes_from(mesh.direction),
            held=held,
            stiffness=stiffness,
            connection=CONNECTION,
            provenance=entry.provenance(held),
        )
        for mesh in meshes
    )


def coupled(joints: Sequence[Joint]) -> tuple[Joint, ...]:
    """Return the meshes among the joints of a model that hold: of gears that hang together already.

    Teeth hold gears in one direction only as long as something else keeps them at their distance: a
    mesh between pieces that nothing else joins is left out, and so is one inside a rigid piece.
    """
    meshes = [joint for joint in joints if joint.type is JointType.MESH]
    others = [joint for joint in joints if joint.type is not JointType.MESH]
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
    first, second = mesh.gears
    ratio = f", {first.teeth} : {second.teeth} teeth" if first.teeth and second.teeth else ""
    end = (
        ""
        if joined is None or mesh.parts in joined
        else "; nothing keeps them together: not coupled"
    )
    if mesh.kind == "worm":
        ratio = ", which locks the gear"
    word = {"spur": "meshes with", "bevel": "meshes at a right angle with"}.get(
        mesh.kind, "is in the teeth of"
    )
    return f"{names[0]} {word} {names[1]}{ratio}{end}"
