"""New bars of a linkage: where one can be pinned, and what it is there.

An end of a new bar lies anywhere on a part: on the line of a bar, on the edge of a plate, on a point of a
rigid part; on a truss, at its ends only. Pins need material around them, so an end nearer to a pin that
is there than one bar's size takes that very pin and joins everything on it.
"""

from __future__ import annotations

import json
from collections import Counter
from dataclasses import dataclass
from pathlib import Path
from typing import Any, Final

import numpy as np

from technic.assembly.joint_types import JointType
from technic.assembly.model import Assembly, Joint, Part
from technic.assembly.shapes import make_shape, section_size
from technic.assembly.typed_joints import held_motions, joint_axes, stiffness_of
from technic.design.apply import HIGHLIGHT
from technic.errors import UsageError
from technic.geometry import Array, Pose
from technic.parts.definition import FrameBody, Material, TrussBody
from technic.parts.materials import ABS

__all__ = [
    "Bar",
    "End",
    "Pattern",
    "Rules",
    "Track",
    "cuts",
    "end_at",
    "legal",
    "made_of",
    "pattern_of",
    "tracks",
]

SAME: Final = 1e-9
"""Points this close (m) are one."""

DECIMALS: Final = 6
"""Places of new pins are given in whole micrometres."""

SHORTEST: Final = 3.0
"""Shortest bar in units of its size: two pins with material around them."""


@dataclass(frozen=True, slots=True, eq=False)
class Pattern:
    """What new bars are made of: what most bars of the model are.

    Parameters
    ----------
    shape : mapping
        Shape of the assembly file without its points.
    material : Material
    size : float
        Root of the section's area (m).
    """

    shape: dict[str, Any]
    material: Material
    size: float

    @property
    def area(self) -> float:
        """Of the section (m2)."""
        return self.size**2


@dataclass(frozen=True, slots=True, eq=False)
class Track:
    """Where on a part a new bar can end.

    Parameters
    ----------
    part : int
    points : (n, 3) ndarray
        In the world (m).
    stations : (n,) ndarray
        Length of the way to each point (m).
    continuous : bool
        Whether it can end between the points as well.
    pins : (m, 3) ndarray
        Pins that are on the part (m).
    """

    part: int
    points: Array
    stations: Array
    continuous: bool
    pins: Array

    @property
    def length(self) -> float:
        """Of the whole way (m)."""
        return float(self.stations[-1])

    def at(self, station: float) -> Array:
        """Return the place at a length of the way (m)."""
        if not self.continuous:
            return np.asarray(self.points[int(np.argmin(np.abs(self.stations - station)))])
        return np.array([np.interp(station, self.stations, axis) for axis in self.points.T])


@dataclass(frozen=True, slots=True)
class End:
    """An end of a new bar: its place (m), and the parts that it is pinned to."""

    point: tuple[float, float, float]
    parts: tuple[int, ...]


@dataclass(frozen=True, slots=True)
class Bar:
    """A new bar between two parts."""

    first: End
    second: End

    @property
    def span(self) -> Array:
        """From the first end to the second (m)."""
        return np.subtract(self.second.point, self.first.point)

    @property
    def length(self) -> float:
        """Between its pins (m)."""
        return float(np.linalg.norm(self.span))

    @property
    def parts(self) -> tuple[int, ...]:
        """The parts that it ties together."""
        return tuple(sorted({*self.first.parts, *self.second.parts}))


@dataclass(frozen=True, slots=True)
class Rules:
    """Which bars may be suggested.

    Parameters
    ----------
    between : (int, int) or None
        Parts that the bar must tie together.
    box : pair of points or None
        Opposite corners of the space that both ends must lie in (m).
    shortest, longest : float
        Length between the pins (m).
    keep_out : frozenset of int
        Parts that nothing may be tied to.
    """

    between: tuple[int, int] | None = None
    box: tuple[tuple[float, float, float], tuple[float, float, float]] | None = None
    shortest: float = 0.0
    longest: float = float("inf")
    keep_out: frozenset[int] = frozenset()


