"""Which axles can slide out of their round bores, and on which side a stop is missing.

An axle turns and slides in a round bore. It cannot slide when it has a stop in both directions: a
collar of its own, or a part that grips it (bush, gear, pin end in a beam) and that touches a part
around one of its bores, directly or through a stack of touching parts on the same line. The two
stops need not sit at the same bore: bushes usually sit on the far sides of two beams.

Axles that meet in a joiner are one shaft, and share their stops.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from itertools import combinations
from typing import Final

import numpy as np

from technic.geometry import Array
from technic.ldraw.matching import Limits, Mating
from technic.ldraw.placed import PlacedPorts, on_line
from technic.parts.definition import PortKind
from technic.tolerances import COUNTERBORE, TOUCH

__all__ = ["missing_stops"]

_BORE: Final = "axle/pin_hole"
_GRIP: Final = "axle/axle_hole"
_PIN: Final = "pin/pin_hole"
_MATERIAL: Final = frozenset({PortKind.AXLE_HOLE, PortKind.PIN_HOLE, PortKind.STOP})


@dataclass(frozen=True, slots=True)
class _Stretch:
    """A part, or a piece of it, along a shaft: from `low` to `high` (m)."""

    part: int
    low: float
    high: float


def missing_stops(
    placed: PlacedPorts,
    matings: Sequence[Mating],
    *,
    gripped: bool = True,
    limits: Limits | None = None,
) -> dict[int, str]:
    """Return for each mating of an axle with a round bore the side on which a stop is missing.

    Parameters
    ----------
    placed : PlacedPorts
    matings : sequence of Mating
    gripped : bool
        Whether parts with an axle hole stay where they are on the axle. When they may slide, only
        the axle's own collars and pin ends stop it.
    limits : Limits, optional

    Returns
    -------
    dict of int to str
        Index of the mating -> ``""`` (held), ``"+"`` or ``"-"`` (along the mating's axis), ``"both"``.
    """
    limits = limits or Limits()
    missing: dict[int, str] = {}
    for shaft in _shafts(placed, matings, limits, gripped=gripped):
        bores = [k for k in shaft if matings[k].connection == _BORE]
        if not bores:
            continue
        axis = matings[bores[0]].axis
        low, high = _stopped(placed, [matings[k] for k in shaft], axis, limits, gripped=gripped)
        for k in bores:
            along = float(matings[k].axis @ axis) > 0.0
            plus, minus = (high, low) if along else (low, high)
            missing[k] = {
                (True, True): "",
                (True, False): "-",
                (False, True): "+",
                (False, False): "both",
            }[plus, minus]
    return missing


def _shafts(
    placed: PlacedPorts, matings: Sequence[Mating], limits: Limits, *, gripped: bool
) -> list[list[int]]:
    """Return the matings of each shaft: of one axle, or of several on one line that a common part
    grips.
    """
    owner: dict[int, list[int]] = {}
    for k, mating in enumerate(matings):
        if placed.kind[mating.male] == PortKind.AXLE:
            owner.setdefault(mating.male, []).append(k)
    root = {port: port for port in owner}

    def find(port: int) -> int:
        while root[port] != port:
            port = root[port]
        return port

    if gripped:
        grips: dict[int, list[Mating]] = {}
        for mating in matings:
            if mating.connection == _GRIP:
                grips.setdefault(int(placed.part[mating.female]), []).append(mating)
        for group in grips.values():
            for first, second in combinations(group, 2):
                if len(on_line(placed, [second.male], first.point, first.axis, *_pair(limits))):
                    a, b = sorted((find(first.male), find(second.male)))
                    root[b] = a
    shafts: dict[int, list[int]] = {}
    for port, indices in owner.items():
        shafts.setdefault(find(port), []).extend(indices)
    # Pin ends on the same part and line hold an axle pin where it is.
    pins: dict[int, list[int]] = {}
    for k, mating in enumerate(matings):
        if mating.connection == _PIN:
            pins.setdefault(int(placed.part[mating.male]), []).append(k)
    for indices in shafts.values():
        line = matings[indices[0]]
        for axle in sorted({int(placed.part[matings[k].male]) for k in indices}):
            for k in pins.get(axle, []):
                male = matings[k].male
                if len(on_line(placed, [male], line.point, line.axis, *_pair(limits))):
                    indices.append(k)
    return [sorted(indices) for _, indices in sorted(shafts.items())]


def _pair(limits: Limits) -> tuple[float, float]:
    return limits.offset, limits.angle


def _stopped(
    placed: PlacedPorts, shaft: Sequence[Mating], axis: Array, limits: Limits, *, gripped: bool
) -> tuple[bool, bool]:
    """Return whether the shaft has a stop on the low side and on the high side of its bores."""
    point = shaft[0].point
    bores: list[_Stretch] = []
    stops: list[_Stretch] = []
    axles = sorted({int(placed.part[mating.male]) for mating in shaft})
    for part in axles:
        stops += _stretches(placed, part, point, axis, limits, frozenset({PortKind.STOP}))
    around: dict[int, bool] = {}
    for mating in shaft:
        part = int(placed.part[mating.female])
        fixed = mating.connection == _PIN or (mating.connection == _GRIP and gripped)
        around[part] = around.get(part, False) or fixed
    for part, fixed in around.items():
        if part not in axles:
            (stops if fixed else bores).extend(
                _stretches(placed, part, point, axis, limits, _MATERIAL)
            )
    mirrored = [_Stretch(s.part, -s.high, -s.low) for s in stops]
    return (
        _blocked([_Stretch(b.part, -b.high, -b.low) for b in bores], mirrored),
        _blocked(bores, stops),
    )


def _stretches(
    placed: PlacedPorts,
    part: int,
    point: Array,
    axis: Array,
    limits: Limits,
    kinds: frozenset[PortKind],
) -> list[_Stretch]:
    """Return the extents of a part's features on a line, touching ones merged."""
    chosen = [k for k in placed.of_part(part) if placed.kind[k] in kinds]
    index = on_line(placed, chosen, point, axis, *_pair(limits))
    middle = (placed.position[index] - point) @ axis
    half = placed.half[index]
    merged: list[_Stretch] = []
    for k in np.argsort(middle - half, kind="stable"):
        low, high = float(middle[k] - half[k]), float(middle[k] + half[k])
        if merged and low <= merged[-1].high + TOUCH:
            merged[-1] = _Stretch(part, merged[-1].low, max(merged[-1].high, high))
        else:
            merged.append(_Stretch(part, low, high))
    return merged


def _blocked(bores: Sequence[_Stretch], stops: Sequence[_Stretch]) -> bool:
    """Return whether some part around a bore has a stop above it."""

    def touches(lower: _Stretch, upper: _Stretch) -> bool:
        # A collar may sit inside the counterbore of the hole that it stops at, flush with its face.
        gap = upper.low - lower.high
        above = upper.low + upper.high > lower.low + lower.high
        return -COUNTERBORE - TOUCH <= gap <= TOUCH and above

    # Every member of a stack is a part around a bore of this shaft, so a stack that ends at a stop
    # has a member that touches it: one look at the neighbours covers stacks of any height.
    return any(touches(bore, stop) for bore in bores for stop in stops if bore.part != stop.part)
