"""Joints of the assembly file: axes, held motions and stiffness from a joint's description."""

from __future__ import annotations

from collections.abc import Mapping
from math import inf, isfinite
from typing import Any, Final

import numpy as np

from technic.assembly.joint_types import HELD, MOTION_NAMES, JointType
from technic.assembly.stiffness import StiffnessTable
from technic.geometry import Array, axes_from, readonly

__all__ = [
    "DEFAULT_STIFFNESS",
    "NEEDS_AXIS",
    "NEEDS_SECOND",
    "AxisFault",
    "connection_stiffness",
    "held_motions",
    "joint_axes",
    "stiffness_of",
    "unused_stiffness",
]

DEFAULT_STIFFNESS: Final = 1e4
"""Of translations (N/m), and of rotations after multiplication by the square of a size (paper: 1e4)."""

JITTER_FORCE: Final = 1.0
"""Load (N) at which play is weighed when the file gives none: a firm touch of a finger."""

JITTER_MOMENT: Final = 0.01
"""The same for rotations (N m): the touch at an arm of 1 cm."""

NEEDS_AXIS: Final = {
    2: {JointType.SLIDER, JointType.PLANAR, JointType.MESH},
    3: {
        JointType.HINGE,
        JointType.SLIDER,
        JointType.CYLINDRICAL,
        JointType.PLANAR,
        JointType.UNIVERSAL,
        JointType.SLOT,
        JointType.MESH,
    },
}
"""Types that mean nothing without an axis, by dimension: in the plane a hinge turns about z."""

NEEDS_SECOND: Final = {
    2: {JointType.SLOT},
    3: {JointType.UNIVERSAL, JointType.SLOT},
}
"""Types that need a second axis."""

ALONG: Final = 1e-9
"""A direction lies in the plane z = 0, or across it, when it misses it by less than this."""


class AxisFault(Exception):
    """What is wrong with an axis or a connection: the key and a sentence."""

    def __init__(self, key: str, message: str) -> None:
        super().__init__(message)
        self.key = key
        self.message = message


def _unit(vector: Array, key: str) -> Array:
    size = float(np.linalg.norm(vector))
    if size == 0.0:
        raise AxisFault(key, "is zero")
    # a unit vector stays as it is, to the last digit: files can be written and read again
    return vector if abs(size - 1.0) < 1e-12 else vector / size


def joint_axes(type_: JointType, axis: Array | None, second: Array | None, dimension: int) -> Array:
    """Return a joint's own axes, rows of a (3, 3) array, as `joint_types` defines them.

    Parameters
    ----------
    type_ : JointType
    axis, second : (3,) ndarray or None
        As in the file; not of unit length. Without an axis it is z.
    dimension : int
        2 or 3.

    Raises
    ------
    AxisFault
        An axis is missing, zero, parallel to the other, or askew to the plane of a 2D assembly.
    """
    if axis is None and type_ in NEEDS_AXIS[dimension]:
        raise AxisFault("axis", f"is missing: a {type_.value} joint needs one")
    if second is None and type_ in NEEDS_SECOND[dimension]:
        raise AxisFault("axis2", f"is missing: a {type_.value} joint needs one")
    first = np.array([0.0, 0.0, 1.0]) if axis is None else _unit(axis, "axis")
    if dimension == 2:
        _check_plane(first, "axis")
    if second is None or type_ not in (JointType.UNIVERSAL, JointType.SLOT):
        return axes_from(first)
    other = _unit(second, "axis2")
    if dimension == 2:
        _check_plane(other, "axis2")
    normal = np.cross(first, other)
    if np.linalg.norm(normal) < 1e-6:
        raise AxisFault("axis2", "is parallel to axis")
    normal = _unit(normal, "axis2")
    if type_ is JointType.UNIVERSAL:
        return np.array([normal, first, np.cross(normal, first)])
    if abs(first @ other) > 1e-6:
        raise AxisFault("axis2", "is not at right angles to axis: the pin slides across its line")
    return np.array([first, np.cross(normal, first), normal])


def _check_plane(axis: Array, key: str) -> None:
    if abs(axis[2]) > ALONG and np.abs(axis[:2]).max() > ALONG:
        raise AxisFault(key, "is askew to the plane: in two dimensions it lies in it or along z")


