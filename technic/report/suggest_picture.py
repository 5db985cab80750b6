"""Before and after, side by side: same camera, same scale, new parts in full colour."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from technic.assembly.model import Assembly, Part
from technic.report.camera import fit, sight
from technic.report.drawing import drawing_of
from technic.report.palette import color_name, color_rgb
from technic.report.phrases import state_words
from technic.report.picture import headline, model_layers
from technic.report.scene import Camera, LegendItem, Lines, Panel, Scene, Surface
from technic.report.wording import count
from technic.rigidity.result import RigidityReport

__all__ = ["before_after_scene"]

_PALE = 0.6
"""How far the present parts are faded beside new ones."""

_HALF = 0.75
"""Width over height of half a picture."""


def before_after_scene(before: RigidityReport, after: RigidityReport) -> Scene:
    """Return the picture of a model without and with new parts.

    Parameters
    ----------
    before : RigidityReport
    after : RigidityReport
        Of the same model with parts added; parts are told apart by their ids.
    """
    known = {part.id for part in before.assembly.parts}
    new = [k for k, part in enumerate(after.assembly.parts) if part.id not in known]
    drawing = drawing_of(after.assembly)
    everything = np.concatenate(drawing.points)
    camera = fit(everything, *sight(after.assembly, everything, aspect=_HALF))
    color = after.assembly.parts[new[0]].color if new else None
    title, subtitle = headline(after)
    legend: tuple[LegendItem, ...] = ()
    if new:
        said = f"{count(len(new), 'new part')} ({color_name(color)})"
        legend = (LegendItem("patch", color_rgb(color), said),)
    panels = (
        _panel(f"before: {state_words(before)}", before.assembly, frozenset(), camera),
        _panel(f"after: {state_words(after)}", after.assembly, frozenset(new), camera),
    )
    return Scene(title, subtitle, panels, legend)


def _panel(caption: str, assembly: Assembly, new: frozenset[int], camera: Camera) -> Panel:
    old = tuple(p for k, p in enumerate(assembly.parts) if k not in new)
    layers = [_layers(assembly, old, _PALE)]
    if new:
        added = tuple(p for k, p in enumerate(assembly.parts) if k in new)
        layers.append(_layers(assembly, added, 0.0))
    surfaces = tuple(surface for body, _ in layers for surface in body)
    return Panel(caption, surfaces, tuple(e for _, e in layers), camera)


def _layers(
    assembly: Assembly, parts: tuple[Part, ...], pale: float
) -> tuple[tuple[Surface, ...], Lines]:
    drawing = drawing_of(replace(assembly, parts=parts, joints=(), findings=(), supports=()))
    return model_layers(drawing, drawing.points, pale=pale)
