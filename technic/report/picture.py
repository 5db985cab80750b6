"""From a report to the scene of its picture.

Left, when something can move: the motions, green. Right, or alone: the model deformed by its worst-case
load (orange) over its undeformed outline, exaggerated by a stated factor.
"""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from technic.geometry import Array
from technic.parts.definition import PartDefinition
from technic.report.arrows import arrow
from technic.report.camera import View, fit, sight, view_direction
from technic.report.canvas import FAR_SHADE, NEAR_SHADE, depth_span
from technic.report.drawing import (
    Drawing,
    deformation_scale,
    deformed_points,
    drawing_of,
    worst_way,
)
from technic.report.load_arrows import LOAD_COLOR, load_arrows
from technic.report.motion_picture import MOTION_COLOR, motion_layers
from technic.report.palette import NEUTRAL, color_alpha, color_rgb
from technic.report.scene import (
    RGB,
    LegendItem,
    Lines,
    Marker,
    Panel,
    Scene,
    Surface,
    merge,
)
from technic.report.solids import solid_of
from technic.report.wording import count, number, spot_words
from technic.report.worst_field import WorstField, worst_field
from technic.rigidity.result import RigidityReport, Verdict
from technic.rigidity.serialize import unit_load
from technic.units import MM

__all__ = ["headline", "model_layers", "outline", "part_scene", "report_scene", "styled"]

OUTLINE: RGB = (0.55, 0.57, 0.60)
SPOT_COLOR: RGB = (0.80, 0.07, 0.18)

_SPOTS = 3

_CROWDED = 60

_NAMED = 24
"""More port names than this would hide the part."""

_WHOLE_ASPECT, _HALF_ASPECT = 1.9, 1.0
"""Width over height, about, of a panel that is alone and of one of two."""


def _edge_color(color: RGB) -> RGB:
    """Return a colour for edges that shows on the part: dark on light parts, light on black ones."""
    brightness = 0.3 * color[0] + 0.6 * color[1] + 0.1 * color[2]
    return (0.55, 0.58, 0.60) if brightness < 0.18 else (0.12, 0.13, 0.14)


def model_layers(
    drawing: Drawing, points: tuple[Array, ...], *, pale: float = 0.0
) -> tuple[tuple[Surface, ...], Lines]:
    """Return the model in its colours, opaque parts before glass-like ones, and its edges.

    Parameters
    ----------
    drawing : Drawing
    points : tuple of (n, 3) ndarray
        World points of each part.
    pale : float
        0 for full colours, 1 for white.
    """
    # Edges keep their strength: they carry the shape when the colours are pale.
    surfaces: dict[float, list[Surface]] = {1.0: []}
    edges, edge_colors, start = [], [], 0
    for part, solid, where in zip(drawing.assembly.parts, drawing.solids, points, strict=True):
        full = np.array(color_rgb(part.color))
        color = full + pale * (1.0 - full)
        faces = solid.faces[:, ::-1] if np.linalg.det(part.pose.rotation) < 0 else solid.faces
        surfaces.setdefault(color_alpha(part.color), []).append(
            Surface(where, faces, np.tile(color, (len(where), 1)))
        )
        line = np.array(_edge_color(color_rgb(part.color)))
        edges.append(solid.edges + start)
        edge_colors.append(np.tile(line, (len(where), 1)))
        start += len(where)
    body = tuple(merge(those, opacity=alpha) for alpha, those in surfaces.items() if those)
    everything = np.concatenate([np.zeros((0, 3)), *points])
    none = np.zeros((0, 2), dtype=np.int64)
    lines = Lines(
        everything,
        np.concatenate([none, *edges]),
        np.concatenate([np.zeros((0, 3)), *edge_colors]),
        width=1.3,
    )
    return body, lines


def outline(drawing: Drawing, points: tuple[Array, ...]) -> Lines:
    """Return the edges of the model as thin grey lines."""
    edges, start = [], 0
    for solid, where in zip(drawing.solids, points, strict=True):
        edges.append(solid.edges + start)
        start += len(where)
    everything = np.concatenate(points)
    return Lines(
        everything,
        np.concatenate(edges),
        np.tile(np.array(OUTLINE), (len(everything), 1)),
        width=1.0,
        # Many parts have many edges behind each other.
        opacity=0.7 if len(points) < _CROWDED else 0.3,
    )


