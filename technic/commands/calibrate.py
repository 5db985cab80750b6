"""`technic calibrate`: how stiff are your joints? From a table of hanging weights."""

from __future__ import annotations

import sys
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from technic.commands.options import JsonOption, PartModelOption, QuietOption
from technic.errors import UsageError

if TYPE_CHECKING:
    from technic.statics.calibration import Calibration

__all__ = ["calibrate"]


def calibrate(
    readings: Annotated[
        Path | None,
        typer.Argument(metavar="CSV", help="Readings, one per row; --template writes an example."),
    ] = None,
    out: Annotated[
        Path | None,
        typer.Option(
            "--out", metavar="TOML", help="Write the stiffness table for `technic analyze`."
        ),
    ] = None,
    json: JsonOption = None,
    report: Annotated[
        Path | None,
        typer.Option("--report", metavar="HTML", help="Write a page with plots of the fit."),
    ] = None,
    template: Annotated[
        Path | None,
        typer.Option(
            "--template",
            metavar="DIR",
            help="Write an empty table, its schema, the protocol and the rigs to build into DIR.",
        ),
    ] = None,
    rigs: Annotated[
        Path | None,
        typer.Option("--rigs", metavar="TOML", help="Your own rigs, beside the shipped ones."),
    ] = None,
    draw: Annotated[
        Path | None,
        typer.Option(
            "--draw", metavar="DIR", help="Draw the rigs in their poses; with --rigs only yours."
        ),
    ] = None,
    install: Annotated[
        bool,
        typer.Option("--install", help="Use the table for all models from now on (your settings)."),
    ] = False,
    base: Annotated[
        Path | None,
        typer.Option("--base", metavar="TOML", help="Table for all that is not measured."),
    ] = None,
    robust: Annotated[
        bool, typer.Option("--robust", help="Give outliers less weight (Huber's loss).")
    ] = False,
    no_offsets: Annotated[
        bool, typer.Option("--no-offsets", help="Do not look for free play and hysteresis.")
    ] = False,
    parts: PartModelOption = "solid",
    quiet: QuietOption = False,
) -> None:
    """Find the stiffness of joints from readings of weights hung on a rig."""
    from technic.report.files import check_writable, write_atomic
    from technic.report.json import STDOUT

    alone = "--template" if template is not None else "--draw" if draw is not None else ""
    if alone and (install or any(x is not None for x in (readings, out, json, report))):
        raise UsageError(f"{alone} stands alone: it needs no readings")
    if template is not None and draw is not None:
        raise UsageError("--template and --draw write different things: one after the other")
    if draw is not None:
        _draw(draw, rigs, quiet=quiet)
        return
    if template is not None:
        from technic.report.calibration_template import write_template

        for path in write_template(template):
            if not quiet:
                typer.echo(str(path))
        return
    if readings is None:
        raise UsageError("name the CSV file with the readings, or use --template DIR to get one")
    for target in (out, report, None if json in (None, STDOUT) else Path(str(json))):
        if target is not None:
            check_writable(target)
    result = _solve(readings, rigs, base, robust=robust, no_offsets=no_offsets, parts=parts)
    from technic.report.calibration import calibration_dict, calibration_text, calibration_toml
    from technic.report.json import write_json
    from technic.report.style import style_for

    if out is not None or install:
        from datetime import UTC, datetime

        table = calibration_toml(result, datetime.now(UTC).date().isoformat())
        if out is not None:
            write_atomic(out, lambda path: _write(path, table))
        if install:
            from technic.commands.config import install_table

            for path in install_table(table):
                typer.echo(f"technic: settings: {path}", err=True)
    if report is not None:
        from technic.report.calibration_page import calibration_page

        page = calibration_page(result)
        write_atomic(report, lambda path: _write(path, page))
    if json is not None:
        write_json(calibration_dict(result), json)
    if not quiet and json != STDOUT:
        sys.stdout.write(calibration_text(result, style_for(sys.stdout)))
        sys.stdout.flush()
    elif not quiet:
        for said in result.warnings:
            typer.echo(f"technic: warning: {said}", err=True)


def _draw(folder: Path, rigs: Path | None, *, quiet: bool) -> None:
    """Draw rigs in their poses into a folder."""
    from calibration.errors import DataError
    from calibration.rigs import read_rigs, shipped_rigs
    from technic.errors import SchemaError
    from technic.report.render import Painter
    from technic.report.rig_picture import rig_scene

    try:
        known = shipped_rigs() if rigs is None else read_rigs(rigs)
    except DataError as error:
        raise SchemaError(error.faults, path=rigs) from error
    try:
        folder.mkdir(parents=True, exist_ok=True)
    except OSError as error:
        raise UsageError(f"{folder} cannot be made: {error.strerror}") from error
    for name, rig in known.items():
        painter = Painter()
        try:
            painter.draw(rig_scene(rig), folder / f"{name}.png")
        finally:
            painter.close()
        if not quiet:
            typer.echo(str(folder / f"{name}.png"))


def _write(path: Path, text: str) -> None:
    path.write_text(text, encoding="utf-8")


def _solve(
    readings: Path,
    rigs: Path | None,
    base: Path | None,
    *,
    robust: bool,
    no_offsets: bool,
    parts: str,
) -> Calibration:
    from technic.assembly.stiffness import read_table
    from technic.statics.calibration import calibrate as solve
    from technic.system.part_models import FACTORIES

    return solve(
        readings,
        rigs=rigs,
        table=None if base is None else read_table(base),
        loss="huber" if robust else "linear",
        offsets="off" if no_offsets else "auto",
        element=FACTORIES[parts],
        parts=parts,
    )
