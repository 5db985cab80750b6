"""Words for parts, places, directions and numbers, the same in every kind of report."""

from __future__ import annotations

from collections import Counter
from collections.abc import Sequence
from math import floor, isfinite, log10

import numpy as np

from technic.assembly.model import Assembly, Part
from technic.geometry import Array
from technic.parts.definition import PortKind
from technic.report.palette import color_name
from technic.rigidity.result import WeakSpot

__all__ = [
    "AXIS_WORDS",
    "DIRECTION_WORDS",
    "count",
    "direction_of",
    "direction_words",
    "joined",
    "number",
    "part_name",
    "part_names",
    "place",
    "spot_words",
]

DIRECTION_WORDS = {
    (0, 1): "right (+x)",
    (0, -1): "left (-x)",
    (1, 1): "down (+y)",
    (1, -1): "up (-y)",
    (2, 1): "back (+z)",
    (2, -1): "front (-z)",
}
"""Directions of an LDraw model as one looks at it: x to the right, y down, z away."""

_PLAIN_WORDS = {
    (axis, sign): f"along {'-+'[sign > 0]}{'xyz'[axis]}" for axis, sign in DIRECTION_WORDS
}
"""Directions of an assembly file, which does not say where up is."""

AXIS_WORDS = ("the x axis (left to right)", "the y axis (upright)", "the z axis (front to back)")


def direction_of(vector: Array) -> tuple[int, int]:
    """Return the model axis nearest to `vector` and the sign along it."""
    axis = int(np.argmax(np.abs(np.asarray(vector)).round(12)))
    return axis, 1 if vector[axis] >= 0.0 else -1


def direction_words(assembly: Assembly) -> dict[tuple[int, int], str]:
    """Return the words for the directions of a model, by what `direction_of` gives."""
    return _PLAIN_WORDS if assembly.source.get("format") == "assembly" else DIRECTION_WORDS


def number(value: float, digits: int = 3) -> str:
    """Return a number with so many significant digits, without an exponent where one can.

    >>> number(0.012345), number(8.6561), number(65625.0), number(1e8)
    ('0.0123', '8.66', '65600', '1e+08')
    """
    if not isfinite(value):
        return "infinite"
    if value == 0.0:
        return "0"
    size = floor(log10(abs(value)))
    if not -4 <= size < 7:
        return f"{value:.{digits - 1}e}".replace(".00e", "e").replace(".0e", "e")
    rounded = round(value, digits - 1 - size)
    return f"{rounded:.{max(0, digits - 1 - floor(log10(abs(rounded))))}f}"


def count(n: int, word: str, plural: str | None = None) -> str:
    """Return ``"1 part"``, ``"3 parts"``.

    >>> count(1, "body", "bodies"), count(2, "body", "bodies"), count(0, "part")
    ('1 body', '2 bodies', '0 parts')
    """
    return f"{n} {word if n == 1 else plural or word + 's'}"


def joined(words: Sequence[str]) -> str:
    """Return ``"a"``, ``"a and b"``, ``"a, b and c"``."""
    if len(words) < 2:
        return "".join(words)
    return ", ".join(words[:-1]) + " and " + words[-1]


def part_name(part: Part, *, line: bool = False) -> str:
    """Return what a person calls a part: name, number, colour, and its line in the file if asked."""
    color = color_name(part.color)
    words = [word for word in (part.number, color) if word and word != part.name]
    if line and part.source is not None:
        words.append(f"line {part.source.line}")
    inner = ", ".join(words)
    name = part.name or part.number or part.id
    return f"{name} ({inner})" if inner else name


def place(part: Part) -> str:
    """Return where a part stands in the model file; its id when it came from no file."""
    source = part.source
    if source is None:
        return part.id
    return f"{source.submodel} step {source.step}, line {source.line}"


def part_names(assembly: Assembly, parts: Sequence[int], limit: int = 3) -> str:
    """Return the names of some parts, equal ones counted, parts of structure first.

    At most `limit` names are given; the rest is counted.
    """
    order = sorted(parts, key=lambda k: assembly.parts[k].fastener)
    names = Counter(part_name(assembly.parts[k]) for k in order)
    said = [name if n == 1 else f"{n} x {name}" for name, n in list(names.items())[:limit]]
    rest = sum(n for _, n in list(names.items())[limit:])
    if rest:
        said.append(f"{rest} more")
    return joined(said)


_ENTERS = frozenset({PortKind.PIN, PortKind.AXLE, PortKind.BALL, PortKind.STUD})


def _enters(part: Part, port: str) -> bool:
    return any(p.name == port and p.kind in _ENTERS for p in part.ports)


def spot_words(assembly: Assembly, spot: WeakSpot) -> str:
    """Return what gives way at a weak spot: "bending of a beam", or "pin in beam" for a joint."""
    first, *others = (assembly.parts[k] for k in spot.parts)
    if spot.kind != "joint":
        return f"bending of {part_name(first)}"
    (second,) = others
    ports = assembly.joints[spot.index].ports
    inside = None if ports is None else [_enters(first, ports[0]), _enters(second, ports[1])]
    if inside == [True, False]:
        return f"{part_name(first)} in {part_name(second)}"
    if inside == [False, True]:
        return f"{part_name(second)} in {part_name(first)}"
    return f"{part_name(first)} with {part_name(second)}"
