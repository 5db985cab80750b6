"""From pieces of bores and shafts to the ports of a part.

The pieces, whatever they were read from, are merged along each line into whole features, divided into
lengths of one pitch, and named. All lengths are in LDU, in part coordinates; only `to_ports` goes over
to metres.
"""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass
from itertools import pairwise, product
from typing import Final

import numpy as np

from technic.geometry import Array
from technic.ldraw.pieces import (
    JOIN,
    PITCH_LDU,
    Line,
    Piece,
    PieceKind,
    canonical,
    covered,
    divide,
    lines_of,
    union,
)
from technic.parts.definition import Port, PortKind
from technic.units import LDU

__all__ = ["Feature", "build_features", "to_ports"]

AXLE_NOTCH: Final = 4.0
"""Longest notch in an axle (3 LDU in 32062)."""


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


def _pin_holes(line: Line) -> list[tuple[float, float]]:
    """Return the pin holes on a line, before division."""
    whole = line.stretches(PieceKind.HOLE)
    mouths = [
        (low, high, along)
        for piece, low, high, along in line.spans
        if piece.kind is PieceKind.MOUTH
    ]
    walls = line.rounded(PieceKind.WALL, 0.7)
    drawn = _raw_mouths(line, walls)
    mouths += drawn
    opening = [low for low, _, along in mouths if along] + [low for low, _ in whole]
    closing = [high for _, high, along in mouths if not along] + [high for _, high in whole]
    solid = whole + walls + [(low, high) for low, high, _ in mouths]
    # two mouths that face each other belong together when at most a pitch lies between them:
    # the wall may be raw polygons where another bore crosses
    for low in opening:
        later = [high for high in closing if low < high <= low + PITCH_LDU + JOIN]
        if later and not any(low + JOIN < other < min(later) for other in opening):
            solid.append((low, min(later)))
    tubes = line.stretches(PieceKind.TUBE_WALL)
    out = []
    for low, high in union(solid + (tubes if walls else []), JOIN):
        # a bore ends where one hole's mouth meets the next one's
        inner = {
            round(s, 2)
            for s in opening
            if low + 3.0 < s < high - 3.0 and any(abs(s - c) < JOIN for c in closing)
        }
        cuts = [low, *sorted(inner), high]
        for a, b in pairwise(cuts):
            opens = any(abs(s - a) < JOIN for s in opening)
            closes = any(abs(s - b) < JOIN for s in closing)
            if opens or closes:
                raw = any(abs(low - a) < JOIN or abs(high - b) < JOIN for low, high, _ in drawn)
                out.append(_nominal(a, b, opens, closes, half=not raw))
            elif b - a >= MIN_RAW_BORE and covered(a, b, walls) > 0.0:
                out.append((a, b))
    return out


def _raw_mouths(line: Line, walls: list[tuple[float, float]]) -> list[tuple[float, float, bool]]:
    """Return counterbores drawn without their primitive: any arc of one in front of a bore."""
    out = []
    for low, high in line.rounded(PieceKind.SOCKET_WALL, 0.1):
        if high - low > MAX_LIP:
            continue
        if any(abs(high - start) < JOIN for start, _ in walls):
            out.append((low, high, True))
        if any(abs(low - end) < JOIN for _, end in walls):
            out.append((low, high, False))
    return out


def _nominal(low: float, high: float, opens: bool, closes: bool, half: bool) -> tuple[float, float]:
    """Return a hole with one mouth in its nominal length, measured from that mouth.

    Behind its wall such a hole opens into a recess of any depth, or ends blind; what a pin fills is
    half a pitch (when `half`: a plate has only 8 of those 10 LDU) or whole ones.
    """
    if opens and closes:
        return low, high
    length = high - low
    step = PITCH_LDU / 2.0
    steps = max(1, round(length / step))
    if abs(length - steps * step) <= NOMINAL_SLACK and (steps % 2 == 0 or (steps == 1 and half)):
        length = steps * step
    return (low, low + length) if opens else (high - length, high)


