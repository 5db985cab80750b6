"""The worst mode, or the first motion, as a film: the model swings to and fro under a still camera."""

from __future__ import annotations

from collections.abc import Callable
from math import cos, pi

import numpy as np

from technic.errors import UsageError
from technic.geometry import Array
from technic.report.camera import View, fit, sight
from technic.report.carried import carried_twists
from technic.report.deform import move_rigidly
from technic.report.drawing import (
    Drawing,
    deformation_scale,
    deformed_points,
    drawing_of,
    furthest_way,
    worst_way,
)
from technic.report.motion_picture import MOTION_COLOR
from technic.report.palette import NEUTRAL
from technic.report.picture import headline, model_layers, outline
from technic.report.scene import Film, FilmKind, LegendItem, Panel, Scene
from technic.report.worst_field import worst_field
from technic.rigidity.result import MotionKind, RigidityReport
from technic.rigidity.serialize import unit_load

__all__ = ["film"]

_FRAMES = 24
_SECONDS = 2.4
_SIZE = (960, 720)

_SWING = 0.10
"""The furthest point of a motion goes this share of the model's diagonal to either side."""

Poses = Callable[[float], tuple[Array, ...]]
"""World points of every part at a phase from -1 to 1."""


def _mode(report: RigidityReport, drawing: Drawing) -> tuple[Poses, LegendItem] | None:
    load = unit_load(report)
    furthest = 0.0 if load is None else worst_way(report, drawing, load[1])
    if load is None or furthest == 0.0:
        return None
    twists = load[1]
    scale = deformation_scale(report, drawing, furthest)
    words = f"worst-case load of 1 N, deformation drawn {scale:g} x; grey: at rest"
    return (
        lambda phase: deformed_points(report, drawing, twists, scale * phase),
        LegendItem("none", NEUTRAL, words),
    )


def _motion(report: RigidityReport, drawing: Drawing) -> tuple[Poses, LegendItem] | None:
    motions = [motion for motion in report.motions if motion.kind is not MotionKind.IDLE]
    if not motions:
        return None
    first = motions[0]
    parts = report.assembly.parts
    twists = carried_twists(report.assembly, first)
    scale = _SWING * drawing.diagonal / max(furthest_way(report, drawing, twists), 1e-300)

    def poses(phase: float) -> tuple[Array, ...]:
        return tuple(
            move_rigidly(where, part.centroid, phase * scale * twist)
            for part, where, twist in zip(parts, drawing.points, twists, strict=True)
        )

    return poses, LegendItem("arrow", MOTION_COLOR, f"what moves: motion 1 of {len(motions)}")


def film(
    report: RigidityReport,
    *,
    drawing: Drawing | None = None,
    view: View = "mode",
    kind: FilmKind = "gif",
) -> Film:
    """Return the film of the worst mode; of the first motion when there is no elastic mode.

    Parameters
    ----------
    report : RigidityReport
        With at least one part.
    drawing : Drawing, optional
        Of the report's assembly, when it is there already.
    view : {"iso", "front", "side", "top", "mode"}
    kind : {"gif", "mp4"}

    Raises
    ------
    UsageError
        When nothing bends and nothing moves.
    """
    drawing = drawing_of(report.assembly) if drawing is None else drawing
    found = _mode(report, drawing) or _motion(report, drawing)
    if found is None:
        raise UsageError("no film was made: nothing in the model bends or moves")
    poses, words = found
    half = _FRAMES // 2
    frames = [poses(cos(2.0 * pi * k / _FRAMES)) for k in range(half + 1)]
    field = worst_field(report)
    movement = None if field is None else field.displacements
    everything = np.concatenate(drawing.points)
    toward, up = sight(report.assembly, everything, view=view, movement=movement)
    # The camera sees all frames, so that it can stand still.
    camera = fit(np.concatenate([*frames[0], *frames[-1], *drawing.points]), toward, up)
    still = outline(drawing, drawing.points)
    title, subtitle = headline(report)
    scenes = []
    for points in frames:
        body, edges = model_layers(drawing, points)
        panel = Panel("", body, (edges, still), camera)
        scenes.append(Scene(title, subtitle, (panel,), (words,), _SIZE))
    order = (*range(half + 1), *range(half - 1, 0, -1))
    return Film(tuple(scenes), order, _SECONDS, kind)
