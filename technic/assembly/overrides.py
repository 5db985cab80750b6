"""Corrections of a user to the connections that were found, from a file of his own.

A TOML file of schema ``technic-overrides/1``. Parts are named as on the command line: by id, by the
end of an id, or by a part number that the model has once. ::

    schema = "technic-overrides/1"

    [[ignore]]                  # leave a part out
    part = "main.ldr/12:3001"

    [[remove]]                  # take the joints between two parts away, or one joint by its id
    parts = ["3:32524", "4:2780"]

    [[retype]]                  # what the joints between two parts hold
    parts = ["3:32524", "5:3705"]
    type = "fixed"
    stiffness = { axial = 1e5 } # N/m, N m/rad; or "rigid"; left out: 1e4 N/m, 0.16 N m/rad

    [[add]]                     # a joint that was not found; `point` in LDU of the model
    parts = ["3:32524", "9:3001"]
    type = "hinge"
    point = [0, -8, 40]
    axis = [0, 1, 0]

    [[weld]]                    # parts that are one piece
    parts = ["20:3001", "21:3001", "22:3001"]

    [[material]]                # what a part, or every part of a number, is made of; without `part`: all
    part = "3705"
    material = "PC"             # or { young_gpa = 2.4, poisson = 0.37, density = 1200 }
"""

from __future__ import annotations

import tomllib
from collections.abc import Callable, Mapping
from dataclasses import replace
from itertools import pairwise
from math import isfinite
from pathlib import Path
from typing import Any, Final

import numpy as np

from technic.assembly.joint_types import HELD, MOTION_NAMES, JointType
from technic.assembly.materials import apply_materials, known_material, plastic_parts
from technic.assembly.model import Assembly, Finding, FindingKind, Joint
from technic.assembly.select import find_part, find_parts
from technic.assembly.typed_joints import AxisFault, joint_axes, stiffness_of
from technic.errors import InputError, SchemaError, UsageError
from technic.geometry import Array, axes_from, readonly
from technic.parts.definition import Material
from technic.units import LDU

__all__ = ["SCHEMA", "apply_overrides", "by_user", "read_overrides"]

SCHEMA: Final = "technic-overrides/1"

WELD: Final = "weld"
ADDED: Final = "@override"
"""What tells a joint of the user: its connection, or a piece of its id."""

ARM: Final = 0.004
"""Lever arm (m) of rotational stiffnesses that the file leaves out: a bore's radius and a half."""

MAX_BYTES: Final = 2**20

_KEYS: Final[dict[str, frozenset[str]]] = {
    "ignore": frozenset({"part"}),
    "remove": frozenset({"parts", "joint"}),
    "retype": frozenset({"parts", "joint", "type", "axis", "axis2", "stiffness"}),
    "add": frozenset({"parts", "type", "point", "axis", "axis2", "stiffness"}),
    "weld": frozenset({"parts"}),
    "material": frozenset({"part", "material"}),
}

_FILE: Final = "overrides file"


def read_overrides(path: str | Path) -> dict[str, Any]:
    """Read a file of corrections; `apply_overrides` checks what it says.

    Raises
    ------
    InputError
        It cannot be read, is absurdly big, or is not TOML.
    """
    place = Path(path)
    try:
        if place.stat().st_size > MAX_BYTES:
            raise InputError("larger than any file of corrections", path=path)
        return tomllib.loads(place.read_text(encoding="utf-8"))
    except OSError as error:
        raise InputError(f"cannot be read: {error.strerror}", path=path) from None
    except (UnicodeDecodeError, tomllib.TOMLDecodeError, RecursionError) as error:
        raise InputError(f"not a TOML file: {error}", path=path) from None


class _Fault(Exception):
    """What is wrong with an entry: the key and a sentence."""

    def __init__(self, key: str, message: str) -> None:
        super().__init__(message)
        self.key, self.message = key, message


def by_user(joint: Joint) -> bool:
    """Tell whether a joint was added by a user's correction."""
    return joint.connection == WELD or ADDED in joint.id


def apply_overrides(
    assembly: Assembly,
    content: Mapping[str, Any],
    path: str | Path = "",
    *,
    join: Callable[[Assembly], Assembly] | None = None,
    lenient: bool = False,
) -> Assembly:
    """Return the assembly with a user's corrections; each becomes a finding of the report.

    Parameters
    ----------
    assembly : Assembly
    content : mapping
        As from `read_overrides`.
    path : path-like
        The file, for messages.
    join : callable, optional
        Finds the joints, once the parts to ignore are gone. Left out: they have been found.
    lenient : bool
        Pass over what does not apply, instead of raising.

    Returns
    -------
    Assembly
        Its `joining`, if it has one, has the corrections with all parts named by their ids.

    Raises
    ------
    SchemaError
        With every fault: unknown keys, parts that do not exist, joints that are not there.
    """
    faults: list[str] = []
    if content.get("schema") != SCHEMA:
        faults.append(f"schema: expected {SCHEMA!r}, found {content.get('schema')!r}")
    faults += [f"{key}: unknown" for key in sorted(set(content) - {"schema", *_KEYS})]
    change = _Change(assembly)
    for table, keys in _KEYS.items():
        rows = content.get(table, [])
        if not isinstance(rows, list):
            faults.append(f"{table}: expected [[{table}]]")
            continue
        for n, row in enumerate(rows, 1):
            where = f"{table}[{n}]"
            if not isinstance(row, dict):
                faults.append(f"{where}: expected a table")
                continue
            faults += [f"{where}.{key}: unknown" for key in sorted(set(row) - keys)]
            try:
                getattr(change, table)(row)
                change.done[table].append(change.named(row))
            except _Fault as fault:
                faults.append(f"{where}.{fault.key}: {fault.message}")
        if table == "ignore":
            change.leave_out(join)
    if faults and not lenient:
        raise SchemaError(faults, path=path or None)
    return change.result()


