"""The model as one block of bytes for the page's viewer, and the table that says what lies where.

The block is compressed (gzip) and written once in base64. All arrays are little-endian; lengths are in
millimetres from the middle of the model, in the axes of the model file. Nothing is stored per part that
belongs to its type.
"""

from __future__ import annotations

import base64
import gzip
import hashlib
import json
from collections.abc import Sequence
from dataclasses import dataclass, field
from typing import Any

import numpy as np
from numpy.typing import NDArray

from technic.geometry import Array
from technic.report.camera import model_axes, sight
from technic.report.drawing import Drawing
from technic.report.energy import energy_shares
from technic.report.heat import RAMP
from technic.report.html.compact import compact
from technic.report.html.fields import Field, mode_fields, motion_fields
from technic.report.html.shapes import Shapes, shapes_of
from technic.report.load_arrows import ARROW_RADIUS, ARROW_SHARE, load_samples
from technic.report.motion_picture import motion_glyphs
from technic.report.palette import color_alpha, color_name, color_rgb
from technic.report.phrases import motion_words
from technic.report.scene import merge
from technic.report.wording import number
from technic.report.worst_field import worst_field
from technic.rigidity.result import MotionKind, RigidityReport
from technic.rigidity.serialize import spot_place
from technic.units import MM

__all__ = ["Block", "corners_of", "extremes", "pack"]

_GLYPHS_ABOVE = 12
"""Motions after these many have no arrows of their own: they are played."""


@dataclass(slots=True)
class Block:
    """Arrays behind one another, each on a multiple of 4 bytes."""

    data: bytearray = field(default_factory=bytearray)
    places: dict[tuple[str, bytes], dict[str, Any]] = field(default_factory=dict)

    def add(self, values: Any, dtype: str) -> dict[str, Any]:
        """Append an array ("float32", "uint32", "int16", "uint16", "uint8"); return where it lies.

        What is there already is not stored again: models of one page share their shapes.
        """
        array: NDArray[Any] = np.ascontiguousarray(values, dtype=np.dtype(dtype).newbyteorder("<"))
        content = array.tobytes()
        key = (dtype, hashlib.sha256(content).digest())
        if key not in self.places:
            self.data.extend(b"\0" * (-len(self.data) % 4))
            self.places[key] = {"type": dtype, "at": len(self.data), "length": int(array.size)}
            self.data.extend(content)
        return self.places[key]

    def text(self) -> str:
        """Return the block compressed, in base64; the same bytes for the same content."""
        return base64.b64encode(gzip.compress(bytes(self.data), 9, mtime=0)).decode("ascii")


class _Words:
    """Each text once; others refer to it by number."""

    def __init__(self) -> None:
        self.texts: dict[str, int] = {}

    def number(self, text: str) -> int:
        return self.texts.setdefault(text, len(self.texts))


def corners_of(points: Sequence[Array]) -> Array:
    """Return the corners of each part's box along the world axes, (8 p, 3): few points, same extent."""
    boxes = np.array([(where.min(axis=0), where.max(axis=0)) for where in points])
    picks = np.array(np.meshgrid(*[[0, 1]] * 3)).reshape(3, -1).T
    return np.asarray(boxes[:, picks, np.arange(3)].reshape(-1, 3))


def extremes(points: Array) -> list[list[float]]:
    """Return the outermost points along a few dozen directions (mm): what a camera must see."""
    steps = np.array(np.meshgrid(*[[-2, -1, 0, 1, 2]] * 3)).reshape(3, -1).T
    directions = steps[np.abs(steps).max(axis=1) == 2]
    found = np.unique((points @ directions.T).argmax(axis=0))
    return [[round(float(v) / MM, 2) for v in points[k]] for k in found]


def _parts(report: RigidityReport, drawing: Drawing, words: _Words) -> list[Any]:
    rows = []
    for k, part in enumerate(report.assembly.parts):
        source = part.source
        rows.append(
            [
                words.number(part.number),
                words.number(part.name or part.number or part.id),
                words.number(color_name(part.color)),
                words.number(source.submodel if source is not None else part.id),
                source.step if source is not None else 0,
                source.line if source is not None else 0,
                int(part.fastener),
                int(drawing.solids[k].stand_in),
            ]
        )
    return rows


def _shapes(block: Block, shapes: Shapes) -> list[dict[str, Any]]:
    members: list[list[int]] = [[] for _ in shapes.solids]
    for k, t in enumerate(shapes.of_part):
        members[t].append(k)
    return [
        {
            "points": block.add(points / MM, "float32"),
            "faces": block.add(codes, "uint16"),
            "edges": block.add(flags, "uint8"),
            "parts": block.add(mine, "uint32"),
        }
        for (points, codes, flags), mine in zip(
            (compact(solid) for solid in shapes.solids), members, strict=True
        )
    ]


def _field(block: Block, movement: Field) -> dict[str, Any]:
    twists = movement.twists.copy()
    twists[:, :3] /= MM
    found: dict[str, Any] = {
        "twists": block.add(twists, "float32"),
        "scale": movement.scale,
        "turns": movement.turns,
    }
    if movement.bending is not None:
        # As steps of a 32767th of the largest: half the bytes, and nothing that an eye could see.
        bending = movement.bending / MM
        unit = max(float(np.abs(bending).max()), 1e-300) / 32767.0
        found["unit"] = unit
        found["bending"] = block.add(np.round(bending / unit), "int16")
        found["sizes"] = block.add(movement.sizes / MM, "float32")
    return found


