"""Parts with inner motion become two bodies or more, joined by what their data say.

A motor's output, an actuator's or a shock absorber's rod, the second fork of a universal joint: each
is a `Part` of its own, ``<id>#output``, right behind the part it belongs to. It has the connectors
that lie on it and a share of the mass; the rest keeps the part's id.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import Final, Literal

import numpy as np

from technic.assembly.joint_types import HELD, JointType
from technic.assembly.model import Finding, FindingKind, Joint, Part
from technic.assembly.typed_joints import joint_axes
from technic.geometry import axes_from, readonly
from technic.parts.definition import MassProperties, PartDefinition, Port, RigidBody
from technic.parts.inner import ASSUMED, TRANSLATION, InnerBody, InnerPart, Screw, inner_parts
from technic.parts.teeth import teeth_table

__all__ = ["Divided", "InnerMotion", "divide"]

InnerMotion = Literal["held", "free"]

_NAMES: Final = {
    "motor": ("motor", "its output"),
    "actuator": ("actuator", "its rod"),
    "spring": ("shock absorber", "its rod"),
    "universal": ("universal joint", "its second fork"),
    "clutch": ("clutch gear", "its centre"),
    "pump": ("pump", "its rod"),
    "turntable": ("turntable", "its top"),
}


@dataclass(frozen=True, slots=True, eq=False)
class Divided:
    """Parts with the pieces of divided ones among them, the joints inside, and what is worth saying."""

    parts: tuple[Part, ...]
    joints: tuple[Joint, ...]
    findings: tuple[Finding, ...]


def divide(parts: Sequence[Part], inner: InnerMotion = "held") -> Divided:
    """Divide the parts that are not one rigid body.

    Parameters
    ----------
    parts : sequence of Part
    inner : {"held", "free"}
        Whether motors and actuators hold their position, like braked ones, or move freely.
    """
    known = inner_parts()
    made: list[Part] = []
    joints: list[Joint] = []
    findings: list[Finding] = []
    for part in parts:
        entry = known.get(part.definition.id if part.definition is not None else part.number)
        entry = entry or known.get(part.number)
        place = len(made)
        made.append(part)
        if entry is None:
            continue
        if entry.always or inner == "free":
            for body in entry.bodies:
                piece = _piece(made[place], body)
                if piece is None:
                    continue
                made[place], moving = piece
                made.append(moving)
                joints.append(_joint(made, place, len(made) - 1, body, entry))
                if body.screw is not None:
                    joints += _thread(made, place, body, body.screw, entry)
        findings.append(_finding(made, place, entry, divided=len(made) > place + 1))
    return Divided(tuple(made), tuple(joints), tuple(findings))


def _piece(part: Part, body: InnerBody) -> tuple[Part, Part] | None:
    """Return the rest and the moving piece; None when nothing holds one of them: connectors or teeth."""
    own = tuple(port for port in part.ports if body.owns(port))
    rest = tuple(port for port in part.ports if not body.owns(port))
    toothed = part.definition is not None and teeth_table().get(part.definition.id)
    if not own or not (rest or toothed):
        return None
    whole = part.mass_properties
    share = body.share
    # The piece is where its connectors are, the rest balances it. Its own extent is that of a part of
    # its mass; the spread of the two is taken from the whole, as far as that has it.
    centroid = np.mean([port.position for port in own], axis=0)
    left = (whole.centroid - share * centroid) / (1.0 - share)
    moving = MassProperties(share * whole.mass, centroid, share * whole.inertia)
    staying = MassProperties((1.0 - share) * whole.mass, left, (1.0 - share) * whole.inertia)
    return (
        replace(part, ports=rest, mass_properties=staying, definition=_without(part, rest)),
        replace(
            part,
            id=f"{part.id}#{body.name}",
            name=f"{part.name}: {body.name}",
            ports=own,
            body=RigidBody(),
            mass_properties=moving,
            definition=_only(part, body, own, moving),
        ),
    )


def _without(part: Part, rest: tuple[Port, ...]) -> PartDefinition | None:
    definition = part.definition
    return None if definition is None else replace(definition, ports=rest)


def _only(
    part: Part, body: InnerBody, own: tuple[Port, ...], mass: MassProperties
) -> PartDefinition | None:
    """Return the definition of a piece; its outline is drawn with the part it belongs to."""
    definition = part.definition
    if definition is None:
        return None
    return replace(
        definition,
        id=f"{definition.id}#{body.name}",
        title=f"{definition.title}: {body.name}",
        ports=own,
        body=RigidBody(),
        mass_properties=mass,
        aliases=(),
        shape={},
        drawing=None,
    )


def _joint(
    parts: Sequence[Part], first: int, second: int, body: InnerBody, entry: InnerPart
) -> Joint:
    type_ = JointType(body.joint)
    held = readonly(HELD[type_], dtype=np.bool_)
    pose = parts[first].pose
    axis = pose.directions(body.axis)
    other = None if body.second is None else pose.directions(body.second)
    provenance = entry.stiffness_source if body.given else "assumed"
    return Joint(
        id=f"{parts[first].id}~#{body.name}",
        type=type_,
        parts=(first, second),
        point=pose.points(body.point),
        axes=joint_axes(type_, axis, other, 3),
        held=held,
        stiffness=np.where(held, body.stiffness, 0.0),
        connection=f"inside/{entry.kind}",
        provenance=provenance,
    )


def _thread(
    parts: Sequence[Part], first: int, body: InnerBody, screw: Screw, entry: InnerPart
) -> list[Joint]:
    """Return the thread between a piece and another one of the same part, if that is there.

    Where the threads touch, they cannot move through each other: one row, like that of two gears. On
    the axis a turn makes ``lead`` of way, so the thread's flank is inclined by ``lead / (2 pi r)``.
    """
    name = f"{parts[first].id}#{screw.partner}"
    partner = next((k for k in range(first + 1, len(parts)) if parts[k].id == name), None)
    if partner is None:
        return []
    pose = parts[first].pose
    axis = pose.directions(body.axis)
    out = axes_from(axis)[1]
    slope = screw.lead / (2.0 * np.pi * screw.radius)
    flank = axis - slope * np.cross(axis, out)
    held = readonly(HELD[JointType.MESH], dtype=np.bool_)
    return [
        Joint(
            id=f"{parts[first].id}~#{screw.partner}~#{body.name}",
            type=JointType.MESH,
            parts=(partner, len(parts) - 1),
            point=pose.points(body.point) + screw.radius * out,
            axes=axes_from(flank),
            held=held,
            stiffness=np.where(held, TRANSLATION, 0.0),
            connection=f"inside/{entry.kind}",
            provenance=ASSUMED,
        )
    ]


def _finding(parts: Sequence[Part], place: int, entry: InnerPart, *, divided: bool) -> Finding:
    part = parts[place]
    kind, piece = _NAMES[entry.kind]
    where = "" if part.source is None else f", line {part.source.line}"
    who = f"{part.name} ({part.number}{where})"
    if divided:
        verb = "springs" if entry.kind == "spring" else "moves"
        said = f"{who}: {piece} {verb} against the rest"
    elif entry.always:
        said = f"{who}: a {kind} without connectors on both its pieces, taken as one rigid body"
    else:
        said = f"{who}: a {kind} that holds its position; --inner free lets {piece} move"
    return Finding(FindingKind.INNER, said, tuple(range(place, len(parts))))
