"""Loads as a person types them: ``PART:PORT:fx,fy,fz`` and ``PART:PORT:200g``."""

from __future__ import annotations

import re
from math import isfinite
from typing import Final

import numpy as np

from technic.assembly.model import Assembly
from technic.assembly.select import find_place
from technic.errors import UsageError
from technic.geometry import Array
from technic.statics.solve import Load
from technic.system.assemble import Probe

__all__ = ["GRAVITY", "parse_direction", "parse_hang", "parse_load", "parse_probe"]

GRAVITY: Final = 9.80665
"""Standard acceleration of gravity (m/s2), ISO 80000-3."""

_FORCE_EXAMPLE = '--load "PART:PORT:0,2,0" with the force in newtons along x, y and z'
_HANG_EXAMPLE = '--hang "PART:PORT:200g" with g, kg or N'

_NEWTONS: Final = {"g": GRAVITY / 1000.0, "kg": GRAVITY, "n": 1.0}
_AMOUNT = re.compile(r"([0-9]*\.?[0-9]+(?:e[+-]?[0-9]+)?)\s*([a-z]*)", re.IGNORECASE)
_AXIS = re.compile(r"([+-]?)([xyz])", re.IGNORECASE)


def parse_direction(text: str) -> Array:
    """Return the unit vector that ``y``, ``-z`` or ``0,1,0`` names, (3,).

    Raises
    ------
    UsageError
        When the text is neither, or the vector is zero.
    """
    axis = _AXIS.fullmatch(text.strip())
    if axis is not None:
        vector = np.zeros(3)
        vector["xyz".index(axis[2].lower())] = -1.0 if axis[1] == "-" else 1.0
        return vector
    vector = _three(text, f"{text!r} is no direction; write an axis (y, -z) or three numbers")
    size = float(np.linalg.norm(vector))
    if size == 0.0:
        raise UsageError(f"{text!r} points nowhere; a direction needs a number that is not zero")
    return vector / size


def parse_load(assembly: Assembly, text: str) -> Load:
    """Return the force that ``PART[:PORT]:fx,fy,fz`` asks for (N, axes of the model).

    Raises
    ------
    UsageError
        When the text cannot be read or names no part or port.
    """
    place, value = _split(text, _FORCE_EXAMPLE)
    wrong = f"cannot read the force in {text!r}; write {_FORCE_EXAMPLE}"
    return _load(assembly, place, _three(value, wrong))


def parse_hang(assembly: Assembly, text: str, down: Array) -> Load:
    """Return the weight that ``PART[:PORT]:200g`` hangs on a part.

    Parameters
    ----------
    assembly : Assembly
    text : str
        The amount is in g, kg or N.
    down : (3,) ndarray
        Unit vector.

    Raises
    ------
    UsageError
        When the text cannot be read, has no unit, or names no part or port.
    """
    place, value = _split(text, _HANG_EXAMPLE)
    amount = _AMOUNT.fullmatch(value.strip())
    unit = "" if amount is None else amount[2].lower()
    if amount is None or unit not in _NEWTONS or not isfinite(float(amount[1])):
        raise UsageError(f"cannot read the weight in {text!r}; write {_HANG_EXAMPLE}")
    return _load(assembly, place, float(amount[1]) * _NEWTONS[unit] * down)


def parse_probe(assembly: Assembly, text: str) -> Probe:
    """Return the point that ``PART`` or ``PART:PORT`` names: a part's is its centroid.

    Raises
    ------
    UsageError
        When there is no such part or port.
    """
    place = find_place(assembly, text)
    part = assembly.parts[place.part]
    if place.port is None:
        return Probe(place.part, part.centroid)
    port = next(port for port in part.ports if port.name == place.port)
    return Probe(place.part, part.pose.points(port.position), place.port)


def _split(text: str, example: str) -> tuple[str, str]:
    place, colon, value = text.rpartition(":")
    if not colon or not place.strip():
        raise UsageError(f"cannot read the load {text!r}; write {example}")
    return place, value


def _three(text: str, wrong: str) -> Array:
    try:
        vector = np.array([float(word) for word in text.split(",")])
    except ValueError:
        raise UsageError(wrong) from None
    if vector.shape != (3,) or not np.isfinite(vector).all():
        raise UsageError(wrong)
    return vector


def _load(assembly: Assembly, place: str, force: Array) -> Load:
    probe = parse_probe(assembly, place)
    return Load(probe.part, probe.point, force, np.zeros(3), probe.port)