NOMINAL_SLACK: Final = 2.5
"""A hole with one mouth is taken for a nominal one when its wall is at most this much shorter or longer
(LDU): the missing counterbore has 2."""

MIN_RAW_BORE: Final = 7.8
"""Shortest round bore without a hole primitive that counts as a pin hole: some plates draw 6 of their
8 LDU, recesses for studs and collars have 2 to 5."""


def _axle_features(line: Line) -> list[Feature]:
    """Return axles and axle holes on a line; the sides of a cross are told apart by neighbours.

    Sides alone, with no end in sight, are a rod of cross-shaped section between other shapes.
    """
    holes = line.stretches(PieceKind.AXLE_HOLE)
    axles = line.stretches(PieceKind.AXLE)
    sides = [
        (low, high, piece.inward)
        for piece, low, high, _ in line.spans
        if piece.kind is PieceKind.AXLE_PERIMETER
    ]
    runs = union([(low, high) for low, high, _ in sides] + axles, AXLE_NOTCH)
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
    # a round rim in front of the cross belongs to the hole
    rims = line.stretches(PieceKind.WALL, PieceKind.SOCKET_WALL, PieceKind.MOUTH)
    rims = [(low, high) for low, high in rims if high - low <= MAX_LIP]
    holes = union(holes, JOIN)
    for low, high in rims:
        if any(abs(low - b) < JOIN or abs(high - a) < JOIN for a, b in holes):
            holes.append((low, high))
    out = []
    for low, high in union(holes, JOIN):
        for a, b in divide(low, high):
            out.append(Feature(PortKind.AXLE_HOLE, line.at(a), line.at(b)))
    # round stops and sleeves between cross-shaped stretches belong to one axle
    for low, high in line.rounded(PieceKind.SHANK, 0.7) + line.rounded(PieceKind.COLLAR, 0.7):
        before = any(a < low and abs(b - low) < AXLE_NOTCH for a, b in axles)
        after = any(b > high and abs(a - high) < AXLE_NOTCH for a, b in axles)
        if before and after:
            axles.append((low, high))
    for low, high in union(axles, AXLE_NOTCH):
        if high - low < JOIN:
            # the end face of an axle drawn alone, at the bottom of a hole
            continue
        out.append(Feature(PortKind.AXLE, line.at(low), line.at(high)))
        for a, b in line.rounded(PieceKind.COLLAR, 0.9):
            # a collar belongs to the axle it touches; a long one is a hub, not a stop
            if b - a <= MAX_STOP and a <= high + JOIN and b >= low - JOIN:
                out.append(Feature(PortKind.STOP, line.at(a), line.at(b)))
    return out


MAX_STOP: Final = 8.0
"""Longest collar that is called a stop."""


def _pins(line: Line) -> list[Feature]:
    """Return the pins on a line, long ones divided.

    A pin is drawn as tips with whatever lies between them; so a run of pins, round shank and collars
    that begins with a tip, and measures whole pitches, is divided from that tip on.
    """
    pins = [
        (low, high, along, piece.kind is PieceKind.PIN_FRICTION)
        for piece, low, high, along in line.spans
        if piece.kind in (PieceKind.PIN, PieceKind.PIN_FRICTION)
    ]
    round_ = line.rounded(PieceKind.SHANK, 0.5)
    round_ += [
        (low, high) for low, high in line.rounded(PieceKind.COLLAR, 0.5) if high - low <= MAX_COLLAR
    ]
    pins += _raw_pins(line, pins, round_)
    if not pins:
        return []
    ribs = [(low + high) / 2.0 for low, high in line.stretches(PieceKind.RIB)]
    solid = [(low, high) for low, high, _, _ in pins] + round_
    out = []
    for low, high in union(solid, JOIN):
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
                (a, b, last and (not first or a + b > low + high)) for a, b in divide(low, high)
            ]
        else:
            for a, b, along, _ in own:
                for c, d in divide(a, b):
                    if not any(abs(c - e) < JOIN and abs(d - f) < JOIN for e, f, _ in cuts):
                        cuts.append((c, d, along))
        for a, b, along in cuts:
            rough = any(rubbed and c < b - JOIN and d > a + JOIN for c, d, _, rubbed in own)
            rough = rough or any(a < s < b for s in ribs)
            start, end = (a, b) if along else (b, a)
            out.append(Feature(PortKind.PIN, line.at(start), line.at(end), rough))
    return out


