"""Motions as green arrows, arcs and outlines."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np

from technic.geometry import Array, shift_twist
from technic.report.arrows import arc_arrow, arrow
from technic.report.deform import move_rigidly
from technic.report.scene import RGB, Lines, Surface, merge
from technic.report.solids import Solid
from technic.report.wording import count
from technic.rigidity.result import Motion, MotionKind, RigidityReport

__all__ = ["MOTION_COLOR", "MotionLayers", "motion_glyphs", "motion_layers"]

MOTION_COLOR: RGB = (0.05, 0.58, 0.22)

_AMPLITUDE = 0.10
"""The furthest point of the first motion is drawn this share of the model's diagonal away."""

_RADIUS = 0.0045
_ARROWS_FIRST = 8
_MOTIONS_SHOWN = 12
_TURN = 0.8
"""Turning arrows go this far round (rad)."""


@dataclass(frozen=True, slots=True, eq=False)
class MotionLayers:
    """Arrows on top, outlines of the moved parts, and the words for them."""

    surfaces: tuple[Surface, ...]
    lines: Lines
    caption: str
    legend: tuple[str, ...]


def _groups(motion: Motion, report: RigidityReport) -> list[list[int]]:
    """Return the parts of a motion that move as one body (positions in ``motion.parts``)."""
    centroids = np.array([report.assembly.parts[k].centroid for k in motion.parts])
    seen = np.einsum("pij,pj->pi", shift_twist(-centroids), motion.twists)
    keys = (seen / max(float(np.abs(seen).max()), 1e-300)).round(4) + 0.0
    groups: dict[tuple[float, ...], list[int]] = {}
    for i, key in enumerate(keys):
        groups.setdefault(tuple(key), []).append(i)
    frames = [
        group
        for group in groups.values()
        if not all(report.assembly.parts[motion.parts[i]].fastener for i in group)
    ]
    return sorted(frames or list(groups.values()), key=len, reverse=True)


def _forward(motion: Motion) -> Motion:
    """Return a motion in the one of its two senses in which its first large component is positive.

    Which of the two the null space gives is chance; a picture should not change with it.
    """
    values = np.asarray(motion.twists).ravel()
    first = int(np.argmax(np.abs(values) > 0.99 * np.abs(values).max(initial=0.0)))
    return motion if values[first] >= 0.0 else replace(motion, twists=-motion.twists)


def _glyph(
    motion: Motion,
    group: list[int],
    report: RigidityReport,
    points: Sequence[Array],
    diagonal: float,
) -> Surface | None:
    """Return the arrow of one body: an arc when it mostly turns about a line near it."""
    where = np.concatenate([points[motion.parts[i]] for i in group])
    center = where.mean(axis=0)
    i = group[0]
    part = report.assembly.parts[motion.parts[i]]
    twist = shift_twist(center - part.centroid) @ motion.twists[i]
    move, turn = twist[:3], twist[3:]
    reach = 0.5 * float(np.linalg.norm(np.ptp(where, axis=0)))
    angle = float(np.linalg.norm(turn))
    speed = float(np.linalg.norm(move))
    radius = _RADIUS * diagonal
    if angle * reach > speed:
        axis = turn / angle
        # The point of the axis nearest to the middle of the body.
        foot = center + np.cross(axis, move) / angle
        away = where - foot
        away = away - np.outer(away @ axis, axis)
        far = int(np.argmax(np.linalg.norm(away, axis=1)))
        # Beside the body rather than on it, and never as small as the arrow's own head.
        size = max(0.75 * float(np.linalg.norm(away[far])), 14.0 * radius)
        arm = away[far] / np.linalg.norm(away[far])
        along = ((center - foot) @ axis) * axis
        return arc_arrow(foot + along, axis, foot + along + size * arm, _TURN, radius, MOTION_COLOR)
    if speed == 0.0:
        return None
    return arrow(center, 0.16 * diagonal * move / speed, radius, MOTION_COLOR)


def motion_glyphs(
    motion: Motion,
    report: RigidityReport,
    points: Sequence[Array],
    diagonal: float,
    limit: int = _ARROWS_FIRST,
) -> list[Surface]:
    """Return the arrows of one motion: one for each of the largest `limit` bodies that it moves."""
    found = (
        _glyph(motion, group, report, points, diagonal) for group in _groups(motion, report)[:limit]
    )
    return [glyph for glyph in found if glyph is not None]


def motion_layers(
    report: RigidityReport, points: Sequence[Array], solids: Sequence[Solid], diagonal: float
) -> MotionLayers | None:
    """Return what shows the structural motions of a report; None when it has none.

    Parameters
    ----------
    report : RigidityReport
    points : sequence of (n, 3) ndarray
        World points of each part's solid, undeformed (m).
    solids : sequence of Solid
    diagonal : float
        Of the model (m).
    """
    structural = [motion for motion in report.motions if motion.kind is MotionKind.STRUCTURAL]
    motions = [_forward(motion) for motion in structural]
    if not motions:
        return None
    first = motions[0]
    # The first motion, gone through far enough to be seen.
    furthest = 0.0
    for k, twist in zip(first.parts, first.twists, strict=True):
        way = twist[:3] + np.cross(twist[3:], points[k] - report.assembly.parts[k].centroid)
        furthest = max(furthest, float(np.linalg.norm(way, axis=1).max()))
    scale = _AMPLITUDE * diagonal / max(furthest, 1e-300)
    moved, edges, start = [], [], 0
    for k, twist in zip(first.parts, first.twists, strict=True):
        if report.assembly.parts[k].fastener and len(first.parts) > 1:
            continue  # outlines of pins only clutter
        moved.append(move_rigidly(points[k], report.assembly.parts[k].centroid, scale * twist))
        edges.append(solids[k].edges + start)
        start += len(points[k])
    if not moved:
        return None
    outline = np.concatenate(moved)
    lines = Lines(
        outline,
        np.concatenate(edges),
        np.tile(np.array(MOTION_COLOR), (len(outline), 1)),
        width=1.4,
        opacity=0.9,
    )
    glyphs = [
        glyph
        for motion, limit in [(first, _ARROWS_FIRST)] + [(m, 1) for m in motions[1:_MOTIONS_SHOWN]]
        for glyph in motion_glyphs(motion, report, points, diagonal, limit)
    ]
    said = [f"what moves: outlines show motion 1 of {len(motions)}, arrows its direction"]
    if len(motions) == 1:
        said = ["what moves: the outline shows where to, the arrows how"]
    elif len(motions) > 1:
        shown = min(len(motions), _MOTIONS_SHOWN)
        said[0] += f"; one arrow for each of {count(shown - 1, 'other motion')}"
    return MotionLayers(
        (merge(glyphs, on_top=True),) if glyphs else (),
        lines,
        "What can move" if len(motions) == 1 else f"What can move ({len(motions)} motions)",
        tuple(said),
    )
