#!/usr/bin/env python3
"""Volume, centroid and inertia of catalogue parts, measured on their LDraw surfaces.

Writes `parts_library/mass.json`. The surface of a part is scanned by parallel rays along the three
axes; a point is inside when at least two of the three directions say so (the winding number counted
along a ray is positive). Surfaces need not be closed nor free of overlaps.

    scripts/ldraw_mass.py LIBRARY [--only ID ...] [--pitch LDU]
"""

from __future__ import annotations

import argparse
import json
import sys
from collections.abc import Mapping
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

ROOT = Path(__file__).resolve().parents[1]
sys.path.insert(0, str(ROOT))

from technic.geometry import Array  # noqa: E402 (the path is set up first)
from technic.ldraw.library import Library  # noqa: E402
from technic.parts.catalogue import Catalogue, read_rows  # noqa: E402
from technic.parts.families import expand  # noqa: E402
from technic.parts.materials import ABS, material  # noqa: E402
from technic.units import LDU  # noqa: E402

MASS_FILE = ROOT / "parts_library" / "mass.json"


class Surfaces:
    """Triangles of LDraw files, wound so that their normals point outward."""

    def __init__(self, library: Library) -> None:
        self.library = library
        self._memo: dict[str, Array] = {}

    def triangles(self, name: str) -> Array:
        """Return the triangles of a file, (n, 3, 3), in LDU."""
        key = self._fine(name)
        if key is None:
            return np.zeros((0, 3, 3))
        found = self._memo.get(key)
        if found is None:
            found = self._memo[key] = self._walk(key)
        return found

    def _fine(self, name: str) -> str | None:
        """Return the library's key of `name`, its 48-sided version where there is one."""
        fine = self.library.find(f"48/{name}") if "/" not in name.replace("\\", "/") else None
        return fine or self.library.find(name)

    def _walk(self, key: str) -> Array:
        blocks: list[Array] = []
        own: list[list[tuple[float, ...]]] = []
        clockwise = False
        inverted = False
        for line in self.library.text(key).splitlines():
            words = line.split()
            if not words:
                continue
            if words[0] == "0" and len(words) > 2 and words[1] == "BFC":
                if words[2] == "INVERTNEXT":
                    inverted = True
                    continue
                if words[-1] in ("CW", "CCW"):
                    clockwise = words[-1] == "CW"
            elif words[0] == "1":
                numbers = np.array([float(w) for w in words[2:14]])
                matrix = numbers[3:].reshape(3, 3)
                child = self.triangles(" ".join(words[14:]).lower().replace("\\", "/"))
                moved = child @ matrix.T + numbers[:3]
                if inverted != (np.linalg.det(matrix) < 0):
                    moved = moved[:, ::-1]
                blocks.append(moved)
            elif words[0] in "34":
                corners = np.array([float(w) for w in words[2 : 2 + 3 * int(words[0])]])
                points = [tuple(p) for p in corners.reshape(-1, 3)]
                if clockwise:
                    points.reverse()
                own.append(points[:3])
                if len(points) == 4:
                    own.append([points[2], points[3], points[0]])
            inverted = False
        if own:
            blocks.append(np.array(own))
        return np.concatenate(blocks) if blocks else np.zeros((0, 3, 3))


def winding(grid: Array, shape: tuple[int, ...]) -> NDArray[np.int16]:
    """Return the winding number of the cells of a grid, counted along rays of the last axis.

    `grid` holds the triangles in cell coordinates: the centre of cell ``i`` is at ``i``.
    """
    crossings = np.zeros((shape[0], shape[1], shape[2] + 1), dtype=np.int16)
    for a, b, c in grid:
        area = (b[0] - a[0]) * (c[1] - a[1]) - (b[1] - a[1]) * (c[0] - a[0])
        if abs(area) < 1e-12:
            continue
        low = np.ceil(np.minimum(np.minimum(a, b), c)[:2]).astype(int)
        high = np.floor(np.maximum(np.maximum(a, b), c)[:2]).astype(int)
        low, high = np.maximum(low, 0), np.minimum(high, np.array(shape[:2]) - 1)
        if (high < low).any():
            continue
        x = np.arange(low[0], high[0] + 1)[:, None]
        y = np.arange(low[1], high[1] + 1)[None, :]
        wb = ((x - a[0]) * (c[1] - a[1]) - (y - a[1]) * (c[0] - a[0])) / area
        wc = ((y - a[1]) * (b[0] - a[0]) - (x - a[0]) * (b[1] - a[1])) / area
        hit = (wb >= 0) & (wc >= 0) & (wb + wc <= 1)
        if not hit.any():
            continue
        z = a[2] + wb * (b[2] - a[2]) + wc * (c[2] - a[2])
        i, j = np.nonzero(hit)
        k = np.clip(np.ceil(z[i, j]).astype(int), 0, shape[2])
        np.add.at(crossings, (i + low[0], j + low[1], k), -1 if area > 0 else 1)
    return np.cumsum(crossings, axis=2, dtype=np.int16)[:, :, :-1]


