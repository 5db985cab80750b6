"""Which features of a model are in each other: pins in holes, axles in bores, balls in sockets.

The search runs on arrays (`placed`); what it returns are `Mating` records, one for each pair of
parts and line, before they become joints. Two rules make the answer unique: a stretch of a hole
holds one part only, the best match first; and all ties are broken by the order of the ports.
"""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass, replace
from math import sin, sqrt
from typing import Final

import numpy as np

from technic.geometry import Array
from technic.ldraw.placed import Indices, Overlap, PlacedPorts, near_pairs, overlap
from technic.parts.definition import PortKind
from technic.tolerances import ANGLE, AXIAL_OVERLAP, RADIAL_OFFSET, SHORT_FEATURE_SHARE, STUD_OFFSET
from technic.units import LDU

__all__ = ["MATES", "Limits", "Matched", "Mating", "match"]

MATES: Final[dict[tuple[PortKind, PortKind], str]] = {
    (PortKind.AXLE, PortKind.AXLE_HOLE): "axle/axle_hole",
    (PortKind.PIN, PortKind.PIN_HOLE): "pin/pin_hole",
    (PortKind.AXLE, PortKind.PIN_HOLE): "axle/pin_hole",
    (PortKind.STUD, PortKind.PIN_HOLE): "stud/pin_hole",
    (PortKind.STUD, PortKind.TUBE): "stud/tube",
    (PortKind.BALL, PortKind.SOCKET): "ball/socket",
}
"""What enters what, and the key of the stiffness table. Where two parts mate in several ways on one
line, the first of this list is what joins them."""

_STUD: Final = MATES[PortKind.STUD, PortKind.TUBE]

_BESIDE: Final = (0.0, 10.0 * LDU, 10.0 * sqrt(2.0) * LDU)
"""Where studs sit from the middle of a tube: in it; beside the rod of a part one stud wide; between
the four around the tube of a wider part."""

_POINTS: Final = {_STUD, MATES[PortKind.BALL, PortKind.SOCKET]}
"""Connections at a point of their own: never merged along a line."""

_RANK: Final = {connection: rank for rank, connection in enumerate(MATES.values())}


@dataclass(frozen=True, slots=True)
class Limits:
    """How far from ideal two features may be and still mate: metres and radians."""

    offset: float = RADIAL_OFFSET
    angle: float = ANGLE


@dataclass(frozen=True, slots=True, eq=False)
class Mating:
    """Two parts that are in each other on one line.

    Parameters
    ----------
    connection : str
        Value of `MATES`.
    male, female : int
        Port indices (of `PlacedPorts`) of the best pair of ports.
    low, high : float
        The stretch they share, along the axis of the female port from its middle (m).
    offset : float
        Distance of the two lines in the middle of that stretch (m).
    point : (3,) ndarray
        Middle of the stretch, on the female line (m).
    axis : (3,) ndarray
        Axis of the female port.
    ports : tuple of int
        All ports that it stands for, ascending; empty while they are not merged.
    """

    connection: str
    male: int
    female: int
    low: float
    high: float
    offset: float
    point: Array
    axis: Array
    ports: tuple[int, ...] = ()


@dataclass(frozen=True, slots=True, eq=False)
class Matched:
    """All matings, and the ports that take part in one.

    Parameters
    ----------
    matings : tuple of Mating
    used : frozenset of int
        Ports that mate, also those whose line another pair of ports stands for.
    refused : tuple of (int, int)
        Pairs (male, female) that would mate, had another part not taken the place.
    """

    matings: tuple[Mating, ...]
    used: frozenset[int]
    refused: tuple[tuple[int, int], ...]


def match(placed: PlacedPorts, limits: Limits | None = None) -> Matched:
    """Return what is in what."""
    limits = limits or Limits()
    candidates: list[Mating] = []
    for (male, female), connection in MATES.items():
        reach = limits.offset if female is not PortKind.TUBE else _BESIDE[-1] + STUD_OFFSET
        pairs = near_pairs(placed, placed.of_kind(male), placed.of_kind(female), reach)
        if male is PortKind.BALL:
            candidates += _balls(placed, pairs, limits)
        elif female is PortKind.TUBE:
            candidates += _tubes(placed, pairs, limits)
        else:
            candidates += _lines(placed, pairs, connection, limits)
    kept, refused = _occupy(placed, candidates)
    used = frozenset(index for mating in kept for index in (mating.male, mating.female))
    return Matched(tuple(_merge(placed, kept, limits)), used, tuple(refused))


def enough(placed: PlacedPorts, pairs: Indices, lie: Overlap) -> np.ndarray:
    """Return which pairs share enough of their length, (m,) bool."""
    shorter = 2.0 * np.minimum(placed.half[pairs[:, 0]], placed.half[pairs[:, 1]])
    least = np.minimum(AXIAL_OVERLAP, SHORT_FEATURE_SHARE * shorter)
    return np.asarray((lie.length >= least) & (lie.length > 0.0))


def _lines(
    placed: PlacedPorts, pairs: Indices, connection: str, limits: Limits
) -> Iterable[Mating]:
    lie = overlap(placed, pairs)
    good = (lie.offset <= limits.offset) & (lie.angle <= limits.angle)
    good &= enough(placed, pairs, lie)
    for k in np.flatnonzero(good):
        low, high = float(lie.low[k]), float(lie.high[k])
        male, female = int(pairs[k, 0]), int(pairs[k, 1])
        axis = placed.axis[female]
        point = placed.position[female] + (low + high) / 2.0 * axis
        yield Mating(connection, male, female, low, high, float(lie.offset[k]), point, axis)


