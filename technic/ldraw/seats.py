"""Parts that belong to each other without a connector: tyres on rims, the two halves of a turntable,
planet gears in a differential, driving rings on their joiners and in the gears that they drive,
the halves of hinges.

None of them has a pin, an axle or a stud for it. They are recognised by what they are (family or LDraw
title) and by lying on one line at one place.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Final

import numpy as np

from technic.assembly.model import Finding, FindingKind, Part
from technic.geometry import Array
from technic.ldraw.hinges import knuckles_in_place
from technic.ldraw.matching import Limits
from technic.parts.definition import PortKind
from technic.units import LDU, PITCH

__all__ = ["DOGS", "HINGE", "PLANET", "RING", "TURNTABLE", "TYRE", "Seat", "seats", "tyre_findings"]

TYRE = "tyre/rim"
TURNTABLE = "turntable/turntable"
PLANET = "planet/differential"
RING = "driving ring/joiner"
HINGE = "hinge/hinge"
DOGS = "driving ring/clutch"

PLANET_REACH = PITCH
"""Furthest that a planet gear is from the middle of its casing along its own shaft (m)."""


RINGS: Final = {"6539": 20.0 * LDU, "18947": 28.0 * LDU, "2473a": 18.0 * LDU}
"""Driving rings and half their length (LDraw 2026-02: their dogs reach that far along z)."""

RIDGES: Final = 15.0 * LDU
"""Furthest that a ring is from the middle of the joiner it clicks on: a step of 10 LDU either way."""

GEAR_HALF: Final = 10.0 * LDU
"""Half the length of the gears with a clutch."""

ENGAGED: Final = 4.0 * LDU
"""How deep a ring's dogs are in a gear at least, when they drive it; 8 LDU in LDraw, none in neutral."""


@dataclass(frozen=True, slots=True, eq=False)
class Seat:
    """Two parts that belong to each other.

    Parameters
    ----------
    connection : str
        Key of the stiffness table.
    parts : (int, int)
        Ascending.
    point, axis : (3,) ndarray
        Their common line (m).
    offset : float
        How far apart their lines are (m).
    """

    connection: str
    parts: tuple[int, int]
    point: Array
    axis: Array
    offset: float


def seats(parts: Sequence[Part], limits: Limits) -> list[Seat]:
    """Return the tyres on rims and the turntables of a model, in the order of the parts.

    Parameters
    ----------
    parts : sequence of Part
    limits : Limits
        How far apart their lines may be.
    """
    tyres = [k for k, part in enumerate(parts) if _is(part, "tyre")]
    rims = [k for k, part in enumerate(parts) if _is(part, "wheel") and k not in tyres]
    halves = [k for k, part in enumerate(parts) if _is(part, "turntable")]
    found: list[Seat] = []
    taken: set[int] = set()
    for tyre in tyres:
        lines = {k: _bore(parts[k]) for k in rims if k not in taken}
        best = _nearest(tyre, _ring(parts[tyre]), lines, PITCH, limits, TYRE)
        if best is not None:
            taken.update(best.parts)
            found.append(best)
    for half in halves:
        if half in taken:
            continue
        lines = {
            k: _upright(parts[k])
            for k in halves
            if k > half and k not in taken and parts[k].number != parts[half].number
        }
        best = _nearest(half, _upright(parts[half]), lines, PITCH / 2.0, limits, TURNTABLE)
        if best is not None:
            taken.update(best.parts)
            found.append(best)
    found += _planets(parts, limits)
    found += _driving(parts, limits)
    found += [
        Seat(HINGE, hinge.parts, hinge.point, hinge.axis, hinge.offset)
        for hinge in knuckles_in_place(parts, limits)
    ]
    return sorted(found, key=lambda seat: seat.parts)


def tyre_findings(parts: Sequence[Part]) -> tuple[Finding, ...]:
    """Return what is said of the tyres: one finding for all of them."""
    tyres = tuple(k for k, part in enumerate(parts) if _is(part, "tyre"))
    if not tyres:
        return ()
    count = "1 tyre" if len(tyres) == 1 else f"{len(tyres)} tyres"
    message = f"{count}: taken as rigid, what they give is not modelled"
    return (Finding(FindingKind.FLEXIBLE, message, tyres),)


