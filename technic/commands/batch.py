"""`technic batch`: many models at once, one line each."""

from __future__ import annotations

import os
import sys
from functools import partial
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from technic.commands.options import (
    AS_FOUND,
    JsonOption,
    MeasureOption,
    MinRigidityOption,
    ModelOptions,
    PartModelOption,
    QuietOption,
    RequireRigidOption,
)
from technic.commands.progress import progress_bar
from technic.commands.reading import model_options, reading

if TYPE_CHECKING:
    from technic.batch import Outcome

__all__ = ["batch"]

_BELOW_DEMAND = 1


@model_options
def batch(
    models: Annotated[
        list[Path],
        typer.Argument(
            metavar="MODEL|DIR...",
            help="Model files (.ldr, .mpd, .io, .json), or directories to search for them.",
        ),
    ],
    json: JsonOption = None,
    csv: Annotated[
        Path | None, typer.Option("--csv", metavar="CSV", help="Write the table as CSV.")
    ] = None,
    reports: Annotated[
        Path | None,
        typer.Option("--reports", metavar="DIR", help="Write every model's JSON report there."),
    ] = None,
    jobs: Annotated[
        int | None,
        typer.Option("--jobs", "-j", min=1, metavar="N", help="Models at a time; all processors."),
    ] = None,
    max_seconds: Annotated[
        float,
        typer.Option("--max-seconds", min=0.0, metavar="S", help="Give a model up after this."),
    ] = float("inf"),
    measure: MeasureOption = "mean_square",
    how: ModelOptions = AS_FOUND,
    parts: PartModelOption = "solid",
    require_rigid: RequireRigidOption = False,
    min_rigidity: MinRigidityOption = None,
    quiet: QuietOption = False,
) -> None:
    """Analyse many models: verdict, motions and rigidity, one line each.

    A model that cannot be read or analysed is listed with the reason and does not stop the others; the
    exit code is then that of the first such model.
    """
    from technic.batch import analyze_many, find_models
    from technic.report.batch_table import batch_csv, batch_dict, batch_text
    from technic.report.files import check_writable, write_bytes
    from technic.report.json import STDOUT, write_json
    from technic.report.style import style_for

    for target in (csv, None if json in (None, STDOUT) else Path(str(json))):
        if target is not None:
            check_writable(target)
    paths = find_models(models)
    outcomes: list[Outcome] = []
    with progress_bar(shown=not quiet) as tell:
        tell("models", 0, len(paths))
        for outcome in analyze_many(
            paths,
            partial(reading, how=how),
            jobs=jobs or os.cpu_count() or 1,
            max_seconds=max_seconds,
            measure=measure,
            parts=parts,
        ):
            outcomes.append(outcome)
            tell("models", len(outcomes), len(paths))
    if reports is not None:
        _write_reports(outcomes, reports)
    if csv is not None:
        write_bytes(csv, batch_csv(outcomes).encode("utf-8-sig"))
    if json is not None:
        write_json(batch_dict(outcomes), json)
    if not quiet and json != STDOUT:
        sys.stdout.write(batch_text(outcomes, style_for(sys.stdout)))
        sys.stdout.flush()
    failed = [outcome.exit_code for outcome in outcomes if outcome.report is None]
    if failed:
        raise typer.Exit(failed[0])
    if any(_below(outcome, min_rigidity, require_rigid=require_rigid) for outcome in outcomes):
        raise typer.Exit(_BELOW_DEMAND)


def _below(outcome: Outcome, least: float | None, *, require_rigid: bool) -> bool:
    """Return whether a model is below what the caller demanded."""
    report = outcome.report
    if report is None:
        return False
    if require_rigid and report["verdict"] != "rigid":
        return True
    rigidity = report["rigidity"]
    return least is not None and (rigidity is None or rigidity["value_n_per_m"] < least)


def _write_reports(outcomes: list[Outcome], folder: Path) -> None:
    """Write one JSON report per model; models of one name in different folders are numbered."""
    from technic.errors import UsageError
    from technic.report.json import write_json

    try:
        folder.mkdir(parents=True, exist_ok=True)
    except OSError as error:
        raise UsageError(f"{folder} cannot be made a directory: {error.strerror}") from error
    used: set[str] = set()
    for outcome in outcomes:
        if outcome.report is None:
            continue
        name, k = outcome.path.name, 1
        while name.casefold() in used:
            k += 1
            name = f"{outcome.path.stem}-{k}{outcome.path.suffix}"
        used.add(name.casefold())
        write_json(outcome.report, str(folder / f"{name}.json"))