def _load(
    block: Block,
    report: RigidityReport,
    diagonal: float,
    scale: float,
    middle: Array,
    strongest: float | None,
) -> Any:
    sampled = worst_field(report)
    if sampled is None:
        return None
    samples = load_samples(report, diagonal, sampled, scale)
    if not samples:
        return None
    ways = sampled.displacements[samples]
    largest = float(np.linalg.norm(ways, axis=1).max())
    if strongest is not None:
        largest = strongest / sampled.load_per_mass
    return {
        "points": block.add((sampled.points[samples] - middle) / MM, "float32"),
        "ways": block.add(ways / MM, "float32"),
        "parts": block.add(sampled.parts[samples], "uint32"),
        "vectors": block.add(ways / largest * ARROW_SHARE * diagonal / MM, "float32"),
        "radius": ARROW_RADIUS * diagonal / MM,
    }


def _motions(
    block: Block, report: RigidityReport, drawing: Drawing, shapes: Shapes, middle: Array
) -> list[dict[str, Any]]:
    found = []
    for n, (motion, movement) in enumerate(motion_fields(report, drawing, shapes)):
        entry = _field(block, movement)
        entry["parts"] = block.add(list(movement.movers), "uint32")
        entry["kind"] = motion.kind.value
        entry["number"] = report.motions.index(motion)
        entry["words"] = motion_words(report, motion)
        if n < _GLYPHS_ABOVE and motion.kind is MotionKind.STRUCTURAL:
            glyphs = motion_glyphs(motion, report, drawing.points, drawing.diagonal)
            if glyphs:
                surface = merge(glyphs)
                entry["arrows"] = {
                    "points": block.add((surface.points - middle) / MM, "float32"),
                    "faces": block.add(surface.faces, "uint16"),
                }
        found.append(entry)
    return found


def _spots(report: RigidityReport, limit: int) -> list[dict[str, Any]]:
    found = []
    for spot in report.weak_spots[:limit]:
        place = spot_place(report.assembly, spot)
        point = report.assembly.joints[spot.index].point if spot.kind == "joint" else None
        found.append(
            {
                "rank": spot.rank,
                "part": next(k for k in spot.parts if report.assembly.parts[k] is place),
                "parts": list(spot.parts),
                "point": None if point is None else [float(v) for v in point],
            }
        )
    return found


def pack(
    report: RigidityReport,
    drawing: Drawing,
    block: Block,
    *,
    spots: int = 0,
    middle: Array | None = None,
    strongest: float | None = None,
) -> dict[str, Any]:
    """Put a model into the block; return its table of contents, ready for JSON.

    Parameters
    ----------
    report : RigidityReport
    drawing : Drawing
    block : Block
    spots : int
        How many weak spots have a row to fly from.
    middle : (3,) ndarray, optional
        The point (m) that everything is placed from; of the model's box unless given.
    strongest : float, optional
        The load (N/kg) that has the longest arrow; this model's strongest unless given.
    """
    parts = report.assembly.parts
    shapes = shapes_of(parts, drawing.solids)
    corners = corners_of(drawing.points)
    low, high = corners.min(axis=0), corners.max(axis=0)
    middle = 0.5 * (low + high) if middle is None else middle
    energy = energy_shares(report)
    words = _Words()
    modes = mode_fields(report, drawing, shapes)
    field = worst_field(report)
    movement = None if field is None else field.displacements
    toward, _ = sight(report.assembly, corners, movement=movement)
    rotations = np.array([part.pose.rotation for part in parts])
    translations = np.array([part.pose.translation for part in parts])
    centroids = np.array([part.centroid for part in parts])
    inner = np.array([part.mass_properties.centroid for part in parts])
    rows = _parts(report, drawing, words)
    contents: dict[str, Any] = {
        "name": report.assembly.name,
        "count": len(parts),
        "half": [float(v) for v in 0.5 * (high - low) / MM],
        "extremes": extremes(corners - middle),
        "light": shapes.light,
        "ramp": [list(stop) for stop in RAMP],
        "toward": [float(v) for v in toward],
        "axes": model_axes(report.assembly).ravel().tolist(),
        "rotations": block.add(rotations, "float32"),
        "translations": block.add((translations - middle) / MM, "float32"),
        "centroids": block.add((centroids - middle) / MM, "float32"),
        "inner": block.add(inner / MM, "float32"),
        "colors": block.add(
            np.round(255 * np.array([(*color_rgb(p.color), color_alpha(p.color)) for p in parts])),
            "uint8",
        ),
        "energy": block.add(energy, "float32"),
        "shapes": _shapes(block, shapes),
        "modes": [
            {
                **_field(block, movement),
                "label": f"{number(mode.value)} N/m",
                "bends": movement.bending is not None,
            }
            for mode, movement in zip(
                [m for m in report.modes if m.value > 0.0], modes, strict=False
            )
        ],
        "load": _load(block, report, drawing.diagonal, modes[0].scale, middle, strongest)
        if modes
        else None,
        "motions": _motions(block, report, drawing, shapes, middle),
    }
    spot_rows = _spots(report, spots)
    for row in spot_rows:
        if row["point"] is not None:
            row["point"] = [float(v) for v in (np.array(row["point"]) - middle) / MM]
    contents["spots"] = spot_rows
    told = json.dumps({"words": list(words.texts), "rows": rows}, ensure_ascii=False)
    contents["parts"] = block.add(np.frombuffer(told.encode("utf-8"), dtype=np.uint8), "uint8")
    return contents
