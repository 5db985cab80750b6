"""The teeth of placed parts: from the table of teeth, else from the LDraw title.

LEGO gears have a module of 1 mm: a gear of n teeth rolls on a circle of n / 2 mm. A title says how
many teeth a gear has and of what kind; its bore says where they are. What a title does not say
(turntables, racks, rings, bevels with teeth on one side) is in `parts_library/teeth.toml`.
"""

from __future__ import annotations

import re
from collections.abc import Sequence
from dataclasses import dataclass
from typing import Final

import numpy as np

from technic.assembly.model import Part
from technic.geometry import Array
from technic.parts.definition import Port, PortKind
from technic.parts.teeth import MODULE, Toothing, teeth_table
from technic.units import LDU

__all__ = ["Gear", "gears_of"]

KNOB_RADIUS: Final = 20.0 * LDU
"""Knob wheels stand 40 LDU apart."""

NARROW, WIDE = 5.0 * LDU, 8.0 * LDU
"""Half the width of the teeth of spur gears and of double bevels, whose last 2 LDU are chamfered."""

FACE: Final = 5.0 * LDU
"""Where double bevels have their rolling circles for crossing shafts, on both sides of the middle. On
the grid each stands so that the other's circle reaches it: 20 LDU for 12 teeth, 30 LDU for 20."""

_TEETH: Final = re.compile(r"^gear (\d+) tooth")


@dataclass(frozen=True, slots=True, eq=False)
class Gear:
    """A row of teeth in its place.

    Parameters
    ----------
    part : int
    teeth : Toothing
        In world coordinates (m).
    """

    part: int
    teeth: Toothing


def gears_of(part: Part, index: int) -> tuple[Gear, ...]:
    """Return the rows of teeth of a part; most have none, some turntables and differentials two."""
    if part.definition is None or part.fastener:
        return ()
    own = teeth_table().get(part.definition.id)
    if own is None:
        # a piece of a divided part (its id has a #) has the part's title, but not its teeth
        own = () if "#" in part.definition.id else _by_title(part)
    return tuple(Gear(index, _placed(teeth, part)) for teeth in own)


def _placed(teeth: Toothing, part: Part) -> Toothing:
    pose = part.pose
    return Toothing(
        teeth.kind,
        teeth.teeth,
        pose.points(teeth.center),
        pose.directions(teeth.axis),
        teeth.radius,
        teeth.half,
        teeth.inner,
        teeth.faces,
        None
        if teeth.sector is None
        else (pose.directions(teeth.sector[0]), pose.directions(teeth.sector[1])),
        None if teeth.out is None else pose.directions(teeth.out),
    )


def _by_title(part: Part) -> tuple[Toothing, ...]:
    assert part.definition is not None  # checked by the caller
    title = part.definition.title.lower().lstrip("~=_| ").removeprefix("technic ")
    match = _TEETH.match(title)
    knob = title.startswith("gear 4 knob") and "45" not in title
    if match is None and not knob:
        return ()
    middle = part.mass_properties.centroid
    bore = _bore(part.ports, middle)
    if bore is None:
        return ()
    center = bore.position + float((middle - bore.position) @ bore.axis) * bore.axis
    if match is None:
        return (Toothing("knob", 4, center, bore.axis, KNOB_RADIUS, WIDE, faces=_both(0.0)),)
    count = int(match[1])
    radius = count * MODULE / 2.0
    if "double bevel" in title:
        return (
            Toothing("double bevel", count, center, bore.axis, radius, WIDE, faces=_both(FACE)),
        )
    if "bevel" in title or "crown" in title:
        return ()  # teeth on one side: on which, and how far along, is a matter of the table
    return (Toothing("spur", count, center, bore.axis, radius, NARROW),)


def _both(at: float) -> tuple[tuple[float, int], ...]:
    return ((at, 1), (-at, -1))


def _bore(ports: Sequence[Port], middle: Array) -> Port | None:
    """Return the bore through the middle of a gear: an axle hole before a round one."""
    through = [
        port
        for port in ports
        if port.kind in (PortKind.AXLE_HOLE, PortKind.PIN_HOLE)
        and np.linalg.norm(np.cross(middle - port.position, port.axis)) <= 2.0 * LDU
    ]
    return min(through, key=lambda port: port.kind is PortKind.PIN_HOLE, default=None)