def pattern_of(assembly: Assembly) -> Pattern:
    """Return what most bars of a model are made of.

    Raises
    ------
    UsageError
        It has no bar.
    """
    kinds: Counter[str] = Counter()
    first: dict[str, Part] = {}
    for part in assembly.parts:
        if isinstance(part.body, FrameBody | TrussBody) and part.shape:
            shape = {k: v for k, v in part.shape.items() if k in ("kind", "section", "area")}
            key = json.dumps([shape, part.body.material.name], sort_keys=True)
            kinds[key] += 1
            first.setdefault(key, part)
    if not kinds:
        raise UsageError("no part of the model is a bar: nothing says what a new one should be")
    part = first[kinds.most_common(1)[0][0]]
    assert isinstance(part.body, FrameBody | TrussBody)
    shape = {k: v for k, v in part.shape.items() if k in ("kind", "section", "area")}
    return Pattern(shape, part.body.material, section_size(part.body))


def tracks(assembly: Assembly, keep_out: frozenset[int] = frozenset()) -> list[Track]:
    """Return where new bars can end, for every part that has such places."""
    pins: list[list[Array]] = [[] for _ in assembly.parts]
    for joint in assembly.joints:
        for p in joint.parts:
            pins[p].append(joint.point)
    for support in assembly.supports:
        if support.point is not None:
            pins[support.part].append(support.point)
    found = []
    for k, part in enumerate(assembly.parts):
        kind = part.shape.get("kind")
        if k in keep_out or kind not in ("bar", "truss", "polygon", "rigid"):
            continue
        if "points" not in part.shape:
            continue
        flat = np.zeros((len(part.shape["points"]), 3))
        for row, point in zip(flat, part.shape["points"], strict=True):
            row[: len(point)] = point
        world = part.pose.points(flat)
        if kind == "polygon":
            world = np.vstack([world, world[:1]])
        steps = np.linalg.norm(np.diff(world, axis=0), axis=1)
        stations = np.concatenate([[0.0], np.cumsum(np.maximum(steps, SAME))])
        own = np.array(pins[k]).reshape(-1, 3)
        found.append(Track(k, world, stations, kind in ("bar", "polygon"), own))
    return found


def end_at(assembly: Assembly, track: Track, station: float, clear: float) -> End:
    """Return the end at a length of the way; near a pin that is there, on that pin."""
    point = track.at(station).round(DECIMALS) + 0.0
    if len(track.pins):
        gaps = np.linalg.norm(track.pins - point, axis=1)
        nearest = int(np.argmin(gaps))
        if gaps[nearest] < clear:
            point = track.pins[nearest]
    parts = {track.part}
    for _ in range(2):  # everything that hangs on the same pin
        for joint in assembly.joints:
            if np.linalg.norm(joint.point - point) < SAME and parts & set(joint.parts):
                parts |= set(joint.parts)
    x, y, z = np.asarray(point).tolist()
    return End((x, y, z), tuple(sorted(parts)))


def legal(bar: Bar, rules: Rules, size: float) -> bool:
    """Return whether a bar ties two parts together and obeys the rules."""
    first, second = set(bar.first.parts), set(bar.second.parts)
    if first & second or (first | second) & rules.keep_out:
        return False
    if (
        not max(rules.shortest, SHORTEST * size)
        <= bar.length * (1 + SAME)
        <= rules.longest * (1 + 2 * SAME)
    ):
        return False
    if rules.between is not None:
        a, b = rules.between
        if not ((a in first and b in second) or (b in first and a in second)):
            return False
    if rules.box is not None:
        low, high = np.minimum(*np.array(rules.box)), np.maximum(*np.array(rules.box))
        ends = np.array([bar.first.point, bar.second.point])
        return bool((ends >= low - SAME).all() and (ends <= high + SAME).all())
    return True


