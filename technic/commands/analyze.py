"""`technic analyze`: is it rigid, what moves, how rigid, where is it weak?"""

from __future__ import annotations

import sys
from dataclasses import replace
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from technic.commands.options import (
    AS_FOUND,
    AnalysisOptions,
    AnimateOption,
    CsvOption,
    DepthOption,
    FixOption,
    GltfOption,
    HeatmapOption,
    JsonOption,
    MaterialOption,
    MeasureOption,
    MinRigidityOption,
    ModelOptions,
    ModesOption,
    PartModelOption,
    PictureOption,
    PortWallsOption,
    QuietOption,
    RendererOption,
    ReportOption,
    RequireRigidOption,
    TransparentOption,
    ViewOption,
)
from technic.commands.outputs import Outputs
from technic.commands.reading import check_table, model_options, reading
from technic.commands.solids import make_solids, make_walls

if TYPE_CHECKING:
    from technic.rigidity.result import RigidityReport

__all__ = ["analyze", "run"]

_BELOW_DEMAND = 1


def _check_targets(options: AnalysisOptions) -> None:
    """Refuse unwritable targets before minutes are spent on the answer."""
    from technic.report.files import check_writable
    from technic.report.json import STDOUT

    if options.json is not None and options.json != STDOUT:
        check_writable(Path(options.json))


def _demands(report: RigidityReport, options: AnalysisOptions) -> list[str]:
    """Return what the caller demanded and the model does not give, one sentence each."""
    from technic.report.wording import number
    from technic.rigidity.result import Verdict

    missed = []
    if options.require_rigid and report.verdict is not Verdict.RIGID:
        missed.append(f"the model is {report.verdict.value}, --require-rigid demands a rigid one")
    if options.min_rigidity is not None:
        if report.rigidity is None:
            missed.append("the model has no rigidity to compare with --min-rigidity")
        elif report.rigidity.value < options.min_rigidity:
            missed.append(
                f"the rigidity is {number(report.rigidity.value, 6)} N/m, "
                f"--min-rigidity demands {number(options.min_rigidity, 6)} N/m"
            )
    return missed


def _unsure(report: RigidityReport, options: AnalysisOptions) -> str:
    """Return a warning when the calibration's uncertainty leaves open whether --min-rigidity is met."""
    rigidity, least = report.rigidity, options.min_rigidity
    if rigidity is None or least is None or rigidity.interval_95 is None:
        return ""
    low, high = rigidity.interval_95
    if not low <= least <= high:
        return ""
    from technic.report.wording import number

    return (
        f"whether --min-rigidity is met is not sure: the measured joints leave {number(low)} to "
        f"{number(high)} N/m with 95 % confidence"
    )


def run(model: Path, options: AnalysisOptions) -> None:
    """Load, analyze and report, as `technic analyze` and `technic demo` do.

    Raises
    ------
    TechnicError
        With the exit code that its kind has.
    typer.Exit
        With code 1 when the model is below what was demanded.
    """
    from technic.assembly.materials import apply_materials, parse_materials
    from technic.assembly.select import parse_fix
    from technic.loading import load
    from technic.report.json import STDOUT, write_json
    from technic.rigidity.analyze import analyze as analyze_assembly

    _check_targets(options)
    with Outputs(options) as outputs:
        how = reading(model, options.how)
        assembly = load(model, **how)
        check_table(assembly, how)
        if options.fix:
            supports = tuple(parse_fix(assembly, text) for text in options.fix)
            assembly = replace(assembly, supports=assembly.supports + supports)
        assembly = apply_materials(assembly, parse_materials(assembly, options.material))
        make_solids(assembly, options.parts, quiet=options.quiet)
        if options.port_walls == "rigid" and options.parts == "solid":
            make_walls(assembly, quiet=options.quiet)
        report = analyze_assembly(
            assembly,
            measure=options.measure,
            modes=options.modes,
            parts=options.parts,
            port_walls=options.port_walls,
            table=how.get("table"),
        )
        if options.json is not None:
            write_json(report.to_dict(), options.json)
        if not options.quiet and options.json != STDOUT:
            from technic.report.style import style_for
            from technic.report.text import to_text

            sys.stdout.write(to_text(report, style_for(sys.stdout)))
            sys.stdout.flush()
        missed = _demands(report, options)
        for sentence in missed:
            typer.echo(f"technic: {sentence}", err=True)
        if unsure := _unsure(report, options):
            typer.echo(f"technic: warning: {unsure}", err=True)
        outputs.write(model, report)
    if missed:
        raise typer.Exit(_BELOW_DEMAND)


@model_options
def analyze(
    model: Annotated[
        Path,
        typer.Argument(metavar="MODEL", help="LDraw file (.ldr, .mpd) or assembly file (.json)."),
    ],
    json: JsonOption = None,
    picture: PictureOption = None,
    report: ReportOption = None,
    heatmap: HeatmapOption = None,
    gltf: GltfOption = None,
    csv: CsvOption = None,
    animate: AnimateOption = None,
    view: ViewOption = "mode",
    renderer: RendererOption = "pyvista",
    transparent: TransparentOption = False,
    depth: DepthOption = False,
    fix: FixOption = None,
    measure: MeasureOption = "mean_square",
    how: ModelOptions = AS_FOUND,
    modes: ModesOption = 6,
    parts: PartModelOption = "solid",
    port_walls: PortWallsOption = "mean",
    material: MaterialOption = None,
    require_rigid: RequireRigidOption = False,
    min_rigidity: MinRigidityOption = None,
    quiet: QuietOption = False,
) -> None:
    """Say how rigid a model is, what can move, and where it is weak."""
    run(
        model,
        AnalysisOptions(
            json=json,
            picture=picture,
            report=report,
            heatmap=heatmap,
            gltf=gltf,
            csv=csv,
            animate=animate,
            view=view,
            renderer=renderer,
            transparent=transparent,
            depth=depth,
            fix=tuple(fix or ()),
            measure=measure,
            how=how,
            modes=modes,
            parts=parts,
            port_walls=port_walls,
            material=tuple(material or ()),
            require_rigid=require_rigid,
            min_rigidity=min_rigidity,
            quiet=quiet,
        ),
    )
