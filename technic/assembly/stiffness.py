"""Stiffness tables: how stiff each kind of connection is, and how we know.

A table is a TOML file of schema ``technic-stiffness/1``; the shipped one, `default.toml` of the
package `calibration`, documents the format. Every value names its source, so that a report can say
which of its numbers were measured and which were assumed.
"""

from __future__ import annotations

import tomllib
from collections.abc import Mapping
from dataclasses import dataclass, field
from functools import cache
from importlib import resources
from math import isfinite
from pathlib import Path
from typing import Any, Final, TypeGuard

import numpy as np

from technic.assembly.joint_types import HELD, JointType
from technic.errors import InputError, SchemaError, UsageError
from technic.geometry import Array, readonly

__all__ = [
    "MOTIONS",
    "SCHEMA",
    "SLOTS",
    "ConnectionStiffness",
    "StiffnessTable",
    "StiffnessValue",
    "default_table",
    "read_table",
]

SCHEMA: Final = "technic-stiffness/1"

MOTIONS: Final = ("axial", "shear", "spin", "tilt")
"""Names of the values of a connection: N/m for the first two, N m/rad for the others."""

_NORMAL_95: Final = 1.959964
"""Half width of a 95 % interval in standard deviations."""

SLOTS: Final = {"axial": (0,), "shear": (1, 2), "spin": (3,), "tilt": (4, 5)}


@dataclass(frozen=True, slots=True)
class StiffnessValue:
    """One stiffness with its origin.

    Parameters
    ----------
    value : float
        N/m, or N m/rad for spin and tilt; positive, or ``inf`` for rigid.
    provenance : str
        ``"paper"``, ``"assumed"``, ``"calibrated"`` or another name that the table's sources explain.
    note : str
    interval_95 : (float, float) or None
        95 % interval of a calibrated value.
    """

    value: float
    provenance: str
    note: str = ""
    interval_95: tuple[float, float] | None = None


@dataclass(frozen=True, slots=True)
class ConnectionStiffness:
    """Joint type and stiffness of one kind of connection.

    Parameters
    ----------
    connection : str
        ``"male/female"``, e.g. ``"pin/pin_hole"``.
    type : JointType
    values : mapping of str to StiffnessValue
        Keys from `MOTIONS`.
    """

    connection: str
    type: JointType
    values: Mapping[str, StiffnessValue]

    def held(self, type_: JointType | None = None) -> Array:
        """Return the held motions, (6,) bool, when the joint is of type `type_` (default: the
        table's): those of the type, and the spin when the table gives it a stiffness.
        """
        mask = list(HELD[type_ or self.type])
        if "spin" in self.values:
            mask[3] = True
        return readonly(mask, dtype=bool)

    def vector(self) -> Array:
        """Return the six stiffnesses [axial, shear, shear, spin, tilt, tilt], 0 where none is given."""
        out = [0.0] * 6
        for motion, entry in self.values.items():
            for slot in SLOTS[motion]:
                out[slot] = entry.value
        return readonly(out)

    def provenance(self, held: Array) -> str:
        """Return where the stiffnesses of the held motions come from, e.g. ``"paper"`` or
        ``"paper (shear), assumed (axial, tilt)"``.
        """
        origins: dict[str, list[str]] = {}
        for motion in MOTIONS:
            if motion in self.values and held[SLOTS[motion][0]]:
                origins.setdefault(self.values[motion].provenance, []).append(motion)
        if len(origins) == 1:
            return next(iter(origins))
        return ", ".join(f"{origin} ({', '.join(names)})" for origin, names in origins.items())


