"""Write an assembly as an assembly file; reading it back gives the same assembly."""

from __future__ import annotations

import json
import os
from collections.abc import Mapping
from pathlib import Path
from typing import Any

import numpy as np

from technic.assembly.file import HELD_NAMES, SCHEMA
from technic.assembly.joint_types import JointType
from technic.assembly.model import Assembly, Joint, Part, Support
from technic.assembly.typed_joints import stiffness_to_file
from technic.errors import UsageError
from technic.geometry import Array, Pose
from technic.parts.definition import FrameBody, Material, RigidBody
from technic.parts.materials import ABS, materials

__all__ = ["save_assembly", "to_document"]


def save_assembly(assembly: Assembly, path: str | Path) -> None:
    """Write an assembly file.

    Raises
    ------
    UsageError
        The assembly has parts of a LEGO catalogue, which an assembly file cannot describe.
    """
    path = Path(path)
    data = to_document(assembly)
    home = assembly.source.get("path")
    for row in data["parts"]:
        if "file" in row["shape"] and home is not None:
            file = Path(home).parent / row["shape"]["file"]
            row["shape"]["file"] = os.path.relpath(file, path.parent)
    path.write_text(json.dumps(data, indent=1, allow_nan=False) + "\n", encoding="utf-8")


def to_document(assembly: Assembly) -> dict[str, Any]:
    """Return an assembly as the JSON object of its file.

    Joints are written with the stiffness that they have, defaults and play included, and with where it
    comes from; those that name a connection of the stiffness table, with that name.

    Raises
    ------
    UsageError
        A part has no shape of an assembly file.
    """
    used: dict[str, Material] = {}
    parts = [_part(part, assembly.dimension, used) for part in assembly.parts]
    data: dict[str, Any] = {
        "schema": SCHEMA,
        "name": assembly.name,
        "dimension": assembly.dimension,
    }
    known = materials()
    own = {name: m for name, m in used.items() if m != known.get(name)}
    if own:
        data["materials"] = {name: _material(own[name]) for name in sorted(own)}
    data["parts"] = parts
    if assembly.joints:
        data["joints"] = [_joint(assembly, joint) for joint in assembly.joints]
    if assembly.supports:
        data["supports"] = [_support(assembly, support) for support in assembly.supports]
    return data


def _material(material: Material) -> dict[str, Any]:
    out: dict[str, Any] = {
        "young_pa": material.young_pa,
        "poisson": material.poisson,
        "density": material.density,
    }
    if material.source:
        out["source"] = material.source
    return out


def _numbers(values: Array, dimension: int = 3) -> list[float]:
    return [float(v) + 0.0 for v in values[:dimension]]


def _part(part: Part, dimension: int, used: dict[str, Material]) -> dict[str, Any]:
    if not part.shape:
        raise UsageError(
            f"part {part.id} is a LEGO part: an assembly file describes shapes; "
            "write the model as LDraw instead"
        )
    shape = {key: value for key, value in part.shape.items() if key != "material"}
    name = str(part.shape.get("material", ABS))
    if not isinstance(part.body, RigidBody):
        name = part.body.material.name
        if used.setdefault(name, part.body.material) != part.body.material:
            raise UsageError(f"two materials are called {name!r}")
    else:
        shape["mass"] = part.mass_properties.mass
        name = ABS
    row: dict[str, Any] = {"id": part.id}
    if part.name:
        row["name"] = part.name
    row["shape"] = _placed(shape, part, dimension)
    if name != ABS:
        row["material"] = name
    if part.fastener:
        row["fastener"] = True
    return row


def _placed(shape: Mapping[str, Any], part: Part, dimension: int) -> dict[str, Any]:
    """Return the shape in the assembly's coordinates."""
    out = dict(shape)
    pose = part.pose
    if _still(pose):
        return out
    if shape["kind"] == "mesh":
        out["position"] = _numbers(pose.translation, dimension)
        out["rotation"] = _numbers(pose.rotation.ravel(), 9)
        return out
    if "points" in shape:
        points = np.zeros((len(shape["points"]), 3))
        for k, point in enumerate(shape["points"]):
            points[k, : len(point)] = point
        out["points"] = [_numbers(p, dimension) for p in pose.points(points)]
    if isinstance(part.body, FrameBody):
        normals = pose.directions(part.body.normals)
        out["normal"] = [_numbers(n) for n in normals]
    return out


def _still(pose: Pose) -> bool:
    return bool(np.all(pose.rotation == np.eye(3)) and np.all(pose.translation == 0.0))


def _joint(assembly: Assembly, joint: Joint) -> dict[str, Any]:
    row: dict[str, Any] = {
        "id": joint.id,
        "type": joint.type.value,
        "parts": [assembly.parts[p].id for p in joint.parts],
        "point": _numbers(joint.point, assembly.dimension),
    }
    if joint.type is JointType.UNIVERSAL:
        row["axis"], row["axis2"] = _numbers(joint.axes[1]), _numbers(joint.axes[2])
    else:
        row["axis"] = _numbers(joint.axes[0])
        if joint.type is JointType.SLOT:
            row["axis2"] = _numbers(joint.axes[1])
    if joint.connection != joint.type.value:
        # its stiffness is the table's, whichever is in force when the file is read
        row["connection"] = joint.connection
        return row
    row["stiffness"] = stiffness_to_file(joint.held, joint.stiffness)
    if joint.provenance:
        row["provenance"] = joint.provenance
    return row


def _support(assembly: Assembly, support: Support) -> dict[str, Any]:
    row: dict[str, Any] = {"part": assembly.parts[support.part].id}
    if support.point is not None:
        row["point"] = _numbers(support.point, assembly.dimension)
    row["held"] = [name for name, held in zip(HELD_NAMES, support.held, strict=True) if held]
    return row