def _spot_markers(report: RigidityReport, points: tuple[Array, ...]) -> tuple[Marker, ...]:
    markers = []
    for spot in report.weak_spots[:_SPOTS]:
        fasteners = [k for k in spot.parts if report.assembly.parts[k].fastener]
        k = (fasteners or list(spot.parts))[0]
        middle = 0.5 * (points[k].min(axis=0) + points[k].max(axis=0))
        if spot.kind == "part":  # a bent bar is not in the middle of its box
            middle = points[k][int(np.argmin(np.linalg.norm(points[k] - middle, axis=1)))]
        markers.append(Marker(middle, str(spot.rank)))
    return tuple(markers)


def headline(report: RigidityReport) -> tuple[str, str]:
    """Return title and subtitle of a picture: verdict and rigidity, then mass and compliance."""
    verdict = report.verdict.value.capitalize()
    if report.verdict is not Verdict.RIGID and report.mobility.structural:
        motions = count(report.mobility.structural, "motion")
        verdict += f", {report.qualifier} {motions}" if report.qualifier else f", {motions}"
    title = f"{report.assembly.name}: {verdict}"
    if report.rigidity is not None:
        title += f", {number(report.rigidity.value)} N/m"
    said = [count(len(report.assembly.parts), "part"), f"{number(report.mass * 1e3)} g"]
    if report.rigidity is not None:
        if report.rigidity.measure == "mean_square":
            millimetres = number(report.rigidity.compliance_mm_per_n)
            said.append(f"softest way to push it: {millimetres} mm per newton")
        if report.rigidity.frequency_hz is not None:
            said.append(f"lowest natural frequency {number(report.rigidity.frequency_hz)} Hz")
    return title, " · ".join(said)


def _elastic_panel(
    report: RigidityReport, drawing: Drawing, field: WorstField, sight: tuple[Array, Array]
) -> tuple[Panel, list[LegendItem]] | None:
    load = unit_load(report)
    if load is None:
        return None
    _, twists = load
    furthest = worst_way(report, drawing, twists)
    if furthest == 0.0:
        return None
    scale = deformation_scale(report, drawing, furthest)
    moved = deformed_points(report, drawing, twists, scale)
    body, edges = model_layers(drawing, moved)
    arrows, largest = load_arrows(report, drawing, field, scale)
    surfaces = body if arrows is None else (*body, arrows)
    extent = np.concatenate([*drawing.points, *(surface.points for surface in surfaces)])
    panel = Panel(
        f"How it gives way (deformation x {scale:g})",
        surfaces,
        (edges, outline(drawing, drawing.points)),
        fit(extent, *sight),
        _spot_markers(report, moved),
    )
    legend = [
        LegendItem("line", OUTLINE, "undeformed outline"),
        LegendItem(
            "none",
            OUTLINE,
            f"deformation drawn {scale:g} x; 1 N moves the furthest point {number(furthest / MM)} mm",
        ),
    ]
    if arrows is not None:
        legend.append(
            LegendItem(
                "arrow",
                LOAD_COLOR,
                "worst-case load: 1 N in all, spread over the material"
                + (
                    f"; longest arrow {number(largest * 1e-3)} N per gram"
                    if report.rigidity is not None and report.rigidity.measure == "mean_square"
                    else ""
                ),
            )
        )
    for spot in report.weak_spots[:_SPOTS]:
        what = spot_words(report.assembly, spot)
        share = f"{100.0 * spot.energy_share:.0f} %"
        legend.append(LegendItem(f"disc{spot.rank}", SPOT_COLOR, f"weak spot, {share}: {what}"))
    return panel, legend


