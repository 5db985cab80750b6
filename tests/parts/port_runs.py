"""Ports reduced to what can be compared: runs of material along lines."""

from __future__ import annotations

from collections.abc import Iterable

import numpy as np

from technic.parts.definition import Port, PortKind
from technic.units import LDU

__all__ = ["runs"]

ROUND = 0.05
"""LDU; LDraw gives slanted directions to four digits, so positions differ in the second decimal."""

LETTERS: dict[tuple[float, ...], str] = {
    (1.0, 0.0, 0.0): "x",
    (0.0, 1.0, 0.0): "y",
    (0.0, 0.0, 1.0): "z",
}
DIRECTED = (PortKind.STUD,)
DIVIDED = (PortKind.PIN, PortKind.PIN_HOLE, PortKind.AXLE_HOLE)
ROUND_KINDS = (PortKind.BALL, PortKind.SOCKET)


def _number(value: float) -> str:
    return f"{round(value / ROUND) * ROUND + 0.0:g}"


def runs(ports: Iterable[Port]) -> list[str]:
    """Return one line of text per uninterrupted feature, sorted.

    Ports of one kind that continue each other on one line are one run: a pin of three ports of one
    pitch reads like a pin of sixty units. The sign of an axis is kept for studs only, balls and sockets
    have none.
    """
    lines: dict[tuple[str, tuple[float, ...], tuple[str, ...]], list[tuple[float, float]]] = {}
    out: list[str] = []
    for port in ports:
        word = "friction_pin" if port.friction else port.kind.value
        place = port.position / LDU
        if port.kind in ROUND_KINDS:
            out.append(f"{word} {' '.join(_number(c) for c in place)} {_number(port.length / LDU)}")
            continue
        axis = np.round(port.axis, 3) + 0.0
        if port.kind not in DIRECTED and axis[np.nonzero(axis)[0][0]] < 0:
            axis = -axis + 0.0
        along = float(place @ axis / (axis @ axis))
        foot = tuple(_number(c) for c in place - along * axis)
        half = port.length / LDU / 2
        lines.setdefault((word, tuple(axis.tolist()), foot), []).append(
            (along - half, along + half)
        )
    for (word, axis_key, foot), spans in lines.items():
        axis = np.array(axis_key)
        base = np.array([float(c) for c in foot])
        joined: list[list[float]] = []
        for low, high in sorted(spans):
            if joined and low <= joined[-1][1] + 2 * ROUND and word not in ("stud", "tube"):
                joined[-1][1] = max(joined[-1][1], high)
            else:
                joined.append([low, high])
        name = LETTERS.get(axis_key) or ",".join(f"{c:g}" for c in axis)
        for low, high in joined:
            middle = base + (low + high) / 2 * axis
            numbers = " ".join(_number(c) for c in middle)
            out.append(f"{word} {name} {numbers} {_number(high - low)}")
    return sorted(out)
