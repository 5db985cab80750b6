#!/usr/bin/env python3
"""Time reading, drawing and the gallery, each beside a baseline measured in the same run.

    python benchmarks/reading.py [MODEL]

- MODEL (any LDraw file) to placements and to an assembly, beside splitting its lines;
- a 7L beam's solid shape, beside its convex hull;
- the self-contained page of the demo, beside the analysis of the demo;
- every system of the gallery of up to 500 nodes, beside the paper's longest time (0.9 s).

Processor seconds, the best of three, so that other work on the machine counts little.
"""

from __future__ import annotations

import json
import sys
from collections.abc import Callable
from pathlib import Path
from time import process_time

sys.path.insert(0, str(Path(__file__).resolve().parents[1]))

import technic
from technic.ldraw.document import placements, poses, read
from technic.parts.catalogue import catalogue
from technic.parts.shapes import mesh
from technic.report.html.page import page

DATA = Path(technic.__file__).resolve().parent / "data"
DEMO = DATA / "rolling_chassis.mpd"
PAPER_LONGEST_S = 0.9


def seconds(work: Callable[[], object]) -> float:
    """Return the best of three runs."""
    times = []
    for _ in range(3):
        start = process_time()
        work()
        times.append(process_time() - start)
    return min(times)


def reading(model: Path) -> dict[str, float]:
    """Time the reading of a model."""

    def split() -> list[list[str]]:
        return [line.split() for line in model.read_text("utf-8", "replace").splitlines()]

    def place() -> None:
        poses(placements(read(model), lambda number: not number.endswith(".ldr")).parts)

    return {
        "split_lines_s": seconds(split),
        "placements_s": seconds(place),
        "assembly_s": seconds(lambda: technic.load(model)),
    }


def drawing() -> dict[str, float]:
    """Time one shape and one page."""
    beam = catalogue().get("32524")
    assert beam is not None
    hull = mesh(beam, "solid").convex_hull

    def shape() -> None:
        mesh.cache_clear()
        mesh(beam, "solid")

    model = technic.load(DEMO)
    report = technic.analyze(model)
    return {
        "hull_of_7L_s": seconds(lambda: type(hull)(hull.vertices).convex_hull),
        "solid_7L_s": seconds(shape),
        "analyze_demo_s": seconds(lambda: technic.analyze(model)),
        "page_of_demo_s": seconds(lambda: page(report)),
    }


def gallery() -> dict[str, float]:
    """Time the systems of the paper; values are seconds."""
    times = {}
    for path in sorted((DATA / "gallery").glob("*.json")):
        model = technic.load(path)
        times[path.stem] = seconds(lambda model=model: technic.analyze(model, modes=1))
    return {
        "systems": len(times),
        "slowest_s": max(times.values()),
        "slowest_over_paper": max(times.values()) / PAPER_LONGEST_S,
        "total_s": sum(times.values()),
    }


def main() -> None:
    """Measure and print."""
    model = Path(sys.argv[1]) if len(sys.argv) > 1 else DEMO
    figures = {"reading": reading(model), "drawing": drawing(), "gallery": gallery()}
    print(json.dumps(figures, indent=2))


if __name__ == "__main__":
    main()
