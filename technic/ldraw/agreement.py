"""Comparing two lists of ports of one part, and naming what differs."""

from __future__ import annotations

from collections.abc import Callable, Iterable
from dataclasses import dataclass
from enum import StrEnum
from typing import Final

import numpy as np

from technic.parts.definition import Port, PortKind
from technic.units import LDU

__all__ = ["Cause", "Difference", "differences"]

POSITION: Final = 1.05 * LDU
"""Two ports are at one place when their middles are closer than this: whether a counterbore (2 LDU)
at one end is counted moves the middle by 1 LDU."""

LENGTH: Final = 2.1 * LDU
"""And as long when they differ by less than this, for the same reason."""

COMPARED: Final = frozenset(
    {
        PortKind.PIN_HOLE,
        PortKind.AXLE_HOLE,
        PortKind.PIN,
        PortKind.AXLE,
        PortKind.BALL,
        PortKind.SOCKET,
        PortKind.STUD,
    }
)
"""Stops are nothing that another part fits, and tubes are described in two ways: the tube itself, or
the places of the studs around it."""


class Cause(StrEnum):
    """How two lists of ports can differ at a place."""

    EXTENT = "other extent or position on the same line"
    KIND = "other kind at the same place"
    FIRST = "only in the first"
    SECOND = "only in the second"


@dataclass(frozen=True, slots=True)
class Difference:
    """One difference: its cause, and the ports concerned."""

    cause: Cause
    first: Port | None
    second: Port | None

    def __str__(self) -> str:
        """Return the difference in one line."""
        return f"{self.cause}: {_text(self.first)} / {_text(self.second)}"


def _text(port: Port | None) -> str:
    if port is None:
        return "-"
    x, y, z = (port.position / LDU).round(1) + 0.0
    a, b, c = port.axis.round(2) + 0.0
    return f"{port.kind} at ({x:g}, {y:g}, {z:g}) along ({a:g}, {b:g}, {c:g}), {port.length / LDU:.3g} LDU"


def differences(
    first: Iterable[Port],
    second: Iterable[Port],
    kinds: frozenset[PortKind] = COMPARED,
) -> tuple[Difference, ...]:
    """Return where two lists of ports differ in kind, position, axis or length.

    Parameters
    ----------
    first, second : iterable of Port
    kinds : frozenset of PortKind, optional
        Kinds that are compared.

    Returns
    -------
    tuple of Difference
        Empty when the lists agree.
    """
    left = [port for port in first if port.kind in kinds]
    right = [port for port in second if port.kind in kinds]
    _pair_off(left, right, _same)
    out = [Difference(Cause.EXTENT, a, b) for a, b in _pair_off(left, right, _same_line)]
    out += [Difference(Cause.KIND, a, b) for a, b in _pair_off(left, right, _same_place)]
    out += [Difference(Cause.FIRST, port, None) for port in left]
    out += [Difference(Cause.SECOND, None, port) for port in right]
    return tuple(out)


def _pair_off(
    left: list[Port], right: list[Port], match: Callable[[Port, Port], bool]
) -> list[tuple[Port, Port]]:
    """Take matching pairs out of both lists, and return them."""
    pairs = []
    for a in list(left):
        for b in right:
            if match(a, b):
                pairs.append((a, b))
                left.remove(a)
                right.remove(b)
                break
    return pairs


def _same(a: Port, b: Port) -> bool:
    if a.kind is not b.kind or float(np.linalg.norm(a.position - b.position)) >= POSITION:
        return False
    if a.kind in (PortKind.BALL, PortKind.SOCKET):
        return True
    return _parallel(a, b) and abs(a.length - b.length) < LENGTH


def _same_line(a: Port, b: Port) -> bool:
    apart = a.position - b.position
    off = float(np.linalg.norm(apart - (apart @ b.axis) * b.axis))
    reach = (a.length + b.length) / 2.0
    along = abs(float(apart @ b.axis))
    return a.kind is b.kind and _parallel(a, b) and off < POSITION and along < reach


def _same_place(a: Port, b: Port) -> bool:
    return float(np.linalg.norm(a.position - b.position)) < (a.length + b.length) / 2.0


def _parallel(a: Port, b: Port) -> bool:
    return abs(float(a.axis @ b.axis)) > 0.999