def _axis(assembly: Assembly, bar: Bar) -> Array | None:
    """Return the axis that all hinges at both ends share when the bar lies across it."""
    axes = [
        joint.axes[0]
        for joint in assembly.joints
        if joint.type is JointType.HINGE and set(joint.parts) & set(bar.parts)
    ]
    if not axes:
        return None
    along = bar.span / bar.length
    if any(np.linalg.norm(np.cross(a, axes[0])) > 1e-6 for a in axes):
        return None
    return None if abs(along @ axes[0]) > 1e-6 else axes[0]


def made_of(
    assembly: Assembly, bar: Bar, pattern: Pattern, name: str, index: int
) -> tuple[Part, list[Joint], list[dict[str, Any]]]:
    """Return a bar as a part with its joints, and as rows of an assembly file.

    Parameters
    ----------
    assembly : Assembly
    bar : Bar
    pattern : Pattern
    name : str
        Id of the new part.
    index : int
        Number of the new part.

    Returns
    -------
    part : Part
    joints : list of Joint
    rows : list of dict
        The part's row, then those of its joints.
    """
    dimension = assembly.dimension
    ends = [list(end.point[:dimension]) for end in (bar.first, bar.second)]
    shape = {**pattern.shape, "points": ends}
    made = make_shape(shape, pattern.material, dimension, (), Path())
    part = Part(
        id=name,
        number="",
        name="",
        pose=Pose.identity(),
        ports=(),
        body=made.body,
        mass_properties=made.mass_properties,
        color=HIGHLIGHT,
        shape={**shape, "material": pattern.material.name},
    )
    row: dict[str, Any] = {"id": name, "shape": shape}
    if pattern.material.name != ABS:
        row["material"] = pattern.material.name
    type_, axis = JointType.HINGE, None
    if dimension == 3:
        axis = _axis(assembly, bar)
        type_ = JointType.BALL if axis is None else JointType.HINGE
    axes = joint_axes(type_, axis, None, dimension)
    held = held_motions(type_, axes, dimension)
    joints, rows = [], [row]
    for end, at in zip((bar.first, bar.second), ends, strict=True):
        for p in end.parts:
            size = min(section_size(assembly.parts[p].body), section_size(made.body))
            values, provenance = stiffness_of(held, None, None, size)
            other = assembly.parts[p].id
            joints.append(
                Joint(
                    id=f"{other}-{name}",
                    type=type_,
                    parts=(p, index),
                    point=np.array(end.point),
                    axes=axes,
                    held=held,
                    stiffness=values,
                    connection=type_.value,
                    provenance=provenance,
                )
            )
            joint_row: dict[str, Any] = {"type": type_.value, "parts": [other, name], "point": at}
            if axis is not None:
                joint_row["axis"] = [float(v) for v in axis]
            rows.append(joint_row)
    return part, joints, rows


def cuts(assembly: Assembly, bar: Bar, size: float) -> bool:
    """Return whether a bar in space would run through another bar that it is not pinned to.

    In two dimensions bars lie in layers, side by side, and may cross.
    """
    if assembly.dimension == 2:
        return False
    for k, part in enumerate(assembly.parts):
        if k in bar.parts or not isinstance(part.body, FrameBody | TrussBody):
            continue
        points = part.pose.points(np.asarray(part.body.points))
        room = (size + section_size(part.body)) / 2.0
        members = getattr(part.body, "members", np.array([[0, 1]]))
        for a, b in members:
            if _gap(np.array(bar.first.point), bar.span, points[a], points[b] - points[a]) < room:
                return True
    return False


def _gap(p: Array, u: Array, q: Array, v: Array) -> float:
    """Return the shortest distance (m) between two straight stretches."""
    a, b, c = float(u @ u), float(u @ v), float(v @ v)
    w = p - q
    d, e = float(u @ w), float(v @ w)
    denominator = a * c - b * b
    s = 0.0 if denominator < 1e-12 * a * c else float(np.clip((b * e - c * d) / denominator, 0, 1))
    t = float(np.clip((b * s + e) / c, 0.0, 1.0))
    s = float(np.clip((b * t - d) / a, 0.0, 1.0))
    return float(np.linalg.norm(w + s * u - t * v))