def held_motions(type_: JointType, axes: Array, dimension: int) -> Array:
    """Return which of the six motions a joint holds, (6,) bool.

    In two dimensions only translations in the plane and the rotation about z count: held motions that no
    part could make anyway are no rows.
    """
    held = np.array(HELD[type_])
    if dimension == 2:
        across = np.abs(axes[:, 2]) > 0.5
        held &= np.concatenate([~across, across])
    return readonly(held, dtype=np.bool_)


def stiffness_of(
    held: Array, given: Any, jitter: Mapping[str, float] | None, size: float
) -> tuple[Array, str]:
    """Return the six stiffnesses and where they come from.

    Parameters
    ----------
    held : (6,) ndarray of bool
    given : None, "rigid" or mapping
        As in the file.
    jitter : mapping or None
        Play of each motion (m or rad) with the force (N) and moment (N m) at which it counts.
    size : float
        Section size for the default of rotations (m).

    Returns
    -------
    (6,) ndarray, str
    """
    table: Mapping[str, Any] = {} if given is None or given == "rigid" else given
    values = np.zeros(6)
    origins: dict[str, list[str]] = {}
    for k, motion in enumerate(MOTION_NAMES):
        if not held[k]:
            continue
        if given == "rigid" or table.get(motion) == "rigid":
            values[k], origin = inf, "file"
        elif motion in table:
            values[k], origin = float(table[motion]), "file"
        else:
            values[k], origin = DEFAULT_STIFFNESS * (1.0 if k < 3 else size**2), "assumed"
        if jitter is not None and motion in jitter:
            load = (
                jitter.get("force", JITTER_FORCE) if k < 3 else jitter.get("moment", JITTER_MOMENT)
            )
            values[k] = 1.0 / (1.0 / values[k] + float(jitter[motion]) / load)
            origin += ", softened by play"
        names = origins.setdefault(origin, [])
        if motion not in names:
            names.append(motion)
    if len(origins) == 1:
        return readonly(values), next(iter(origins))
    return readonly(values), "; ".join(f"{o} ({', '.join(n)})" for o, n in origins.items())


def connection_stiffness(
    row: Mapping[str, Any], held: Array, table: StiffnessTable
) -> tuple[Array, str]:
    """Return the six stiffnesses of a joint that names a connection of a table, and their provenance.

    Parameters
    ----------
    row : mapping
        The joint in the file.
    held : (6,) ndarray of bool
    table : StiffnessTable

    Raises
    ------
    AxisFault
        The table has no such connection or no value for a held motion, or the joint says its stiffness
        twice.
    """
    name = row["connection"]
    for other in ("stiffness", "jitter", "provenance"):
        if other in row:
            raise AxisFault("connection", f"the table says it, and {other!r} says it too: give one")
    entry = table.connections.get(name)
    if entry is None:
        known = ", ".join(sorted(table.connections))
        raise AxisFault(
            "connection", f"the stiffness table {table.name!r} has no {name!r}; it has {known}"
        )
    motions = [m for k, m in enumerate(MOTION_NAMES) if held[k]]
    missing = [m for m in dict.fromkeys(motions) if m not in entry.values]
    if missing:
        raise AxisFault(
            "connection",
            f"{name!r} has no {', '.join(missing)} in the stiffness table, and a {row['type']} "
            "joint holds it",
        )
    return readonly(np.where(held, entry.vector(), 0.0)), entry.provenance(held)


def unused_stiffness(type_: JointType, given: Any, jitter: Mapping[str, float] | None) -> list[str]:
    """Return the motions that are given a stiffness or a play although the type frees them."""
    named = set(given) if isinstance(given, Mapping) else set()
    named |= set(jitter or ())
    free = {
        motion
        for motion in MOTION_NAMES
        if not any(h for h, name in zip(HELD[type_], MOTION_NAMES, strict=True) if name == motion)
    }
    return [motion for motion in dict.fromkeys(MOTION_NAMES) if motion in named & free]


def stiffness_to_file(held: Array, values: Array) -> Any:
    """Return the `stiffness` entry of a joint, exact."""
    if not held.any() or not np.isfinite(values[held]).any():
        return "rigid"
    out: dict[str, Any] = {}
    for k, motion in enumerate(MOTION_NAMES):
        if held[k]:
            value = float(values[k])
            out[motion] = value if isfinite(value) else "rigid"
    return out
