"""A calibration rig in its poses, as it stands on the table: clamp, weight and ruler beside it."""

from __future__ import annotations

from typing import Final

import numpy as np

from calibration.rigs import Pose, Rig
from technic.assembly.model import Assembly
from technic.assembly.stiffness import default_table
from technic.geometry import Array
from technic.report.arrows import tube
from technic.report.camera import fit
from technic.report.drawing import Drawing, drawing_of
from technic.report.picture import model_layers
from technic.report.scene import RGB, LegendItem, Lines, Marker, Panel, Scene, Surface
from technic.statics.forward import held_rig
from technic.statics.loads import parse_probe
from technic.units import LDU, MM

__all__ = ["rig_scene"]

_CLAMP: Final[RGB] = (0.15, 0.42, 0.75)
_WEIGHT: Final[RGB] = (0.16, 0.55, 0.36)
_RULER: Final[RGB] = (0.93, 0.78, 0.35)
_THREAD: Final[RGB] = (0.25, 0.25, 0.25)
_DISC: Final[RGB] = (0.80, 0.05, 0.20)
_TICK: Final[RGB] = (0.15, 0.15, 0.15)

_AROUND: Final = 10.5 * LDU
"""Half the width of a beam, and a little: the jaws of the clamp touch it."""

_ELEVATION: Final = np.radians(24.0)
_AZIMUTHS: Final = np.radians(np.arange(0.0, 360.0, 15.0))


def rig_scene(rig: Rig) -> Scene:
    """Return the picture of a rig, one panel per pose, down being down.

    Raises
    ------
    TechnicError
        The rig's model cannot be read, or has no such clamped or loaded place.
    """
    assembly = held_rig(rig, default_table())
    drawing = drawing_of(assembly)
    place = parse_probe(assembly, rig.loads[0].place).point
    panels = tuple(
        _panel(name, pose, assembly, drawing, np.asarray(place)) for name, pose in rig.poses.items()
    )
    legend = (
        LegendItem("patch", _CLAMP, "clamp: holds it still"),
        LegendItem("patch", _WEIGHT, "weight, on a thread"),
        LegendItem("patch", _RULER, "ruler"),
        LegendItem("disc", _DISC, "1: hang here, read here"),
    )
    return Scene(f"Rig {rig.name}", rig.title, panels, legend, size=(120 + 460 * len(panels), 660))


def _panel(name: str, pose: Pose, assembly: Assembly, drawing: Drawing, place: Array) -> Panel:
    down = pose.down_at(pose.angle_deg)
    surfaces, edges = model_layers(drawing, drawing.points)
    clamps = [_box(*corners, _CLAMP, opacity=0.45) for corners in _clamped(assembly, drawing)]
    toward = _toward(np.concatenate(drawing.points), down)
    right = np.cross(-down, toward)
    right = right / np.linalg.norm(right)
    size = drawing.diagonal
    knot = place + 0.32 * size * down
    hung = [
        tube(place, knot, 0.4 * MM, _THREAD),
        tube(knot, knot + 0.16 * size * down, 0.075 * size, _WEIGHT),
    ]
    seen = [*(s.points for s in (*surfaces, *clamps, *hung))]
    # beside the loaded hole, on the side where nothing else is
    middle = np.concatenate(drawing.points).mean(axis=0)
    side = 1.0 if right @ (place - middle) >= 0.0 else -1.0
    ruler, ticks = _ruler(place + side * 0.16 * size * right, down, side * right, toward, size)
    camera = fit(np.concatenate([*seen, ruler.points]), toward, -down)
    return Panel(
        f"pose: {name}",
        (*surfaces, *hung, ruler, *clamps),
        (edges, ticks),
        camera,
        (Marker(place, "1"),),
    )


def _toward(points: Array, down: Array) -> Array:
    """Return where to look from: a little above, from the side that shows most of the model."""
    first = np.cross(down, np.eye(3)[int(np.argmin(np.abs(down)))])
    first = first / np.linalg.norm(first)
    second = np.cross(down, first)
    best, most = first, -1.0
    for azimuth in _AZIMUTHS:
        level = np.cos(azimuth) * first + np.sin(azimuth) * second
        toward = np.cos(_ELEVATION) * level - np.sin(_ELEVATION) * down
        across = np.cross(-down, toward)
        across = across / np.linalg.norm(across)
        spread = float(np.ptp(points @ across) * np.ptp(points @ np.cross(toward, across)))
        # of views that show equally much, one from the front of the LDraw file (-z)
        spread *= 1.0 - 0.02 * toward[2] - 0.01 * toward[0]
        if spread > most:
            best, most = toward, spread
    return np.asarray(best)


def _clamped(assembly: Assembly, drawing: Drawing) -> list[tuple[Array, Array]]:
    """Return the boxes that are clamped, one per part: low and high corners."""
    boxes = []
    for part in dict.fromkeys(support.part for support in assembly.supports):
        points = [s.point for s in assembly.supports if s.part == part and s.point is not None]
        if points:
            low = np.min(points, axis=0) - _AROUND
            high = np.max(points, axis=0) + _AROUND
        else:
            low = drawing.points[part].min(axis=0) - 0.5 * LDU
            high = drawing.points[part].max(axis=0) + 0.5 * LDU
        boxes.append((low, high))
    return boxes


def _box(low: Array, high: Array, color: RGB, *, opacity: float = 1.0) -> Surface:
    """Return a box along the axes."""
    corners = np.array([[x, y, z] for x in (0, 1) for y in (0, 1) for z in (0, 1)], dtype=float)
    points = low + corners * (high - low)
    quads = [(0, 1, 3, 2), (4, 6, 7, 5), (0, 4, 5, 1), (2, 3, 7, 6), (0, 2, 6, 4), (1, 5, 7, 3)]
    faces = [tri for a, b, c, d in quads for tri in ((a, b, c), (a, c, d))]
    # every face has corners of its own, so that edges stay sharp
    own = points[np.array(faces).ravel()]
    index = np.arange(len(own), dtype=np.int64).reshape(-1, 3)
    return Surface(own, index, np.tile(color, (len(own), 1)), opacity)


def _ruler(
    top: Array, down: Array, right: Array, toward: Array, size: float
) -> tuple[Surface, Lines]:
    """Return a ruler that stands upright, millimetres counting downward, and its marks."""
    start = top - 0.2 * size * down
    length, width = 0.75 * size, 0.07 * size
    corners = np.array(
        [start, start + width * right, start + length * down + width * right, start + length * down]
    )
    blade = Surface(
        corners, np.array([[0, 1, 2], [0, 2, 3]], dtype=np.int64), np.tile(_RULER, (4, 1))
    )
    points: list[Array] = []
    for k in range(int(length / (2.0 * MM)) + 1):
        foot = start + k * 2.0 * MM * down + 1e-4 * toward
        points += [foot, foot + (0.6 if k % 5 == 0 else 0.3) * width * right]
    segments = np.arange(len(points), dtype=np.int64).reshape(-1, 2)
    return blade, Lines(np.array(points), segments, np.tile(_TICK, (len(points), 1)), 1.2)