def _balls(placed: PlacedPorts, pairs: Indices, limits: Limits) -> Iterable[Mating]:
    between = placed.position[pairs[:, 0]] - placed.position[pairs[:, 1]]
    distance = np.linalg.norm(between, axis=1)
    connection = MATES[PortKind.BALL, PortKind.SOCKET]
    for k in np.flatnonzero(distance <= limits.offset):
        male, female = int(pairs[k, 0]), int(pairs[k, 1])
        half = float(placed.half[female])
        yield Mating(
            connection,
            male,
            female,
            -half,
            half,
            float(distance[k]),
            placed.position[female],
            placed.axis[female],
        )


def _tubes(placed: PlacedPorts, pairs: Indices, limits: Limits) -> Iterable[Mating]:
    """Return the studs that sit in a tube or against its outside, on the line of the stud."""
    lie = overlap(placed, pairs)
    beside = np.abs(lie.offset[:, None] - np.array(_BESIDE))
    good = (beside.min(axis=1) <= min(STUD_OFFSET, limits.offset)) & (lie.angle <= limits.angle)
    good &= enough(placed, pairs, lie)
    good &= np.einsum("ij,ij->i", placed.axis[pairs[:, 0]], placed.axis[pairs[:, 1]]) < 0.0
    for k in np.flatnonzero(good):
        stud, tube = int(pairs[k, 0]), int(pairs[k, 1])
        low, high = float(lie.low[k]), float(lie.high[k])
        point, axis = placed.position[stud], placed.axis[stud]
        offset = float(beside[k].min())
        yield Mating(_STUD, stud, tube, low, high, offset, point, axis)


def _occupy(
    placed: PlacedPorts, candidates: list[Mating]
) -> tuple[list[Mating], list[tuple[int, int]]]:
    """Keep the candidates for which there is room: most overlap first, then least offset."""

    def preference(mating: Mating) -> tuple[float, float, int, int]:
        # Rounded, so that placement noise does not decide between equals.
        return (
            -round((mating.high - mating.low) / LDU),
            round(2.0 * mating.offset / LDU),
            mating.male,
            mating.female,
        )

    taken: dict[int, list[Mating]] = {}
    kept, refused = [], []
    for mating in sorted(candidates, key=preference):
        # A tube has room for studs on all sides, but each stud enters a part once.
        place = mating.female if mating.connection != _STUD else -1 - mating.male
        others = taken.setdefault(place, [])
        if mating.connection == _STUD:
            if all(placed.part[mating.female] != placed.part[other.female] for other in others):
                others.append(mating)
                kept.append(mating)
        elif any(_clash(mating, other) for other in others):
            refused.append((mating.male, mating.female))
        else:
            others.append(mating)
            kept.append(mating)
    return sorted(kept, key=lambda m: (m.female, m.male)), sorted(refused)


def _clash(mating: Mating, other: Mating) -> bool:
    """Two features in one hole clash when they claim a common stretch that would itself be enough
    for a connection.
    """
    shared = min(mating.high, other.high) - max(mating.low, other.low)
    shorter = min(mating.high - mating.low, other.high - other.low)
    return shared >= min(AXIAL_OVERLAP, SHORT_FEATURE_SHARE * shorter)


def _merge(placed: PlacedPorts, matings: list[Mating], limits: Limits) -> list[Mating]:
    """Return one mating for each pair of parts and line."""
    by_pair: dict[tuple[int, int], list[Mating]] = {}
    for mating in matings:
        a, b = int(placed.part[mating.male]), int(placed.part[mating.female])
        by_pair.setdefault((min(a, b), max(a, b)), []).append(mating)
    merged: list[Mating] = []
    for pair in sorted(by_pair):
        lines: list[list[Mating]] = []
        for mating in by_pair[pair]:
            for line in lines:
                if _same_line(line[0], mating, limits):
                    line.append(mating)
                    break
            else:
                lines.append([mating])
        merged += [_strongest(line) for line in lines]
    return merged


def _same_line(first: Mating, second: Mating, limits: Limits) -> bool:
    if {first.connection, second.connection} & _POINTS:
        return False
    cosine = float(first.axis @ second.axis)
    if 1.0 - cosine * cosine > sin(limits.angle) ** 2:
        return False
    between = second.point - first.point
    along = float(between @ first.axis)
    return float(between @ between) - along * along <= limits.offset**2


def _strongest(line: list[Mating]) -> Mating:
    """Merge the matings of one line: the strongest kind, over the whole stretch they share."""
    ports = tuple(sorted({port for mating in line for port in (mating.male, mating.female)}))
    if len(line) == 1:
        return replace(line[0], ports=ports)
    best = min(
        line,
        key=lambda m: (_RANK[m.connection], -round((m.high - m.low) / LDU), m.male, m.female),
    )
    origin = best.point - (best.low + best.high) / 2.0 * best.axis
    low, high = best.low, best.high
    for other in line:
        if other.connection != best.connection:
            continue
        middle = float((other.point - origin) @ best.axis)
        half = (other.high - other.low) / 2.0
        low, high = min(low, middle - half), max(high, middle + half)
    point = origin + (low + high) / 2.0 * best.axis
    return replace(best, low=low, high=high, point=point, ports=ports)
