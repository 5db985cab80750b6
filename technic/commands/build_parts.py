"""`technic parts build`: condense the solid models of parts into the file that is shipped."""

from __future__ import annotations

import sys
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from technic.commands.options import JsonOption, QuietOption

if TYPE_CHECKING:
    from technic.fem.solid.settings import MeshSettings
    from technic.fem.solid.superelement import SuperElement
    from technic.parts.definition import PartDefinition

__all__ = ["build"]


DRAFT_CELL = 1.2e-3
"""Of `--draft` (m)."""


def _target() -> Path:
    """Return where the shipped file stands: in the source tree, beside the other part data."""
    from importlib.resources import files

    from technic.fem.solid.store import FILE

    return Path(str(files("parts_library").joinpath(FILE)))


def _built(
    chosen: list[PartDefinition], settings: MeshSettings, jobs: int, *, quiet: bool
) -> tuple[dict[str, SuperElement], dict[str, str]]:
    """Build with a bar for somebody who watches, a line for each part for others."""
    from technic.commands.progress import progress_bar
    from technic.fem.solid.store import build as build_all

    done = 0
    lines = not quiet and not sys.stderr.isatty()
    with progress_bar(shown=not quiet) as tell:

        def progress(part: str, failure: str | None) -> None:
            nonlocal done
            done += 1
            tell("meshing", done, len(chosen))
            if lines:
                said = "" if failure is None else f": {failure}"
                typer.echo(f"{done}/{len(chosen)} {part}{said}", err=True)

        return build_all(chosen, settings, jobs=jobs, progress=progress)


def build(
    numbers: Annotated[
        list[str] | None,
        typer.Argument(metavar="[ID]...", help="Parts to build; without any, all of them."),
    ] = None,
    cell: Annotated[
        float | None,
        typer.Option("--cell", min=0.3, max=4.0, metavar="MM", help="Edge of a cell (0.8)."),
    ] = None,
    draft: Annotated[
        bool,
        typer.Option(
            "--draft",
            help="Cells of 1.2 mm: a sixth of the time; for trying shapes out, with --out.",
        ),
    ] = False,
    jobs: Annotated[int, typer.Option("--jobs", min=1, metavar="N", help="Processes.")] = 1,
    out: Annotated[
        Path | None,
        typer.Option("--out", metavar="FILE", help="Where to; without it, the shipped file."),
    ] = None,
    json: JsonOption = None,
    quiet: QuietOption = False,
) -> None:
    """Condense the solid model of each part onto its ports. Parts not named stay as they are."""
    import os
    import tempfile

    from technic.errors import UsageError
    from technic.fem.solid.settings import MeshSettings
    from technic.fem.solid.store import has_solid_model, read, read_shape, shape_key, write
    from technic.parts.catalogue import catalogue
    from technic.parts.shapes import is_approximate
    from technic.report.json import STDOUT, write_json
    from technic.units import MM

    if draft and cell is not None:
        raise UsageError("--draft and --cell exclude each other")
    settings = MeshSettings(cell=DRAFT_CELL if draft else MeshSettings().cell)
    if cell is not None:
        settings = MeshSettings(cell=cell * MM)
    if out is None and settings != MeshSettings():
        raise UsageError(
            f"the shipped file has cells of {MeshSettings().cell / MM:g} mm, and an analysis reads no "
            "others from it; write these elsewhere with --out FILE"
        )
    known = {d.id: d for d in catalogue()}
    chosen = []
    for number in numbers or known:
        definition = catalogue().get(number)
        if definition is None:
            raise UsageError(f"no part {number!r} in the catalogue")
        # a shape that is right in volume only says nothing about stiffness
        if numbers or (has_solid_model(definition) and not is_approximate(definition)):
            chosen.append(definition)
    elements, failures = _built(chosen, settings, jobs, quiet=quiet)
    target = out or _target()
    built = set(elements)
    shapes = {part: shape_key(known[part]) for part in elements}
    if target.exists():
        for part in known:
            kept = None if part in built or part in failures else read(target, part)
            if kept is not None:
                elements[part] = kept
                # of the shape that it was made from: one that has changed since stays out of date
                shapes[part] = read_shape(target, part)
    handle, name = tempfile.mkstemp(dir=target.parent, suffix=".zip")
    os.close(handle)
    try:
        write(name, elements, shapes=shapes)
        os.chmod(name, 0o644)
        os.replace(name, target)
    except BaseException:
        Path(name).unlink(missing_ok=True)
        raise
    if json is not None:
        figures = {
            part: {
                "cell_mm": element.cell / MM,
                "ports": len(element.ports),
                "condensation_error": element.condensation_error,
            }
            for part, element in sorted(elements.items())
            if part in built
        }
        write_json({"schema": "technic-build/1", "built": figures, "failed": failures}, json)
    if json != STDOUT and not quiet:
        typer.echo(f"{len(built)} built, {len(failures)} failed, {len(elements)} in {target}")
