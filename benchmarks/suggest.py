#!/usr/bin/env python3
"""Time the search for beams on the demo, beside re-analysing each candidate in the same run.

    python benchmarks/suggest.py [--exact N] [--cpu] [--json PATH]

- the screen: forecasts of all candidates, its preparation included and apart;
- the refined forecasts of the best 50, and how far they are from the exact answer;
- exact re-analysis (connections found anew, kinematics, eigen step) of N candidates at random.

Prints rank correlations of the screen and of the paper's heuristic with the exact order.
"""

from __future__ import annotations

import argparse
import json
import sys
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
from technic.design.screen import Screen
from technic.loading import load
from technic.rigidity.analyze import analyze

DEMO = Path(__file__).resolve().parents[1] / "technic" / "data" / "rolling_chassis.mpd"
SHORTLIST = 50


def measure(exact: int, clock: Callable[[], float]) -> dict[str, float]:
    """Return all figures by name, times in seconds."""
    out: dict[str, float] = {}
    assembly = load(DEMO)
    analyze(assembly, modes=1)  # imports and caches
    start = clock()
    found = candidates(assembly)
    out["candidates"] = len(found)
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
    start = clock()
    refined = [screen.refine(c) for c in best]
    out["refine the best 50"] = clock() - start
    random = np.random.default_rng(0).permutation(len(found))
    chosen = [
        k for k in random[: 3 * exact] if fit(surroundings, found[k], change_of(assembly, found[k]))
    ][:exact]
    start = clock()
    truth = [
        analyze(extend(assembly, [change_of(assembly, found[k])]), modes=1).rigidity.value
        for k in chosen
    ]
    out["exact, each"] = (clock() - start) / len(chosen)
    out["screen, times faster than exact"] = out["exact, each"] / (out["screen 1500"] / 1500)
    close = [screen.refine(found[k]).rigidity for k in chosen]
    out["refined against exact, largest error"] = float(
        np.abs(np.array(close) / np.array(truth) - 1.0).max()
    )
    out["Spearman, screen"] = spearmanr([forecasts[k].rigidity for k in chosen], truth)[0]
    out["Spearman, refined"] = spearmanr(close, truth)[0]
    out["Spearman, paper"] = spearmanr(screen.projections([found[k] for k in chosen]), truth)[0]
    out["best refined (N/m)"] = max(f.rigidity for f in refined)
    return {name: float(value) for name, value in out.items()}


def main() -> None:
    """Print the figures."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--exact", type=int, default=40, help="candidates to re-analyse")
    parser.add_argument("--json", type=Path, help="write the figures here as well")
    parser.add_argument("--cpu", action="store_true", help="processor time, on a busy machine")
    arguments = parser.parse_args()
    figures = measure(arguments.exact, process_time if arguments.cpu else perf_counter)
    for name, value in figures.items():
        print(f"{name:40} {value:.4g}")
    if arguments.json is not None:
        arguments.json.write_text(json.dumps(figures, indent=1) + "\n", encoding="utf-8")


if __name__ == "__main__":
    main()
