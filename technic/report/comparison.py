"""Before and after, side by side: the same camera, the same scale of deformation, the same arrows."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from technic.report.camera import View, fit, sight
from technic.report.drawing import (
    Drawing,
    deformation_scale,
    deformed_points,
    drawing_of,
    furthest_way,
)
from technic.report.palette import NEUTRAL
from technic.report.picture import model_layers, outline
from technic.report.scene import LegendItem, Lines, Panel, Scene, Surface
from technic.report.wording import number
from technic.report.worst_field import worst_field
from technic.rigidity.result import RigidityReport
from technic.rigidity.serialize import unit_load
from technic.units import MM

__all__ = ["common_scale", "comparison_scene"]


def common_scale(reports: Sequence[RigidityReport], drawings: Sequence[Drawing]) -> float:
    """Return the one factor by which all deformations are drawn: that of the softest model."""
    scales = []
    for report, drawing in zip(reports, drawings, strict=True):
        load = unit_load(report)
        furthest = 0.0 if load is None else furthest_way(report, drawing, load[1])
        if furthest > 0.0:
            scales.append(deformation_scale(report, drawing, furthest))
    return min(scales, default=0.0)


def _layers(
    report: RigidityReport, drawing: Drawing, scale: float
) -> tuple[tuple[Surface, ...], Lines, str]:
    load = unit_load(report)
    if load is None or scale == 0.0:
        body, edges = model_layers(drawing, drawing.points)
        return body, edges, ""
    moved = deformed_points(report, drawing, load[1], scale)
    body, edges = model_layers(drawing, moved)
    furthest = furthest_way(report, drawing, load[1]) / MM
    return body, edges, f"; 1 N moves the furthest point {number(furthest)} mm"


def comparison_scene(
    reports: Sequence[RigidityReport], captions: Sequence[str], *, view: View = "mode"
) -> Scene:
    """Return a strip of models under their worst loads of 1 N, one panel each.

    Parameters
    ----------
    reports : sequence of RigidityReport
        The one before first: its worst mode chooses the view.
    captions : sequence of str
        Such as "before" and "after".
    view : {"iso", "front", "side", "top", "mode"}
    """
    drawings = [drawing_of(report.assembly) for report in reports]
    scale = common_scale(reports, drawings)
    field = worst_field(reports[0])
    toward, up = sight(
        reports[0].assembly,
        np.concatenate(drawings[0].points),
        view=view,
        movement=None if field is None else field.displacements,
        aspect=1.0,
    )
    found = [
        _layers(report, drawing, scale) for report, drawing in zip(reports, drawings, strict=True)
    ]
    extent = [surface.points for body, _, _ in found for surface in body]
    camera = fit(np.concatenate([*extent, *(p for d in drawings for p in d.points)]), toward, up)
    panels, legend = [], []
    for report, drawing, caption, (body, edges, words) in zip(
        reports, drawings, captions, found, strict=True
    ):
        value = "" if report.rigidity is None else f", {number(report.rigidity.value)} N/m"
        said = f"{caption}: {report.verdict.value}{value}"
        still = outline(drawing, drawing.points)
        panels.append(Panel(said, body, (edges, still), camera))
        legend.append(LegendItem("none", NEUTRAL, f"{caption}: {len(drawing.points)} parts{words}"))
    drawn = f"worst-case load of 1 N each, deformations drawn {scale:g} x" if scale else ""
    return Scene(reports[0].assembly.name, drawn, tuple(panels), tuple(legend), (1600, 900))
