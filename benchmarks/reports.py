#!/usr/bin/env python3
"""Time and weigh the page and the picture: the demo of 153 parts, a lattice of about 4000.

    python benchmarks/reports.py [--wall] [--lattice ROWS COLUMNS] [--json PATH]

The page is made from the finished analysis, which is timed apart. A picture is drawn by a process of its
own; its processor time is that of the child. Every figure stands beside its limit and their ratio: below
1 is good. Processor seconds unless --wall: other programs on the machine do not change them much.
"""

from __future__ import annotations

import argparse
import json
import os
import sys
import tempfile
from collections.abc import Callable
from pathlib import Path
from time import perf_counter

sys.path.insert(0, str(Path(__file__).resolve().parents[1]))

from technic.assembly.model import Assembly
from technic.loading import load
from technic.report.comparison import comparison_scene
from technic.report.drawing import drawing_of
from technic.report.html.page import page
from technic.report.picture import report_scene
from technic.report.render import Painter
from technic.rigidity.analyze import analyze
from technic.rigidity.result import RigidityReport

DEMO = Path(__file__).resolve().parents[1] / "technic" / "data" / "rolling_chassis.mpd"

LIMITS = {
    "page, 153 parts (s)": 3.0,
    "page, 153 parts (MB)": 1.5,
    "picture, 153 parts (s)": 4.0,
    "page, 4000 parts (s)": 20.0,
    "page, 4000 parts (MB)": 8.0,
}

BEAM, PITCH = 15, 20
"""Holes of the lattice's beams; LDU from hole to hole."""


def _shift(line: int) -> int:
    """Return by how many holes the beams of a line are shifted."""
    return 8 if line // 2 % 2 else 0


def lattice(rows: int, columns: int, folder: Path) -> Assembly:
    """Return beams of 15 in two layers that cross at every second hole, a pin at each crossing.

    Every second line of beams is shifted by half a beam, so that all hang together.

    Parameters
    ----------
    rows, columns : int
        Beams along x in a line, and along z.
    folder : Path
        Where the model file is written.
    """
    across, along = BEAM * rows, BEAM * columns
    lines = ["0 Lattice"]
    half = (BEAM - 1) / 2
    for z in range(0, along, 2):
        for k in range(rows):
            x = PITCH * (BEAM * k + half + _shift(z))
            lines.append(f"1 4 {x:g} 0 {PITCH * z} 0 0 1 0 1 0 -1 0 0 32278.dat")
    for x in range(0, across, 2):
        for k in range(columns):
            z = PITCH * (BEAM * k + half + _shift(x))
            lines.append(f"1 14 {PITCH * x} -20 {z:g} 1 0 0 0 1 0 0 0 1 32278.dat")
    for x in range(0, across, 2):
        for z in range(0, along, 2):
            if x >= _shift(z) and z >= _shift(x):
                lines.append(f"1 0 {PITCH * x} -10 {PITCH * z} 0 1 0 1 0 0 0 0 1 2780.dat")
    path = folder / "lattice.ldr"
    path.write_text("\n".join([*lines, ""]), encoding="utf-8")
    return load(path)


def processor() -> float:
    """Return the seconds that this process and its ended children had a processor."""
    times = os.times()
    return times.user + times.system + times.children_user + times.children_system


def timed(clock: Callable[[], float], what: Callable[[], object]) -> tuple[float, object]:
    """Return how long something took, and what it returned."""
    start = clock()
    found = what()
    return clock() - start, found


def pages(
    out: dict[str, float], report: RigidityReport, name: str, clock: Callable[[], float]
) -> None:
    """Time the page of a model and weigh it, with its picture."""
    seconds, drawing = timed(clock, lambda: drawing_of(report.assembly))
    drawn, picture = timed(clock, lambda: Painter().picture(report_scene(report, drawing=drawing)))
    made, text = timed(clock, lambda: page(report, picture=picture, drawing=drawing))
    out[f"page, {name} (s)"] = seconds + made
    out[f"page, {name} (MB)"] = len(str(text).encode()) / 1e6
    out[f"picture, {name} (s)"] = seconds + drawn
    out[f"picture, {name} (MB)"] = len(bytes(picture)) / 1e6  # type: ignore[call-overload]


def measure(rows: int, columns: int, clock: Callable[[], float]) -> dict[str, float]:
    """Return all figures by name."""
    out: dict[str, float] = {}
    analyze(load(DEMO), modes=1)  # imports and caches
    seconds, demo = timed(clock, lambda: analyze(load(DEMO)))
    assert isinstance(demo, RigidityReport)
    out["analysis, 153 parts (s)"] = seconds
    drawing_of(demo.assembly)
    pages(out, demo, "153 parts", clock)
    strip = comparison_scene([demo, demo], ["before", "after"])
    out["before/after, 153 parts (s)"] = timed(clock, lambda: Painter().picture(strip))[0]
    with tempfile.TemporaryDirectory() as folder:
        model = lattice(rows, columns, Path(folder))
    out["lattice (parts)"] = len(model.parts)
    seconds, big = timed(clock, lambda: analyze(model))
    assert isinstance(big, RigidityReport)
    out["analysis, 4000 parts (s)"] = seconds
    pages(out, big, "4000 parts", clock)
    return out


def main() -> None:
    """Measure and print."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0] if __doc__ else None)
    parser.add_argument("--wall", action="store_true", help="seconds of the clock on the wall")
    parser.add_argument("--lattice", nargs=2, type=int, default=(7, 8), metavar=("ROWS", "COLUMNS"))
    parser.add_argument("--json", type=Path, metavar="PATH")
    asked = parser.parse_args()
    found = measure(*asked.lattice, perf_counter if asked.wall else processor)
    for name, value in found.items():
        limit = LIMITS.get(name)
        said = "" if limit is None else f"   limit {limit:g}, ratio {value / limit:.2f}"
        print(f"{name:32} {value:10.3f}{said}")
    if asked.json is not None:
        asked.json.write_text(json.dumps(found, indent=1) + "\n", encoding="utf-8")


if __name__ == "__main__":
    main()
