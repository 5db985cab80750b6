#!/usr/bin/env python3
"""How far the shipped solid models are from the limit of ever finer cells: lambda_1 on three grids.

    python benchmarks/convergence.py [MODEL] [--jobs N] [--json PATH]

A free beam 3, two beams 3 on two pins, and MODEL (the demo, unless another is named) with all of its parts
meshed anew. Cells shrink by the square root of two from grid to grid, and the finest ones are the shipped
0.8 mm; one more step, to 0.57 mm, shows how far off these are (kinds of part that are too large for it, a
frame 5 x 7 say, take 0.71 mm). The limit is that of Aitken's formula on the last three grids, and the order
is the one that they show.
"""

from __future__ import annotations

import argparse
import json
import sys
from collections.abc import Mapping
from pathlib import Path
from tempfile import TemporaryDirectory
from time import process_time

import numpy as np
from scipy import sparse

sys.path.insert(0, str(Path(__file__).resolve().parents[1]))

from technic.assembly.model import Assembly, Part
from technic.fem.element import Element
from technic.fem.solid.settings import MeshSettings
from technic.fem.solid.store import build, load
from technic.fem.solid.superelement import SuperElement
from technic.geometry import Array
from technic.ldraw.reader import load_ldraw
from technic.rigidity.eigen import elastic_modes
from technic.statics.solve import free_motions
from technic.system.assemble import assemble, element_of
from technic.system.part_models import element_from

DEMO = Path(__file__).resolve().parents[1] / "technic" / "data" / "rolling_chassis.mpd"
SHIPPED = 0.8e-3
STEP = 2**0.5
GRIDS = {"part": (3, -1), "joint": (3, -1), "model": (2, -1)}
"""Coarsest and finest grid: so many times `STEP` coarser than the shipped one."""

PART = "0 Beam 3\n1 4 0 0 0 1 0 0 0 1 0 0 0 1 32523.dat\n"
JOINT = (
    "0 Two beams 3 on two pins\n"
    "1 4 0 0 0 1 0 0 0 1 0 0 0 1 32523.dat\n"
    "1 4 0 -20 20 1 0 0 0 1 0 0 0 1 32523.dat\n"
    "1 0 0 -10 20 0 1 0 1 0 0 0 0 1 2780.dat\n"
    "1 0 0 -10 0 0 1 0 1 0 0 0 0 1 2780.dat\n"
)


def lowest(assembly: Assembly, models: Mapping[str, SuperElement]) -> float:
    """Return lambda_1 (N/m) with the solid models given."""

    def element(part: Part, points: Array, ports: tuple[str | None, ...]) -> Element:
        condensed = models.get(part.definition.id) if part.definition is not None else None
        if condensed is None:
            return element_of(part, points, ports)
        return element_from(condensed, part, points, ports)

    system = assemble(assembly, element=element)
    held = sparse.csr_array(system.A[~system.elastic])
    stiffness = sparse.csr_array(system.K + system.J)
    pairs = elastic_modes(stiffness, system.M, held, free_motions(system), 1)
    return float(pairs.values[0])


def study(assembly: Assembly, grids: tuple[int, int], jobs: int) -> dict[str, object]:
    """Return lambda_1 on every grid, the order, the limit, and how far the shipped grid is off it."""
    definitions = {
        p.definition.id: p.definition
        for p in assembly.parts
        if p.definition is not None and load(p.definition) is not None
    }
    cells, values = [], []
    start = process_time()
    for power in range(grids[0], grids[1] - 1, -1):
        cell = SHIPPED * STEP**power
        models, failed = build(definitions.values(), MeshSettings(cell=cell), jobs=jobs)
        if failed:
            raise SystemExit(f"not built: {failed}")
        cells.append(round(cell * 1e3, 3))
        values.append(lowest(assembly, models))
        print(f"{assembly.name}: {cells[-1]} mm  {values[-1]:.6g} N/m", file=sys.stderr)
    a, b, c = values[-3:]
    limit = c - (c - b) ** 2 / ((c - b) - (b - a))
    ratio = (a - b) / (b - c)
    at = cells.index(0.8)
    return {
        "cells_mm": cells,
        "lambda_1_n_per_m": values,
        "order": float(np.log(ratio) / np.log(STEP)) if ratio > 0 else None,
        "limit_n_per_m": limit,
        "shipped_above_limit": values[at] / limit - 1.0,
        "kinds_of_part": len(definitions),
        "processor_s": process_time() - start,
    }


def main() -> None:
    """Measure and print."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("model", nargs="?", type=Path, default=DEMO)
    parser.add_argument("--jobs", type=int, default=1, help="processes; a beam 15 takes 2 GB each")
    parser.add_argument("--json", metavar="PATH", help="write the figures as JSON")
    options = parser.parse_args()
    with TemporaryDirectory() as folder:
        small = {}
        for name, text in (("part", PART), ("joint", JOINT)):
            path = Path(folder) / f"{name}.ldr"
            path.write_text(text, encoding="utf-8")
            small[name] = load_ldraw(path)
    models = {**small, "model": load_ldraw(options.model)}
    figures = {name: study(model, GRIDS[name], options.jobs) for name, model in models.items()}
    text = json.dumps(figures, indent=2)
    print(text)
    if options.json:
        Path(options.json).write_text(text + "\n", encoding="utf-8")


if __name__ == "__main__":
    main()