def solid(triangles: Array, wanted: float) -> tuple[Array, Array]:
    """Return the centres of the occupied cells and the size of a cell (LDU).

    The grid has its outer faces on the part's bounding box, so that symmetric parts stay symmetric.
    """
    low, high = triangles.min((0, 1)), triangles.max((0, 1))
    counts = np.maximum(np.round((high - low) / wanted), 4).astype(int)
    cell = (high - low) / counts
    # a small odd shift keeps the rays off edges and vertices
    shift = np.array([1.37e-4, 2.41e-4, -1.93e-4])
    grid = (triangles - low) / cell - 0.5 + shift
    votes = np.zeros(tuple(counts), dtype=np.int8)
    for axis in range(3):
        order = [(axis + 1) % 3, (axis + 2) % 3, axis]
        count = winding(grid[:, :, order], tuple(counts[order]))
        votes += np.transpose(count > 0, np.argsort(order)).astype(np.int8)
    return (np.argwhere(votes >= 2) + 0.5) * cell + low, cell


def properties(triangles: Array, wanted: float, density: float, source: str) -> dict[str, Any]:
    """Return the mass properties of the solid that `triangles` bound."""
    size = triangles.max((0, 1)) - triangles.min((0, 1))
    # no more than some two million cells
    pitch = float(max(wanted, (np.prod(size) / 2e6) ** (1 / 3)))
    places, cell = solid(triangles, pitch)
    volume = len(places) * float(np.prod(cell)) * LDU**3
    centroid = places.mean(0)
    arms = (places - centroid) * LDU
    squares = arms.T @ arms / len(arms) + np.diag((cell * LDU) ** 2) / 12
    mass = volume * density
    inertia = mass * (np.trace(squares) * np.eye(3) - squares)
    return {
        "mass_kg": _round(mass),
        "centroid_m": [_round(c) for c in centroid * LDU],
        "inertia_kg_m2": [[_round(v) for v in row] for row in inertia],
        "volume_m3": _round(volume),
        "source": source,
    }


def weighed(found: dict[str, Any], row: Mapping[str, Any]) -> dict[str, Any]:
    """Return mass properties scaled to the mass that the row gives: housings are not full of ABS."""
    if "mass_g" not in row:
        return found
    factor = row["mass_g"] * 1e-3 / found["mass_kg"]
    inertia = [[_round(v * factor) for v in line] for line in found["inertia_kg_m2"]]
    return {
        **found,
        "mass_kg": row["mass_g"] * 1e-3,
        "inertia_kg_m2": inertia,
        "source": row["mass_source"],
    }


def _round(value: float) -> float:
    return float(f"{value:.4g}") if abs(value) > 1e-14 else 0.0


def main() -> None:
    """Measure the parts that are asked for, or all that lack an entry."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("library", type=Path)
    parser.add_argument("--only", nargs="*")
    parser.add_argument("--pitch", type=float, default=0.5)
    asked = parser.parse_args()
    rows = read_rows()
    known: dict[str, Mapping[str, Any]] = {}
    if MASS_FILE.exists():
        known = json.loads(MASS_FILE.read_text(encoding="utf-8"))
    library = Library.open(asked.library)
    source = f"LDraw geometry {library.release()}"
    surfaces = Surfaces(library)
    names = Catalogue(rows, known)
    for part in asked.only or [p for p in rows if p not in known]:
        row = expand(*rows[part])
        triangles = surfaces.triangles(f"{part}.dat")
        if len(triangles) == 0:
            print(f"{part}: no geometry", file=sys.stderr)
            continue
        density = material(row.get("material", ABS)).density
        found = properties(triangles, asked.pitch, density, source)
        known[part] = weighed(found, row)
        print(f"{part}: {known[part]['mass_kg'] * 1e3:.3f} g", file=sys.stderr)
    ordered = {part: known[part] for part in names.ids() if part in known}
    lines = [f"{json.dumps(part)}: {json.dumps(ordered[part])}" for part in ordered]
    MASS_FILE.write_text("{\n" + ",\n".join(lines) + "\n}\n", encoding="utf-8")


if __name__ == "__main__":
    main()
