"""The picture of a static answer: the model under its loads, over the outline of the model without."""

from __future__ import annotations

import numpy as np

from technic.geometry import Array
from technic.report.arrows import arrow
from technic.report.camera import View, fit, sight
from technic.report.deflection import StaticCase
from technic.report.deform import bend_field, move_rigidly
from technic.report.drawing import DEFORMED_SHARE, Drawing, drawing_of, nice
from technic.report.load_arrows import ARROW_RADIUS, ARROW_SHARE, LOAD_COLOR
from technic.report.picture import OUTLINE, model_layers, outline
from technic.report.scene import RGB, LegendItem, Marker, Panel, Scene, Surface, merge
from technic.report.wording import count, number, part_name
from technic.rigidity.worst_case import node_fields
from technic.units import MM

__all__ = ["deflection_scene"]

_HELD: RGB = (0.10, 0.35, 0.75)
_ASPECT = 1.9
_NAMED = 3
"""Parts that go furthest, numbered in the picture."""

Movement = list[tuple[Array, Array]]
"""Of each part: where its points are, and how far each of them goes (m)."""


def deflection_scene(case: StaticCase, *, view: View = "mode") -> Scene:
    """Return the picture of a static answer.

    Parameters
    ----------
    case : StaticCase
        Of an assembly with at least one part.
    view : {"iso", "front", "side", "top", "mode"}
        Where to look from; `mode` shows the movement best.
    """
    assembly, answer = case.assembly, case.deflection
    drawing = drawing_of(assembly)
    nodes, ways = node_fields(answer.system, answer.unknowns)
    fields = [(np.asarray(nodes[k]), np.asarray(ways[k])) for k in range(len(assembly.parts))]
    furthest = max(_furthest(drawing, case, k, fields) for k in range(len(assembly.parts)))
    scale = nice(DEFORMED_SHARE * drawing.diagonal / furthest) if furthest > 0.0 else 1.0
    moved = _moved(drawing, case, fields, scale)
    change = np.concatenate(moved) - np.concatenate(drawing.points)
    toward, up = sight(
        assembly,
        np.concatenate(drawing.points),
        view=view,
        movement=change if furthest > 0.0 else None,
        aspect=_ASPECT,
    )
    body, edges = model_layers(drawing, moved)
    arrows = _arrows(case, drawing, scale)
    surfaces: tuple[Surface, ...] = (*body, *arrows)
    extent = np.concatenate([*drawing.points, *(surface.points for surface in surfaces)])
    shown = [k for k, part in enumerate(assembly.parts) if not part.fastener]
    order = sorted(
        shown or range(len(assembly.parts)),
        key=lambda k: (-round(float(np.linalg.norm(answer.part_twists[k, :3])) / MM, 9), k),
    )[:_NAMED]
    markers = tuple(
        Marker(0.5 * (moved[k].min(axis=0) + moved[k].max(axis=0)), str(n))
        for n, k in enumerate(order, 1)
    )
    panel = Panel(
        f"Under its loads (deformation x {scale:g})",
        surfaces,
        (edges, outline(drawing, drawing.points)),
        fit(extent, toward, up),
        markers if furthest > 0.0 else (),
    )
    return Scene(
        f"{assembly.name}: the furthest point goes {number(furthest / MM)} mm",
        _subtitle(case),
        (panel,),
        _legend(case, order if furthest > 0.0 else [], arrows),
    )


def _furthest(drawing: Drawing, case: StaticCase, part: int, fields: Movement) -> float:
    """Return how far the furthest drawn point or node of a part goes (m), to first order."""
    center = case.assembly.parts[part].centroid
    twist = case.deflection.part_twists[part]
    way = twist[:3] + np.cross(twist[3:], drawing.points[part] - center)
    nodes, ways = fields[part]
    way = way + bend_field(drawing.points[part], center, twist, nodes, ways)
    return float(np.linalg.norm(way, axis=1).max(initial=0.0))


def _moved(drawing: Drawing, case: StaticCase, fields: Movement, scale: float) -> tuple[Array, ...]:
    out = []
    for k, where in enumerate(drawing.points):
        center = case.assembly.parts[k].centroid
        twist = case.deflection.part_twists[k]
        bent = bend_field(where, center, twist, *fields[k])
        out.append(move_rigidly(where, center, scale * twist) + scale * bent)
    return tuple(out)


def _arrows(case: StaticCase, drawing: Drawing, scale: float) -> list[Surface]:
    """Return the loads as arrows that end where they pull, and the supports as short blue ones."""
    biggest = max((float(np.linalg.norm(load.force)) for load in case.loads), default=0.0)
    pieces = []
    for k, load in enumerate(case.loads):
        if np.linalg.norm(load.force) > 0.0:
            start = load.point + scale * case.deflection.probe_twists[k, :3]
            vector = load.force / biggest * ARROW_SHARE * drawing.diagonal
            pieces.append(arrow(start, vector, ARROW_RADIUS * drawing.diagonal, LOAD_COLOR))
    held = []
    reactions = case.deflection.reactions
    most = float(np.linalg.norm(reactions[:, :3], axis=1).max(initial=0.0))
    for support, reaction in zip(case.assembly.supports, reactions, strict=True):
        point = support.point
        at = case.assembly.parts[support.part].centroid if point is None else point
        if most > 0.0 and np.linalg.norm(reaction[:3]) > 1e-6 * most:
            vector = reaction[:3] / most * ARROW_SHARE * drawing.diagonal
            held.append(arrow(at - vector, vector, ARROW_RADIUS * drawing.diagonal, _HELD))
    return [merge(those, on_top=True) for those in (pieces, held) if those]


def _subtitle(case: StaticCase) -> str:
    said = [count(len(case.loads), "load")] if case.loads else []
    if case.gravity is not None:
        weight = case.deflection.system.mass * float(np.linalg.norm(case.gravity))
        said.append(f"its own weight, {number(weight)} N")
    for k, load in enumerate(case.loads[:_NAMED]):
        way = float(np.linalg.norm(case.deflection.probe_twists[k, :3])) / MM
        force = number(float(np.linalg.norm(load.force)))
        said.append(f"{force} N moves its point {number(way)} mm")
    return " · ".join(said)


def _legend(case: StaticCase, order: list[int], arrows: list[Surface]) -> tuple[LegendItem, ...]:
    legend = [LegendItem("line", OUTLINE, "without loads")]
    if case.loads and arrows:
        legend.append(LegendItem("arrow", LOAD_COLOR, "loads; the longest arrow is the largest"))
    if case.assembly.supports and arrows:
        legend.append(LegendItem("arrow", _HELD, "what the ground gives, at a scale of its own"))
    for n, k in enumerate(order, 1):
        way = float(np.linalg.norm(case.deflection.part_twists[k, :3])) / MM
        name = part_name(case.assembly.parts[k], line=True)
        legend.append(LegendItem(f"disc{n}", (0.80, 0.07, 0.18), f"{number(way)} mm: {name}"))
    return tuple(legend)
