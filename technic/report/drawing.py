"""The model ready to be drawn: shapes in their places, deformed by a stated factor."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from technic.assembly.model import Assembly
from technic.geometry import Array
from technic.report.deform import bend_field, move_rigidly
from technic.report.solids import Solid, solid_of, world_points
from technic.rigidity.result import RigidityReport

__all__ = [
    "Drawing",
    "deformation_scale",
    "deformed_points",
    "drawing_of",
    "furthest_way",
    "nice",
    "worst_way",
]

DEFORMED_SHARE = 0.07
"""The furthest point of the deformed shape goes this share of the model's diagonal."""


@dataclass(frozen=True, slots=True, eq=False)
class Drawing:
    """The undeformed model ready to be drawn.

    Parameters
    ----------
    assembly : Assembly
    solids : tuple of Solid
        One per part.
    points : tuple of (n, 3) ndarray
        World points of each solid (m).
    diagonal : float
        Of the box around everything (m).
    """

    assembly: Assembly
    solids: tuple[Solid, ...]
    points: tuple[Array, ...]
    diagonal: float


def drawing_of(assembly: Assembly) -> Drawing:
    """Return the shapes of all parts in their places."""
    solid = solid_of()
    solids = tuple(solid(part) for part in assembly.parts)
    points = tuple(world_points(part, s) for part, s in zip(assembly.parts, solids, strict=True))
    everything = np.concatenate(points)
    return Drawing(assembly, solids, points, float(np.linalg.norm(np.ptp(everything, axis=0))))


def nice(value: float) -> float:
    """Return a round number not above `value`: 1, 1.5, 2, 3, 5 or 7 times a power of ten."""
    power = 10.0 ** np.floor(np.log10(value))
    return float(power * max(m for m in (1.0, 1.5, 2.0, 3.0, 5.0, 7.0) if m * power <= value))


def deformed_points(
    report: RigidityReport, drawing: Drawing, twists: Array, scale: float
) -> tuple[Array, ...]:
    """Return the world points of each part, moved by `scale` times the worst mode at 1 N."""
    moved = []
    per_newton = 1.0 / report.modes[0].value
    for k, (part, where) in enumerate(zip(report.assembly.parts, drawing.points, strict=True)):
        center = part.centroid
        points = move_rigidly(where, center, scale * twists[k])
        if k in report.node_points:
            nodes = np.asarray(report.node_points[k])
            whole = per_newton * np.asarray(report.node_displacements[k])
            points = points + scale * bend_field(where, center, twists[k], nodes, whole)
        moved.append(points)
    return tuple(moved)


def furthest_way(report: RigidityReport, drawing: Drawing, twists: Array) -> float:
    """Return how far the furthest point goes with rigid parts (m), to first order."""
    best = 0.0
    for k, (part, where) in enumerate(zip(report.assembly.parts, drawing.points, strict=True)):
        arms = where - part.centroid
        way = twists[k, :3] + np.cross(twists[k, 3:], arms)
        best = max(best, float(np.linalg.norm(way, axis=1).max()))
    return best


def worst_way(report: RigidityReport, drawing: Drawing, twists: Array) -> float:
    """Return how far the furthest point goes in the worst mode at 1 N (m), bending included.

    A part may do nothing but bend; then its twist is zero up to rounding.

    Parameters
    ----------
    report : RigidityReport
        With an elastic mode.
    drawing : Drawing
    twists : (p, 6) ndarray
        Rigid part of the movement of each part at 1 N.
    """
    ways = [np.linalg.norm(way, axis=1).max() for way in report.node_displacements.values()]
    bent = float(max(ways, default=0.0)) / report.modes[0].value
    return max(bent, furthest_way(report, drawing, twists))


def deformation_scale(report: RigidityReport, drawing: Drawing, furthest: float) -> float:
    """Return the round factor that shows a deformation whose furthest point goes `furthest` (m).

    It is measured against the heaviest component, which is the one that deforms.
    """
    moving = np.concatenate([drawing.points[k] for k in report.components[0].parts])
    return nice(DEFORMED_SHARE * float(np.linalg.norm(np.ptp(moving, axis=0))) / furthest)
