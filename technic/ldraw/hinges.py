"""Hinges of two parts that clip into each other: the two halves of a hinge brick, click hinges.

Their knuckles are no pins and no holes. Each kind of half is known by its number, with the place and
the axis of its knuckles; two halves that fit and whose knuckles are in one place turn about it.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Final, Literal

import numpy as np

from technic.assembly.model import Part
from technic.geometry import Array
from technic.ldraw.matching import Limits
from technic.units import LDU

__all__ = ["HALVES", "Half", "Knuckles", "knuckles_in_place"]

ALONG: Final = 2.0 * LDU
"""Furthest that two halves are apart along their axis, to be one hinge."""


@dataclass(frozen=True, slots=True)
class Half:
    """One half of a hinge: LDU, axes of the part's LDraw file."""

    kind: Literal["brick", "click"]
    side: Literal["inner", "outer"]
    point: tuple[float, float, float]
    axis: tuple[float, float, float]


HALVES: Final[dict[str, Half]] = {
    # LDraw 2026-02: the round ends of 3937 are at y = 10, and turn with those of its tops.
    "3937": Half("brick", "outer", (0, 10, 0), (1, 0, 0)),
    "3938": Half("brick", "inner", (0, 10, 0), (1, 0, 0)),
    "6134": Half("brick", "inner", (0, 10, 0), (1, 0, 0)),
    # From the primitives: clh1 and clh3 are one finger around (0, 0, -10), clh12 around (0, -7, 0), clh4
    # is half of two fingers around (0, 0, 4); all along x.
    "30552": Half("click", "inner", (0, 0, -10), (1, 0, 0)),
    "30624": Half("click", "inner", (-31, 0, 0), (0, 1, 0)),
    "47973": Half("click", "inner", (-30, 0, 0), (0, 1, 0)),
    "30394": Half("click", "outer", (0, 0, 0), (1, 0, 0)),
}


@dataclass(frozen=True, slots=True, eq=False)
class Knuckles:
    """Two halves with their knuckles in one place.

    Parameters
    ----------
    parts : (int, int)
        Ascending.
    point, axis : (3,) ndarray
        Of the hinge (m).
    offset : float
        How far apart their axes are (m).
    """

    parts: tuple[int, int]
    point: Array
    axis: Array
    offset: float


def knuckles_in_place(parts: Sequence[Part], limits: Limits) -> list[Knuckles]:
    """Return the hinges that two parts make; each half is in one hinge, the nearest fitting one.

    Parameters
    ----------
    parts : sequence of Part
    limits : Limits
        How far apart the axes of two halves may be.
    """
    halves = []
    for k, part in enumerate(parts):
        half = HALVES.get(part.number if part.definition is None else part.definition.id)
        if half is not None:
            point = part.pose.points(np.array(half.point) * LDU)
            halves.append((k, half, point, part.pose.directions(np.array(half.axis))))
    found: list[tuple[float, Knuckles]] = []
    for a, half, point, axis in halves:
        for b, other, place, line in halves:
            if half.side != "outer" or (other.kind, other.side) != (half.kind, "inner"):
                continue
            if np.linalg.norm(np.cross(axis, line)) > np.sin(limits.angle):
                continue
            between = place - point
            along = float(between @ axis)
            offset = float(np.linalg.norm(between - along * axis))
            if offset <= limits.offset and abs(along) <= ALONG:
                pair = (min(a, b), max(a, b))
                found.append((offset + abs(along), Knuckles(pair, point, axis, offset)))
    taken: set[int] = set()
    kept = []
    for _, hinge in sorted(found, key=lambda entry: (round(entry[0] / LDU), entry[1].parts)):
        if not taken & set(hinge.parts):
            taken |= set(hinge.parts)
            kept.append(hinge)
    return sorted(kept, key=lambda hinge: hinge.parts)
