"""Solid models that are not shipped are made before an analysis: in parallel, with a bar that shows it."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from contextlib import ExitStack, contextmanager
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from technic.assembly.model import Assembly
    from technic.commands.progress import Tell
    from technic.system.assemble import Probe
    from technic.system.port_walls import RigidWalls

__all__ = ["make_solids", "make_walls"]


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

    with _bar("library parts", shown=not quiet) as progress:
        prepare(assembly, progress=progress)


def make_walls(
    assembly: Assembly, *, probes: tuple[Probe, ...] = (), quiet: bool = False
) -> RigidWalls:
    """Make, or find in the cache, the solid models with rigid walls in the bores in use."""
    import os

    from technic.system.port_walls import rigid_walls

    with _bar("rigid bores", shown=not quiet) as progress:
        return rigid_walls(assembly, probes=probes, jobs=os.cpu_count() or 1, progress=progress)


@contextmanager
def _bar(what: str, *, shown: bool) -> Iterator[Callable[[int, int, str], None] | None]:
    """Yield what moves a bar on; it appears once there is something to show."""
    if not shown:
        yield None
        return
    from technic.commands.progress import progress_bar

    with ExitStack() as stack:
        tell: Tell | None = None

        def move(done: int, total: int, _title: str) -> None:
            nonlocal tell
            if tell is None:
                tell = stack.enter_context(progress_bar())
            tell(what, done, total)

        yield move
