#!/usr/bin/env python3
"""Time the search for beams on the demo, beside analysing each reinforced model as a whole, same run.

    python benchmarks/suggest.py [--whole N] [--big] [--cpu] [--json PATH]

- the screen: forecasts of all candidates, its preparation included and apart;
- the exact re-analysis of the best 50 (only what a beam touches is made anew), and how far it is from
  the analysis of the whole model (connections found anew, kinematics, all of it) of N at random;
- rank correlations of the screen and of the paper's heuristic with the exact order;
- with --big: the whole command on a model of 1,071 parts (seven chassis side by side), stage by stage.
"""

from __future__ import annotations

import argparse
import json
import sys
import tempfile
from collections.abc import Callable
from pathlib import Path
from time import perf_counter, process_time

import numpy as np
from scipy.stats import spearmanr

sys.path.insert(0, str(Path(__file__).resolve().parents[1]))

from technic.design.apply import change_of, extend
from technic.design.candidates import candidates
from technic.design.collide import Surroundings
from technic.design.fit import fit
from technic.design.reanalysis import Reanalysis
from technic.design.screen import Screen
from technic.design.suggest import suggest
from technic.loading import load
from technic.rigidity.analyze import analyze
from technic.system.inverse import single_thread

DEMO = Path(__file__).resolve().parents[1] / "technic" / "data" / "rolling_chassis.mpd"
SHORTLIST = 50
COPIES, SPACING = 7, 420
"""Chassis of the big model, and how far apart they stand (LDU): their frames touch and share pins."""


def measure(whole: int, clock: Callable[[], float]) -> dict[str, float]:
    """Return all figures by name, times in seconds."""
    out: dict[str, float] = {}
    assembly = load(DEMO)
    analyze(assembly, modes=1)  # imports and caches
    start = clock()
    found = candidates(assembly)
    out["parts"], out["candidates"] = len(assembly.parts), len(found)
    out["find places"] = clock() - start
    start = clock()
    screen = Screen(assembly, found)
    out["prepare screen"] = clock() - start
    start = clock()
    forecasts = screen.forecasts(found)
    out["forecasts"] = clock() - start
    out["screen 1500"] = out["prepare screen"] + out["forecasts"] * 1500 / len(found)
    order = np.argsort([-f.rigidity for f in forecasts])
    surroundings = Surroundings(assembly.parts)
    start = clock()
    best = []
    for k in order:
        if fit(surroundings, found[k], change_of(assembly, found[k])):
            best.append(found[k])
        if len(best) == SHORTLIST:
            break
    out["fit of the best 50"] = clock() - start
    changes = [change_of(assembly, c) for c in best]
    start = clock()
    model = Reanalysis(assembly)
    with single_thread():
        exact = [model.exact(change) for change in changes]
    out["re-analyse the best 50"] = clock() - start
    random = np.random.default_rng(0).permutation(len(found))
    chosen = [
        k for k in random[: 3 * whole] if fit(surroundings, found[k], change_of(assembly, found[k]))
    ][:whole]
    start = clock()
    truth = [
        analyze(extend(assembly, [change_of(assembly, found[k])]), modes=1).rigidity.value
        for k in chosen
    ]
    out["analyse one whole"] = (clock() - start) / len(chosen)
    each = out["screen 1500"] / 1500
    out["screen, times faster than re-analysis"] = out["re-analyse the best 50"] / SHORTLIST / each
    out["screen, times faster than whole"] = out["analyse one whole"] / each
    close = [model.exact(change_of(assembly, found[k])).rigidity for k in chosen]
    out["re-analysis against whole, largest error"] = float(
        np.abs(np.array(close) / np.array(truth) - 1.0).max()
    )
    out["Spearman, screen"] = spearmanr([forecasts[k].rigidity for k in chosen], truth)[0]
    out["Spearman, paper"] = spearmanr(screen.projections([found[k] for k in chosen]), truth)[0]
    out["best (N/m)"] = max(f.rigidity for f in exact)
    return {name: float(value) for name, value in out.items()}


def measure_big(clock: Callable[[], float]) -> dict[str, float]:
    """Return the times of the whole search on a model of 1,071 parts, stage by stage."""
    out: dict[str, float] = {}
    text = DEMO.read_text(encoding="utf-8")
    first = next(line for line in text.splitlines() if line.startswith("0 FILE"))
    name = first.removeprefix("0 FILE ").strip()
    lines = ["0 FILE big.ldr", "0 Chassis side by side", "0 Name: big.ldr"]
    lines += [f"1 16 {k * SPACING} 0 0 1 0 0 0 1 0 0 0 1 {name}" for k in range(COPIES)]
    begin = start = clock()
    with tempfile.TemporaryDirectory() as folder:
        path = Path(folder) / "big.mpd"
        path.write_text("\n".join(lines) + "\n" + text, encoding="utf-8")
        assembly = load(path)
    out["big: read"] = clock() - start
    shown, start = "analyse", clock()

    def tell(stage: str, _done: int, _total: int) -> None:
        nonlocal shown, start
        if stage != shown:
            out[f"big: {shown}"] = clock() - start
            shown, start = stage, clock()

    answer = suggest(assembly, progress=tell)
    out[f"big: {shown}"] = clock() - start
    out["big: all in all"] = clock() - begin
    out["big: parts"], out["big: places"] = len(assembly.parts), answer.places
    return out


def main() -> None:
    """Print the figures."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--whole", type=int, default=40, help="models to analyse as a whole")
    parser.add_argument("--big", action="store_true", help="the model of 1,071 parts as well")
    parser.add_argument("--json", type=Path, help="write the figures here as well")
    parser.add_argument("--cpu", action="store_true", help="processor time, on a busy machine")
    arguments = parser.parse_args()
    clock = process_time if arguments.cpu else perf_counter
    figures = measure(arguments.whole, clock)
    if arguments.big:
        figures |= measure_big(clock)
    for name, value in figures.items():
        print(f"{name:45} {value:.4g}")
    if arguments.json is not None:
        arguments.json.write_text(json.dumps(figures, indent=1) + "\n", encoding="utf-8")


if __name__ == "__main__":
    main()
