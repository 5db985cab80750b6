"""Teeth that a part's title does not place, from `parts_library/teeth.toml`; that file says its format."""

from __future__ import annotations

import functools
import tomllib
from collections.abc import Mapping
from dataclasses import dataclass
from importlib.resources import files
from typing import Any, Final

import numpy as np

from technic.geometry import Array, readonly
from technic.parts.tables import by_number
from technic.units import LDU

__all__ = ["MODULE", "Toothing", "parse_teeth", "teeth_table"]

MODULE: Final = 2.5 * LDU
"""Diameter per tooth (m): 1 mm."""

_KINDS: Final = ("spur", "double bevel", "bevel", "crown")


@dataclass(frozen=True, slots=True, eq=False)
class Toothing:
    """One row of teeth of a part, part coordinates (m).

    Parameters
    ----------
    kind : str
        ``"spur"``, ``"double bevel"``, ``"bevel"``, ``"crown"``, ``"knob"``, ``"worm"`` or ``"rack"``.
    teeth : int
        Around the whole circle; 0 for worms and racks.
    center, axis : (3,) ndarray
        Middle of the teeth on the shaft, and the shaft's direction; of a rack the middle of the
        rolling line and the direction of the line.
    radius : float
        Of the rolling circle; 0 for a rack.
    half : float
        Half the width of the teeth; of a worm or a rack half its length.
    inner : bool
        Whether the teeth point inwards.
    faces : tuple of (float, int)
        Where along the axis, from the center, rolling circles for crossing shafts lie, and whether
        they look along the axis (1) or against it (-1).
    sector : ((3,) ndarray, (3,) ndarray) or None
        Directions between which there are teeth; None: all around.
    out : (3,) ndarray or None
        Where the teeth of a rack look.
    """

    kind: str
    teeth: int
    center: Array
    axis: Array
    radius: float
    half: float
    inner: bool = False
    faces: tuple[tuple[float, int], ...] = ()
    sector: tuple[Array, Array] | None = None
    out: Array | None = None


@functools.cache
def teeth_table() -> Mapping[str, tuple[Toothing, ...]]:
    """Return the shipped table by part number; read once."""
    text = files("parts_library").joinpath("teeth.toml").read_text(encoding="utf-8")
    return parse_teeth(tomllib.loads(text))


def parse_teeth(content: Mapping[str, Any]) -> Mapping[str, tuple[Toothing, ...]]:
    """Return the table that parsed TOML describes.

    Raises
    ------
    SchemaError
        With every fault.
    """
    return by_number(content, _rows, "teeth.toml")


def _rows(part: Mapping[str, Any]) -> tuple[Toothing, ...]:
    return (
        *(_ring(entry) for entry in part.get("ring", ())),
        *(_rack(entry) for entry in part.get("rack", ())),
        *(_worm(entry) for entry in part.get("worm", ())),
    )


def _ring(row: Mapping[str, Any]) -> Toothing:
    kind, count = str(row["kind"]), int(row["count"])
    faces = tuple((float(at) * LDU, int(way)) for at, way in row.get("faces", ()))
    if kind not in _KINDS or count < 1 or any(abs(way) != 1 for _, way in faces):
        raise ValueError("kind, count or faces")
    sector = None
    if "sector" in row:
        first, last = (_unit(direction, "sector") for direction in row["sector"])
        sector = (first, last)
    return Toothing(
        kind,
        count,
        _point(row["center"]),
        _unit(row["axis"], "axis"),
        count * MODULE / 2.0,
        _length(row["half"], "half"),
        bool(row.get("inner", False)),
        faces,
        sector,
    )


def _rack(row: Mapping[str, Any]) -> Toothing:
    center, along = _point(row["center"]), _unit(row["along"], "along")
    half = _length(row["half"], "half")
    return Toothing("rack", 0, center, along, 0.0, half, out=_unit(row["out"], "out"))


def _worm(row: Mapping[str, Any]) -> Toothing:
    radius, half = _length(row["radius"], "radius"), _length(row["half"], "half")
    return Toothing("worm", 0, _point(row["center"]), _unit(row["axis"], "axis"), radius, half)


def _point(values: Any) -> Array:
    point = np.array(values, dtype=float)
    if point.shape != (3,):
        raise ValueError("center")
    return readonly(point * LDU)


def _unit(values: Any, key: str) -> Array:
    vector = np.array(values, dtype=float)
    if vector.shape != (3,) or not np.linalg.norm(vector) > 0.0:
        raise ValueError(key)
    return readonly(vector / np.linalg.norm(vector))


def _length(value: Any, key: str) -> float:
    if not float(value) > 0.0:
        raise ValueError(key)
    return float(value) * LDU
