"""The model as glTF 2.0 with its worst mode as a morph animation, for Blender and viewers.

One binary file (``.glb``). A part type's shape is stored once; what a part adds is how far each of its
corners goes. Axes: metres, y up, as glTF wants it (an LDraw model turned half round about x).

Format: Khronos, "glTF 2.0 Specification".
"""

from __future__ import annotations

import json
import struct
from collections.abc import Sequence
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from technic.geometry import Array
from technic.report.camera import model_axes
from technic.report.drawing import (
    Drawing,
    deformation_scale,
    deformed_points,
    drawing_of,
    worst_way,
)
from technic.report.energy import energy_shares
from technic.report.files import write_bytes
from technic.report.palette import color_alpha, color_rgb
from technic.rigidity.result import RigidityReport
from technic.rigidity.serialize import unit_load

__all__ = ["gltf", "write_gltf"]

_FLOAT, _UINT32 = 5126, 5125
_VERTICES, _INDICES = 34962, 34963

_PERIOD = 2.4
"""Seconds of one swing to and fro."""

_KEYS = 33

_TURN = np.diag([1.0, -1.0, -1.0])
"""From LDraw's axes (y down) to those of glTF (y up)."""


class _Buffer:
    """Arrays behind one another with the accessors that describe them."""

    def __init__(self) -> None:
        self.data = bytearray()
        self.views: list[dict[str, Any]] = []
        self.accessors: list[dict[str, Any]] = []

    def add(
        self, values: NDArray[Any], kind: str, *, target: int | None = None, bounds: bool = False
    ) -> int:
        """Append an array of kind "SCALAR" or "VEC3"; return its accessor's number."""
        integer = np.issubdtype(values.dtype, np.integer)
        array = np.ascontiguousarray(values, dtype="<u4" if integer else "<f4")
        view = {"buffer": 0, "byteOffset": len(self.data), "byteLength": array.nbytes}
        self.views.append(view if target is None else view | {"target": target})
        self.data.extend(array.tobytes())
        accessor: dict[str, Any] = {
            "bufferView": len(self.views) - 1,
            "componentType": _UINT32 if integer else _FLOAT,
            "count": array.size if kind == "SCALAR" else len(array),
            "type": kind,
        }
        if bounds:
            rows = array.reshape(accessor["count"], -1)
            accessor["min"] = [float(v) for v in rows.min(axis=0)]
            accessor["max"] = [float(v) for v in rows.max(axis=0)]
        self.accessors.append(accessor)
        return len(self.accessors) - 1


def _linear(value: float) -> float:
    """Return a colour value of a screen (sRGB) as linear light (IEC 61966-2-1)."""
    return value / 12.92 if value <= 0.04045 else float(((value + 0.055) / 1.055) ** 2.4)


def _material(color: int | None) -> dict[str, Any]:
    alpha = color_alpha(color)
    return ({"alphaMode": "BLEND"} if alpha < 1.0 else {}) | {
        "name": "no colour" if color is None else f"LDraw {color}",
        "pbrMetallicRoughness": {
            "baseColorFactor": [*(_linear(v) for v in color_rgb(color)), alpha],
            "metallicFactor": 0.0,
            "roughnessFactor": 0.6,
        },
        "doubleSided": True,
    }


def _matrix(turn: Array, rotation: Array, translation: Array) -> list[float]:
    """Return the 4 x 4 matrix of a node, turned, column by column."""
    matrix = np.eye(4)
    matrix[:3, :3], matrix[:3, 3] = turn @ rotation, turn @ translation
    return [float(v) + 0.0 for v in matrix.T.ravel()]


def _moved(report: RigidityReport, drawing: Drawing) -> tuple[float, Sequence[Array]]:
    """Return the scale of the deformation and the deformed points of each part; 0 for none."""
    load = unit_load(report)
    furthest = 0.0 if load is None else worst_way(report, drawing, load[1])
    if load is None or furthest == 0.0:
        return 0.0, ()
    scale = deformation_scale(report, drawing, furthest)
    return scale, deformed_points(report, drawing, load[1], scale)


