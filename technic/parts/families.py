"""Parametric families of the catalogue: from a few numbers to ports and frame.

Each function takes one row of a definition file and returns the row of a plain part: the notation of
`technic.parts.notation`, so that a family is nothing but shorthand. Lengths are LDraw units.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping
from typing import Any

__all__ = ["FAMILIES", "expand"]

Row = Mapping[str, Any]
Plain = dict[str, Any]

PITCH = 20.0
DEPTH = {"thick": 20.0, "thin": 10.0}
HOLES = {"p": "pin_hole", "a": "axle_hole"}


def _number(value: float) -> str:
    """Return `value` as short text."""
    return f"{value:.6g}"


def straight_beam(row: Row) -> Plain:
    """A liftarm along z with holes along y: `holes` (a count, or a letter p or a per hole), `first`
    (z of the first hole; middle of the part at 0 when left out), `thickness`, `y` of its middle.
    """
    thickness = row.get("thickness", "thick")
    pattern = row["holes"] if isinstance(row["holes"], str) else "p" * row["holes"]
    half = (len(pattern) - 1) * PITCH / 2
    first = float(row.get("first", -half))
    y, depth = _number(row.get("y", 0.0)), _number(DEPTH[thickness])
    ports = [
        f"{HOLES[letter]} y 0 {y} {_number(first + k * PITCH)} {depth}"
        for k, letter in enumerate(pattern)
    ]
    last = first + 2 * half
    plain: Plain = {
        "title": f"Beam {len(pattern)}" + (" thin" if thickness == "thin" else ""),
        "family": f"beam-{thickness}",
        "ports": ";".join(ports),
    }
    if len(pattern) > 1:
        plain["frame"] = f"{thickness} y | 0 {y} {_number(first)} | 0 {y} {_number(last)}"
    return plain


def alternating_beam(row: Row) -> Plain:
    """A beam along z whose holes lie along y and x in turn: `holes`."""
    count = row["holes"]
    half = (count - 1) * PITCH / 2
    ports = [f"pin_hole {'yx'[k % 2]} 0 0 {_number(k * PITCH - half)}" for k in range(count)]
    return {
        "title": f"Beam {count} with alternating holes",
        "family": "beam-alternating",
        "ports": ";".join(ports),
        "frame": f"thick y | 0 0 {_number(-half)} | 0 0 {_number(half)}",
    }


def bent_beam(row: Row) -> Plain:
    """A liftarm in the plane of x and z with holes along y: `stations`, in order along the arm,
    each ``p|a x z [*n dx dz]``; the frame runs through the corners.
    """
    thickness = row.get("thickness", "thick")
    y, depth = _number(row.get("y", 0.0)), _number(DEPTH[thickness])
    ports, points = [], []
    for station in row["stations"].split(";"):
        letter, x, z, *rest = station.split()
        count = int(rest[0].removeprefix("*")) if rest else 1
        dx, dz = (float(rest[1]), float(rest[2])) if rest else (0.0, 0.0)
        for k in range(count):
            px, pz = float(x) + k * dx, float(z) + k * dz
            points.append((px, pz))
            ports.append(f"{HOLES[letter]} y {_number(px)} {y} {_number(pz)} {depth}")
    corners = [points[0]]
    for before, here, after in zip(points, points[1:], points[2:], strict=False):
        u = (here[0] - before[0], here[1] - before[1])
        v = (after[0] - here[0], after[1] - here[1])
        if abs(u[0] * v[1] - u[1] * v[0]) > 1e-6 * PITCH**2:
            corners.append(here)
    corners.append(points[-1])
    chain = " | ".join(f"{_number(px)} {y} {_number(pz)}" for px, pz in corners)
    return {
        "family": "beam-bent" + ("-thin" if thickness == "thin" else ""),
        "ports": ";".join(ports),
        "frame": f"{thickness} y | {chain}",
    }


def axle(row: Row) -> Plain:
    """An axle along x with its middle at 0: `length` in modules; `stop` adds a head at +x."""
    half = row["length"] * PITCH / 2
    head = 2.0 if row.get("stop", False) else 0.0
    ports = f"axle x {_number(-head / 2)} 0 0 {_number(2 * half - head)}"
    if head:
        ports += f"; stop x {_number(half - head / 2)} 0 0 {_number(head)}"
    return {
        "title": f"Axle {row['length']}" + (" with stop" if head else ""),
        "family": "axle-stop" if head else "axle",
        "material": "POM",
        "fastener": True,
        "ports": ports,
        "frame": f"axle y | {_number(-half)} 0 0 | {_number(half)} 0 0",
    }


def _studs(length: int, width: int, height: float) -> str:
    """Studs on top (y = 0) and receptors below (y = `height`) of a brick or plate."""
    x0, z0 = -(length - 1) * PITCH / 2, -(width - 1) * PITCH / 2
    grid = f"*{length} 20 0 0 *{width} 0 0 20"
    return (
        f"stud -y {_number(x0)} -2 {_number(z0)} 4 {grid};"
        f"tube y {_number(x0)} {_number(height - 2)} {_number(z0)} 4 {grid}"
    )


def technic_brick(row: Row) -> Plain:
    """A brick 1 x `studs` along x with pin holes along z between the studs."""
    studs = row["studs"]
    ports = _studs(studs, 1, 24.0)
    ports += f"; pin_hole z {_number(-(studs - 2) * PITCH / 2)} 10 0 20 *{studs - 1} 20 0 0"
    return {
        "title": f"Technic brick 1 x {studs} with holes",
        "family": "brick-hole",
        "ports": ports,
    }


def technic_plate(row: Row) -> Plain:
    """A plate 2 x `studs` along x with pin holes along y between four studs."""
    studs = row["studs"]
    ports = _studs(studs, 2, 8.0)
    ports += f"; pin_hole y {_number(-(studs - 2) * PITCH / 2)} 4 0 8 *{studs - 1} 20 0 0"
    return {
        "title": f"Technic plate 2 x {studs} with holes",
        "family": "plate-hole",
        "ports": ports,
    }


def brick(row: Row) -> Plain:
    """A System brick `length` (along x) by `width` (along z), 24 LDU high."""
    return _block(row, "Brick", 24.0)


def plate(row: Row) -> Plain:
    """A System plate `length` (along x) by `width` (along z), 8 LDU high."""
    return _block(row, "Plate", 8.0)


def tile(row: Row) -> Plain:
    """A System tile: a plate without studs."""
    plain = _block(row, "Tile", 8.0)
    plain["ports"] = plain["ports"].split(";")[1]
    return plain


def _block(row: Row, name: str, height: float) -> Plain:
    length, width = row["length"], row["width"]
    return {
        "title": f"{name} {min(length, width)} x {max(length, width)}",
        "family": name.lower(),
        "ports": _studs(length, width, height),
    }


FAMILIES: dict[str, Callable[[Row], Plain]] = {
    "straight_beam": straight_beam,
    "alternating_beam": alternating_beam,
    "bent_beam": bent_beam,
    "axle": axle,
    "technic_brick": technic_brick,
    "technic_plate": technic_plate,
    "brick": brick,
    "plate": plate,
    "tile": tile,
}
"""Name of the table in a definition file, and what expands its rows."""


def expand(table: str, row: Row) -> Plain:
    """Return the plain part that a row of `table` stands for; what the row says itself wins.

    Raises
    ------
    KeyError
        When the table is not a family, or the row lacks a number the family needs.
    """
    if table == "part":
        return dict(row)
    plain = FAMILIES[table](row)
    extra = row.get("extra_ports")
    if extra:
        plain["ports"] += ";" + extra
    return {**plain, **row}
