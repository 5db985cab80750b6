"""`technic deflect`: how far does it sag under a load?"""

from __future__ import annotations

import sys
from dataclasses import replace
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from technic.commands.options import (
    AS_FOUND,
    FixOption,
    JsonOption,
    MaterialOption,
    ModelOptions,
    PartModelOption,
    PictureOption,
    PortWallsOption,
    QuietOption,
    View,
    ViewOption,
)
from technic.commands.reading import check_table, model_options, reading
from technic.commands.solids import make_solids, make_walls
from technic.errors import UsageError

if TYPE_CHECKING:
    from technic.assembly.model import Assembly
    from technic.geometry import Array
    from technic.report.deflection import StaticCase
    from technic.statics.solve import Load

__all__ = ["deflect"]


def _down(assembly: Assembly, text: str | None, *, needed: bool) -> Array | None:
    """Return the unit vector down; an LDraw file says itself where down is."""
    from technic.statics.loads import parse_direction

    if text is not None:
        return parse_direction(text)
    if assembly.source.get("format") == "ldraw":
        return parse_direction("y")
    if needed:
        raise UsageError(
            "an assembly file does not say where down is; give --down, for example --down=-y"
        )
    return None


def _draw(case: StaticCase, picture: Path, view: View) -> None:
    from technic.report.deflection_picture import deflection_scene
    from technic.report.render import Painter

    painter = Painter()
    try:
        painter.draw(deflection_scene(case, view=view), picture)
    finally:
        painter.close()


@model_options
def deflect(
    model: Annotated[
        Path,
        typer.Argument(metavar="MODEL", help="LDraw file (.ldr, .mpd) or assembly file (.json)."),
    ],
    fix: FixOption = None,
    load: Annotated[
        list[str] | None,
        typer.Option(
            "--load",
            metavar="PART[:PORT]:FX,FY,FZ",
            help="Force in newtons along the model's x (right), y (down) and z (back), on a port or "
            "on the centre of a part. May be repeated.",
        ),
    ] = None,
    hang: Annotated[
        list[str] | None,
        typer.Option(
            "--hang",
            metavar="PART[:PORT]:200g",
            help="Hang a weight (g, kg or N) on a port or part. May be repeated.",
        ),
    ] = None,
    gravity: Annotated[
        bool, typer.Option("--gravity", help="Add the weight of the model itself.")
    ] = False,
    down: Annotated[
        str | None,
        typer.Option(
            "--down",
            metavar="AXIS|X,Y,Z",
            help="Where down is, e.g. --down=-z. LDraw models: +y, unless said otherwise.",
        ),
    ] = None,
    probe: Annotated[
        list[str] | None,
        typer.Option(
            "--probe",
            metavar="PART[:PORT]",
            help="Another point whose displacement is wanted. May be repeated.",
        ),
    ] = None,
    json: JsonOption = None,
    picture: PictureOption = None,
    view: ViewOption = "mode",
    how: ModelOptions = AS_FOUND,
    parts: PartModelOption = "solid",
    port_walls: PortWallsOption = "mean",
    material: MaterialOption = None,
    quiet: QuietOption = False,
) -> None:
    """Say how far a model moves under loads, and what its joints carry."""
    from technic.assembly.materials import apply_materials, parse_materials
    from technic.assembly.select import parse_fix
    from technic.loading import load as load_model
    from technic.report.deflection import StaticCase, deflection_dict, deflection_text
    from technic.report.files import check_writable
    from technic.report.json import STDOUT, write_json
    from technic.report.style import style_for
    from technic.statics.loads import GRAVITY, parse_hang, parse_load, parse_probe
    from technic.statics.solve import deflect as solve
    from technic.system.assemble import Probe
    from technic.system.part_models import FACTORIES, models_of, plain_parts

    if not (load or hang or gravity):
        raise UsageError("nothing acts on the model; give --load, --hang or --gravity")
    if port_walls == "rigid" and parts != "solid":
        raise UsageError("--port-walls rigid is for solid models of parts (--parts solid)")
    for target in (picture, Path(json) if json not in (None, STDOUT) else None):
        if target is not None:
            check_writable(target)
    options = reading(model, how)
    assembly = load_model(model, **options)
    check_table(assembly, options)
    supports = tuple(parse_fix(assembly, text) for text in fix or ())
    assembly = replace(assembly, supports=assembly.supports + supports)
    way = _down(assembly, down, needed=bool(hang or gravity))
    loads = [parse_load(assembly, text) for text in load or ()]
    weight = None
    if way is not None:
        loads += [parse_hang(assembly, text, way) for text in hang or ()]
        weight = GRAVITY * way if gravity else None
    probes = tuple(parse_probe(assembly, text) for text in probe or ())
    assembly = apply_materials(assembly, parse_materials(assembly, material or ()))
    make_solids(assembly, parts, quiet=quiet)
    points: tuple[Load | Probe, ...] = (*loads, *probes)
    stiffer = None
    if port_walls == "rigid":
        places = tuple(Probe(point.part, point.point, point.port) for point in points)
        walls = make_walls(assembly, probes=places, quiet=quiet)
        stiffer = solve(assembly, tuple(loads), gravity=weight, probes=probes, element=walls)
    answer = solve(assembly, tuple(loads), gravity=weight, probes=probes, element=FACTORIES[parts])
    intervals: tuple[tuple[float, float] | None, ...] = ()
    if "table" in options:
        from technic.statics.uncertainty import displacement_interval

        intervals = tuple(
            displacement_interval(answer, points, k, options["table"], FACTORIES[parts])
            for k in range(len(points))
        )
    case = StaticCase(
        answer,
        tuple(loads),
        probes,
        weight,
        intervals,
        models_of(assembly, parts),
        plain_parts(assembly, parts),
        stiffer,
        options.get("table"),
    )
    if json is not None:
        write_json(deflection_dict(case), json)
    if not quiet and json != STDOUT:
        sys.stdout.write(deflection_text(case, style_for(sys.stdout)))
        sys.stdout.flush()
    if picture is not None:
        _draw(case, picture, view)
