"""Solid models of library parts are made before an analysis: in parallel, with a bar that shows it."""

from __future__ import annotations

import sys
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from technic.assembly.model import Assembly

__all__ = ["make_solids"]


def make_solids(assembly: Assembly, parts: str, *, quiet: bool) -> None:
    """Make the solid models that are not in the cache yet.

    Parameters
    ----------
    assembly : Assembly
    parts : {"solid", "frame", "rigid"}
        What parts are to be: nothing is done unless it is "solid".
    quiet : bool
        No bar. There is none either when messages do not go to a terminal.
    """
    if parts != "solid" or not any(p.definition and p.definition.drawing for p in assembly.parts):
        return
    from technic.system.drawn_solids import prepare

    with _bar(shown=not quiet and sys.stderr.isatty()) as progress:
        prepare(assembly, progress=progress)


@contextmanager
def _bar(*, shown: bool) -> Iterator[Callable[[int, int, str], None] | None]:
    """Show a bar on the terminal, once there is something to show; yields what moves it on."""
    if not shown:
        yield None
        return
    from rich.console import Console
    from rich.progress import BarColumn, MofNCompleteColumn, Progress, TextColumn

    columns = (
        TextColumn("meshing library parts"),
        BarColumn(),
        MofNCompleteColumn(),
        TextColumn("{task.description}"),
    )
    with Progress(*columns, console=Console(stderr=True), transient=True) as bar:
        task = bar.add_task("", total=None, visible=False)

        def move(done: int, total: int, title: str) -> None:
            bar.update(task, completed=done, total=total, description=title[:40], visible=True)

        yield move
