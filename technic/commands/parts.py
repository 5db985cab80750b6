"""`technic parts`: what the program knows about parts."""

from __future__ import annotations

import sys
from pathlib import Path
from typing import Annotated, Any

import typer

from technic.commands.options import JsonOption

__all__ = ["app"]

app = typer.Typer(
    help="List the known parts, or show one of them.", rich_markup_mode=None, no_args_is_help=True
)


@app.command("list")
def list_parts(
    json: JsonOption = None,
    family: Annotated[
        str | None, typer.Option("--family", metavar="NAME", help="Only this family.")
    ] = None,
) -> None:
    """List all parts that have a definition."""
    from technic.errors import UsageError
    from technic.parts.catalogue import catalogue
    from technic.report.json import STDOUT, write_json
    from technic.report.parts import definition_dict, list_text

    definitions = list(catalogue())
    if family is not None:
        families = sorted({definition.family for definition in definitions})
        definitions = [d for d in definitions if d.family == family]
        if not definitions:
            raise UsageError(f"there is no family {family!r}; there are: {', '.join(families)}")
    if json is not None:
        rows: list[dict[str, Any]] = [definition_dict(d, ports=False) for d in definitions]
        write_json({"schema": "technic-parts/1", "parts": rows}, json)
    if json != STDOUT:
        sys.stdout.write(list_text(definitions))


@app.command("show")
def show(
    number: Annotated[str, typer.Argument(metavar="ID", help="LDraw part number, e.g. 32524.")],
    json: JsonOption = None,
    picture: Annotated[
        Path | None, typer.Option("--picture", metavar="PNG", help="Draw the part into a PNG file.")
    ] = None,
) -> None:
    """Show one part: its names, ports, mass and where the facts come from."""
    import difflib

    from technic.errors import UsageError
    from technic.parts.catalogue import catalogue
    from technic.report.files import check_writable
    from technic.report.json import STDOUT, write_json
    from technic.report.parts import definition_dict, show_text

    known = catalogue()
    definition = known.get(number)
    if definition is None:
        close = difflib.get_close_matches(number.lower(), known.numbers(), n=6)
        hint = f"; similar numbers: {', '.join(close)}" if close else ""
        raise UsageError(f"no definition for part {number!r}{hint} (see `technic parts list`)")
    if picture is not None:
        check_writable(picture)
    if json is not None:
        write_json({"schema": "technic-part/1", **definition_dict(definition)}, json)
    if json != STDOUT:
        sys.stdout.write(show_text(definition))
    if picture is not None:
        from technic.report.picture import part_scene
        from technic.report.render import Painter

        painter = Painter()
        try:
            painter.draw(part_scene(definition), picture)
        finally:
            painter.close()
        typer.echo(f"picture: {picture}", err=True)
