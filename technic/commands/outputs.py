"""The files that `technic analyze` writes beside its text: picture, page and files for other programs."""

from __future__ import annotations

from pathlib import Path
from types import TracebackType
from typing import TYPE_CHECKING

import typer

from technic.commands.options import AnalysisOptions
from technic.errors import MissingDependency, UsageError

if TYPE_CHECKING:
    from technic.report.render import Painter
    from technic.rigidity.result import RigidityReport

__all__ = ["Outputs"]


class Outputs:
    """Checks the targets at once, and lets the drawing program start while the analysis runs.

    Parameters
    ----------
    options : AnalysisOptions

    Raises
    ------
    UsageError
        When a target cannot be written.
    """

    def __init__(self, options: AnalysisOptions) -> None:
        from technic.report.files import check_writable

        self._options = options
        for target in (options.picture, options.report):
            if target is not None:
                check_writable(target)
        self._painter: Painter | None = None
        if options.picture is not None or options.report is not None:
            from technic.report.render import Painter

            self._painter = Painter()

    def __enter__(self) -> Outputs:
        return self

    def __exit__(
        self,
        kind: type[BaseException] | None,
        error: BaseException | None,
        trace: TracebackType | None,
    ) -> None:
        if self._painter is not None:
            self._painter.close()

    def _said(self, what: str, path: Path) -> None:
        if not self._options.quiet:
            typer.echo(f"{what}: {path}", err=True)

    def write(self, report: RigidityReport) -> None:
        """Write every file that was asked for.

        A machine that cannot draw gets all the others first.

        Raises
        ------
        MissingDependency
            When a picture was asked for and this machine cannot draw.
        UsageError
            When a file cannot be written, or there is nothing to draw.
        """
        if self._painter is not None:
            self._draw(report, self._painter)

    def _draw(self, report: RigidityReport, painter: Painter) -> None:
        from technic.report.drawing import drawing_of
        from technic.report.files import write_bytes
        from technic.report.picture import report_scene

        options = self._options
        drawing = drawing_of(report.assembly) if report.assembly.parts else None
        picture, problem = None, None
        if drawing is None and options.picture is not None:
            raise UsageError("no picture was drawn: the model has no part that was understood")
        if drawing is not None:
            try:
                picture = painter.picture(report_scene(report, drawing=drawing, view=options.view))
            except MissingDependency as error:
                problem = error
        if options.report is not None:
            from technic.report.html.page import write_page

            write_page(report, options.report, picture=picture, drawing=drawing)
            self._said("report", options.report)
        if problem is not None and options.picture is not None:
            raise problem
        if problem is not None:
            typer.echo(f"technic: the page is without a picture: {problem}", err=True)
        if picture is not None and options.picture is not None:
            write_bytes(options.picture, picture)
            self._said("picture", options.picture)
