"""Pieces of bores and shafts, and the lines they lie on.

Part files build one hole from several pieces: two ends and a wall, quarters, mirrored halves. Here
pieces are put on common lines, where they become intervals. All lengths are in LDU, in part
coordinates.
"""

from __future__ import annotations

from collections import defaultdict
from collections.abc import Iterable, Sequence
from dataclasses import dataclass
from enum import StrEnum
from itertools import pairwise
from typing import Final

import numpy as np

from technic.geometry import Array

__all__ = [
    "JOIN",
    "PITCH_LDU",
    "SAME_LINE",
    "Line",
    "Piece",
    "PieceKind",
    "canonical",
    "covered",
    "divide",
    "lines_of",
    "union",
]

PITCH_LDU: Final = 20.0

SAME_LINE: Final = 1.0
"""Pieces lie on one line when they are closer than this (LDU): part files round to 0.01, posed
subfiles to 0.1, and mirrored quarters of one hole are up to 0.6 apart. Different holes are not closer
than 8."""

JOIN: Final = 1.0
"""Pieces of one bore or shaft touch or overlap; chamfers and edges leave gaps of at most this."""


class PieceKind(StrEnum):
    """What a piece says about its line."""

    HOLE = "hole"
    """A whole pin hole."""
    MOUTH = "mouth"
    """One end of a pin hole; runs from the surface inwards."""
    WALL = "wall"
    """A cylinder of a pin's radius seen from inside."""
    TUBE_WALL = "tube_wall"
    """The inside of a stud's tube: lengthens a hole, but is none by itself."""
    AXLE_HOLE = "axle_hole"
    PIN = "pin"
    """A pin, from its base to its tip."""
    PIN_FRICTION = "pin_friction"
    SHANK = "shank"
    """A cylinder of a pin's radius seen from outside."""
    AXLE = "axle"
    AXLE_PERIMETER = "axle_perimeter"
    """The sides of a cross: an axle, or, in older files, an axle hole."""
    LATCH = "latch"
    """The lip at a pin's tip seen from outside."""
    RIB = "rib"
    """A friction ridge: the pin around it is one with friction."""
    COLLAR = "collar"
    """A cylinder wider than a bore seen from outside."""
    SOCKET_WALL = "socket_wall"
    """A cylinder of a counterbore's radius seen from inside, which is also a tow ball's."""
    SOCKET_RIM = "socket_rim"
    """The outside of a tow ball's socket."""
    STUD = "stud"
    TUBE = "tube"
    BALL = "ball"
    SOCKET = "socket"


@dataclass(frozen=True, slots=True, eq=False)
class Piece:
    """A stretch of a line: `start` and `end` are (3,) points in LDU.

    `share` is the part of the full circle that a piece of a cylinder covers; `inward` tells on which
    side its surface is seen, where that matters.
    """

    kind: PieceKind
    start: Array
    end: Array
    share: float = 1.0
    inward: bool = False


def canonical(direction: Array) -> Array:
    """Return the direction or its opposite, so that its first significant component is positive."""
    first = next(value for value in direction if abs(value) > 1e-3)
    return direction if first > 0.0 else -direction


@dataclass(slots=True)
class Line:
    """A line with the pieces on it; `spans` are (piece, low, high, whether it points along the line)."""

    direction: Array
    foot: Array
    spans: list[tuple[Piece, float, float, bool]]

    def at(self, s: float) -> Array:
        """Return the point at the parameter `s`."""
        return np.asarray(self.foot + s * self.direction)

    def stretches(self, *kinds: PieceKind) -> list[tuple[float, float]]:
        """Return the intervals of the pieces of these kinds."""
        return [(low, high) for piece, low, high, _ in self.spans if piece.kind in kinds]

    def rounded(self, kind: PieceKind, least: float) -> list[tuple[float, float]]:
        """Return where arcs of a cylinder together cover at least `least` of the full circle."""
        arcs = [
            (low, high, piece.share) for piece, low, high, _ in self.spans if piece.kind is kind
        ]
        cuts = sorted({round(s, 3) for low, high, _ in arcs for s in (low, high)})
        kept = []
        for low, high in pairwise(cuts):
            middle = (low + high) / 2.0
            if sum(share for a, b, share in arcs if a < middle < b) >= least - 1e-9:
                kept.append((low, high))
        return union(kept, 1e-3)


def lines_of(pieces: Iterable[Piece]) -> list[Line]:
    """Sort pieces onto common lines."""
    lines: list[Line] = []
    buckets: dict[tuple[int, ...], list[Line]] = defaultdict(list)
    for piece in pieces:
        vector = piece.end - piece.start
        length = float(np.linalg.norm(vector))
        if length < 1e-6:
            continue
        direction = canonical(vector / length)
        foot = piece.start - direction * float(direction @ piece.start)
        key = tuple(np.floor(foot / 2.0 + 0.25).astype(int))
        found = None
        for shift in np.ndindex(3, 3, 3):
            near = (key[0] + shift[0] - 1, key[1] + shift[1] - 1, key[2] + shift[2] - 1)
            for line in buckets.get(near, ()):
                # the angle is judged by how far the line strays over the model's usual half length
                if (
                    np.linalg.norm(line.foot - foot) < SAME_LINE
                    and abs(float(line.direction @ direction)) > 0.99996
                ):
                    found = line
                    break
            if found:
                break
        if found is None:
            found = Line(direction, foot, [])
            lines.append(found)
            buckets[key].append(found)
        a, b = float(found.direction @ piece.start), float(found.direction @ piece.end)
        found.spans.append((piece, min(a, b), max(a, b), b > a))
    for line in lines:
        # mirrored quarters lie around the true line
        starts = np.array([piece.start for piece, *_ in line.spans])
        feet = starts - np.outer(starts @ line.direction, line.direction)
        line.foot = np.unique(feet.round(3), axis=0).mean(axis=0)
    return lines


def union(spans: Iterable[tuple[float, float]], gap: float) -> list[tuple[float, float]]:
    """Return the union of intervals, joined over gaps up to `gap`."""
    out: list[tuple[float, float]] = []
    for low, high in sorted(spans):
        if out and low <= out[-1][1] + gap:
            out[-1] = (out[-1][0], max(out[-1][1], high))
        else:
            out.append((low, high))
    return out


def covered(low: float, high: float, spans: Sequence[tuple[float, float]]) -> float:
    """Return the share of ``[low, high]`` that a union of disjoint intervals covers."""
    common = sum(max(0.0, min(high, b) - max(low, a)) for a, b in spans)
    return common / (high - low) if high > low else 0.0


def divide(low: float, high: float) -> list[tuple[float, float]]:
    """Divide a bore or pin longer than one pitch into equal stretches of about one pitch."""
    count = max(1, round((high - low) / PITCH_LDU))
    cuts = np.linspace(low, high, count + 1)
    return [(float(a), float(b)) for a, b in pairwise(cuts)]
