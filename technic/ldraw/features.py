"""From pieces of bores and shafts to the ports of a part.

Part files build one hole from several pieces (two ends and a wall, quarters, mirrored halves) and one
axle from several lengths. Here the pieces, whatever they were read from, are put on common lines,
merged along each line, divided into lengths of one pitch, and named. All lengths are in LDU, in part
coordinates; only `to_ports` goes over to metres.
"""

from __future__ import annotations

from collections import defaultdict
from collections.abc import Iterable, Sequence
from dataclasses import dataclass
from enum import StrEnum
from typing import Final

import numpy as np

from technic.geometry import Array
from technic.parts.definition import Port, PortKind
from technic.units import LDU

__all__ = ["Feature", "Piece", "PieceKind", "build_features", "to_ports"]

PITCH_LDU: Final = 20.0

SAME_LINE: Final = 1.0
"""Pieces lie on one line when they are closer than this (LDU): part files round to 0.01, posed
subfiles to 0.1, and mirrored quarters of one hole are up to 0.6 apart. Different holes are not closer
than 8."""

JOIN: Final = 1.0
"""Pieces of one bore or shaft touch or overlap; chamfers and edges leave gaps of at most this."""

AXLE_NOTCH: Final = 4.0
"""Longest notch in an axle (3 LDU in 32062)."""


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
    RIB = "rib"
    """A friction ridge: the pin around it is one with friction."""
    COLLAR = "collar"
    """A cylinder wider than a bore seen from outside."""
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


@dataclass(frozen=True, slots=True, eq=False)
class Feature:
    """A whole feature: kind, ends (LDU), and for pins whether it has friction ridges."""

    kind: PortKind
    start: Array
    end: Array
    friction: bool = False

    @property
    def middle(self) -> Array:
        """Middle of the feature, (3,)."""
        return np.asarray((self.start + self.end) / 2.0)

    @property
    def length(self) -> float:
        """Extent along the axis."""
        return float(np.linalg.norm(self.end - self.start))


def _canonical(direction: Array) -> Array:
    """Return the direction or its opposite, so that its first significant component is positive."""
    first = next(value for value in direction if abs(value) > 1e-3)
    return direction if first > 0.0 else -direction


@dataclass(slots=True)
class _Line:
    """A line with the pieces on it; `spans` are (piece, low, high, points along the line)."""

    direction: Array
    foot: Array
    spans: list[tuple[Piece, float, float, bool]]

    def at(self, s: float) -> Array:
        return np.asarray(self.foot + s * self.direction)


def _lines(pieces: Iterable[Piece]) -> list[_Line]:
    """Sort pieces onto common lines."""
    lines: list[_Line] = []
    buckets: dict[tuple[int, ...], list[_Line]] = defaultdict(list)
    for piece in pieces:
        vector = piece.end - piece.start
        length = float(np.linalg.norm(vector))
        if length < 1e-6:
            continue
        direction = _canonical(vector / length)
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
            found = _Line(direction, foot, [])
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


def _union(spans: Iterable[tuple[float, float]], gap: float) -> list[tuple[float, float]]:
    """Return the union of intervals, joined over gaps up to `gap`."""
    out: list[tuple[float, float]] = []
    for low, high in sorted(spans):
        if out and low <= out[-1][1] + gap:
            out[-1] = (out[-1][0], max(out[-1][1], high))
        else:
            out.append((low, high))
    return out


def _covered(low: float, high: float, spans: Sequence[tuple[float, float]]) -> float:
    """Return the share of ``[low, high]`` that a union of disjoint intervals covers."""
    common = sum(max(0.0, min(high, b) - max(low, a)) for a, b in spans)
    return common / (high - low) if high > low else 0.0


