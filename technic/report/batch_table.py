"""Many models in one table: as text, as CSV and as JSON."""

from __future__ import annotations

from collections.abc import Sequence
from os.path import commonpath
from pathlib import Path
from typing import Any, Final

import technic
from technic.batch import Outcome
from technic.report.spreadsheet import csv_text
from technic.report.style import Style
from technic.report.wording import count, number

__all__ = ["SCHEMA", "batch_csv", "batch_dict", "batch_text"]

SCHEMA: Final = "technic-batch/1"

_HEADS: Final = ("model", "parts", "unknown", "verdict", "motions", "spinning", "N/m", "Hz", "s")

_COLORS: Final = {"rigid": "good", "flexible": "warn"}


def batch_dict(outcomes: Sequence[Outcome]) -> dict[str, Any]:
    """Return the JSON object ``technic-batch/1``: per model what ``technic-report/1`` says first."""
    return {
        "schema": SCHEMA,
        "models": [_row(outcome) for outcome in outcomes],
        "failed": sum(outcome.report is None for outcome in outcomes),
        "technic_version": technic.__version__,
    }


def _row(outcome: Outcome) -> dict[str, Any]:
    own: dict[str, Any] = {"path": str(outcome.path)}
    if outcome.report is None:
        own["error"] = {"message": outcome.error, "exit_code": outcome.exit_code}
        return own | {"seconds": outcome.seconds}
    report = outcome.report
    model = report["model"]
    own["error"] = None
    own["sha256"] = report["source"].get("sha256")
    own |= {key: model[key] for key in ("name", "parts", "joints", "mass_kg", "size_mm")}
    own["unknown_parts"] = sum(part["count"] for part in model["unknown_parts"])
    own |= {key: report[key] for key in ("verdict", "mobility", "rigidity")}
    own["weakest"] = report["weak_spots"][0] if report["weak_spots"] else None
    return own | {"seconds": outcome.seconds}


def batch_csv(outcomes: Sequence[Outcome]) -> str:
    """Return one line per model."""
    heads = [
        *("path", "error", "name", "parts", "unknown_parts", "joints", "mass_kg", "verdict"),
        *("total", "structural", "spinning", "sliding", "idle", "proof"),
        *("rigidity_n_per_m", "low_95_n_per_m", "high_95_n_per_m", "frequency_hz"),
        *("weakest", "weakest_energy_share", "seconds"),
    ]
    table: list[list[Any]] = [heads]
    for outcome in outcomes:
        row = _row(outcome)
        flat = dict(row)
        flat["error"] = "" if row["error"] is None else row["error"]["message"]
        flat |= row.get("mobility") or {}
        rigidity = row.get("rigidity")
        if rigidity is not None:
            flat["rigidity_n_per_m"] = rigidity["value_n_per_m"]
            flat["frequency_hz"] = rigidity["frequency_hz"]
            low, high = rigidity["interval_95"] or ("", "")
            flat |= {"low_95_n_per_m": low, "high_95_n_per_m": high}
        weakest = row.get("weakest")
        flat["weakest"] = "" if weakest is None else weakest["id"]
        flat["weakest_energy_share"] = "" if weakest is None else weakest["energy_share"]
        table.append([flat.get(head, "") for head in heads])
    return csv_text(table)


def batch_text(outcomes: Sequence[Outcome], style: Style) -> str:
    """Return a table for the terminal, then what went wrong, model by model."""
    names = _names([outcome.path for outcome in outcomes])
    rows = [_cells(name, outcome) for name, outcome in zip(names, outcomes, strict=True)]
    widths = [max(len(row[c]) for row in [_HEADS, *rows]) for c in range(len(_HEADS))]
    out = [style("bold", _line(_HEADS, widths))]
    for row, outcome in zip(rows, outcomes, strict=True):
        kind = "bad" if outcome.report is None else _COLORS.get(outcome.report["verdict"], "warn")
        out.append(style(kind, _line(row, widths)) if style.color else _line(row, widths))
    failed = [(n, o) for n, o in zip(names, outcomes, strict=True) if o.report is None]
    if failed:
        out += ["", f"{count(len(failed), 'model')} of {len(outcomes)} could not be analysed:"]
        for name, outcome in failed:
            said = outcome.error.replace(f"{outcome.path}: ", "")
            out += style.wrap(" ".join(said.split()), f"  {name}: ", "    ")
    return "\n".join(out) + "\n"


def _names(paths: Sequence[Path]) -> list[str]:
    """Return the paths without the folders that all of them share."""
    parents = [str(path.parent) for path in paths]
    try:
        shared = Path(commonpath(parents))
    except ValueError:  # on different drives, or absolute beside relative: nothing is shared
        return [str(path) for path in paths]
    return [str(path.relative_to(shared)) for path in paths]


def _cells(name: str, outcome: Outcome) -> tuple[str, ...]:
    seconds = f"{outcome.seconds:.1f}"
    report = outcome.report
    if report is None:
        return (name, "", "", "failed", "", "", "", "", seconds)
    unknown = sum(part["count"] for part in report["model"]["unknown_parts"])
    mobility, rigidity = report["mobility"], report["rigidity"]
    value = "" if rigidity is None else number(rigidity["value_n_per_m"])
    hertz = rigidity["frequency_hz"] if rigidity is not None else None
    return (
        name,
        str(report["model"]["parts"]),
        str(unknown) if unknown else "",
        report["verdict"],
        str(mobility["structural"]),
        str(mobility["spinning"] + mobility["sliding"]),
        value,
        "" if hertz is None else number(hertz),
        seconds,
    )


def _line(row: Sequence[str], widths: Sequence[int]) -> str:
    """Return a row: words to the left, figures to the right."""
    left = {0, 3}
    cells = [
        cell.ljust(width) if c in left else cell.rjust(width)
        for c, (cell, width) in enumerate(zip(row, widths, strict=True))
    ]
    return "  ".join(cells).rstrip()
