"""The compact notation of ports and frames in the catalogue files; `parts_library/SCHEMA.md` says it
in words. Lengths in the files are LDraw units; everything returned here is in metres.
"""

from __future__ import annotations

import itertools
import math
from collections.abc import Iterator
from dataclasses import dataclass

import numpy as np

from technic.errors import SchemaError
from technic.geometry import Array, Pose
from technic.parts.definition import FrameBody, Material, Port, PortKind, Section
from technic.units import LDU

__all__ = ["parse_frame", "parse_ports", "parse_pose"]


@dataclass(frozen=True, slots=True)
class _Word:
    """What a word of the notation stands for."""

    kind: PortKind
    name: str
    length: float
    friction: bool = False
    divided: bool = False


_WORDS = {
    "pin_hole": _Word(PortKind.PIN_HOLE, "hole", 20.0, divided=True),
    "axle_hole": _Word(PortKind.AXLE_HOLE, "axle_hole", 20.0, divided=True),
    "pin": _Word(PortKind.PIN, "pin", 20.0, divided=True),
    "friction_pin": _Word(PortKind.PIN, "pin", 20.0, friction=True, divided=True),
    "axle": _Word(PortKind.AXLE, "axle", 20.0),
    "stop": _Word(PortKind.STOP, "stop", 2.0),
    "stud": _Word(PortKind.STUD, "stud", 4.0),
    "tube": _Word(PortKind.TUBE, "tube", 4.0),
    "ball": _Word(PortKind.BALL, "ball", 0.0),
    "socket": _Word(PortKind.SOCKET, "socket", 0.0),
}
_SEGMENT = 20.0
_AXES = {
    "x": (1.0, 0.0, 0.0),
    "y": (0.0, 1.0, 0.0),
    "z": (0.0, 0.0, 1.0),
    "-x": (-1.0, 0.0, 0.0),
    "-y": (0.0, -1.0, 0.0),
    "-z": (0.0, 0.0, -1.0),
}


def _axis(word: str) -> Array:
    """Return the unit vector that `word` names: a letter with a sign, or three numbers."""
    known = _AXES.get(word)
    vector = np.array(known or [float(n) for n in word.split(",")])
    norm = math.sqrt(float(vector @ vector))
    if vector.shape != (3,) or norm == 0.0:
        raise ValueError(f"{word!r} is not a direction")
    return np.asarray(vector / norm)


def _places(fields: list[str], position: Array) -> Iterator[Array]:
    """Yield the positions of ``*N dx dy dz [*M dx dy dz]`` after a port's own numbers."""
    if not fields:
        yield position
        return
    count = int(fields[0].removeprefix("*"))
    step = np.array([float(n) for n in fields[1:4]])
    if not fields[0].startswith("*") or count < 1 or step.shape != (3,):
        raise ValueError(f"{' '.join(fields)!r} is not a repetition")
    for k in range(count):
        yield from _places(fields[4:], position + k * step)


def parse_ports(text: str, part: str) -> tuple[Port, ...]:
    """Return the ports that `text` describes.

    Parameters
    ----------
    text : str
        ``KIND AXIS X Y Z [LENGTH] [*N DX DY DZ]...``, several separated by ``;`` (LDU).
    part : str
        Part number, for messages.

    Returns
    -------
    tuple of Port
        Pins and bores longer than one pitch are divided into ports of one pitch; names count the
        ports of a kind from 1 in the order of the text.

    Raises
    ------
    SchemaError
        When a phrase cannot be understood.
    """
    ports: list[Port] = []
    counts: dict[str, int] = {}
    for phrase in text.split(";"):
        fields = phrase.split()
        if not fields:
            continue
        try:
            word = _WORDS[fields[0]]
            axis = _axis(fields[1])
            middle = np.array([float(n) for n in fields[2:5]])
            rest = fields[5:]
            length = word.length
            if rest and not rest[0].startswith("*"):
                length = float(rest.pop(0))
            if middle.shape != (3,) or not length >= 0.0:
                raise ValueError("three coordinates and a length are needed")
            segments = 1
            if word.divided and length > _SEGMENT:
                segments = round(length / _SEGMENT)
                if abs(segments * _SEGMENT - length) > 1e-9:
                    raise ValueError("a long pin or bore must measure whole pitches")
            for place in _places(rest, middle):
                for k in range(segments):
                    shift = (k - (segments - 1) / 2) * _SEGMENT
                    counts[word.name] = number = counts.get(word.name, 0) + 1
                    ports.append(
                        Port(
                            name=f"{word.name}{number}",
                            kind=word.kind,
                            position=(place + shift * axis) * LDU,
                            axis=axis,
                            length=length / segments * LDU,
                            friction=word.friction,
                        )
                    )
        except (KeyError, ValueError, IndexError) as error:
            raise SchemaError([f"{part}.ports: {phrase.strip()!r}: {error}"]) from error
    return tuple(ports)


def parse_frame(
    text: str, part: str, sections: dict[str, Section], material: Material
) -> FrameBody:
    """Return the frame that `text` describes.

    Parameters
    ----------
    text : str
        ``SECTION NORMAL | x y z | x y z | ...``: a chain of members; several chains separated by
        ``;``. Chains are joined where they share a point (LDU).
    part : str
        Part number, for messages.
    sections : mapping
        Cross-sections by name.
    material : Material

    Raises
    ------
    SchemaError
        When a chain cannot be understood.
    """
    points: dict[tuple[float, ...], int] = {}
    members: list[tuple[int, int]] = []
    chosen: list[Section] = []
    normals: list[Array] = []
    for chain in text.split(";"):
        try:
            head, *stations = chain.split("|")
            name, normal = head.split()
            section, direction = sections[name], _axis(normal)
            nodes = []
            for station in stations:
                point = tuple(float(n) for n in station.split())
                if len(point) != 3:
                    raise ValueError("a point needs three coordinates")
                nodes.append(points.setdefault(point, len(points)))
            if len(nodes) < 2:
                raise ValueError("a chain needs two points")
        except (KeyError, ValueError) as error:
            raise SchemaError([f"{part}.frame: {chain.strip()!r}: {error}"]) from error
        for a, b in itertools.pairwise(nodes):
            members.append((a, b))
            chosen.append(section)
            normals.append(direction)
    return FrameBody(
        points=np.array(list(points)) * LDU,
        members=np.array(members),
        sections=tuple(chosen),
        normals=np.array(normals),
        material=material,
    )


def parse_pose(text: str, part: str) -> Pose:
    """Return the pose ``x y z a b c d e f g h i`` (LDU; the numbers of an LDraw type 1 line).

    Raises
    ------
    SchemaError
        When the text does not hold twelve numbers.
    """
    try:
        numbers = np.array([float(n) for n in text.split()])
        return Pose(numbers[3:].reshape(3, 3), numbers[:3] * LDU)
    except ValueError as error:
        raise SchemaError([f"{part}: {text!r} is not a pose"]) from error
