"""What the shapes of an LDCad shadow library mean for LEGO parts: pieces of bores and shafts."""

from __future__ import annotations

from typing import Final

import numpy as np

from technic.ldraw.pieces import Piece, PieceKind
from technic.ldraw.shadow import Snap

__all__ = ["pieces_of"]

PIN_RADIUS: Final = 6.0

COUNTERBORE: Final = 2.0
"""Depth of a counterbore, height of half a collar, length of a latch (LDU)."""

SHORT_SHAFT: Final = 5.5
"""A round section shorter than this beside a pin is a stud (LDU)."""


_Span = tuple[str, float, float, float]


def _cylinder_pieces(snap: Snap) -> list[Piece]:
    """Return what a cylinder snap means for LEGO parts."""
    total = sum(length for _, _, length in snap.sections)
    # sections grow from the base along -y
    position = total / 2.0 if snap.centered else 0.0
    spans: list[_Span] = []
    for shape, radius, length in snap.sections:
        spans.append((shape, radius, position, position - length))
        position -= length
    found = _male(snap, spans, total) if snap.male else _female(snap, spans, total)
    axis = snap.matrix[:, 1]
    return [Piece(kind, snap.offset + a * axis, snap.offset + b * axis) for kind, a, b in found]


def _is_pin(span: _Span) -> bool:
    return span[0] == "R" and abs(span[1] - PIN_RADIUS) < 0.6


def _is_counterbore(span: _Span) -> bool:
    return span[0] == "R" and span[1] > 7.0 and abs(span[3] - span[2]) <= 2.0 * COUNTERBORE + 1e-6


def _short_and_closed(snap: Snap, total: float) -> bool:
    """Tell a stud or what takes one from a pin or its hole."""
    return len(snap.sections) == 1 and total <= 5.5 and not snap.slide and snap.closed != "none"


def _female(snap: Snap, spans: list[_Span], total: float) -> list[tuple[PieceKind, float, float]]:
    if all(span[0] == "S" for span in spans):
        square = abs(spans[0][1] - PIN_RADIUS) < 0.6
        return [_tube(snap, spans[0][2], spans[-1][3])] if square else []
    if _is_pin(spans[0]) and _short_and_closed(snap, total):
        return [_tube(snap, spans[0][2], spans[0][3])]
    out = []
    if _is_pin(spans[0]) and abs(spans[0][3] - spans[0][2]) <= SHORT_SHAFT and not snap.slide:
        # room for a stud in front of something narrower
        out.append(_tube(snap, spans[0][2], spans[0][3]))
    for index, span in enumerate(spans):
        shape, _, start, end = span
        beside = spans[max(index - 1, 0) : index + 2]
        if shape == "A":
            out.append((PieceKind.AXLE_HOLE, start, end))
        elif _is_counterbore(span) and any(other[0] == "A" for other in beside):
            out.append((PieceKind.SOCKET_WALL, start, end))
        elif _is_pin(span):
            out.append((PieceKind.WALL, start, end))
            if index and _is_counterbore(spans[index - 1]):
                out.append(_mouth(spans, index - 1, start, index > 1 and _is_pin(spans[index - 2])))
            if index + 1 < len(spans) and _is_counterbore(spans[index + 1]):
                shared = index + 2 < len(spans) and _is_pin(spans[index + 2])
                out.append(_mouth(spans, index + 1, end, shared))
    return out


def _tube(snap: Snap, base: float, top: float) -> tuple[PieceKind, float, float]:
    """Return a socket for a stud, pointing out of its open end."""
    return (PieceKind.TUBE, base, top) if snap.closed == "a" else (PieceKind.TUBE, top, base)


def _mouth(
    spans: list[_Span], index: int, inner: float, shared: bool
) -> tuple[PieceKind, float, float]:
    """Return a counterbore as a mouth; between two holes, half of it."""
    _, _, start, end = spans[index]
    outer = start if abs(end - inner) < abs(start - inner) else end
    length = abs(outer - inner) / (2.0 if shared else 1.0)
    # a longer recess is a clearance in front of the mouth
    length = min(length, COUNTERBORE)
    return PieceKind.MOUTH, inner + np.sign(outer - inner) * length, inner


def _male(snap: Snap, spans: list[_Span], total: float) -> list[tuple[PieceKind, float, float]]:
    out: list[tuple[PieceKind, float, float]] = []
    if _is_pin(spans[0]) and _short_and_closed(snap, total):
        return [(PieceKind.STUD, spans[0][2], spans[0][3])]
    cross = [index for index, span in enumerate(spans) if span[0] == "A"]
    if cross:
        # round stops and sleeves between cross-shaped stretches belong to one axle
        out.append((PieceKind.AXLE, spans[cross[0]][2], spans[cross[-1]][3]))
        for _, radius, start, end in (span for span in spans if span[0] == "R"):
            if 7.0 < radius < 9.5:
                out.append((PieceKind.COLLAR, start, end))
    round_ = [
        index
        for index, span in enumerate(spans)
        if _is_pin(span) and not (cross and cross[0] < index < cross[-1])
    ]
    # the latch of a pin is a flexible section; a shaft without one is no pin
    if not any(span[0] in ("_L", "L_") for span in spans):
        if round_ and round_[-1] == len(spans) - 1:
            _, _, start, end = spans[-1]
            if abs(end - start) <= SHORT_SHAFT:
                out.append((PieceKind.STUD, start, end))
        return out
    for index in round_:
        _, _, start, end = spans[index]
        if abs(end - start) < SHORT_SHAFT:
            # the stud end of a half pin
            out.append((PieceKind.STUD, start, end))
            continue
        if index > 0:
            start += _margin(spans[index - 1], index > 1 and _is_pin(spans[index - 2]))
        if index + 1 < len(spans):
            shared = index + 2 < len(spans) and _is_pin(spans[index + 2])
            end -= _margin(spans[index + 1], shared)
        if index > 0 and spans[index - 1][0] in ("_L", "L_"):
            start, end = end, start
        out.append((PieceKind.PIN, start, end))
    return out


def _margin(span: _Span, shared: bool) -> float:
    """Return how far a pin reaches into the section beside it: its latch or half its collar."""
    length = abs(span[3] - span[2])
    if span[0] in ("_L", "L_") or _is_counterbore(span):
        return min(length / 2.0 if shared else length, COUNTERBORE)
    return 0.0


def _general_pieces(snap: Snap) -> list[Piece]:
    """Return a ball or socket for a spherical general snap."""
    if not snap.bounding or snap.bounding[0] != "sph" or len(snap.bounding) != 2:
        return []
    radius = float(snap.bounding[1])
    # tow balls have 8, the balls of suspension parts 12.7 LDU
    if not any(abs(radius - known) < 0.5 for known in (8.0, 12.8)):
        return []
    axis = snap.matrix[:, 1] / np.linalg.norm(snap.matrix[:, 1])
    kind = PieceKind.BALL if snap.male else PieceKind.SOCKET
    return [Piece(kind, snap.offset + radius * axis, snap.offset - radius * axis)]


def pieces_of(snap: Snap) -> list[Piece]:
    """Return the pieces that a snap stands for; none for fingers, clips and snaps with a group.

    Snaps of a group fit only their own kind: turntable halves, actuator tubes, crane arms.
    """
    if snap.type == "CYL" and not snap.group:
        return _cylinder_pieces(snap)
    if snap.type == "GEN":
        return _general_pieces(snap)
    return []
