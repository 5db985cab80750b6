"""The assembly file ``technic-assembly/1``: JSON for linkages, frames and anything not made of LEGO parts.

The published schema is `schema/technic-assembly-1.schema.json` beside this module. What a schema cannot
say (names that must exist, lengths that must not be zero) is checked here; every fault becomes one message
with its JSON path.
"""

from __future__ import annotations

import json
from collections.abc import Iterator, Mapping
from functools import cache
from hashlib import sha256
from importlib import resources
from math import isfinite
from pathlib import Path
from typing import Any, Final

import numpy as np

from technic.assembly.joint_types import JointType
from technic.assembly.model import Assembly, Finding, FindingKind, Joint, Part, Support
from technic.assembly.shapes import ShapeFault, as_points, make_shape, section_size
from technic.assembly.stiffness import StiffnessTable, default_table
from technic.assembly.typed_joints import (
    AxisFault,
    connection_stiffness,
    held_motions,
    joint_axes,
    stiffness_of,
    unused_stiffness,
)
from technic.errors import InputError, SchemaError
from technic.geometry import Array, Pose, nearest_orthogonal, readonly
from technic.parts.definition import Material
from technic.parts.materials import ABS, materials

__all__ = ["SCHEMA", "build_assembly", "load_assembly", "schema"]

SCHEMA: Final = "technic-assembly/1"

HELD_NAMES: Final = ("x", "y", "z", "rx", "ry", "rz")

ORTHOGONAL: Final = 1e-6
"""A rotation matrix further from orthogonal than this is refused."""


@cache
def schema() -> dict[str, Any]:
    """Return the JSON schema of the assembly file."""
    resource = resources.files("technic.assembly") / "schema" / "technic-assembly-1.schema.json"
    found: dict[str, Any] = json.loads(resource.read_text(encoding="utf-8"))
    return found


def load_assembly(path: str | Path, *, table: StiffnessTable | None = None) -> Assembly:
    """Read an assembly file.

    Parameters
    ----------
    path : path-like
    table : StiffnessTable, optional
        Stiffness of the connections that joints name; default: the shipped one.

    Raises
    ------
    InputError
        The file is not JSON; SchemaError with every fault if it breaks the schema.
    """
    path = Path(path)
    raw = path.read_bytes()
    repeated: list[str] = []

    def pairs(items: list[tuple[str, Any]]) -> dict[str, Any]:
        out = dict(items)
        if len(out) < len(items):
            keys = [key for key, _ in items]
            repeated.extend(f"key {k!r} stands twice" for k in out if keys.count(k) > 1)
        return out

    try:
        data = json.loads(raw.decode("utf-8-sig"), object_pairs_hook=pairs)
    except UnicodeDecodeError as error:
        raise InputError(f"not UTF-8 text: {error}", path=path) from error
    except json.JSONDecodeError as error:
        raise InputError(f"not JSON: {error.msg}", path=path, line=error.lineno) from error
    except RecursionError as error:
        raise InputError("not an assembly: nested too deeply", path=path) from error
    if repeated:
        raise SchemaError([f"$: {fault}" for fault in repeated], path=path)
    source = {"path": str(path), "sha256": sha256(raw).hexdigest(), "format": "assembly"}
    return build_assembly(data, path=path, source=source, table=table)


def build_assembly(
    data: Any,
    *,
    path: Path | None = None,
    source: Mapping[str, Any] | None = None,
    table: StiffnessTable | None = None,
) -> Assembly:
    """Return the assembly that parsed JSON describes.

    Parameters
    ----------
    data : mapping
        As in the file.
    path : Path, optional
        The file, for messages; mesh files are looked for beside it.
    source : mapping, optional
        What `Assembly.source` becomes.
    table : StiffnessTable, optional
        Stiffness of the connections that joints name; default: the shipped one.

    Raises
    ------
    SchemaError
        One message per fault, each with the JSON path.
    """
    faults = list(_schema_faults(data))
    if faults:
        raise SchemaError(faults, path=path)
    folder = Path() if path is None else path.parent
    builder = _Build(data, folder, table or default_table())
    assembly = builder.run("assembly" if path is None else path.stem, dict(source or {}))
    if builder.faults or assembly is None:
        raise SchemaError(builder.faults, path=path)
    return assembly


def _schema_faults(data: Any) -> Iterator[str]:
    """Yield what the schema finds, in the order of the file, then numbers that are none."""
    from jsonschema import Draft202012Validator

    if isinstance(data, dict) and data.get("schema") != SCHEMA:
        yield f"$.schema: expected {SCHEMA!r}, found {data.get('schema')!r}"
        return
    errors = Draft202012Validator(schema()).iter_errors(data)
    for error in sorted(errors, key=lambda e: [str(p).zfill(9) for p in e.absolute_path]):
        yield f"{error.json_path}: {_said(error)}"
    yield from _not_finite(data, "$")


