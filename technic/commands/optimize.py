"""`technic optimize`: move the joints of a linkage so that it becomes more rigid."""

from __future__ import annotations

import sys
from contextlib import closing
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from technic.commands.options import AS_FOUND, JsonOption, PictureOption, QuietOption
from technic.commands.progress import progress_bar
from technic.commands.reading import reading

if TYPE_CHECKING:
    from technic.design.optimize.solve import Optimization, Step

__all__ = ["optimize"]


def optimize(
    assembly: Annotated[Path, typer.Argument(help="Assembly file (.json) of a linkage.")],
    out: Annotated[
        Path | None, typer.Option("--out", metavar="JSON", help="Write the optimised assembly.")
    ] = None,
    vertices: Annotated[
        Path | None,
        typer.Option(
            "--vertices", metavar="JSON", help="Names of vertices and how each of them may move."
        ),
    ] = None,
    fix: Annotated[
        list[str] | None,
        typer.Option("--fix", metavar="VERTEX", help="This vertex stays. May be repeated."),
    ] = None,
    list_vertices: Annotated[
        bool, typer.Option("--list", help="List the vertices and stop.")
    ] = False,
    svg: Annotated[
        Path | None,
        typer.Option("--svg", metavar="SVG", help="Draw before and after, with the path between."),
    ] = None,
    gif: Annotated[
        Path | None,
        typer.Option("--gif", metavar="GIF", help="Write the path of the joints as a film."),
    ] = None,
    picture: PictureOption = None,
    cut: Annotated[
        Path | None,
        typer.Option(
            "--cut",
            metavar="SVG|DXF",
            help="Write the bars of a flat linkage for a laser cutter, with pin holes.",
        ),
    ] = None,
    stl: Annotated[
        Path | None,
        typer.Option("--stl", metavar="DIR", help="Write the bars for printing, with pin holes."),
    ] = None,
    pin: Annotated[
        float, typer.Option("--pin", min=0.0, metavar="MM", help="Diameter of pin holes.")
    ] = 1.0,
    shortest: Annotated[
        float,
        typer.Option("--shortest", metavar="SHARE", help="Least length of a bar, of its own."),
    ] = 0.5,
    longest: Annotated[
        float, typer.Option("--longest", metavar="SHARE", help="Greatest length of a bar.")
    ] = 2.0,
    clearance: Annotated[
        float | None,
        typer.Option("--clearance", min=0.0, metavar="MM", help="Least distance of two joints."),
    ] = None,
    max_mass: Annotated[
        float | None, typer.Option("--max-mass", min=0.0, metavar="G", help="Greatest mass.")
    ] = None,
    geometry_weight: Annotated[
        float,
        typer.Option("--keep", min=0.0, metavar="W", help="Weight of the change of total length."),
    ] = 0.002,
    restarts: Annotated[
        int, typer.Option("--restarts", min=0, help="Further searches from nearby geometries.")
    ] = 0,
    max_evaluations: Annotated[
        int, typer.Option("--max-evaluations", min=1, metavar="N", help="Geometries tried at most.")
    ] = 500,
    max_seconds: Annotated[
        float, typer.Option("--max-seconds", min=0.0, metavar="S", help="Time allowed.")
    ] = float("inf"),
    json: JsonOption = None,
    quiet: QuietOption = False,
) -> None:
    """Move the joints of a linkage so that it resists its worst load better, with little change."""
    from technic.design.optimize.freedom import Rule
    from technic.design.optimize.rule_file import read_rules
    from technic.design.optimize.solve import optimize as solve
    from technic.design.optimize.vertices import find_geometry
    from technic.loading import load, save
    from technic.report.files import check_writable, write_atomic
    from technic.report.json import STDOUT, write_json
    from technic.report.optimize_text import optimization_dict, optimization_text
    from technic.report.style import style_for

    for target in (
        out,
        svg,
        gif,
        picture,
        cut,
        None if json in (None, STDOUT) else Path(str(json)),
    ):
        if target is not None:
            check_writable(target)
    model = load(assembly, **reading(assembly, AS_FOUND))
    names, rules = ({}, {}) if vertices is None else read_rules(vertices, model)
    rules |= dict.fromkeys(fix or (), Rule("fixed"))
    if list_vertices:
        typer.echo(vertex_list(find_geometry(model, names), model.dimension))
        return
    with progress_bar(shown=not quiet) as tell:

        def progress(step: Step) -> None:
            tell("search", step.evaluation, max_evaluations, f"{step.rigidity:.4g} N/m")

        found = solve(
            model,
            rules=rules,
            names=names,
            geometry_weight=geometry_weight,
            lengths=(shortest, longest),
            clearance=None if clearance is None else 1e-3 * clearance,
            max_mass=None if max_mass is None else 1e-3 * max_mass,
            restarts=restarts,
            max_evaluations=max_evaluations,
            max_seconds=max_seconds,
            progress=progress,
        )
    if out is not None:
        write_atomic(out, lambda path: save(found.after, path))
    if svg is not None:
        from technic.report.linkage_svg import comparison_svg

        _write(svg, comparison_svg(found))
    if gif is not None:
        from technic.report.files import write_bytes
        from technic.report.linkage_gif import path_gif

        write_bytes(gif, path_gif(found))
    if picture is not None:
        _draw(found, picture)
    if cut is not None or stl is not None:
        from technic.report.cutting import write_cut, write_stl

        if cut is not None:
            write_cut(found.after, cut, 1e-3 * pin)
        if stl is not None:
            write_stl(found.after, stl, 1e-3 * pin)
    if json is not None:
        write_json(optimization_dict(found), json)
    if not quiet and json != STDOUT:
        sys.stdout.write(optimization_text(found, style_for(sys.stdout)))
        sys.stdout.flush()


def vertex_list(geometry: object, dimension: int) -> str:
    """Return one line per vertex: name, place, and why it stays if it does."""
    from technic.design.optimize.vertices import Geometry

    assert isinstance(geometry, Geometry)
    lines = []
    for k, name in enumerate(geometry.names):
        place = ", ".join(f"{1e3 * v:.2f}" for v in geometry.positions[k, :dimension])
        note = geometry.pinned.get(k, "")
        if k in geometry.carried:
            note = "carried by the bar it lies in"
        elif k in geometry.slides and not note:
            note = "slides along its bar"
        lines.append(f"{name:>6}  {place:>24} mm  {note}".rstrip())
    return "\n".join(lines)


def _write(path: Path, text: str) -> None:
    from technic.report.files import write_bytes

    write_bytes(path, text.encode())


def _draw(found: Optimization, picture: Path) -> None:
    """Draw the linkage before and after under its worst loads, with one camera and one scale."""
    from technic.report.comparison import comparison_scene
    from technic.report.render import Painter
    from technic.rigidity.analyze import analyze

    with closing(Painter()) as painter:
        reports = [analyze(found.before), analyze(found.after)]
        painter.draw(comparison_scene(reports, ("before", "after")), picture)
