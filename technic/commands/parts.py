"""`technic parts`: what the program knows about parts."""

from __future__ import annotations

import sys
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import Annotated, Any

import typer

from technic.commands.build_parts import build
from technic.commands.options import JsonOption, QuietOption

__all__ = ["app"]

app = typer.Typer(
    help="List the known parts, show one of them, fetch the library of all.",
    rich_markup_mode=None,
    no_args_is_help=True,
)


app.command("build")(build)


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


@app.command("fetch")
def fetch_library(
    url: Annotated[
        str | None,
        typer.Option("--url", metavar="URL", help="Another place than ldraw.org."),
    ] = None,
    target: Annotated[
        Path | None,
        typer.Option(
            "--to", metavar="ZIP", help="Another file than the one that is found by itself."
        ),
    ] = None,
    quiet: QuietOption = False,
) -> None:
    """Download the LDraw parts library (complete.zip, about 130 MB) for parts outside the catalogue."""
    from technic.ldraw.fetch import fetch, library_target, library_url
    from technic.ldraw.library import Library

    place = target or library_target()
    with _bar(shown=not quiet and sys.stderr.isatty()) as progress:
        done = fetch(url or library_url(), place, progress=progress)
    if not quiet:
        library = Library.open(done.path)
        before = f" ({done.resumed / 2**20:.1f} MB were there)" if done.resumed else ""
        typer.echo(
            f"{done.path}: {done.size / 2**20:.1f} MB{before}, {len(library)} files", err=True
        )
        if target is not None:
            typer.echo(f"Name it with --library {done.path} or in LDRAWDIR.", err=True)


@contextmanager
def _bar(*, shown: bool) -> Iterator[Callable[[int, int | None], None] | None]:
    """Show a progress bar on the terminal; yields what it is told the progress with."""
    if not shown:
        yield None
        return
    from rich.console import Console
    from rich.progress import BarColumn, DownloadColumn, Progress, TimeRemainingColumn

    columns = (BarColumn(), DownloadColumn(), TimeRemainingColumn())
    with Progress(*columns, console=Console(stderr=True)) as bar:
        task = bar.add_task("", total=None)
        yield lambda done, total: bar.update(task, completed=done, total=total)


@app.command("cache")
def show_cache(
    json: JsonOption = None,
    clear: Annotated[bool, typer.Option("--clear", help="Delete what is cached.")] = False,
) -> None:
    """Show what is kept in the cache folder, or clear it."""
    from technic.errors import UsageError
    from technic.ldraw import caches as kept
    from technic.report.json import STDOUT, write_json
    from technic.system.solid_cache import limit

    found = kept.caches()
    limits = {"solids": limit()}
    if clear:
        try:
            count, size = kept.clear()
        except OSError as error:
            raise UsageError(f"{error.filename}: cannot be deleted ({error.strerror})") from None
        typer.echo(f"deleted {count} files, {size / 1024:.0f} kB", err=True)
        found = kept.caches()
    if json is not None:
        rows = [
            {
                "name": c.name,
                "folder": str(c.folder),
                "files": len(c.files),
                "bytes": c.size,
                "limit_bytes": limits.get(c.name),
            }
            for c in found
        ]
        write_json({"schema": "technic-cache/1", "caches": rows}, json)
    if json != STDOUT:
        for cache in found:
            head = f"{cache.title}: {len(cache.files)} files, {cache.size / 1024:.0f} kB"
            most = limits.get(cache.name)
            bound = "" if most is None else f" (at most {most / 2**20:.0f} MB)"
            sys.stdout.write(f"{head} in {cache.folder}{bound}\n")