def _raw_pins(
    line: Line, known: list[tuple[float, float, bool, bool]], round_: list[tuple[float, float]]
) -> list[tuple[float, float, bool, bool]]:
    """Return pins drawn without their primitive: a round shank of a pitch that ends in a lip."""
    out = []
    shanks = union(round_, JOIN)
    for low, high in line.rounded(PieceKind.LATCH, 0.5):
        for tip, inner, sign in ((high, low, 1.0), (low, high, -1.0)):
            a, b = sorted((tip - sign * PITCH_LDU, inner))
            taken = any(c - JOIN < tip < d + JOIN for c, d, _, _ in known)
            if high - low <= MAX_LIP and not taken and covered(a, b, shanks) > SHANK_SHARE:
                out.append(
                    (
                        min(tip, tip - sign * PITCH_LDU),
                        max(tip, tip - sign * PITCH_LDU),
                        sign > 0.0,
                        False,
                    )
                )
    return out


MAX_LIP: Final = 2.6
"""Longest lip at a pin's tip, and deepest counterbore (LDU)."""

SHANK_SHARE: Final = 0.7
"""Least share of a pin's length that must be round shank (slits and collars take the rest)."""

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
    # baseplates have thousands of studs: only what lies in neighbouring cells is compared
    cells: dict[tuple[int, ...], list[Feature]] = {}
    for piece in pieces:
        kind = kinds.get(piece.kind)
        if kind is None:
            continue
        feature = Feature(kind, piece.start, piece.end)
        round_ = kind in (PortKind.BALL, PortKind.SOCKET)
        i, j, k = (int(x) for x in np.floor(feature.middle / JOIN))
        near = (
            other
            for di, dj, dk in product((-1, 0, 1), repeat=3)
            for other in cells.get((i + di, j + dj, k + dk), ())
        )
        if not any(
            other.kind is kind
            and np.linalg.norm(other.middle - feature.middle) < JOIN
            and (round_ or abs(other.length - feature.length) < JOIN)
            for other in near
        ):
            out.append(feature)
            cells.setdefault((i, j, k), []).append(feature)
    return out


def _sockets(line: Line) -> list[Feature]:
    """Return the sockets of tow balls: short round cups, some with slots at the sides."""
    rims = line.rounded(PieceKind.SOCKET_RIM, 0.5)
    out = []
    for low, high in union(line.rounded(PieceKind.SOCKET_WALL, 0.5), JOIN):
        length = high - low
        if CUP[0] <= length <= CUP[1] and covered(low, high, rims) > 0.7:
            middle, half = (low + high) / 2.0, BALL_DIAMETER / 2.0
            out.append(Feature(PortKind.SOCKET, line.at(middle - half), line.at(middle + half)))
    return out


CUP: Final = (9.0, 14.0)
"""Depth of a tow ball's socket (LDU)."""

BALL_DIAMETER: Final = 16.0


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
    for line in lines_of(piece for piece in pieces if piece.kind not in point_kinds):
        axial = _axle_features(line)
        taken = union(
            [
                (float(line.direction @ f.start), float(line.direction @ f.end))
                for f in axial
                if f.kind in (PortKind.AXLE_HOLE, PortKind.AXLE)
            ],
            JOIN,
        )
        out += axial + _pins(line)
        holes = _pin_holes(line)
        if not holes and not taken:
            out += _sockets(line)
        for low, high in holes:
            # the round outline of a cross-shaped hole is no pin hole
            if covered(low, high, taken) > 0.5:
                continue
            for a, b in divide(low, high):
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
                axis = canonical(axis)
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