@dataclass(frozen=True, slots=True)
class StiffnessTable:
    """Stiffness of every kind of connection.

    Parameters
    ----------
    name : str
    connections : mapping of str to ConnectionStiffness
    sources : mapping of str to str
        What each provenance means.
    measured : tuple of (str, str)
        Connection and motion of every value with a known uncertainty.
    log_covariance : (k, k) ndarray
        Covariance of the natural logarithms of these values.
    path : str
        File it was read from; empty for the shipped one.
    found : str
        How it came into force: "shipped", "given", or where it was found.
    calibration : mapping
        What the file says of the calibration it came from: `file`, `date`, `rigs`, `readings`...
    """

    name: str
    connections: Mapping[str, ConnectionStiffness]
    sources: Mapping[str, str] = field(default_factory=dict)
    measured: tuple[tuple[str, str], ...] = ()
    log_covariance: Array = field(default_factory=lambda: readonly(np.zeros((0, 0))), compare=False)
    path: str = ""
    found: str = "shipped"
    calibration: Mapping[str, Any] = field(default_factory=dict, compare=False)

    def get(self, connection: str) -> ConnectionStiffness:
        """Return the entry of a connection.

        Raises
        ------
        UsageError
            If the table has none.
        """
        try:
            return self.connections[connection]
        except KeyError:
            known = ", ".join(sorted(self.connections))
            raise UsageError(
                f"stiffness table {self.name!r} has no connection {connection!r}; it has {known}"
            ) from None


@cache
def default_table() -> StiffnessTable:
    """Return the shipped table."""
    resource = resources.files("calibration") / "tables" / "default.toml"
    return parse_table(tomllib.loads(resource.read_text(encoding="utf-8")), "default.toml")


def read_table(path: str | Path, *, found: str = "given") -> StiffnessTable:
    """Read a stiffness table.

    Connections that the file leaves out are taken from the shipped table, which their provenance
    shows.

    Parameters
    ----------
    path : path-like
    found : str
        How it came into force, for reports.

    Raises
    ------
    InputError
        If the file cannot be read or is not TOML; SchemaError with every fault if it breaks the
        schema.
    """
    try:
        data = tomllib.loads(Path(path).read_text(encoding="utf-8"))
    except OSError as error:
        raise InputError(f"cannot read the stiffness table: {error.strerror}", path=path) from error
    except (UnicodeDecodeError, tomllib.TOMLDecodeError) as error:
        raise InputError(f"not a TOML file: {error}", path=path) from error
    table = parse_table(data, path)
    base = default_table()
    return StiffnessTable(
        table.name,
        {**base.connections, **table.connections},
        {**base.sources, **table.sources},
        table.measured,
        table.log_covariance,
        path=str(path),
        found=found,
        calibration=_told(data.get("calibration", {})),
    )


def _told(section: Any) -> dict[str, Any]:
    """Return what a file says of its calibration, without the numbers that are read elsewhere."""
    given = section if isinstance(section, dict) else {}
    return {k: v for k, v in given.items() if k not in ("parameters", "log_covariance")}


def parse_table(data: Mapping[str, Any], path: str | Path) -> StiffnessTable:
    """Return the table that parsed TOML describes; SchemaError with every fault."""
    faults: list[str] = []
    if data.get("schema") != SCHEMA:
        faults.append(f"schema: expected {SCHEMA!r}, found {data.get('schema')!r}")
    sources = data.get("sources", {})
    if not isinstance(sources, dict) or not all(isinstance(v, str) for v in sources.values()):
        faults.append("sources: expected a table of strings")
        sources = {}
    raw = data.get("connection", {})
    if not isinstance(raw, dict) or not raw:
        faults.append("connection: expected at least one table")
        raw = {}
    connections = {key: _connection(key, entry, faults) for key, entry in raw.items()}
    found = {k: v for k, v in connections.items() if v is not None}
    measured, covariance = _covariance(data.get("calibration", {}), found, faults)
    if faults:
        raise SchemaError(faults, path=path)
    name = str(data.get("name", Path(path).stem))
    return StiffnessTable(name, found, sources, measured, covariance)