def _animation(buffer: _Buffer, nodes: int) -> dict[str, Any]:
    times = np.linspace(0.0, _PERIOD, _KEYS)
    weights = np.sin(2.0 * np.pi * times / _PERIOD)
    sampler = {
        "input": buffer.add(times, "SCALAR", bounds=True),
        "output": buffer.add(weights, "SCALAR"),
        "interpolation": "LINEAR",
    }
    channels = [
        {"sampler": 0, "target": {"node": node, "path": "weights"}} for node in range(nodes)
    ]
    return {"name": "worst mode", "samplers": [sampler], "channels": channels}


def gltf(report: RigidityReport, drawing: Drawing | None = None) -> bytes:
    """Return the model as binary glTF.

    Parameters
    ----------
    report : RigidityReport
        With at least one part.
    drawing : Drawing, optional
        Of the report's assembly, when it is there already.
    """
    import technic

    drawing = drawing_of(report.assembly) if drawing is None else drawing
    turn = _TURN @ model_axes(report.assembly).T
    buffer = _Buffer()
    scale, moved = _moved(report, drawing)
    shapes: dict[int, tuple[int, int]] = {}
    materials: dict[int | None, int] = {}
    meshes: list[dict[str, Any]] = []
    nodes: list[dict[str, Any]] = []
    energy = energy_shares(report)
    for k, part in enumerate(report.assembly.parts):
        solid = drawing.solids[k]
        if id(solid) not in shapes:
            shapes[id(solid)] = (
                buffer.add(solid.points, "VEC3", target=_VERTICES, bounds=True),
                buffer.add(solid.faces.ravel(), "SCALAR", target=_INDICES),
            )
        points, indices = shapes[id(solid)]
        primitive: dict[str, Any] = {
            "attributes": {"POSITION": points},
            "indices": indices,
            "material": materials.setdefault(part.color, len(materials)),
        }
        mesh: dict[str, Any] = {"name": part.name or part.number, "primitives": [primitive]}
        if scale:
            ways = (moved[k] - drawing.points[k]) @ part.pose.rotation
            target = buffer.add(ways, "VEC3", target=_VERTICES, bounds=True)
            primitive["targets"] = [{"POSITION": target}]
            mesh |= {"weights": [0.0], "extras": {"targetNames": ["worst mode"]}}
        meshes.append(mesh)
        nodes.append(
            {
                "name": part.id,
                "mesh": k,
                "matrix": _matrix(turn, part.pose.rotation, part.pose.translation),
                "extras": {"part_number": part.number, "energy_share": float(energy[k])},
            }
        )
    content: dict[str, Any] = {
        "asset": {
            "version": "2.0",
            "generator": f"technic {technic.__version__}",
            "extras": {"deformation_scale_at_1_n": scale},
        },
        "scene": 0,
        "scenes": [{"name": report.assembly.name, "nodes": list(range(len(nodes)))}],
        "nodes": nodes,
        "meshes": meshes,
        "materials": [_material(color) for color in materials],
    }
    if scale:
        content["animations"] = [_animation(buffer, len(nodes))]
    content |= {
        "accessors": buffer.accessors,
        "bufferViews": buffer.views,
        "buffers": [{"byteLength": len(buffer.data)}],
    }
    return _binary(content, bytes(buffer.data))


def _binary(content: dict[str, Any], data: bytes) -> bytes:
    """Return the GLB container: header, JSON chunk, binary chunk, each on 4 bytes."""
    text = json.dumps(content, ensure_ascii=False, allow_nan=False, separators=(",", ":"))
    header = text.encode("utf-8")
    header += b" " * (-len(header) % 4)
    data += b"\0" * (-len(data) % 4)
    chunks = struct.pack("<I4s", len(header), b"JSON") + header
    chunks += struct.pack("<I4s", len(data), b"BIN\0") + data
    return struct.pack("<4sII", b"glTF", 2, 12 + len(chunks)) + chunks


def write_gltf(report: RigidityReport, path: Path, drawing: Drawing | None = None) -> None:
    """Write `gltf` into a file.

    Raises
    ------
    UsageError
        When the file cannot be written.
    """
    write_bytes(path, gltf(report, drawing))