def _said(error: Any) -> str:
    """Return a schema fault in words; only the start of long values is shown."""
    if error.validator == "additionalProperties":
        known = set(error.schema.get("properties", {}))
        extra = sorted(set(error.instance) - known)
        return f"unknown key {', '.join(map(repr, extra))} (known: {', '.join(sorted(known))})"
    if error.validator == "required":
        missing = [key for key in error.validator_value if key not in error.instance]
        return f"{', '.join(map(repr, missing))} is missing"
    if error.validator == "enum":
        options = ", ".join(str(v) for v in error.validator_value)
        return f"{error.instance!r} is not one of: {options}"
    message: str = error.message
    return message if len(message) < 200 else message[:120] + " ... " + message[-60:]


def _not_finite(value: Any, path: str) -> Iterator[str]:
    if isinstance(value, dict):
        for key, inner in value.items():
            yield from _not_finite(inner, f"{path}.{key}")
    elif isinstance(value, list):
        for k, inner in enumerate(value):
            yield from _not_finite(inner, f"{path}[{k}]")
    elif isinstance(value, float) and not isfinite(value):
        yield f"{path}: {value} is not a finite number"


def _kept(shape: Mapping[str, Any], material: str, points: Array | None) -> dict[str, Any]:
    """Return the shape as the part keeps it: in part coordinates, with the points it was given."""
    out = {k: v for k, v in shape.items() if k not in ("position", "rotation")}
    if points is not None:
        out["points"] = points.tolist()
    return {**out, "material": material}


