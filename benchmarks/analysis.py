#!/usr/bin/env python3
"""Time the main job, each figure beside a baseline measured in the same run.

    python benchmarks/analysis.py [--quick] [--json PATH]

- the demo from file to JSON as a whole process, beside an empty interpreter;
- the eigen step beside dense ``scipy.linalg.eigh`` for 12 pairs on the same matrices (about 8,000
  unknowns; about 1,500 with --quick);
- the solid model of a part, read from the shipped file, over 40 parts;
- the catalogue from nothing, in a fresh process, beside an empty interpreter.

Medians of several runs; times depend on the machine, ratios less so.
"""

from __future__ import annotations

import argparse
import json
import subprocess
import sys
from dataclasses import replace
from pathlib import Path
from statistics import median
from tempfile import TemporaryDirectory
from time import perf_counter, process_time

import numpy as np
from scipy import linalg, sparse

sys.path.insert(0, str(Path(__file__).resolve().parents[1]))

from technic.loading import load
from technic.parts.definition import FrameBody
from technic.rigidity.eigen import elastic_modes
from technic.rigidity.kinematics import component_motions, kinematics
from technic.system.assemble import assemble, element_of
from technic.system.inverse import single_thread

ROOT = Path(__file__).resolve().parents[1]
DEMO = ROOT / "technic" / "data" / "rolling_chassis.mpd"
RUNS = 5
MODES = 12


def process_seconds(arguments: list[str]) -> float:
    """Return the median wall time of a Python process, started in the project."""
    times = []
    for _ in range(RUNS + 1):
        start = perf_counter()
        subprocess.run([sys.executable, *arguments], cwd=ROOT, check=True, capture_output=True)
        times.append(perf_counter() - start)
    return median(times[1:])


def refined(unknowns: int):
    """Return the demo with its beams divided until it has about so many unknowns."""
    model = load(DEMO)
    low, high = 1e-4, 0.1
    for _ in range(12):
        stretch = (low * high) ** 0.5
        parts = tuple(
            replace(p, body=replace(p.body, max_stretch=stretch))
            if isinstance(p.body, FrameBody)
            else p
            for p in model.parts
        )
        finer = replace(model, parts=parts)
        size = assemble(finer, element=element_of).size
        if size > unknowns:
            low = stretch
        else:
            high = stretch
    return finer


def eigen_seconds(unknowns: int) -> dict[str, float]:
    """Time the lowest modes, sparse and dense, and compare their values."""
    model = refined(unknowns)
    system = assemble(model, element=element_of)
    kin = kinematics(model)
    found = component_motions(kin, 0)
    scale = sparse.diags_array(np.tile(kin.units, len(found.parts)))
    motions = sparse.csc_array(system.R @ (scale @ found.twists))
    stiffness = sparse.csr_array(system.K + system.J)
    none = sparse.csr_array((0, system.size))
    times = []
    for _ in range(RUNS):
        start = perf_counter()
        pairs = elastic_modes(stiffness, system.M, none, motions, MODES)
        times.append(perf_counter() - start)
    zero = motions.shape[1]
    start = perf_counter()
    with single_thread():
        dense = linalg.eigh(
            stiffness.toarray(),
            system.M.toarray(),
            eigvals_only=True,
            subset_by_index=[zero, zero + MODES - 1],
        )
    baseline = perf_counter() - start
    return {
        "unknowns": system.size,
        "eigen_s": median(times),
        "dense_eigh_s": baseline,
        "ratio": baseline / median(times),
        "largest_relative_difference": float(np.abs(pairs.values / dense - 1).max()),
    }


def solid_model_seconds(parts: int = 40) -> float:
    """Return the processor time that reading a part's solid model takes, the first one's included."""
    from technic.fem.solid.store import load as read_model
    from technic.fem.solid.store import stored
    from technic.parts.catalogue import catalogue

    chosen = [catalogue().get(number) for number in stored()[:parts]]
    start = process_time()
    found = [read_model(part) for part in chosen if part is not None]
    seconds = process_time() - start
    if None in found:
        raise SystemExit("a shipped solid model is out of date")
    return seconds / len(found)


def main() -> None:
    """Measure and print."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--quick", action="store_true", help="smaller eigenvalue problem")
    parser.add_argument("--json", metavar="PATH", help="write the figures as JSON")
    options = parser.parse_args()
    figures: dict[str, object] = {"empty_interpreter_s": process_seconds(["-c", "pass"])}
    with TemporaryDirectory() as folder:
        target = str(Path(folder) / "report.json")
        figures["demo_file_to_json_s"] = process_seconds(
            ["-m", "technic", "analyze", str(DEMO), "--json", target, "--quiet"]
        )
    code = "from technic.parts.catalogue import catalogue; catalogue()"
    loaded = process_seconds(["-c", code])
    bare = process_seconds(["-c", "import technic.parts.definition"])
    figures["catalogue_s"] = loaded - bare
    figures["solid_model_s"] = solid_model_seconds()
    figures["eigen"] = eigen_seconds(1500 if options.quick else 8000)
    text = json.dumps(figures, indent=2)
    print(text)
    if options.json:
        Path(options.json).write_text(text + "\n", encoding="utf-8")


if __name__ == "__main__":
    main()
