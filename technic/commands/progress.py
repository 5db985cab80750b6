"""A progress bar on standard error, drawn only for somebody who watches."""

from __future__ import annotations

import sys
from collections.abc import Iterator
from contextlib import contextmanager
from typing import Protocol

__all__ = ["Tell", "progress_bar"]


class Tell(Protocol):
    """Is told the stage, how much of it is done, how much there is, and what to show beside the bar."""

    def __call__(self, stage: str, done: int, total: int, note: str = "", /) -> None:
        """Show it."""


@contextmanager
def progress_bar(*, shown: bool = True) -> Iterator[Tell]:
    """Yield a function that is told the stage, how much is done, and how much there is.

    Parameters
    ----------
    shown : bool
        False draws nothing. Nothing is drawn, and nothing imported, either when standard error is not
        a terminal.
    """
    if not shown or not sys.stderr.isatty():
        yield lambda _stage, _done, _total, _note="": None
        return
    from rich.console import Console
    from rich.progress import BarColumn, MofNCompleteColumn, Progress, TextColumn, TimeElapsedColumn

    columns = (
        TextColumn("{task.description:12}"),
        BarColumn(),
        MofNCompleteColumn(),
        TimeElapsedColumn(),
        TextColumn("{task.fields[note]}"),
    )
    with Progress(*columns, console=Console(stderr=True), transient=True) as bar:
        task = bar.add_task("reading", total=None, note="")
        current = "reading"

        def tell(stage: str, done: int, total: int, note: str = "", /) -> None:
            nonlocal current
            if stage != current:
                bar.reset(task, description=stage, total=total)
                current = stage
            bar.update(task, completed=done, total=total, note=note)

        yield tell
