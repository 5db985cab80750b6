#!/usr/bin/env python3
"""Time the opening of a parts library as large as the complete one: a zip and a folder.

    python benchmarks/library.py [--parts 23800] [--mean-kb 4] [--keep DIR]

The library is made up: as many parts, subparts and primitives as the complete LDraw library has, with
sizes spread like its (many small files, a few of megabytes) around a mean that fits on a small disk;
what a list of files costs does not depend on their content. For each form: the first opening, which
lists the files (cold), the second, which reads the list from the cache (cached), what is read to name
the release, and one part with its subfiles.

Processor seconds; the folder's first opening also in wall seconds, since it waits for the disk.
"""

from __future__ import annotations

import argparse
import json
import os
import random
import sys
import tempfile
import zipfile
from collections.abc import Callable, Iterator
from pathlib import Path
from time import perf_counter, process_time

sys.path.insert(0, str(Path(__file__).resolve().parents[1]))

from technic.ldraw.library import Library
from technic.ldraw.triangles import surface_of

SUBPARTS_PER_PART = 0.6
PRIMITIVES = 2200
BUDGET = {"cold_s": 3.0, "cached_s": 0.3}


def lines(count: int, names: list[str], seed: int) -> str:
    """Return the text of a file of so many lines that refers to others."""
    draw = random.Random(seed)
    release = f"0 !LDRAW_ORG Part UPDATE 2025-{1 + seed % 9:02d}"
    head = f"0 Part {seed}\n0 Name: x.dat\n{release}\n0 BFC CERTIFY CCW\n"
    out = [f"1 16 {draw.randint(-99, 99)} 0 0 1 0 0 0 1 0 0 0 1 {name}" for name in names]
    for _ in range(count):
        out.append("3 16 " + " ".join(f"{draw.uniform(-99, 99):.4g}" for _ in range(9)))
    return head + "\n".join(out) + "\n"


def made_up(parts: int, mean_kb: float) -> Iterator[tuple[str, bytes]]:
    """Yield names and contents; contents come from a pool, names are all different."""
    draw = random.Random(1)
    pool = []
    for seed in range(60):
        size = draw.lognormvariate(0.0, 1.2) / 2.05 * mean_kb * 1024  # mean of the spread: 2.05
        pool.append(lines(max(1, int(size / 55)), [], seed).encode())
    for k in range(PRIMITIVES):
        folder = ("p/", "p/48/", "p/8/")[k % 3]
        yield f"{folder}prim{k}.dat", pool[k % len(pool)][:1200].rsplit(b"\n", 1)[0]
    for k in range(int(parts * SUBPARTS_PER_PART)):
        yield f"parts/s/{k:05d}s01.dat", pool[k % len(pool)]
    for k in range(parts):
        yield f"parts/{k:05d}.dat", pool[k % len(pool)]
    yield "parts/sample.dat", lines(200, [f"s\\{k:05d}s01.dat" for k in range(20)], 7).encode()


def seconds(work: Callable[[], object]) -> tuple[float, float]:
    """Return processor and wall seconds of one run."""
    wall, cpu = perf_counter(), process_time()
    work()
    return process_time() - cpu, perf_counter() - wall


def best(work: Callable[[], object]) -> float:
    """Return the least processor seconds of three runs."""
    return min(seconds(work)[0] for _ in range(3))


def measure(path: Path, cache: Path) -> dict[str, float]:
    """Time one library."""
    os.environ["TECHNIC_CACHE"] = str(cache)
    cold, wall = seconds(lambda: Library.open(path))
    found = {"cold_s": cold, "cold_wall_s": wall, "cached_s": best(lambda: Library.open(path))}
    library = Library.open(path)
    found["release_s"] = seconds(library.release)[0]
    found["release_cached_s"] = best(lambda: Library.open(path).release()) - found["cached_s"]
    found["one_part_s"] = seconds(lambda: surface_of(library, "sample"))[0]
    found["files"] = len(library)
    found["parts"] = sum(1 for _ in library.part_numbers())
    return found


def main() -> int:
    """Make the library, measure, print; 1 when an opening takes longer than it may."""
    asked = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    asked.add_argument("--parts", type=int, default=23_800)
    asked.add_argument("--mean-kb", type=float, default=4.0)
    asked.add_argument("--keep", type=Path, help="make it here and leave it there")
    given = asked.parse_args()
    with tempfile.TemporaryDirectory() as temporary:
        place = given.keep or Path(temporary)
        archive, folder = place / "complete.zip", place / "ldraw"
        if not archive.exists():
            place.mkdir(parents=True, exist_ok=True)
            with zipfile.ZipFile(archive, "w", zipfile.ZIP_DEFLATED, compresslevel=1) as packed:
                for name, content in made_up(given.parts, given.mean_kb):
                    packed.writestr(f"ldraw/{name}", content)
            with zipfile.ZipFile(archive) as packed:
                packed.extractall(place)
        figures = {
            "zip": measure(archive, Path(temporary) / "cache"),
            "folder": measure(folder, Path(temporary) / "cache"),
        }
    print(json.dumps(figures, indent=2))
    late = [
        f"{form}: {name} {row[name]:.2f} > {most}"
        for form, row in figures.items()
        for name, most in BUDGET.items()
        if row[name] > most
    ]
    print("\n".join(late) or "within the budget")
    return 1 if late else 0


if __name__ == "__main__":
    sys.exit(main())