def _rounded_walls(line: _Line, kind: PieceKind, least: float) -> list[tuple[float, float]]:
    """Return where arcs of a cylinder together cover at least `least` of the full circle."""
    arcs = [(low, high, piece.share) for piece, low, high, _ in line.spans if piece.kind is kind]
    cuts = sorted({round(s, 3) for low, high, _ in arcs for s in (low, high)})
    kept = []
    for low, high in zip(cuts, cuts[1:], strict=False):
        middle = (low + high) / 2.0
        if sum(share for a, b, share in arcs if a < middle < b) >= least - 1e-9:
            kept.append((low, high))
    return _union(kept, 1e-3)


def _divide(low: float, high: float) -> list[tuple[float, float]]:
    """Divide a bore or pin longer than one pitch into equal stretches of about one pitch."""
    count = max(1, round((high - low) / PITCH_LDU))
    cuts = np.linspace(low, high, count + 1)
    return [(float(a), float(b)) for a, b in zip(cuts, cuts[1:], strict=False)]


def _spans(line: _Line, *kinds: PieceKind) -> list[tuple[float, float]]:
    return [(low, high) for piece, low, high, _ in line.spans if piece.kind in kinds]


def _pin_holes(line: _Line) -> list[tuple[float, float]]:
    """Return the pin holes on a line, before division."""
    whole = _spans(line, PieceKind.HOLE)
    mouths = [
        (low, high, along)
        for piece, low, high, along in line.spans
        if piece.kind is PieceKind.MOUTH
    ]
    walls = _rounded_walls(line, PieceKind.WALL, 0.7)
    opening = [low for low, _, along in mouths if along] + [low for low, _ in whole]
    closing = [high for _, high, along in mouths if not along] + [high for _, high in whole]
    solid = whole + walls + [(low, high) for low, high, _ in mouths]
    # two mouths that face each other belong together when at most a pitch lies between them:
    # the wall may be raw polygons where another bore crosses
    for low in opening:
        later = [high for high in closing if low < high <= low + PITCH_LDU + JOIN]
        if later and not any(low + JOIN < other < min(later) for other in opening):
            solid.append((low, min(later)))
    tubes = _spans(line, PieceKind.TUBE_WALL)
    out = []
    for low, high in _union(solid + (tubes if walls else []), JOIN):
        # a bore ends where one hole's mouth meets the next one's
        inner = {
            round(s, 2)
            for s in opening
            if low + 3.0 < s < high - 3.0 and any(abs(s - c) < JOIN for c in closing)
        }
        cuts = [low, *sorted(inner), high]
        for a, b in zip(cuts, cuts[1:], strict=False):
            opens = any(abs(s - a) < JOIN for s in opening)
            closes = any(abs(s - b) < JOIN for s in closing)
            if opens or closes:
                out.append(_nominal(a, b, opens, closes))
            elif b - a >= MIN_RAW_BORE and _covered(a, b, walls) > 0.0:
                out.append((a, b))
    return out


def _nominal(low: float, high: float, opens: bool, closes: bool) -> tuple[float, float]:
    """Return a hole with one mouth in its nominal length, measured from that mouth.

    Behind its wall such a hole opens into a recess of any depth, or ends blind; what a pin fills is
    half a pitch or whole ones.
    """
    if opens and closes:
        return low, high
    length = high - low
    half = PITCH_LDU / 2.0
    steps = max(1, round(length / half))
    if abs(length - steps * half) <= NOMINAL_SLACK and (steps == 1 or steps % 2 == 0):
        length = steps * half
    return (low, low + length) if opens else (high - length, high)


NOMINAL_SLACK: Final = 2.5
"""A hole with one mouth is taken for a nominal one when its wall is at most this much shorter or longer
(LDU): the missing counterbore has 2."""

MIN_RAW_BORE: Final = 6.0
"""Shortest round bore without a hole primitive that counts as a pin hole: plates have 8 LDU, recesses
for studs and collars 2 to 5."""


