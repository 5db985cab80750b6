"""The faces of beams and frames: layers of parallel holes by which a part can be pinned."""

from __future__ import annotations

from dataclasses import dataclass
from functools import lru_cache
from typing import Final

import numpy as np

from technic.errors import UsageError
from technic.geometry import Array, readonly
from technic.parts.catalogue import catalogue
from technic.parts.definition import PartDefinition, PortKind
from technic.units import LDU

__all__ = ["Face", "faces", "holes_of"]


@dataclass(frozen=True, slots=True, eq=False)
class Face:
    """Holes of a part that lie in one layer, by which it can be pinned. Beams have one, frames more.

    Parameters
    ----------
    definition : PartDefinition
    names : tuple of str
        Of the holes.
    turn : (3, 3) ndarray
        From the part's axes to those of the face, in which holes lie along y.
    points : (h, 3) ndarray
        Middles of the holes in the axes of the face (m).
    """

    definition: PartDefinition
    names: tuple[str, ...]
    turn: Array
    points: Array

    @property
    def plane(self) -> Array:
        """Middles of the holes in the plane of the face, (h, 2)."""
        return np.asarray(self.points[:, [2, 0]])


_TURNS: Final = (
    np.eye(3),
    np.array([[0.0, 0.0, 1.0], [1.0, 0.0, 0.0], [0.0, 1.0, 0.0]]),
    np.array([[0.0, 1.0, 0.0], [0.0, 0.0, 1.0], [1.0, 0.0, 0.0]]),
)
"""Turns that bring y, x and z to y."""


@lru_cache(maxsize=64)
def faces(number: str) -> tuple[Face, ...]:
    """Return the faces of a beam or a frame; those with holes along y come first."""
    definition = catalogue().get(number)
    if definition is None:
        raise UsageError(f"part {number} is not in the catalogue")
    holes = [p for p in definition.ports if p.kind is PortKind.PIN_HOLE]
    found = []
    for turn in _TURNS:
        along = [(p, turn @ p.position) for p in holes if abs(turn[1] @ p.axis) > 0.999]
        for depth in sorted({round(float(point[1]) / LDU) for _, point in along}):
            own = [(p, q) for p, q in along if round(float(q[1]) / LDU) == depth]
            if len(own) > 1:
                names = tuple(p.name for p, _ in own)
                points = readonly(np.array([q for _, q in own]))
                found.append(Face(definition, names, readonly(turn), points))
    return tuple(found)


def holes_of(number: str, face: int = 0) -> tuple[str, ...]:
    """Return the names of the pin holes of a face, in order."""
    return faces(number)[face].names
