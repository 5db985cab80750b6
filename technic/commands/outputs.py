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
    from technic.report.scene import FilmKind
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
    MissingDependency
        When what draws or films is not installed.
    """

    def __init__(self, options: AnalysisOptions) -> None:
        from technic.report.files import check_writable

        self._options = options
        for target in (
            options.picture,
            options.report,
            options.heatmap,
            options.gltf,
            options.animate,
        ):
            if target is not None:
                check_writable(target)
        if options.csv is not None and not options.csv.is_dir():
            check_writable(options.csv)
        self._film_kind: FilmKind = "gif"
        if options.animate is not None and options.animate.suffix.lower() == ".mp4":
            from technic.report.video import find_ffmpeg

            find_ffmpeg()
            self._film_kind = "mp4"
        if (options.transparent or options.depth) and options.picture is None:
            raise UsageError("--transparent and --depth are for --picture")
        self._painter: Painter | None = None
        if options.picture is not None or options.report is not None:
            from technic.report.render import Painter

            self._painter = Painter(options.renderer)

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

    def write(self, model: Path, report: RigidityReport) -> None:
        """Write every file that was asked for.

        A machine that cannot draw gets all the others first.

        Parameters
        ----------
        model : Path
            The file that the report is of.
        report : RigidityReport

        Raises
        ------
        MissingDependency
            When a picture was asked for and this machine cannot draw.
        UsageError
            When a file cannot be written, or there is nothing to draw.
        """
        options = self._options
        if options.csv is not None:
            from technic.report.spreadsheet import write_tables

            write_tables(report, options.csv)
            self._said("tables", options.csv)
        if options.heatmap is not None:
            self._heat_map(model, report, options.heatmap)
        if options.gltf is not None:
            from technic.report.gltf import write_gltf

            if not report.assembly.parts:
                raise UsageError("no glTF was written: the model has no part that was understood")
            write_gltf(report, options.gltf)
            self._said("glTF", options.gltf)
        if self._painter is not None:
            self._draw(report, self._painter)
        if options.animate is not None:
            self._animate(report, options.animate)

    def _heat_map(self, model: Path, report: RigidityReport, path: Path) -> None:
        from technic.report.heat_map import write_heat_map
        from technic.report.wording import count

        if model.suffix.lower() == ".json":
            raise UsageError("--heatmap is for LDraw models; an assembly file has no colours")
        found = write_heat_map(report, model, path)
        if found.elsewhere:
            parts = count(found.elsewhere, "part")
            typer.echo(f"technic: heat map: {parts} in other files keep their colour", err=True)
        if found.shared and not self._options.quiet:
            lines = count(found.shared, "line")
            typer.echo(
                f"heat map: {lines} of submodels used more than once: coloured by the part with "
                "the most energy",
                err=True,
            )
        self._said("heat map", path)

    def _animate(self, report: RigidityReport, path: Path) -> None:
        from technic.report.files import write_bytes
        from technic.report.film import film
        from technic.report.render import Painter

        if not report.assembly.parts:
            raise UsageError("no film was made: the model has no part that was understood")
        painter = Painter(self._options.renderer)
        try:
            made = film(report, view=self._options.view, kind=self._film_kind)
            write_bytes(path, painter.picture(made))
        finally:
            painter.close()
        self._said("animation", path)

    def _draw(self, report: RigidityReport, painter: Painter) -> None:
        from technic.report.drawing import drawing_of
        from technic.report.files import write_bytes
        from technic.report.picture import report_scene, styled

        options = self._options
        drawing = drawing_of(report.assembly) if report.assembly.parts else None
        picture, problem = None, None
        if drawing is None and options.picture is not None:
            raise UsageError("no picture was drawn: the model has no part that was understood")
        if drawing is not None:
            try:
                scene = report_scene(report, drawing=drawing, view=options.view)
                scene = styled(scene, transparent=options.transparent, depth=options.depth)
                picture = painter.picture(scene)
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