class _Build:
    """One pass over a file that obeys the schema; faults are collected, not raised."""

    def __init__(self, data: Mapping[str, Any], folder: Path, table: StiffnessTable) -> None:
        self.data = data
        self.folder = folder
        self.table = table
        self.dimension: int = data["dimension"]
        self.faults: list[str] = []
        self.findings: list[Finding] = []
        self.index: dict[str, int] = {}
        self.parts: list[Part] = []

    def run(self, name: str, source: dict[str, Any]) -> Assembly | None:
        """Return the assembly; None when there are faults."""
        data = self.data
        self._index_parts()
        known = {
            **materials(),
            **{
                key: Material(
                    key,
                    float(row["young_pa"]),
                    float(row["poisson"]),
                    float(row["density"]),
                    row.get("source", ""),
                )
                for key, row in data.get("materials", {}).items()
            },
        }
        joint_points = self._attachments()
        for k, row in enumerate(data["parts"]):
            self._part(k, row, known, joint_points.get(row["id"], []))
        if self.faults:
            return None
        joints = self._joints()
        supports = self._supports()
        if self.faults:
            return None
        return Assembly(
            name=data.get("name", name),
            parts=tuple(self.parts),
            joints=tuple(joints),
            supports=tuple(supports),
            dimension=self.dimension,
            findings=tuple(self.findings),
            source=source,
        )

    def _index_parts(self) -> None:
        for k, row in enumerate(self.data["parts"]):
            if row["id"] in self.index:
                first = self.index[row["id"]]
                self.faults.append(
                    f"$.parts[{k}].id: {row['id']!r} is also the id of parts[{first}]"
                )
            self.index.setdefault(row["id"], k)
        for k, row in enumerate(self.data.get("joints", [])):
            for m, name in enumerate(row["parts"]):
                self._known(name, f"$.joints[{k}].parts[{m}]")
        for k, row in enumerate(self.data.get("supports", [])):
            self._known(row["part"], f"$.supports[{k}].part")

    def _known(self, name: str, path: str) -> None:
        if name not in self.index:
            self.faults.append(f"{path}: there is no part {name!r}")

    def _point(self, value: list[float], path: str) -> Array | None:
        try:
            return np.asarray(as_points([value], self.dimension, "")[0])
        except ShapeFault as fault:
            self.faults.append(f"{path}{fault.path.removeprefix('[0]')}: {fault.message}")
            return None

    def _attachments(self) -> dict[str, list[Array]]:
        """Return the points where something attaches to each part."""
        out: dict[str, list[Array]] = {}
        for key in ("joints", "supports"):
            for k, row in enumerate(self.data.get(key, [])):
                if "point" not in row:
                    continue
                at = self._point(row["point"], f"$.{key}[{k}].point")
                for name in row["parts"] if key == "joints" else [row["part"]]:
                    if at is not None:
                        out.setdefault(name, []).append(at)
        return out

    def _part(
        self, k: int, row: Mapping[str, Any], known: Mapping[str, Material], points: list[Array]
    ) -> None:
        shape = row["shape"]
        name = row.get("material", ABS)
        if name not in known:
            self.faults.append(
                f"$.parts[{k}].material: {name!r} is not among the materials: "
                + ", ".join(sorted(known))
            )
            return
        try:
            pose = self._pose(shape)
            made = make_shape(shape, known[name], self.dimension, points, self.folder)
        except ShapeFault as fault:
            self.faults.append(f"$.parts[{k}].shape{fault.path}: {fault.message}")
            return
        except InputError as error:
            self.faults.append(f"$.parts[{k}].shape.file: {error}")
            return
        self.parts.append(
            Part(
                id=row["id"],
                number="",
                name=row.get("name", ""),
                pose=pose,
                ports=(),
                body=made.body,
                mass_properties=made.mass_properties,
                fastener=row.get("fastener", False),
                shape=_kept(shape, name, made.points),
            )
        )

    def _pose(self, shape: Mapping[str, Any]) -> Pose:
        """Return where a mesh is placed; other shapes are given in the assembly's coordinates."""
        if "position" not in shape and "rotation" not in shape:
            return Pose.identity()
        position = as_points([shape.get("position", [0.0, 0.0, 0.0])], self.dimension, ".position")
        rotation = np.array(shape.get("rotation", np.eye(3)), dtype=float).reshape(3, 3)
        nearest = nearest_orthogonal(rotation)
        if np.abs(rotation - nearest).max() > ORTHOGONAL:
            raise ShapeFault(".rotation", "is not an orthogonal matrix")
        if self.dimension == 2 and np.abs(nearest[2, :2]).max() > ORTHOGONAL:
            raise ShapeFault(".rotation", "turns the mesh out of the plane")
        return Pose(rotation, position[0])

    def _joints(self) -> list[Joint]:
        joints: list[Joint] = []
        taken: set[str] = set()
        for k, row in enumerate(self.data.get("joints", [])):
            names = row["parts"]
            pairs = [(a, b) for m, a in enumerate(names) for b in names[m + 1 :]]
            for a, b in pairs:
                base = row.get("id", f"{a}-{b}")
                if len(pairs) > 1 and "id" in row:
                    base = f"{base}:{a}-{b}"
                if base in taken and "id" in row:
                    self.faults.append(f"$.joints[{k}].id: {base!r} stands twice")
                name, n = base, 2
                while name in taken:
                    name, n = f"{base}/{n}", n + 1
                taken.add(name)
                joint = self._joint(k, row, name, (self.index[a], self.index[b]))
                if joint is not None:
                    joints.append(joint)
        return joints

    def _joint(
        self, k: int, row: Mapping[str, Any], name: str, pair: tuple[int, int]
    ) -> Joint | None:
        type_ = JointType(row["type"])
        point = self._point(row["point"], f"$.joints[{k}].point")
        axes_given = []
        for key in ("axis", "axis2"):
            value = row.get(key)
            if value is not None and self.dimension == 3 and len(value) != 3:
                self.faults.append(f"$.joints[{k}].{key}: a direction has 3 components")
                return None
            axes_given.append(None if value is None else np.array([*value, 0.0], dtype=float)[:3])
        try:
            axes = joint_axes(type_, axes_given[0], axes_given[1], self.dimension)
        except AxisFault as fault:
            self.faults.append(f"$.joints[{k}].{fault.key}: {fault.message}")
            return None
        if point is None:
            return None
        held = held_motions(type_, axes, self.dimension)
        size = min(section_size(self.parts[p].body) for p in pair)
        given, jitter = row.get("stiffness"), row.get("jitter")
        values, provenance = stiffness_of(held, given, jitter, size)
        if "connection" in row:
            try:
                values, provenance = connection_stiffness(row, held, self.table)
            except AxisFault as fault:
                self.faults.append(f"$.joints[{k}].{fault.key}: {fault.message}")
                return None
        for motion in unused_stiffness(type_, given, jitter):
            message = (
                f"joint {name}: the {motion} stiffness or play is not used, a {type_} frees it"
            )
            self.findings.append(Finding(FindingKind.WARNING, message, pair))
        return Joint(
            id=name,
            type=type_,
            parts=pair,
            point=point,
            axes=axes,
            held=held,
            stiffness=values,
            connection=row.get("connection", type_.value),
            provenance=row.get("provenance", provenance),
        )

    def _supports(self) -> list[Support]:
        supports = []
        for k, row in enumerate(self.data.get("supports", [])):
            point = None
            if "point" in row:
                point = self._point(row["point"], f"$.supports[{k}].point")
            held = np.array([name in row.get("held", HELD_NAMES) for name in HELD_NAMES])
            if self.dimension == 2:
                held &= np.array([True, True, False, False, False, True])
                if not held.any():
                    self.faults.append(
                        f"$.supports[{k}].held: holds nothing in two dimensions (x, y, rz)"
                    )
            supports.append(
                Support(
                    self.index[row["part"]],
                    None if point is None else readonly(point),
                    readonly(held, dtype=np.bool_),
                )
            )
        return supports
