"""`technic demo`: the analysis of a shipped example, a rolling chassis."""

from __future__ import annotations

from pathlib import Path

import typer

from technic.commands.analyze import run
from technic.commands.options import (
    AS_FOUND,
    AnalysisOptions,
    FixOption,
    JsonOption,
    MeasureOption,
    MinRigidityOption,
    ModelOptions,
    ModesOption,
    PartModelOption,
    PictureOption,
    QuietOption,
    RequireRigidOption,
)
from technic.commands.reading import model_options

__all__ = ["DEMO_PICTURE", "demo"]

DEMO_PICTURE = Path("technic-demo.png")


@model_options
def demo(
    json: JsonOption = None,
    picture: PictureOption = None,
    no_picture: bool = typer.Option(False, "--no-picture", help="Do not draw."),
    fix: FixOption = None,
    measure: MeasureOption = "mean_square",
    how: ModelOptions = AS_FOUND,
    modes: ModesOption = 6,
    parts: PartModelOption = "solid",
    require_rigid: RequireRigidOption = False,
    min_rigidity: MinRigidityOption = None,
    quiet: QuietOption = False,
) -> None:
    """Analyze the shipped example, a rolling chassis, and draw technic-demo.png."""
    from importlib.resources import as_file, files

    drawing = None if no_picture else picture or DEMO_PICTURE
    options = AnalysisOptions(
        json=json,
        picture=drawing,
        fix=tuple(fix or ()),
        measure=measure,
        how=how,
        modes=modes,
        parts=parts,
        require_rigid=require_rigid,
        min_rigidity=min_rigidity,
        quiet=quiet,
    )
    with as_file(files("technic") / "data" / "rolling_chassis.mpd") as model:
        run(model, options)
