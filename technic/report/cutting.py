"""Bars to be made: outlines with pin holes for a laser cutter (SVG, DXF), solids for a printer (STL).

Lengths in the files are millimetres.
"""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path
from xml.sax.saxutils import escape

import numpy as np

from technic.assembly.model import Assembly
from technic.errors import UsageError
from technic.geometry import Array
from technic.parts.definition import FrameBody
from technic.report.files import check_writable, write_atomic, write_bytes

__all__ = ["Blank", "blanks", "write_cut", "write_stl"]

WALL = 1.0
"""Material left around a hole (mm): a bar that is narrower than hole and walls is widened to them at its
whole length, because a laser does not cut what a pin would tear."""

GAP = 3.0
"""Between two bars on the sheet (mm)."""

ARC = 16
"""Sides of a half circle in solids and of the rounded ends."""


@dataclass(frozen=True, slots=True, eq=False)
class Blank:
    """One bar laid flat.

    Parameters
    ----------
    id : str
    axis : (k, 2) ndarray
        Corners of the centre line (mm).
    width, thickness : float
        mm.
    holes : (h, 2) ndarray
        Middles of pin holes (mm).
    """

    id: str
    axis: Array
    width: float
    thickness: float
    holes: Array


def blanks(assembly: Assembly, pin: float) -> list[Blank]:
    """Return the bars of an assembly, each in its own plane.

    Parameters
    ----------
    assembly : Assembly
    pin : float
        Diameter of the holes (m).

    Raises
    ------
    UsageError
        There is no bar, or a bar is bent out of a plane.
    """
    out = []
    for p, part in enumerate(assembly.parts):
        if not isinstance(part.body, FrameBody) or not part.shape:
            continue
        points = part.pose.points(part.body.points)
        normal = part.pose.directions(part.body.normals[0])
        x = points[1] - points[0]
        x = x / np.linalg.norm(x)
        z = normal - (normal @ x) * x
        z = z / np.linalg.norm(z)
        flat = np.array([x, np.cross(z, x)])
        arms = points - points[0]
        if np.abs(arms @ z).max() > 1e-6 * float(np.abs(arms).max()):
            raise UsageError(f"bar {part.id} is bent out of a plane: it cannot be laid flat")
        section = part.shape["section"]
        if section["kind"] == "rectangle":
            width, thick = float(section["height"]), float(section["width"])
        else:
            width = thick = float(section["diameter"])
        at = [j.point for j in assembly.joints if p in j.parts]
        at += [s.point for s in assembly.supports if s.part == p and s.point is not None]
        holes = np.array(at).reshape(-1, 3)
        holes = np.unique((1e3 * (holes - points[0]) @ flat.T).round(6), axis=0)
        width = max(1e3 * width, 1e3 * pin + 2 * WALL) if pin else 1e3 * width
        out.append(Blank(part.id, 1e3 * arms @ flat.T, width, 1e3 * thick, holes))
    if not out:
        raise UsageError("no bar to make: the assembly has none")
    return out


def outline(blank: Blank) -> Array:
    """Return the outline of a bar with round ends and mitred bends, (n, 2) in mm, counterclockwise."""
    axis = blank.axis
    spans = np.diff(axis, axis=0)
    spans = spans / np.linalg.norm(spans, axis=1)[:, None]
    sides = np.column_stack([-spans[:, 1], spans[:, 0]])
    half = blank.width / 2.0
    left: list[Array] = []
    for k in range(len(axis)):
        if k in (0, len(axis) - 1):
            left.append(half * sides[min(k, len(sides) - 1)])
        else:
            middle = sides[k - 1] + sides[k]
            # a sharp bend is cut off at twice the half width
            share = max(float(middle @ middle) / 2.0, 0.5)
            left.append(half * middle / share)
    turn = np.linspace(0.0, np.pi, ARC + 1)[1:-1]
    ends = []
    for k, sign in ((0, -1.0), (len(axis) - 1, 1.0)):
        d, n = sign * spans[min(k, len(spans) - 1)], sign * sides[min(k, len(spans) - 1)]
        ends.append(axis[k] + half * (np.outer(-np.cos(turn), n) + np.outer(np.sin(turn), d)))
    right = [a - w for a, w in zip(axis, left, strict=True)]
    back = [a + w for a, w in zip(axis, left, strict=True)][::-1]
    return np.vstack([right, ends[1], back, ends[0]])


