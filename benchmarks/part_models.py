#!/usr/bin/env python3
"""How far frame members and rigid parts are from solid models: lambda_1 of whole models, as a table.

    python benchmarks/part_models.py [MODEL]... [--json PATH]

Without models: the demo, and those of the folder that TECHNIC_SHARED names (or ../shared) in ``models``.
Parts that the catalogue does not have are left out.
"""

from __future__ import annotations

import argparse
import json
import os
import sys
from pathlib import Path
from time import process_time

sys.path.insert(0, str(Path(__file__).resolve().parents[1]))

import technic
from technic.rigidity.result import RigidityReport
from technic.system.part_models import FACTORIES

ROOT = Path(__file__).resolve().parents[1]
DEMO = ROOT / "technic" / "data" / "rolling_chassis.mpd"
KINDS = tuple(FACTORIES)


def chosen() -> list[Path]:
    """Return the demo and the shared models."""
    shared = Path(os.environ.get("TECHNIC_SHARED", ROOT.parent / "shared")) / "models"
    return [DEMO, *sorted(path for path in shared.glob("*") if path.suffix in {".ldr", ".mpd"})]


def measure(path: Path) -> dict[str, object]:
    """Analyze a model with each kind of part."""
    model = technic.load(path)
    reports: dict[str, RigidityReport] = {}
    seconds: dict[str, float] = {}
    for kind in KINDS:
        start = process_time()
        reports[kind] = technic.analyze(model, modes=1, parts=kind)
        seconds[kind] = process_time() - start
    values = {kind: r.rigidity.value if r.rigidity else None for kind, r in reports.items()}
    return {
        "model": path.stem,
        "verdict": reports["solid"].verdict.value,
        "parts": len(model.parts),
        "part_models": dict(reports["solid"].part_models),
        "lambda_1_n_per_m": values,
        "unknowns": {kind: r.unknowns for kind, r in reports.items()},
        "processor_s": seconds,
    }


def table(rows: list[dict]) -> str:
    """Return the figures as a Markdown table."""
    lines = [
        "| model | parts: solid, frame, rigid | solid (N/m) | frame | rigid |",
        "|---|---|---|---|---|",
    ]
    for row in rows:
        values, counts = row["lambda_1_n_per_m"], row["part_models"]
        kinds = ", ".join(str(counts.get(kind, 0)) for kind in KINDS)
        solid = values["solid"]
        said = [f"{solid:.4g}"] + [f"{100 * (values[k] / solid - 1):+.1f} %" for k in KINDS[1:]]
        lines.append(f"| {row['model']} | {kinds} | " + " | ".join(said) + " |")
    return "\n".join(lines)


def main() -> None:
    """Measure and print."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("models", nargs="*", type=Path)
    parser.add_argument("--json", metavar="PATH", help="write the figures as JSON")
    options = parser.parse_args()
    rows = []
    for path in options.models or chosen():
        rows.append(measure(path))
        print(f"{path.name} done", file=sys.stderr)
    print(table([row for row in rows if row["lambda_1_n_per_m"]["solid"]]))
    if options.json:
        Path(options.json).write_text(json.dumps(rows, indent=2) + "\n", encoding="utf-8")


if __name__ == "__main__":
    main()