def _axle_features(line: _Line) -> list[Feature]:
    """Return axles and axle holes on a line; the sides of a cross are told apart by neighbours.

    Sides alone, with no end in sight, are a rod of cross-shaped section between other shapes.
    """
    holes = _spans(line, PieceKind.AXLE_HOLE)
    axles = _spans(line, PieceKind.AXLE)
    sides = [
        (low, high, piece.inward)
        for piece, low, high, _ in line.spans
        if piece.kind is PieceKind.AXLE_PERIMETER
    ]
    runs = _union([(low, high) for low, high, _ in sides] + axles, AXLE_NOTCH)
    for low, high, inward in sides:
        near_axle = any(
            a <= low and high <= b and any(a <= c and d <= b for c, d in axles) for a, b in runs
        )
        near_hole = any(a <= high + JOIN and b >= low - JOIN for a, b in holes)
        if near_hole and (inward or not near_axle):
            holes.append((low, high))
        elif near_axle:
            axles.append((low, high))
        elif inward:
            holes.append((low, high))
    out = []
    for low, high in _union(holes, JOIN):
        for a, b in _divide(low, high):
            out.append(Feature(PortKind.AXLE_HOLE, line.at(a), line.at(b)))
    for low, high in _union(axles, AXLE_NOTCH):
        out.append(Feature(PortKind.AXLE, line.at(low), line.at(high)))
        for a, b in _rounded_walls(line, PieceKind.COLLAR, 0.9):
            # a collar belongs to the axle it touches; a long one is a hub, not a stop
            if b - a <= MAX_STOP and a <= high + JOIN and b >= low - JOIN:
                out.append(Feature(PortKind.STOP, line.at(a), line.at(b)))
    return out


MAX_STOP: Final = 8.0
"""Longest collar that is called a stop."""


def _pins(line: _Line) -> list[Feature]:
    """Return the pins on a line, long ones divided.

    A pin is drawn as tips with whatever lies between them; so a run of pins, round shank and collars
    that begins with a tip, and measures whole pitches, is divided from that tip on.
    """
    pins = [
        (low, high, along, piece.kind is PieceKind.PIN_FRICTION)
        for piece, low, high, along in line.spans
        if piece.kind in (PieceKind.PIN, PieceKind.PIN_FRICTION)
    ]
    if not pins:
        return []
    ribs = [(low + high) / 2.0 for low, high in _spans(line, PieceKind.RIB)]
    collars = _rounded_walls(line, PieceKind.COLLAR, 0.5)
    solid = [(low, high) for low, high, _, _ in pins]
    solid += _rounded_walls(line, PieceKind.SHANK, 0.5)
    solid += [(low, high) for low, high in collars if high - low <= MAX_COLLAR]
    out = []
    for low, high in _union(solid, JOIN):
        own = [pin for pin in pins if low - JOIN < pin[0] and pin[1] < high + JOIN]
        if not own:
            continue
        first = any(not along and a < low + JOIN for a, _, along, _ in own)
        last = any(along and b > high - JOIN for _, b, along, _ in own)
        steps = round((high - low) / PITCH_LDU)
        whole = steps >= 1 and abs(high - low - steps * PITCH_LDU) <= NOMINAL_SLACK
        cuts: list[tuple[float, float, bool]] = []
        if whole and (first or last):
            if first and not last:
                high = low + steps * PITCH_LDU
            elif last and not first:
                low = high - steps * PITCH_LDU
            cuts = [
                (a, b, last and (not first or a + b > low + high)) for a, b in _divide(low, high)
            ]
        else:
            for a, b, along, _ in own:
                for c, d in _divide(a, b):
                    if not any(abs(c - e) < JOIN and abs(d - f) < JOIN for e, f, _ in cuts):
                        cuts.append((c, d, along))
        for a, b, along in cuts:
            rough = any(rubbed and c < b - JOIN and d > a + JOIN for c, d, _, rubbed in own)
            rough = rough or any(a < s < b for s in ribs)
            start, end = (a, b) if along else (b, a)
            out.append(Feature(PortKind.PIN, line.at(start), line.at(end), rough))
    return out


