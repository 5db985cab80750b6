"""What the page can play: elastic modes under a load of 1 N, and motions that cost nothing."""

from __future__ import annotations

from dataclasses import dataclass, field

import numpy as np

from technic.geometry import Array
from technic.report.carried import carried_twists
from technic.report.drawing import Drawing, deformation_scale
from technic.report.html.bending import POWERS, bending_of
from technic.report.html.shapes import Shapes
from technic.rigidity.result import Mode, Motion, MotionKind, MotionType, RigidityReport

__all__ = ["MOTIONS_PLAYED", "Field", "mode_fields", "motion_fields"]

MOTIONS_PLAYED = 60
"""Motions that get a play button; a model with more of them has a table of all."""

_SWING = 0.10
"""The furthest point of a motion goes this share of the model's diagonal to either side."""

_LARGEST_ANGLE = 0.6
"""Parts of a motion turn no further than this (rad), unless they spin in full circles."""

_BEND_SIZE = 0.02
"""Coordinates of a bending polynomial are divided by half the part's length, by this at least (m)."""


@dataclass(frozen=True, slots=True, eq=False)
class Field:
    """A movement of all parts.

    Parameters
    ----------
    twists : (p, 6) ndarray
        About the parts' centroids, world axes (m, rad).
    scale : float
        By which it is drawn.
    bending : (p, 20, 3) ndarray or None
        Coefficients of the parts' bending (m); None when parts are drawn rigid.
    sizes : (p,) ndarray
        Lengths that part coordinates are divided by (m).
    turns : bool
        True when it is played in full circles.
    movers : tuple of int
    """

    twists: Array
    scale: float
    bending: Array | None = None
    sizes: Array = field(default_factory=lambda: np.zeros(0))
    turns: bool = False
    movers: tuple[int, ...] = ()


def _furthest(drawing: Drawing, shapes: Shapes, twists: Array) -> float:
    """Return how far the furthest corner of all parts' boxes goes (m), to first order."""
    corners = []
    for solid in shapes.solids:
        low, high = solid.points.min(axis=0), solid.points.max(axis=0)
        corners.append(np.array(np.meshgrid(*zip(low, high, strict=True))).reshape(3, -1).T)
    parts = drawing.assembly.parts
    where = np.array(
        [part.pose.points(corners[t]) for part, t in zip(parts, shapes.of_part, strict=True)]
    )
    arms = where - np.array([part.centroid for part in parts])[:, None, :]
    ways = twists[:, None, :3] + np.cross(twists[:, None, 3:], arms)
    return float(np.linalg.norm(ways, axis=2).max())


def _bending(report: RigidityReport, mode: Mode, shapes: Shapes) -> tuple[Array, Array]:
    parts = report.assembly.parts
    sizes = np.array(
        [
            max(0.5 * float(np.ptp(shapes.solids[t].points, axis=0).max()), _BEND_SIZE)
            for t in shapes.of_part
        ]
    )
    found = np.zeros((len(parts), len(POWERS), 3))
    for k, part in enumerate(parts):
        nodes = report.node_points.get(k)
        if nodes is None or len(nodes) < 2 or k not in mode.displacements:
            continue
        nodes = np.asarray(nodes)
        local = part.pose.to_local(nodes) - part.mass_properties.centroid
        whole = np.asarray(mode.displacements[k]) / mode.value
        found[k] = bending_of(
            local, nodes, whole, part.centroid, mode.twists[k] / mode.value, float(sizes[k])
        )
    return found, sizes


def mode_fields(report: RigidityReport, drawing: Drawing, shapes: Shapes) -> list[Field]:
    """Return the elastic modes at 1 N, the worst first, parts bent where their nodes are known."""
    fields: list[Field] = []
    for mode in report.modes:
        if mode.value <= 0.0:
            continue
        twists = np.asarray(mode.twists) / mode.value
        bent = (np.linalg.norm(way, axis=1).max() for way in mode.displacements.values())
        furthest = max(_furthest(drawing, shapes, twists), max(bent, default=0.0) / mode.value)
        if furthest == 0.0:
            continue
        scale = deformation_scale(report, drawing, furthest)
        if mode.displacements and report.node_points:
            bending, sizes = _bending(report, mode, shapes)
            fields.append(Field(twists, scale, bending, sizes))
        else:
            fields.append(Field(twists, scale))
    return fields


def _motion_field(motion: Motion, drawing: Drawing, shapes: Shapes) -> Field | None:
    twists = carried_twists(drawing.assembly, motion)
    movers = tuple(int(k) for k in np.flatnonzero(np.any(twists != 0.0, axis=1)))
    furthest = _furthest(drawing, shapes, twists)
    angle = float(np.linalg.norm(twists[:, 3:], axis=1).max())
    if furthest == 0.0:
        return None
    if motion.kind in (MotionKind.SPINNING, MotionKind.IDLE) and motion.type is MotionType.ROTATION:
        return Field(twists, 2.0 * np.pi / angle, turns=True, movers=movers)
    scale = _SWING * drawing.diagonal / furthest
    if angle * scale > _LARGEST_ANGLE:
        scale = _LARGEST_ANGLE / angle
    return Field(twists, scale, movers=movers)


def motion_fields(
    report: RigidityReport, drawing: Drawing, shapes: Shapes
) -> list[tuple[Motion, Field]]:
    """Return the motions that get a play button with their fields; idle ones are only counted."""
    found = []
    for motion in report.motions:
        if motion.kind is MotionKind.IDLE:
            continue
        movement = _motion_field(motion, drawing, shapes)
        if movement is not None:
            found.append((motion, movement))
        if len(found) == MOTIONS_PLAYED:
            break
    return found
