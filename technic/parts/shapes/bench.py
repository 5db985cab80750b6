"""What a builder works with: the definition's bores in LDU, the fineness of circles, the features."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass
from typing import Any

import numpy as np
from manifold3d import Manifold

from technic.geometry import Array
from technic.parts.definition import PartDefinition, PortKind
from technic.units import LDU

__all__ = ["FEATURES", "Bench", "Bore", "Feature", "feature"]

_SAME = 1e-3
"""Two bores are in line and touch when they differ by less than this (LDU)."""
_NEIGHBOUR = 25.0
"""Bores further apart than this (LDU) are not each other's neighbours."""


@dataclass(frozen=True, slots=True, eq=False)
class Bore:
    """A pin hole or an axle hole from face to face (LDU).

    Parameters
    ----------
    name : str
        Name of its first port.
    cross : bool
        True for an axle hole.
    start, end : (3,) ndarray
    """

    name: str
    cross: bool
    start: Array
    end: Array

    @property
    def middle(self) -> Array:
        """Middle of the bore (LDU)."""
        return np.asarray((self.start + self.end) / 2)

    @property
    def length(self) -> float:
        """Depth of the bore (LDU)."""
        return float(np.linalg.norm(self.end - self.start))

    @property
    def axis(self) -> Array:
        """Unit vector from start to end."""
        return np.asarray((self.end - self.start) / self.length)


def _bores(definition: PartDefinition) -> tuple[Bore, ...]:
    """Return the bores of a definition; ports of one long bore are put together again."""
    whole: list[Bore] = []
    for port in definition.ports:
        if port.kind not in (PortKind.PIN_HOLE, PortKind.AXLE_HOLE):
            continue
        middle, half = port.position / LDU, port.axis * (port.length / LDU / 2)
        bore = Bore(port.name, port.kind is PortKind.AXLE_HOLE, middle - half, middle + half)
        for k, other in enumerate(whole):
            in_line = abs(other.axis @ bore.axis) > 1.0 - _SAME and other.cross == bore.cross
            if in_line and np.linalg.norm(other.end - bore.start) < _SAME:
                whole[k] = Bore(other.name, other.cross, other.start, bore.end)
                break
            if in_line and np.linalg.norm(other.start - bore.end) < _SAME:
                whole[k] = Bore(other.name, other.cross, bore.start, other.end)
                break
        else:
            whole.append(bore)
    return tuple(whole)


@dataclass(frozen=True, slots=True, eq=False)
class Bench:
    """A definition on the bench of a builder.

    Parameters
    ----------
    definition : PartDefinition
    segments : int
        Sides of a full circle, a multiple of 4.
    bores : tuple of Bore
    """

    definition: PartDefinition
    segments: int
    bores: tuple[Bore, ...]

    @classmethod
    def of(cls, definition: PartDefinition, segments: int) -> Bench:
        """Return the bench with the definition's bores laid out."""
        return cls(definition, segments, _bores(definition))

    def bore(self, name: str) -> Bore:
        """Return the bore called `name`; KeyError if there is none."""
        for bore in self.bores:
            if bore.name == name:
                return bore
        raise KeyError(name)

    def across(self, bore: Bore) -> Array | None:
        """Return where an arm of an axle hole points: at the nearest parallel bore, if one is near."""
        best, where = _NEIGHBOUR, None
        for other in self.bores:
            step = other.middle - bore.middle
            distance = float(np.linalg.norm(step))
            if other is bore or distance >= best or distance < 1.0:
                continue
            if abs(step @ bore.axis) < 1.0 and abs(other.axis @ bore.axis) > 1.0 - _SAME:
                best, where = distance, step / distance
        return where


Feature = Callable[[Bench, Mapping[str, Any]], Manifold]
"""Builds a solid (LDU) from the parameters of one entry of a shape table."""

FEATURES: dict[str, Feature] = {}
"""Feature by the word that names it in a shape table (``kind``)."""


def feature(kind: str) -> Callable[[Feature], Feature]:
    """Register a builder under the word that names it in shape tables."""

    def register(build: Feature) -> Feature:
        FEATURES[kind] = build
        return build

    return register