MAX_COLLAR: Final = 4.5
"""Longest collar within a pin (LDU): the two halves of the one in the middle."""


def _points(pieces: Iterable[Piece]) -> list[Feature]:
    """Return studs, tubes, balls and sockets, each once."""
    kinds = {
        PieceKind.STUD: PortKind.STUD,
        PieceKind.TUBE: PortKind.TUBE,
        PieceKind.BALL: PortKind.BALL,
        PieceKind.SOCKET: PortKind.SOCKET,
    }
    out: list[Feature] = []
    for piece in pieces:
        kind = kinds.get(piece.kind)
        if kind is None:
            continue
        feature = Feature(kind, piece.start, piece.end)
        round_ = kind in (PortKind.BALL, PortKind.SOCKET)
        if not any(
            other.kind is kind
            and np.linalg.norm(other.middle - feature.middle) < JOIN
            and (round_ or abs(other.length - feature.length) < JOIN)
            for other in out
        ):
            out.append(feature)
    return out


def build_features(pieces: Iterable[Piece]) -> tuple[Feature, ...]:
    """Merge pieces into whole features.

    Parameters
    ----------
    pieces : iterable of Piece

    Returns
    -------
    tuple of Feature
        Long bores and pins divided into lengths of about one pitch.
    """
    pieces = list(pieces)
    point_kinds = (PieceKind.STUD, PieceKind.TUBE, PieceKind.BALL, PieceKind.SOCKET)
    out = _points(pieces)
    for line in _lines(piece for piece in pieces if piece.kind not in point_kinds):
        axial = _axle_features(line)
        taken = _union(
            [
                (float(line.direction @ f.start), float(line.direction @ f.end))
                for f in axial
                if f.kind in (PortKind.AXLE_HOLE, PortKind.AXLE)
            ],
            JOIN,
        )
        out += axial + _pins(line)
        for low, high in _pin_holes(line):
            # the round outline of a cross-shaped hole is no pin hole
            if _covered(low, high, taken) > 0.5:
                continue
            for a, b in _divide(low, high):
                out.append(Feature(PortKind.PIN_HOLE, line.at(a), line.at(b)))
    return tuple(out)


_NAMES: Final[dict[PortKind, str]] = {
    PortKind.PIN_HOLE: "hole",
    PortKind.AXLE_HOLE: "axlehole",
    PortKind.SOCKET: "socket",
    PortKind.TUBE: "tube",
    PortKind.PIN: "pin",
    PortKind.AXLE: "axle",
    PortKind.BALL: "ball",
    PortKind.STUD: "stud",
    PortKind.STOP: "stop",
}


def to_ports(features: Iterable[Feature]) -> tuple[Port, ...]:
    """Return features as ports: in metres, ordered by kind and position, named ``hole1`` and so on."""

    def order(feature: Feature) -> tuple[float, ...]:
        middle = feature.middle.round(2) + 0.0
        axis = ((feature.end - feature.start) / max(feature.length, 1e-9)).round(3) + 0.0
        return (*middle, *axis)

    features = tuple(features)
    ports = []
    for kind, name in _NAMES.items():
        chosen = sorted((f for f in features if f.kind is kind), key=order)
        for number, feature in enumerate(chosen, start=1):
            axis = feature.end - feature.start
            if kind in (PortKind.PIN_HOLE, PortKind.AXLE_HOLE, PortKind.AXLE, PortKind.STOP):
                axis = _canonical(axis)
            ports.append(
                Port(
                    f"{name}{number}",
                    kind,
                    (feature.middle.round(6) + 0.0) * LDU,
                    (axis / feature.length).round(9) + 0.0,
                    round(feature.length, 6) * LDU,
                    feature.friction,
                )
            )
    return tuple(ports)
