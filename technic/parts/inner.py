"""Parts that are not one rigid body, from `parts_library/inner_joints.toml`; that file says its format."""

from __future__ import annotations

import functools
import tomllib
from collections.abc import Mapping
from dataclasses import dataclass
from importlib.resources import files
from typing import Any, Final

import numpy as np

from technic.geometry import Array, readonly
from technic.parts.definition import Port
from technic.parts.tables import by_number
from technic.units import LDU

__all__ = [
    "ASSUMED",
    "TRANSLATION",
    "InnerBody",
    "InnerPart",
    "Screw",
    "inner_parts",
    "parse_inner",
]

TRANSLATION: Final = 1e4
"""Stiffness (N/m) of held translations that the file does not give: the paper's default."""

ROTATION: Final = 0.16
"""The same for rotations (N m/rad): 1e4 N/m at 4 mm."""

ASSUMED: Final = "assumed"

_KINDS: Final = ("motor", "actuator", "spring", "universal", "clutch", "pump", "turntable")
_JOINTS: Final = ("hinge", "slider", "cylindrical", "ball", "universal")
_MOTIONS: Final = ("axial", "shear", "spin", "tilt")


@dataclass(frozen=True, slots=True)
class Screw:
    """A thread between two pieces of a part.

    Parameters
    ----------
    partner : str
        Name of the other piece.
    lead : float
        Way along the axis a turn (m).
    radius : float
        Of the thread (m).
    """

    partner: str
    lead: float
    radius: float


@dataclass(frozen=True, slots=True, eq=False)
class InnerBody:
    """A piece of a part that moves against the rest.

    Parameters
    ----------
    name : str
        Appended to the part's id: ``<id>#<name>``.
    joint : str
        Joint type between the piece and the rest.
    point, axis : (3,) ndarray
        Line of the joint, part coordinates (m).
    second : (3,) ndarray or None
        The other axis of a universal joint.
    line : (3,) ndarray
        Direction along which connectors are chosen.
    low, high, radius : float
        Stretch of the line, and distance from it, in which a connector belongs to the piece (m).
    share : float
        Of the part's mass.
    stiffness : (6,) ndarray
        In the order of `assembly.joint_types`.
    given : tuple of str
        Motions whose stiffness the file states.
    screw : Screw or None
    """

    name: str
    joint: str
    point: Array
    axis: Array
    second: Array | None
    line: Array
    low: float
    high: float
    radius: float
    share: float
    stiffness: Array
    given: tuple[str, ...]
    screw: Screw | None = None

    def owns(self, port: Port) -> bool:
        """Tell whether a connector belongs to the piece."""
        arm = port.position - self.point
        along = float(arm @ self.line)
        across = float(np.linalg.norm(arm - along * self.line))
        return self.low <= along <= self.high and across <= self.radius


@dataclass(frozen=True, slots=True, eq=False)
class InnerPart:
    """What moves in a part: see the file for `kind` and `when`."""

    kind: str
    always: bool
    bodies: tuple[InnerBody, ...]
    source: str
    stiffness_source: str


@functools.cache
def inner_parts() -> Mapping[str, InnerPart]:
    """Return the shipped table by part number; read once."""
    text = files("parts_library").joinpath("inner_joints.toml").read_text(encoding="utf-8")
    return parse_inner(tomllib.loads(text))


def parse_inner(content: Mapping[str, Any]) -> Mapping[str, InnerPart]:
    """Return the table that parsed TOML describes.

    Raises
    ------
    SchemaError
        With every fault.
    """
    return by_number(content, _part, "inner_joints.toml")


def _choice(row: Mapping[str, Any], key: str, allowed: tuple[str, ...]) -> str:
    value = str(row[key])
    if value not in allowed:
        raise ValueError(f"{key} {value!r}")
    return value


def _part(row: Mapping[str, Any]) -> InnerPart:
    return InnerPart(
        kind=_choice(row, "kind", _KINDS),
        always=_choice(row, "when", ("always", "free")) == "always",
        bodies=tuple(_body(body) for body in row["body"]),
        source=str(row["source"]),
        stiffness_source=str(row.get("stiffness_source", ASSUMED)),
    )


def _unit(values: Any, key: str) -> Array:
    vector = np.array(values, dtype=float)
    if vector.shape != (3,) or not np.linalg.norm(vector) > 0.0:
        raise ValueError(key)
    return readonly(vector / np.linalg.norm(vector))


def _body(row: Mapping[str, Any]) -> InnerBody:
    axis = _unit(row["axis"], "axis")
    point = np.array(row["point"], dtype=float)
    low, high = (float(value) for value in row["along"])
    share = float(row["share"])
    if point.shape != (3,) or not low < high or not 0.0 < share < 1.0:
        raise ValueError("point, along or share")
    given = tuple(motion for motion in _MOTIONS if motion in row)
    value = {"axial": TRANSLATION, "shear": TRANSLATION, "spin": ROTATION, "tilt": ROTATION}
    value |= {motion: float(row[motion]) for motion in given}
    if min(value.values()) <= 0.0:
        raise ValueError("a stiffness")
    joint = _choice(row, "joint", _JOINTS)
    return InnerBody(
        name=str(row["name"]),
        joint=joint,
        point=readonly(point * LDU),
        axis=axis,
        second=_unit(row["second"], "second") if joint == "universal" else None,
        line=_unit(row["along_axis"], "along_axis") if "along_axis" in row else axis,
        low=low * LDU,
        high=high * LDU,
        radius=float(row["radius"]) * LDU,
        share=share,
        stiffness=readonly([value[m] for m in ("axial", "shear", "shear", "spin", "tilt", "tilt")]),
        given=given,
        screw=_screw(row["screw"]) if "screw" in row else None,
    )


def _screw(row: Mapping[str, Any]) -> Screw:
    lead, radius = float(row["lead"]), float(row["radius"])
    if not (lead > 0.0 and radius > 0.0):
        raise ValueError("lead or radius")
    return Screw(str(row["with"]), lead * LDU, radius * LDU)
