"""Rigs: which models are measured, how they are held, loaded and turned. Data in `rigs.toml`."""

from __future__ import annotations

import tomllib
from collections.abc import Mapping
from dataclasses import dataclass, field
from functools import cache
from importlib.resources import files
from importlib.resources.abc import Traversable
from pathlib import Path
from typing import Any, Final

import numpy as np
from numpy.typing import NDArray

from calibration.errors import DataError

__all__ = ["SCHEMA", "Condition", "LoadHole", "Pose", "Rig", "read_rigs", "shipped_rigs"]

SCHEMA: Final = "technic-rigs/1"

ANGLE_OFF: Final = 20.0
"""A pose whose measured angle is further than this (degrees) from what it should be is another pose."""

SPAN_OFF: Final = 1.0
"""A span (mm) names the hole that is this close: holes are 8 mm apart."""

MOTIONS: Final = ("axial", "shear", "spin", "tilt")


@dataclass(frozen=True, slots=True)
class Pose:
    """How a rig is put.

    Parameters
    ----------
    down : (float, float, float)
        Where down is in the axes of the rig's model file.
    angle_deg : float
        What the column ``pose_angle_deg`` says when the pose is exact.
    turn : (float, float, float)
        Axis about which an inexact pose is turned.
    say : str
    """

    down: tuple[float, float, float]
    angle_deg: float
    turn: tuple[float, float, float]
    say: str = ""

    def down_at(self, angle_deg: float) -> NDArray[np.float64]:
        """Return the unit vector down when the pose is at this angle (Rodrigues' rotation)."""
        a = np.radians(angle_deg - self.angle_deg)
        v, k = (np.asarray(w) / np.linalg.norm(w) for w in (self.down, self.turn))
        out = v * np.cos(a) + np.cross(k, v) * np.sin(a) + k * (k @ v) * (1.0 - np.cos(a))
        return np.asarray(out)


@dataclass(frozen=True, slots=True)
class LoadHole:
    """A place that can carry the weight, and the span (mm) that names it."""

    place: str
    span_mm: float


@dataclass(frozen=True, slots=True)
class Rig:
    """One rig.

    Parameters
    ----------
    name, title : str
    model : Traversable or Path
        Its LDraw file.
    clamped : tuple of str
        Places ``PART`` or ``PART:PORT`` that do not move.
    joints : mapping of str to tuple of str
        Motions to be found, most wanted first, by connection.
    loads : tuple of LoadHole
    poses : mapping of str to Pose
    """

    name: str
    title: str
    model: Traversable
    clamped: tuple[str, ...]
    joints: Mapping[str, tuple[str, ...]]
    loads: tuple[LoadHole, ...]
    poses: Mapping[str, Pose] = field(default_factory=dict)

    def hole(self, span_mm: float | None) -> LoadHole | None:
        """Return the hole that a span names, the first one when there is no span; None if none."""
        if span_mm is None:
            return self.loads[0]
        near = min(self.loads, key=lambda hole: abs(hole.span_mm - span_mm))
        return near if abs(near.span_mm - span_mm) <= SPAN_OFF else None


@dataclass(frozen=True, slots=True, order=True)
class Condition:
    """What decides how a rig answers: equal conditions are computed once.

    Parameters
    ----------
    rig, pose : str
    angle_deg : float
    place : str
        The loaded and measured hole.
    tap : bool
        Whether a natural frequency is measured instead of a displacement.
    mass : float
        What is fixed to the place while it is tapped (kg).
    """

    rig: str
    pose: str
    angle_deg: float
    place: str
    tap: bool = False
    mass: float = 0.0


@cache
def shipped_rigs() -> Mapping[str, Rig]:
    """Return the rigs that come with the program, by name."""
    folder = files(__name__)
    return _rigs(tomllib.loads(folder.joinpath("rigs.toml").read_text(encoding="utf-8")), folder)


def read_rigs(path: str | Path) -> dict[str, Rig]:
    """Read a file of rigs; their models lie beside it.

    Raises
    ------
    DataError
        With every fault of the file.
    """
    path = Path(path)
    try:
        data = tomllib.loads(path.read_text(encoding="utf-8"))
    except OSError as error:
        raise DataError([f"cannot be read: {error.strerror}"]) from error
    except (UnicodeDecodeError, tomllib.TOMLDecodeError) as error:
        raise DataError([f"not a TOML file: {error}"]) from error
    return _rigs(data, path.parent)


def _rigs(data: Mapping[str, Any], folder: Traversable) -> dict[str, Rig]:
    faults: list[str] = []
    if data.get("schema") != SCHEMA:
        faults.append(f"schema: expected {SCHEMA!r}, found {data.get('schema')!r}")
    raw = data.get("rig")
    if not isinstance(raw, dict) or not raw:
        faults.append("rig: expected at least one table [rig.NAME]")
        raw = {}
    rigs = {}
    for name, entry in raw.items():
        try:
            rigs[name] = _rig(name, entry, folder)
        except (KeyError, TypeError, ValueError, AttributeError) as error:
            said = f"{error.args[0]!r} is missing" if isinstance(error, KeyError) else str(error)
            faults.append(f"rig.{name}: {said}")
    if faults:
        raise DataError(faults)
    return rigs


def _rig(name: str, entry: Mapping[str, Any], folder: Traversable) -> Rig:
    joints = {str(key): tuple(map(str, value)) for key, value in entry["joints"].items()}
    for key, motions in joints.items():
        wrong = [m for m in motions if m not in MOTIONS]
        if wrong or not motions:
            raise ValueError(f"joints.{key!r}: motions are {', '.join(MOTIONS)}, found {motions}")
    poses = {str(key): _pose(value) for key, value in entry["pose"].items()}
    loads = tuple(LoadHole(str(x["place"]), float(x["span_mm"])) for x in entry["loads"])
    if not (joints and poses and loads and entry["clamped"]):
        raise ValueError("needs joints, loads, a pose and a clamped part")
    model = folder.joinpath(str(entry["model"]))
    if not model.is_file():
        raise ValueError(f"there is no file {entry['model']!r} beside it")
    clamped = tuple(map(str, entry["clamped"]))
    return Rig(name, str(entry.get("title", name)), model, clamped, joints, loads, poses)


def _pose(entry: Mapping[str, Any]) -> Pose:
    down, turn = (tuple(map(float, entry[key])) for key in ("down", "turn"))
    if len(down) != 3 or len(turn) != 3 or not any(down) or not any(turn):
        raise ValueError("down and turn are three numbers, not all 0")
    return Pose(
        (down[0], down[1], down[2]),
        float(entry.get("angle_deg", 0.0)),
        (turn[0], turn[1], turn[2]),
        str(entry.get("say", "")),
    )