class _Change:
    """An assembly while it is being corrected."""

    def __init__(self, assembly: Assembly) -> None:
        self.assembly = assembly
        self.joints = list(assembly.joints)
        self.ignored: set[int] = set()
        self.findings: list[Finding] = []
        self.made_of: dict[int, Material] = {}
        self.done: dict[str, list[dict[str, Any]]] = {table: [] for table in _KEYS}

    def named(self, row: Mapping[str, Any]) -> dict[str, Any]:
        """Return an entry with its parts named by their ids, which stay when other parts come."""
        named = dict(row)
        if "material" in row:
            return named  # it may be for every part of a number, those to come too
        ids = [part.id for part in self.assembly.parts]
        if "parts" in row:
            named["parts"] = [ids[find_part(self.assembly, name)] for name in row["parts"]]
        if "part" in row:
            named["part"] = ids[find_part(self.assembly, row["part"])]
        return named

    def leave_out(self, join: Callable[[Assembly], Assembly] | None) -> None:
        """Take the parts to ignore away and find the joints of the others."""
        old = self.assembly
        keep = [k for k in range(len(old.parts)) if k not in self.ignored]
        place = {k: n for n, k in enumerate(keep)}
        self.findings = [
            Finding(FindingKind.OVERRIDE, f"{_FILE}: {old.parts[k].id} is left out")
            for k in sorted(self.ignored)
        ]
        bare = replace(
            old,
            parts=tuple(old.parts[k] for k in keep),
            joints=tuple(
                replace(j, parts=(place[j.parts[0]], place[j.parts[1]]))
                for j in old.joints
                if not self.ignored & set(j.parts)
            ),
            supports=tuple(replace(s, part=place[s.part]) for s in old.supports if s.part in place),
            findings=tuple(
                replace(f, parts=tuple(place[p] for p in f.parts))
                for f in old.findings
                if not self.ignored & set(f.parts)
            ),
        )
        self.assembly = bare if join is None else join(bare)
        self.joints = list(self.assembly.joints)

    # --- entries ------------------------------------------------------------------------------
    def ignore(self, row: Mapping[str, Any]) -> None:
        part = self._part(row.get("part"), "part")
        self.ignored.add(part)

    def remove(self, row: Mapping[str, Any]) -> None:
        chosen = self._joints(row)
        self.joints = [joint for joint in self.joints if id(joint) not in chosen]
        self._note(f"{len(chosen)} joint(s) taken away", self._pair_of(row))

    def retype(self, row: Mapping[str, Any]) -> None:
        chosen = self._joints(row)
        for k, joint in enumerate(self.joints):
            if id(joint) in chosen:
                made = self._joint(row, joint.parts, joint.id, joint.point, joint.axes)
                self.joints[k] = replace(made, ports=joint.ports, offset=joint.offset)
        self._note(f"{len(chosen)} joint(s) made {row['type']}", self._pair_of(row))

    def add(self, row: Mapping[str, Any]) -> None:
        pair = self._parts(row, exactly=2)
        point = self._vector(row.get("point"), "point") * LDU
        names = "~".join(self.assembly.parts[p].id for p in pair)
        number = 1 + sum(j.id.startswith(f"{names}{ADDED}") for j in self.joints)
        made = self._joint(row, (pair[0], pair[1]), f"{names}{ADDED}{number}", point, None)
        self.joints.append(made)
        self._note(f"a {made.type.value} joint was added", pair)

    def weld(self, row: Mapping[str, Any]) -> None:
        parts = self._parts(row, exactly=None)
        for first, second in pairwise(parts):
            a, b = sorted((first, second))
            one, other = self.assembly.parts[a], self.assembly.parts[b]
            self.joints.append(
                Joint(
                    id=f"{one.id}~{other.id}@weld",
                    type=JointType.FIXED,
                    parts=(a, b),
                    point=(one.centroid + other.centroid) / 2.0,
                    axes=axes_from((1.0, 0.0, 0.0)),
                    held=np.ones(6, dtype=bool),
                    stiffness=np.full(6, np.inf),
                    connection=WELD,
                    provenance=_FILE,
                )
            )
        self._note(f"{len(parts)} parts are one piece", parts)

    def material(self, row: Mapping[str, Any]) -> None:
        try:
            made_of = known_material(row.get("material"))
        except InputError as fault:
            raise _Fault("material", fault.message) from None
        if "part" not in row:
            self.made_of = dict.fromkeys(plastic_parts(self.assembly), made_of) | self.made_of
            return
        if not isinstance(row["part"], str):
            raise _Fault("part", "expected the name of a part")
        try:
            self.made_of |= dict.fromkeys(find_parts(self.assembly, row["part"]), made_of)
        except UsageError as fault:
            raise _Fault("part", str(fault)) from None

    def result(self) -> Assembly:
        """Return the corrected assembly."""
        done = {"schema": SCHEMA} | {table: rows for table, rows in self.done.items() if rows}
        joining = self.assembly.joining
        corrected = replace(
            self.assembly,
            joints=tuple(self.joints),
            findings=(*self.assembly.findings, *self.findings),
            joining=None if joining is None else replace(joining, corrections=done),
        )
        return apply_materials(corrected, self.made_of)

    # --- pieces of entries ----------------------------------------------------------------------
    def _note(self, what: str, parts: tuple[int, ...]) -> None:
        names = ", ".join(self.assembly.parts[p].id for p in parts)
        self.findings.append(Finding(FindingKind.OVERRIDE, f"{_FILE}: {what} ({names})", parts))

    def _part(self, value: Any, key: str) -> int:
        if not isinstance(value, str):
            raise _Fault(key, "expected the name of a part")
        try:
            return find_part(self.assembly, value)
        except UsageError as error:
            raise _Fault(key, str(error)) from None

    def _parts(self, row: Mapping[str, Any], exactly: int | None) -> tuple[int, ...]:
        names = row.get("parts")
        if not isinstance(names, list) or len(names) < 2 or exactly not in (None, len(names)):
            raise _Fault("parts", f"expected {exactly or 'two or more'} names of parts")
        found = tuple(self._part(name, f"parts[{n}]") for n, name in enumerate(names, 1))
        if len(set(found)) < len(found):
            raise _Fault("parts", "a part is named twice")
        return found

    def _joints(self, row: Mapping[str, Any]) -> set[int]:
        if ("joint" in row) == ("parts" in row):
            raise _Fault("parts", "expected either `parts` or `joint`")
        if "joint" in row:
            chosen = {id(j) for j in self.joints if j.id == row["joint"]}
        else:
            pair = set(self._parts(row, exactly=2))
            chosen = {id(j) for j in self.joints if set(j.parts) == pair}
        if not chosen:
            raise _Fault("joint" if "joint" in row else "parts", "there is no such joint")
        return chosen

    def _pair_of(self, row: Mapping[str, Any]) -> tuple[int, ...]:
        if "parts" in row:
            return self._parts(row, exactly=2)
        return next(j.parts for j in self.assembly.joints if j.id == row["joint"])

    def _joint(
        self,
        row: Mapping[str, Any],
        pair: tuple[int, int],
        name: str,
        point: Array,
        axes: Array | None,
    ) -> Joint:
        try:
            type_ = JointType(str(row.get("type")))
        except ValueError:
            known = ", ".join(JointType)
            raise _Fault("type", f"{row.get('type')!r} is none of {known}") from None
        first = self._vector(row["axis"], "axis") if "axis" in row else None
        second = self._vector(row["axis2"], "axis2") if "axis2" in row else None
        if axes is None or first is not None or type_ is JointType.UNIVERSAL:
            try:
                axes = joint_axes(type_, first, second, self.assembly.dimension)
            except AxisFault as fault:
                raise _Fault(fault.key, fault.message) from None
        held = readonly(HELD[type_], dtype=np.bool_)
        stiffness, origin = stiffness_of(held, _stiffness(row.get("stiffness")), None, ARM)
        return Joint(
            id=name,
            type=type_,
            parts=pair,
            point=point,
            axes=axes,
            held=held,
            stiffness=stiffness,
            connection=type_.value,
            provenance=origin.replace("file", _FILE),
        )

    def _vector(self, value: Any, key: str) -> Array:
        good = isinstance(value, list) and len(value) == 3
        if not good or not all(_finite(number) for number in value):
            raise _Fault(key, "expected three numbers")
        return np.array(value, dtype=float)


def _finite(value: Any) -> bool:
    return isinstance(value, int | float) and not isinstance(value, bool) and isfinite(value)


def _stiffness(value: Any) -> Any:
    if value is None or value == "rigid":
        return value
    if not isinstance(value, dict):
        raise _Fault("stiffness", 'expected a table or "rigid"')
    for key, number in value.items():
        if key not in MOTION_NAMES:
            raise _Fault(f"stiffness.{key}", "unknown")
        if number != "rigid" and not (_finite(number) and number > 0.0):
            raise _Fault(f"stiffness.{key}", "expected a positive number")
    return value