def report_scene(
    report: RigidityReport, *, drawing: Drawing | None = None, view: View = "mode"
) -> Scene:
    """Return the picture of a report.

    Parameters
    ----------
    report : RigidityReport
        With at least one part.
    drawing : Drawing, optional
        Of the report's assembly, when it is there already.
    view : {"iso", "front", "side", "top", "mode"}
        Where to look from; `mode` shows the worst mode best.
    """
    drawing = drawing_of(report.assembly) if drawing is None else drawing
    field = worst_field(report)
    movement = None if field is None else field.displacements
    moving = motion_layers(report, drawing.points, drawing.solids, drawing.diagonal)
    side_by_side = moving is not None and field is not None
    toward, up = sight(
        report.assembly,
        np.concatenate(drawing.points),
        view=view,
        movement=movement,
        aspect=_HALF_ASPECT if side_by_side else _WHOLE_ASPECT,
    )
    panels: list[Panel] = []
    legend: list[LegendItem] = []
    if moving is not None:
        body, edges = model_layers(drawing, drawing.points, pale=0.25)
        surfaces = (*body, *moving.surfaces)
        extent = np.concatenate([s.points for s in surfaces] + [moving.lines.points])
        panels.append(
            Panel(moving.caption, surfaces, (edges, moving.lines), fit(extent, toward, up))
        )
        legend += [LegendItem("arrow", MOTION_COLOR, text) for text in moving.legend]
    elastic = None if field is None else _elastic_panel(report, drawing, field, (toward, up))
    if elastic is not None:
        panels.append(elastic[0])
        legend += elastic[1]
    if not panels:
        body, edges = model_layers(drawing, drawing.points)
        camera = fit(np.concatenate(drawing.points), toward, up)
        panels.append(Panel("", body, (edges,), camera))
    stand_ins = sum(solid.stand_in for solid in drawing.solids)
    if stand_ins:
        legend.append(
            LegendItem(
                "none", NEUTRAL, f"{count(stand_ins, 'part')} without a shape drawn as tubes"
            )
        )
    title, subtitle = headline(report)
    return Scene(title, subtitle, tuple(panels), tuple(legend))


def styled(scene: Scene, *, transparent: bool = False, depth: bool = False) -> Scene:
    """Return a scene without its paper, or in shades of depth, with the words for them."""
    legend = scene.legend
    if depth:
        far = f"{number(depth_span(scene.panels) / MM)} mm behind the nearest point"
        legend = (
            LegendItem("patch", NEAR_SHADE, "nearest"),
            LegendItem("patch", FAR_SHADE, far),
            *(item for item in legend if item.swatch != "line"),  # no outlines are drawn
        )
    return replace(scene, legend=legend, transparent=transparent, depth=depth)


def part_scene(definition: PartDefinition) -> Scene:
    """Return the picture of one part definition, with its ports named by kind."""
    solid = solid_of()(definition)
    color = np.array(color_rgb(71))
    body = Surface(solid.points, solid.faces, np.tile(color, (len(solid.points), 1)))
    edges = Lines(
        solid.points,
        solid.edges,
        np.tile(np.array(_edge_color(color_rgb(71))), (len(solid.points), 1)),
        width=1.5,
    )
    diagonal = float(np.linalg.norm(np.ptp(solid.points, axis=0)))
    ports = [
        arrow(
            port.position - 0.5 * port.length * port.axis,
            1.25 * port.length * port.axis,
            0.005 * diagonal,
            MOTION_COLOR,
        )
        for port in definition.ports
        if port.length > 0.0
    ]
    surfaces = (body, merge(ports, on_top=True)) if ports else (body,)
    toward = view_direction(solid.points)
    names = tuple(
        Marker(port.position - 0.5 * port.length * port.axis, port.name)
        for port in definition.ports
    )
    camera = fit(np.concatenate([s.points for s in surfaces]), toward)
    panel = Panel("", surfaces, (edges,), camera, names if len(names) <= _NAMED else ())
    legend = [
        LegendItem("arrow", MOTION_COLOR, f"{count(len(definition.ports), 'port')}: names and axes")
    ]
    if solid.stand_in:
        legend.append(LegendItem("none", NEUTRAL, "without a shape: drawn as tubes"))
    mass = number(definition.mass_properties.mass * 1e3)
    return Scene(
        f"{definition.id} {definition.title}",
        f"{definition.family} · {mass} g",
        (panel,),
        tuple(legend),
        (1200, 900),
    )