def _planets(parts: Sequence[Part], limits: Limits) -> list[Seat]:
    """Return the gears on the stubs inside of differentials.

    Such a gear has its bore across the casing's axis and on it; gears on the axles have theirs along.
    """
    casings = [k for k, part in enumerate(parts) if _is(part, "differential")]
    gears = [k for k, part in enumerate(parts) if _is(part, "gear")] if casings else []
    found = []
    for casing in casings:
        line = _bore(parts[casing])
        if line is None:
            continue
        axis = line[1]
        foot = next(
            parts[casing].pose.points(port.position)
            for port in parts[casing].ports
            if port.kind in (PortKind.PIN_HOLE, PortKind.AXLE_HOLE)
        )
        middle = foot + ((parts[casing].centroid - foot) @ axis) * axis
        for gear in gears:
            shaft = _bore(parts[gear])
            if shaft is None or abs(float(shaft[1] @ axis)) > np.sin(limits.angle):
                continue
            between = middle - shaft[0]
            along = float(between @ shaft[1])
            miss = between - along * shaft[1]
            # the stubs cross the axis somewhere in the casing, not always at its centre of mass
            offset = float(np.linalg.norm(miss - (miss @ axis) * axis))
            near = max(abs(along), abs(float(miss @ axis))) <= PLANET_REACH
            if near and offset <= limits.offset:
                pair = (min(casing, gear), max(casing, gear))
                found.append(Seat(PLANET, pair, shaft[0], shaft[1], offset))
    return found


def _driving(parts: Sequence[Part], limits: Limits) -> list[Seat]:
    """Return the driving rings on their joiners, and the gears that they are shifted into.

    A gear with a clutch turns freely on its shaft until the dogs of a ring enter it.
    """
    found: list[Seat] = []
    for k, ring in enumerate(parts):
        half = RINGS.get(ring.definition.id if ring.definition is not None else ring.number)
        if half is None:
            continue
        line = ring.pose.translation, ring.pose.directions(np.array([0.0, 0.0, 1.0]))
        titles = [_title(part) for part in parts]
        joiners = {n: _bore(parts[n]) for n, t in enumerate(titles) if t.startswith("axle joiner")}
        gears = {
            n: _bore(parts[n])
            for n, t in enumerate(titles)
            if t.startswith("gear ") and " clutch" in t and _turns(parts[n])
        }
        seat = _nearest(k, line, joiners, RIDGES, limits, RING)
        reach = half + GEAR_HALF - ENGAGED
        driven = _nearest(k, line, gears, reach, limits, DOGS)
        found += [one for one in (seat, driven) if one is not None]
    return found


def _turns(part: Part) -> bool:
    """Tell whether a gear's bores are round."""
    return all(port.kind is not PortKind.AXLE_HOLE for port in part.ports)


def _is(part: Part, what: str) -> bool:
    """Return whether a part is of a kind, by its family or by its title in the LDraw manner."""
    definition = part.definition
    if definition is None:
        return False
    return definition.family.split("-")[0] == what or _title(part).split(" ")[0] == what


def _title(part: Part) -> str:
    """Return a part's title without marks of the library, in small letters."""
    title = "" if part.definition is None else part.definition.title
    return title.lower().lstrip("~=_| ").removeprefix("technic ")


_Line = tuple[Array, Array]
"""Point and unit direction, world coordinates."""


def _ring(part: Part) -> _Line:
    """Return the axis of a round part: the principal axis of inertia unlike the other two."""
    moments, axes = np.linalg.eigh(part.mass_properties.inertia)
    odd = 2 if moments[2] - moments[1] > moments[1] - moments[0] else 0
    return part.centroid, part.pose.directions(axes[:, odd])


def _bore(part: Part) -> _Line | None:
    """Return the line of the bore nearest to a wheel's middle; None when it has none."""
    bores = [p for p in part.ports if p.kind in (PortKind.PIN_HOLE, PortKind.AXLE_HOLE)]
    if not bores:
        return None
    middle = part.mass_properties.centroid
    bore = min(bores, key=lambda p: float(np.linalg.norm(np.cross(middle - p.position, p.axis))))
    return part.centroid, part.pose.directions(bore.axis)


def _upright(part: Part) -> _Line:
    """Return the axis of half a turntable: LDraw draws both halves about y, around one origin."""
    return part.pose.points(np.zeros(3)), part.pose.directions(np.array([0.0, 1.0, 0.0]))


def _nearest(
    this: int,
    line: _Line,
    others: dict[int, _Line | None],
    reach: float,
    limits: Limits,
    connection: str,
) -> Seat | None:
    """Return the seat on the nearest part whose line is this line, at most `reach` (m) along it."""
    point, axis = line
    best: tuple[float, Seat] | None = None
    for k, other in others.items():
        if other is None or np.linalg.norm(np.cross(axis, other[1])) > np.sin(limits.angle):
            continue
        between = other[0] - point
        along = float(between @ axis)
        offset = float(np.linalg.norm(between - along * axis))
        if (
            offset <= limits.offset
            and abs(along) <= reach
            and (best is None or abs(along) < best[0])
        ):
            pair = (min(this, k), max(this, k))
            best = (abs(along), Seat(connection, pair, point, axis, offset))
    return None if best is None else best[1]