def _covariance(
    section: Any, connections: Mapping[str, ConnectionStiffness], faults: list[str]
) -> tuple[tuple[tuple[str, str], ...], Array]:
    """Return the values of known uncertainty and the covariance of their logarithms.

    The section ``[calibration]`` gives it; values that have only an interval stand for themselves.
    """
    intervals = {
        (name, motion): value.interval_95
        for name, entry in connections.items()
        for motion, value in entry.values.items()
        if value.interval_95 is not None and value.interval_95[0] > 0.0
    }
    given = section.get("parameters", []) if isinstance(section, dict) else None
    if not isinstance(given, list) or not all(isinstance(x, str) and " " in x for x in given):
        faults.append('calibration.parameters: expected names like "pin/pin_hole shear"')
        return (), readonly(np.zeros((0, 0)))
    listed = [(x.rpartition(" ")[0], x.rpartition(" ")[2]) for x in given]
    for name in listed:
        if name[0] not in connections or name[1] not in connections[name[0]].values:
            faults.append(f"calibration.parameters: the table has no {name[1]} of {name[0]}")
    try:
        matrix = np.array(section.get("log_covariance", []), dtype=float)
    except (TypeError, ValueError):
        matrix = np.full((1, 1), np.nan)
    count = len(listed)
    matrix = matrix.reshape(0, 0) if matrix.size == 0 else matrix
    good = matrix.shape == (count, count) and bool(np.isfinite(matrix).all())
    if not good or not np.allclose(matrix, matrix.T) or (count and _lowest(matrix) < 0.0):
        faults.append(
            f"calibration.log_covariance: expected {count} rows of {count} numbers, symmetric "
            "and positive semi-definite"
        )
        return (), readonly(np.zeros((0, 0)))
    alone = [name for name in intervals if name not in listed]
    out = np.zeros((count + len(alone), count + len(alone)))
    out[:count, :count] = matrix
    for k, name in enumerate(alone, count):
        low, high = intervals[name]
        out[k, k] = (np.log(high / low) / (2.0 * _NORMAL_95)) ** 2
    return (*listed, *alone), readonly(out)


def _lowest(matrix: Array) -> float:
    """Return the smallest eigenvalue, rounding set to 0."""
    values = np.linalg.eigvalsh(matrix)
    return float(values[0]) if values[0] < -1e-9 * abs(values[-1]) else 0.0


def _connection(key: str, entry: Any, faults: list[str]) -> ConnectionStiffness | None:
    where = f'connection."{key}"'
    if not isinstance(entry, dict):
        faults.append(f"{where}: expected a table")
        return None
    try:
        type_ = JointType(str(entry.get("type")))
    except ValueError:
        faults.append(f"{where}.type: {entry.get('type')!r} is not a joint type")
        return None
    for name in sorted(set(entry) - {"type", *MOTIONS}):
        faults.append(f"{where}.{name}: unknown key")
    values = {m: _value(f"{where}.{m}", entry[m], faults) for m in MOTIONS if m in entry}
    found = {motion: value for motion, value in values.items() if value is not None}
    held = HELD[type_]
    for motion in MOTIONS:
        if held[SLOTS[motion][0]] and motion not in values:
            faults.append(f"{where}.{motion}: missing, and a {type_} joint holds it")
    return ConnectionStiffness(key, type_, found)


def _value(where: str, entry: Any, faults: list[str]) -> StiffnessValue | None:
    if not isinstance(entry, dict):
        faults.append(f"{where}: expected {{ value = ..., provenance = ... }}")
        return None
    for name in sorted(set(entry) - {"value", "provenance", "note", "interval_95", "unit"}):
        faults.append(f"{where}.{name}: unknown key")
    value = entry.get("value")
    if not _number(value) or not value > 0.0:
        faults.append(f"{where}.value: expected a positive number, found {value!r}")
        return None
    provenance = entry.get("provenance")
    if not isinstance(provenance, str) or not provenance:
        faults.append(f"{where}.provenance: missing; say where the number comes from")
        return None
    interval = entry.get("interval_95")
    if interval is not None:
        good = (
            isinstance(interval, list) and len(interval) == 2 and all(_number(x) for x in interval)
        )
        if not good or not all(isfinite(x) for x in interval) or not interval[0] <= interval[1]:
            faults.append(f"{where}.interval_95: expected [low, high], found {interval!r}")
            return None
        interval = (float(interval[0]), float(interval[1]))
    return StiffnessValue(float(value), provenance, str(entry.get("note", "")), interval)


def _number(value: object) -> TypeGuard[float]:
    return isinstance(value, int | float) and not isinstance(value, bool)
