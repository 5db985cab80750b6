"""From parts in their places to typed joints: what is in what, and what that holds.

Pins turn in round bores, axles turn and slide in them unless stops hold them, axles sit fast in axle
holes, balls swivel in sockets, one stud turns and several hold. Every joint names the key of the
stiffness table that it got its numbers from.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from functools import lru_cache
from typing import Final, Literal

import numpy as np

from technic.assembly.joint_types import HELD, JointType
from technic.assembly.model import Finding, Joint, Part
from technic.assembly.stiffness import ConnectionStiffness, StiffnessTable
from technic.errors import UsageError
from technic.geometry import Array, axes_from, readonly
from technic.ldraw.findings import find
from technic.ldraw.matching import Limits, Matched, Mating, match
from technic.ldraw.placed import PlacedPorts, collect
from technic.ldraw.seats import HINGE, Seat, seats
from technic.ldraw.stops import missing_stops

__all__ = ["AxleSlide", "Links", "connect", "findings_of", "link"]

AxleSlide = Literal["held", "free"]

_STUD: Final = "stud/tube"


@dataclass(frozen=True, slots=True, eq=False)
class Links:
    """The joints between parts, and what they were found from.

    Parameters
    ----------
    joints : tuple of Joint
        One for each pair of parts and line, in the order of the parts.
    placed : PlacedPorts
    matched : Matched
    limits : Limits
    ports : dict of str to tuple of int
        The ports that each joint takes, by its id.
    """

    joints: tuple[Joint, ...]
    placed: PlacedPorts
    matched: Matched
    limits: Limits
    ports: Mapping[str, tuple[int, ...]]


def connect(
    parts: Sequence[Part],
    table: StiffnessTable,
    *,
    axle_slide: AxleSlide = "held",
    limits: Limits | None = None,
    inner: Sequence[Joint] = (),
) -> tuple[tuple[Joint, ...], tuple[Finding, ...]]:
    """Return the joints between parts, and what is worth a sentence about them.

    Parameters
    ----------
    parts : sequence of Part
    table : StiffnessTable
    axle_slide : {"held", "free"}
        Whether friction keeps a part where it is on an axle that it grips. When free, such a part
        slides, and is no stop for the axle either.
    limits : Limits, optional
        How far from ideal features may be and still mate.
    inner : sequence of Joint
        Joints inside of parts, which are no matter of connectors; they come last.

    Returns
    -------
    joints : tuple of Joint
    findings : tuple of Finding
    """
    links = link(parts, table, axle_slide=axle_slide, limits=limits)
    joints = (*links.joints, *inner)
    return joints, findings_of(links, joints)


def link(
    parts: Sequence[Part],
    table: StiffnessTable,
    *,
    axle_slide: AxleSlide = "held",
    limits: Limits | None = None,
) -> Links:
    """Return the joints between parts with what they come from; see `connect`."""
    if axle_slide not in ("held", "free"):
        raise UsageError(f"axle_slide is 'held' or 'free', not {axle_slide!r}")
    limits = limits or Limits()
    placed = collect(parts)
    matched = match(placed, limits)
    missing = missing_stops(placed, matched.matings, gripped=axle_slide == "held", limits=limits)
    by_pair: dict[tuple[int, int], list[Joint]] = {}
    ports: dict[str, tuple[int, ...]] = {}
    for group in _stud_groups(placed, matched.matings):
        first = matched.matings[group[0]]
        pair = _pair(placed, first)
        joint_id = f"{parts[pair[0]].id}~{parts[pair[1]].id}@{len(by_pair.get(pair, [])) + 1}"
        if first.connection == _STUD:
            joint = _studs(placed, [matched.matings[k] for k in group], table, joint_id)
        else:
            joint = _joint(placed, first, table, joint_id, axle_slide, missing.get(group[0], ""))
        by_pair.setdefault(pair, []).append(joint)
        ports[joint_id] = tuple(port for k in group for port in matched.matings[k].ports)
    for seat in seats(parts, limits):
        if seat.connection == HINGE and seat.parts in by_pair:
            continue  # the catalogue describes its knuckles as a pin and its hole
        number = len(by_pair.get(seat.parts, [])) + 1
        joint_id = f"{parts[seat.parts[0]].id}~{parts[seat.parts[1]].id}@{number}"
        by_pair.setdefault(seat.parts, []).append(_seat(seat, table, joint_id))
    joints = tuple(joint for pair in sorted(by_pair) for joint in by_pair[pair])
    return Links(joints, placed, matched, limits, ports)


def findings_of(links: Links, joints: Sequence[Joint]) -> tuple[Finding, ...]:
    """Return what is worth a sentence when these are the joints, which may have been corrected.

    A port whose joint was taken away is open again.
    """
    used = frozenset(port for joint in joints for port in links.ports.get(joint.id, ()))
    return find(links.placed, replace(links.matched, used=used), joints, links.limits)


@lru_cache(maxsize=4096)
def _axes(x: float, y: float, z: float) -> Array:
    """Return the joint axes of a line; most lines of a model are parallel."""
    return readonly(axes_from((x, y, z)))


def _pair(placed: PlacedPorts, mating: Mating) -> tuple[int, int]:
    a, b = int(placed.part[mating.male]), int(placed.part[mating.female])
    return (a, b) if a < b else (b, a)


def _stud_groups(placed: PlacedPorts, matings: Sequence[Mating]) -> list[list[int]]:
    """Return the matings of each joint: studs between the same two parts together, others alone."""
    groups: list[list[int]] = []
    studs: dict[tuple[int, int], list[int]] = {}
    for k, mating in enumerate(matings):
        pair = _pair(placed, mating)
        if mating.connection == _STUD and pair in studs:
            studs[pair].append(k)
            continue
        groups.append([k])
        if mating.connection == _STUD:
            studs[pair] = groups[-1]
    return groups


def _joint(
    placed: PlacedPorts,
    mating: Mating,
    table: StiffnessTable,
    joint_id: str,
    axle_slide: AxleSlide,
    missing: str,
) -> Joint:
    entry = table.get(mating.connection)
    type_ = entry.type
    if mating.connection == "axle/axle_hole":
        type_ = JointType.FIXED if axle_slide == "held" else JointType.SLIDER
    elif mating.connection == "axle/pin_hole":
        type_ = JointType.CYLINDRICAL if missing else JointType.HINGE
    point, axis = _shaft_line(placed, mating)
    axes = _axes(*axis)
    return _build(placed, mating, entry, type_, entry.vector(), joint_id, axes, missing, point)


def _shaft_line(placed: PlacedPorts, mating: Mating) -> tuple[Array, Array]:
    """Return the joint's point and axis: on the shaft's line when a shaft sits in a bore.

    A pin turns in all its bores about one line, its own. Files place parts a little off; taking each
    bore's line instead would make a crank of every pin that is not placed perfectly.
    """
    if not mating.connection.startswith(("pin/", "axle/")):
        return mating.point, mating.axis
    axis = placed.axis[mating.male]
    foot = placed.position[mating.male]
    point = foot + ((mating.point - foot) @ axis) * axis
    return point, axis if axis @ mating.axis > 0.0 else -axis


def _studs(
    placed: PlacedPorts, matings: Sequence[Mating], table: StiffnessTable, joint_id: str
) -> Joint:
    """Return the joint of one or more studs between two parts.

    Studs act as springs side by side between two faces: n of them add up, and about the middle of
    the pattern their lever arms resist rotation: ``spin += k_shear r^2``, ``tilt += k_axial r^2``.
    """
    entry = table.get(_STUD)
    single = entry.vector()
    first = matings[0]
    if len(matings) == 1:
        type_ = JointType.HINGE
        return _build(placed, first, entry, type_, single, joint_id, _axes(*first.axis), "")
    points = np.array([mating.point for mating in matings])
    middle = points.mean(axis=0)
    axes = np.array(_axes(*first.axis))
    y, z = axes[1:] @ (points - middle).T
    # Turned to the principal directions of the pattern, the rotational stiffness is diagonal.
    angle = 0.5 * np.arctan2(2.0 * float(y @ z), float(y @ y - z @ z))
    c, s = np.cos(angle), np.sin(angle)
    axes[1:] = [c * axes[1] + s * axes[2], c * axes[2] - s * axes[1]]
    y, z = c * y + s * z, c * z - s * y
    stiffness = len(matings) * np.array(single)
    stiffness[3] += single[1] * float(y @ y + z @ z)
    stiffness[4] += single[0] * float(z @ z)
    stiffness[5] += single[0] * float(y @ y)
    return _build(placed, first, entry, JointType.FIXED, stiffness, joint_id, axes, "", middle)


def _seat(seat: Seat, table: StiffnessTable, joint_id: str) -> Joint:
    entry = table.get(seat.connection)
    held = entry.held()
    return Joint(
        id=joint_id,
        type=entry.type,
        parts=seat.parts,
        point=seat.point,
        axes=_axes(*seat.axis),
        held=held,
        stiffness=np.where(held, entry.vector(), 0.0),
        connection=seat.connection,
        provenance=entry.provenance(held),
        offset=seat.offset,
    )


def _build(
    placed: PlacedPorts,
    mating: Mating,
    entry: ConnectionStiffness,
    type_: JointType,
    stiffness: Array,
    joint_id: str,
    axes: Array,
    missing: str,
    point: Array | None = None,
) -> Joint:
    held = entry.held(type_)
    if mating.connection == "pin/pin_hole" and not placed.port(mating.male).friction:
        # A spin stiffness in the table is the friction of ridged pins; smooth ones turn freely.
        held = readonly(HELD[type_], dtype=bool)
    if np.any(np.asarray(stiffness)[held] <= 0.0):
        raise UsageError(
            f"the stiffness table gives no value for a held motion of {entry.connection!r} "
            f"as {type_} joint"
        )
    pair = _pair(placed, mating)
    ports = (placed.name(mating.male), placed.name(mating.female))
    if int(placed.part[mating.male]) != pair[0]:
        ports = (ports[1], ports[0])
    return Joint(
        id=joint_id,
        type=type_,
        parts=pair,
        point=mating.point if point is None else point,
        axes=axes,
        held=held,
        stiffness=np.where(held, stiffness, 0.0),
        connection=entry.connection,
        provenance=entry.provenance(held),
        ports=ports,
        offset=mating.offset,
        missing_stop=missing,
    )