def _sheet(assembly: Assembly, pin: float) -> tuple[list[tuple[Blank, Array]], float, float]:
    """Lay the bars below each other; return each with its shift, and the sheet's size (mm)."""
    if assembly.dimension != 2:
        raise UsageError("a sheet is cut for flat linkages; use --stl for one in space")
    placed, y, wide = [], GAP, 0.0
    for blank in sorted(blanks(assembly, pin), key=lambda b: b.id):
        edge = outline(blank)
        low, high = edge.min(axis=0), edge.max(axis=0)
        placed.append((blank, np.array([GAP - low[0], y - low[1]])))
        y += float(high[1] - low[1]) + GAP
        wide = max(wide, float(high[0] - low[0]) + 2 * GAP)
    return placed, wide, y


def write_cut(assembly: Assembly, path: Path, pin: float) -> None:
    """Write the bars of a flat linkage for a laser cutter: ``.svg`` or ``.dxf`` by the suffix.

    Raises
    ------
    UsageError
        Another suffix, an assembly in space, or the file cannot be written.
    """
    writers = {".svg": _svg, ".dxf": _dxf}
    if path.suffix.lower() not in writers:
        raise UsageError(f"{path}: a cutting file ends in .svg or .dxf")
    placed, wide, high = _sheet(assembly, pin)
    text = writers[path.suffix.lower()](placed, wide, high, 1e3 * pin)
    write_bytes(path, text.encode())


def _svg(placed: list[tuple[Blank, Array]], wide: float, high: float, hole: float) -> str:
    out = [
        (
            f'<svg xmlns="http://www.w3.org/2000/svg" width="{wide:.3f}mm" height="{high:.3f}mm" '
            f'viewBox="0 0 {wide:.3f} {high:.3f}" fill="none" stroke="red" stroke-width="0.1">'
        )
    ]
    for blank, shift in placed:
        edge = outline(blank) + shift
        # the sheet's y axis points down in SVG
        points = " ".join(f"{x:.4f},{high - y:.4f}" for x, y in edge)
        out.append(f'<g id="{escape(blank.id, {chr(34): "&quot;"})}"><polygon points="{points}"/>')
        if hole:
            for x, y in blank.holes + shift:
                out.append(f'<circle cx="{x:.4f}" cy="{high - y:.4f}" r="{hole / 2:.4f}"/>')
        out.append("</g>")
    return "\n".join([*out, "</svg>"]) + "\n"


def _dxf(placed: list[tuple[Blank, Array]], _wide: float, _high: float, hole: float) -> str:
    """Return DXF of the oldest kind that cutters read (R12): polylines and circles, millimetres."""
    rows: list[tuple[int, str]] = [
        (0, "SECTION"), (2, "HEADER"), (9, "$ACADVER"), (1, "AC1009"), (0, "ENDSEC"),
        (0, "SECTION"), (2, "ENTITIES"),
    ]  # fmt: skip
    for blank, shift in placed:
        rows += [(0, "POLYLINE"), (8, "CUT"), (66, "1"), (70, "1")]
        for x, y in outline(blank) + shift:
            rows += [(0, "VERTEX"), (8, "CUT"), (10, f"{x:.4f}"), (20, f"{y:.4f}")]
        rows.append((0, "SEQEND"))
        if hole:
            for x, y in blank.holes + shift:
                rows += [(0, "CIRCLE"), (8, "HOLES"), (10, f"{x:.4f}"), (20, f"{y:.4f}")]
                rows.append((40, f"{hole / 2:.4f}"))
    rows += [(0, "ENDSEC"), (0, "EOF")]
    return "".join(f"{code:>3}\n{value}\n" for code, value in rows)


def write_stl(assembly: Assembly, folder: Path, pin: float) -> list[Path]:
    """Write one solid per bar with its pin holes; round bars become flat ones of the same width.

    Raises
    ------
    UsageError
        The folder cannot be written.
    """
    import trimesh
    from manifold3d import CrossSection, Manifold

    folder.mkdir(parents=True, exist_ok=True)
    written = []
    for k, blank in enumerate(blanks(assembly, pin)):
        safe = "".join(c if c.isalnum() or c in "-_" else "_" for c in blank.id)
        path = folder / f"{k + 1:03d}_{safe}.stl"
        check_writable(path)
        figure = CrossSection([outline(blank)])
        if pin:
            for hole in blank.holes:
                disc = CrossSection.circle(500.0 * pin, 2 * ARC).translate(hole.tolist())
                figure = figure - disc
        mesh = Manifold.extrude(figure, blank.thickness).to_mesh()
        solid = trimesh.Trimesh(mesh.vert_properties[:, :3], mesh.tri_verts, process=True)
        write_atomic(path, lambda temporary, s=solid: _export(s, temporary))  # type: ignore[misc]
        written.append(path)
    return written


def _export(solid: object, path: Path) -> None:
    solid.export(path)  # type: ignore[attr-defined]
