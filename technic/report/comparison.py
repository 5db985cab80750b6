"""Before and after, side by side: the same camera, the same scale of deformation, the same arrows."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from technic.report.camera import View, fit, sight
from technic.report.drawing import (
    Drawing,
    deformation_scale,
    deformed_points,
    drawing_of,
    worst_way,
)
from technic.report.load_arrows import LOAD_COLOR, load_arrows
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
        furthest = 0.0 if load is None else worst_way(report, drawing, load[1])
        if furthest > 0.0:
            scales.append(deformation_scale(report, drawing, furthest))
    return min(scales, default=0.0)


def _layers(
    report: RigidityReport, drawing: Drawing, scale: float, strongest: float
) -> tuple[tuple[Surface, ...], Lines, str]:
    load, field = unit_load(report), worst_field(report)
    if load is None or field is None or scale == 0.0:
        body, edges = model_layers(drawing, drawing.points)
        return body, edges, ""
    moved = deformed_points(report, drawing, load[1], scale)
    body, edges = model_layers(drawing, moved)
    arrows, _ = load_arrows(report, drawing, field, scale, strongest)
    furthest = worst_way(report, drawing, load[1]) / MM
    surfaces = body if arrows is None else (*body, arrows)
    return surfaces, edges, f"; 1 N moves the furthest point {number(furthest)} mm"


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
    # Arrows of one length for one load: measured by one diagonal, and by the strongest load of all.
    diagonal = max(drawing.diagonal for drawing in drawings)
    drawings = [replace(drawing, diagonal=diagonal) for drawing in drawings]
    fields = [worst_field(report) for report in reports]
    strongest = max((field.strongest for field in fields if field is not None), default=0.0)
    toward, up = sight(
        reports[0].assembly,
        np.concatenate(drawings[0].points),
        view=view,
        movement=None if fields[0] is None else fields[0].displacements,
        aspect=1.0,
    )
    found = [
        _layers(report, drawing, scale, strongest)
        for report, drawing in zip(reports, drawings, strict=True)
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
    if strongest > 0.0 and scale:
        words = f"worst-case load, 1 N in all; longest arrow {number(strongest * 1e-3)} N per gram"
        legend.insert(0, LegendItem("arrow", LOAD_COLOR, words))
    drawn = f"worst-case load of 1 N each, deformations drawn {scale:g} x" if scale else ""
    return Scene(reports[0].assembly.name, drawn, tuple(panels), tuple(legend), (1600, 900))
