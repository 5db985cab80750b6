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
    ModelOptions,
    PartModelOption,
    QuietOption,
)
from technic.commands.reading import model_options, reading
from technic.commands.solids import make_solids
from technic.errors import UsageError

if TYPE_CHECKING:
    from technic.assembly.model import Assembly
    from technic.geometry import Array
    from technic.statics.solve import Load
    from technic.system.assemble import Probe

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
    how: ModelOptions = AS_FOUND,
    parts: PartModelOption = "solid",
    quiet: QuietOption = False,
) -> None:
    """Say how far a model moves under loads, and what its joints carry."""
    from technic.assembly.select import parse_fix
    from technic.loading import load as load_model
    from technic.report.deflection import StaticCase, deflection_dict, deflection_text
    from technic.report.files import check_writable
    from technic.report.json import STDOUT, write_json
    from technic.report.style import style_for
    from technic.statics.loads import GRAVITY, parse_hang, parse_load, parse_probe
    from technic.statics.solve import deflect as solve
    from technic.system.part_models import FACTORIES, models_of, plain_parts

    if not (load or hang or gravity):
        raise UsageError("nothing acts on the model; give --load, --hang or --gravity")
    if json is not None and json != STDOUT:
        check_writable(Path(json))
    options = reading(model, how)
    assembly = load_model(model, **options)
    supports = tuple(parse_fix(assembly, text) for text in fix or ())
    assembly = replace(assembly, supports=assembly.supports + supports)
    way = _down(assembly, down, needed=bool(hang or gravity))
    loads = [parse_load(assembly, text) for text in load or ()]
    weight = None
    if way is not None:
        loads += [parse_hang(assembly, text, way) for text in hang or ()]
        weight = GRAVITY * way if gravity else None
    probes = tuple(parse_probe(assembly, text) for text in probe or ())
    make_solids(assembly, parts, quiet=quiet)
    answer = solve(assembly, tuple(loads), gravity=weight, probes=probes, element=FACTORIES[parts])
    intervals: tuple[tuple[float, float] | None, ...] = ()
    if "table" in options:
        from technic.statics.uncertainty import displacement_interval

        points: tuple[Load | Probe, ...] = (*loads, *probes)
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
    )
    if json is not None:
        write_json(deflection_dict(case), json)
    if not quiet and json != STDOUT:
        sys.stdout.write(deflection_text(case, style_for(sys.stdout)))
        sys.stdout.flush()
