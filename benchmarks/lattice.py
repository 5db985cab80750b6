#!/usr/bin/env python3
"""Analyze a generated lattice of thousands of parts, file to JSON, as one process.

    python benchmarks/lattice.py [--parts N] [--json PATH] [--kind solid|frame|rigid]

Layers of 15L beams, every second layer across, laid like bricks so that no seam goes through, with a pin
at every crossing that lies in a hole: about a quarter beams, three quarters pins. Pinned rectangles shear,
so the outer layers are flexible: motions are found, sorted and named too. The demo is analyzed in
the same way in the same run; the ratio of the times depends less on the machine than either does.
Processor seconds of the whole process, and its largest memory.
"""

from __future__ import annotations

import argparse
import json
import os
import sys
from pathlib import Path
from tempfile import TemporaryDirectory
from time import perf_counter

ROOT = Path(__file__).resolve().parents[1]
DEMO = ROOT / "technic" / "data" / "rolling_chassis.mpd"

BEAM, PIN = "32278", "2780"
LENGTH = 15
"""Holes of a beam."""

LINES = (0, 7, 14), (3, 8, 11)
"""Where beams lie, in holes from the beginning of a tile; pairs of layers take turns, so that no bore has
pins from both sides."""

TILES = 4
"""Beams in a row."""

HALF = 7
"""Every other pair of layers is shifted by so many holes, as bricks are."""


def rows(layer: int) -> tuple[list[int], list[int]]:
    """Return where the beams of a layer begin, and the lines they lie on, in holes."""
    turn = layer // 2 % 2
    shift = HALF * turn
    begins = [LENGTH * k - shift for k in range(TILES + (1 if shift else 0))]
    lines = [LENGTH * k + line for k in range(TILES) for line in LINES[turn]]
    return begins, lines


def lattice(parts: int) -> str:
    """Return an LDraw file of about so many parts."""
    lines = [f"0 Lattice of about {parts} parts", "0 Name: lattice.ldr"]
    count, layer = 0, 0
    covered: set[tuple[int, int]] = set()
    while count < parts:
        height = -20 * layer
        begins, across = rows(layer)
        now: set[tuple[int, int]] = set()
        for line in across:
            for begin in begins:
                middle = 20 * (begin + LENGTH // 2)
                # the holes of a beam stand upright; its length is the part's z
                if layer % 2 == 0:
                    lines.append(f"1 4 {middle} {height} {20 * line} 0 0 1 0 1 0 -1 0 0 {BEAM}.dat")
                else:
                    lines.append(f"1 14 {20 * line} {height} {middle} 1 0 0 0 1 0 0 0 1 {BEAM}.dat")
                count += 1
                holes = range(begin, begin + LENGTH)
                now |= {(h, line) if layer % 2 == 0 else (line, h) for h in holes}
        for x, z in sorted(covered & now):
            lines.append(f"1 0 {20 * x} {height + 10} {20 * z} 0 1 0 1 0 0 0 0 1 {PIN}.dat")
            count += 1
        covered = now
        layer += 1
    return "\n".join(lines) + "\n"


def analyze(model: Path, target: Path, kind: str) -> dict[str, object]:
    """Analyze a model in a process of its own."""
    command = ["-m", "technic", "analyze", str(model), "--json", str(target), "-q", "--parts", kind]
    start = perf_counter()
    child = os.spawnve(os.P_NOWAIT, sys.executable, [sys.executable, *command], os.environ)
    _, status, used = os.wait4(child, 0)
    if status:
        raise SystemExit(f"the analysis of {model.name} failed")
    report = json.loads(target.read_text(encoding="utf-8"))
    return {
        "parts": report["model"]["parts"],
        "joints": report["model"]["joints"],
        "unknowns": report["model"]["dof"],
        "verdict": report["verdict"],
        "rigidity_n_per_m": report["rigidity"]["value_n_per_m"],
        "processor_s": used.ru_utime + used.ru_stime,
        "wall_s": perf_counter() - start,
        "memory_mb": used.ru_maxrss / 1024.0,
        "timings_s": report["timings_s"],
    }


def main() -> None:
    """Measure and print."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--parts", type=int, default=4000, metavar="N", help="about so many")
    parser.add_argument("--kind", default="solid", choices=["solid", "frame", "rigid"])
    parser.add_argument("--json", metavar="PATH", help="write the figures as JSON")
    options = parser.parse_args()
    os.environ.setdefault("OPENBLAS_NUM_THREADS", "1")
    os.chdir(ROOT)
    with TemporaryDirectory() as folder:
        model, target = Path(folder) / "lattice.ldr", Path(folder) / "report.json"
        model.write_text(lattice(options.parts), encoding="utf-8")
        figures = {
            "demo": analyze(DEMO, target, options.kind),
            "lattice": analyze(model, target, options.kind),
        }
    text = json.dumps(figures, indent=2)
    print(text)
    if options.json:
        Path(options.json).write_text(text + "\n", encoding="utf-8")


if __name__ == "__main__":
    main()
