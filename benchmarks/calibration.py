#!/usr/bin/env python3
"""Time a calibration from ten thousand readings, as `technic calibrate` does it.

    python benchmarks/calibration.py [--rows N] [--taps] [--json PATH]

Readings are made up with the values of Liu et al. 2022 (0.1 mm steps, 5 % scatter) on three conditions, each
with two weights; `--taps` makes every second one a tap test. Times are CPU seconds of this process: reading
the file, solving the rigs, the fit, the grid search beside it, the warnings, and all together.
"""

from __future__ import annotations

import argparse
import json
import sys
import tempfile
from pathlib import Path
from time import process_time

import numpy as np

sys.path.insert(0, str(Path(__file__).resolve().parents[1]))

from calibration.dataset import COLUMNS, GRAVITY, read_csv
from calibration.diagnose import grid_check, warnings
from calibration.fit import fit
from calibration.rigs import Condition, shipped_rigs
from technic.assembly.stiffness import default_table
from technic.statics.calibration import calibrate
from technic.statics.forward import forward_model
from technic.system.parameters import Parameter

PINS = [Parameter("pin/pin_hole", "shear"), Parameter("pin/pin_hole", "tilt")]
TRUTH = np.array([65625.0, 0.240])
PLAN = [
    ("pin-pair", "edge", (20, 50)),
    ("pin-pair", "flat", (20, 50)),
    ("pin-sandwich", "edge", (100, 250)),
]


def made_up(rows: int, *, taps: bool) -> str:
    """Return a file of readings."""
    rigs, random = shipped_rigs(), np.random.default_rng(1)
    places = {(rig, rigs[rig].loads[0].place) for rig, *_ in PLAN}
    forward = forward_model(rigs, places, PINS, default_table())
    lines = [",".join(COLUMNS)]
    known: dict[tuple[str, str, int, bool], float] = {}
    while len(lines) <= rows:
        rig, pose, loads = PLAN[len(lines) % len(PLAN)]
        load = loads[len(lines) // len(PLAN) % 2]
        tap = taps and len(lines) % 2 == 0
        key = (rig, pose, load, tap)
        if key not in known:
            at, place = rigs[rig].poses[pose].angle_deg, rigs[rig].loads[0].place
            condition = Condition(rig, pose, at, place, tap, load * 1e-3 if tap else 0.0)
            answer = forward([condition], np.log(TRUTH))
            sag = 1e3 * answer.per_newton[0] * load * 1e-3 * GRAVITY
            known[key] = float(answer.frequency[0] if tap else sag)
        read = known[key] * (1.0 + (0.01 if tap else 0.05) * random.standard_normal())
        values = f",,,{read:.1f},0.1" if tap else f"{20 + read:.1f},20,0.1,,"
        number = 1 + len(lines) // 6
        lines.append(f"t,pin/pin_hole,{rig},{pose},,1,{number},32,{load},{values},,made up")
    return "\n".join(lines)


def measure(rows: int, *, taps: bool) -> dict[str, float]:
    """Return all figures by name, times in CPU seconds."""
    out: dict[str, float] = {}
    rigs = shipped_rigs()
    with tempfile.TemporaryDirectory() as folder:
        path = Path(folder) / "readings.csv"
        path.write_text(made_up(rows, taps=taps), encoding="utf-8")
        began = start = process_time()
        readings = read_csv(path, rigs).readings
        out["readings"] = len(readings)
        out["read"] = process_time() - start
        start = process_time()
        places = {(r.condition.rig, r.condition.place) for r in readings}
        forward = forward_model(rigs, places, PINS, default_table())
        forward(sorted({r.condition for r in readings}), np.log(TRUTH))
        out["solve the rigs"] = process_time() - start
        start = process_time()
        begin = np.array([9e3, 1.5])
        found = fit(readings, forward, begin)
        out["fit"] = process_time() - start
        start = process_time()
        grid = grid_check(readings, forward, found, begin)
        out["grid search"] = process_time() - start
        start = process_time()
        warnings(readings, found)
        out["warnings"] = process_time() - start
        out["sum"] = process_time() - began
        start = process_time()
        result = calibrate(path)
        out["technic.calibrate"] = process_time() - start
    off = np.abs(found.log_stiffness - np.log(TRUTH)) / found.deviations[:2]
    out["furthest from the truth (deviations)"] = float(off.max())
    out["grid agrees"] = float(grid.agrees and result.grid.agrees)
    return out


def main() -> None:
    """Measure and print."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--rows", type=int, default=10_000)
    parser.add_argument("--taps", action="store_true")
    parser.add_argument("--json", type=Path)
    options = parser.parse_args()
    figures = measure(options.rows, taps=options.taps)
    for name, value in figures.items():
        print(f"{name:40s} {value:10.3f}")
    if options.json:
        options.json.write_text(json.dumps(figures, indent=1), encoding="utf-8")


if __name__ == "__main__":
    main()
