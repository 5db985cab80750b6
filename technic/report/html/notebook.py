"""A report in a notebook: a short summary by itself, the whole page when asked for."""

from __future__ import annotations

import sys
import tempfile
import webbrowser
from html import escape
from pathlib import Path

from technic.report.files import write_bytes
from technic.report.html.page import facts, page
from technic.report.html.tables import spot_rows
from technic.rigidity.result import RigidityReport

__all__ = ["show", "summary"]

_SPOTS = 5
_HEIGHT = 900
"""Of the page in a notebook, in pixels."""


def summary(report: RigidityReport) -> str:
    """Return verdict, numbers and first weak spots as a piece of HTML."""
    rows = [
        f"<tr><th>{escape(title)}</th><td><b>{escape(value)}</b> {escape(remark)}</td></tr>"
        for title, value, remark in facts(report)
    ]
    spots = [
        f"<tr><td>{spot['rank']}</td><td>{escape(spot['share'])} %</td>"
        f"<td>{escape(spot['words'])}</td></tr>"
        for spot in spot_rows(report)[:_SPOTS]
    ]
    found = [
        f"<h3>{escape(report.assembly.name)}: {escape(report.verdict.value)}</h3>",
        f"<p>{escape(report.reason)}</p>",
        f"<table>{''.join(rows)}</table>",
    ]
    if spots:
        found.append(f"<p>Weakest spots</p><table>{''.join(spots)}</table>")
    return "\n".join(found)


def _in_notebook() -> bool:
    """Return whether a notebook's kernel runs this (not just a terminal with IPython)."""
    ipython = sys.modules.get("IPython")
    shell = None if ipython is None else ipython.get_ipython()
    return shell is not None and hasattr(shell, "kernel")


def show(report: RigidityReport, path: Path | None = None) -> Path | None:
    """Show the page: in the notebook, else in the browser.

    Parameters
    ----------
    report : RigidityReport
    path : Path, optional
        Where to write the page; a temporary file when left out.

    Returns
    -------
    Path or None
        The file that the browser was sent to; None in a notebook.

    Raises
    ------
    UsageError
        When the file cannot be written.
    """
    text = page(report)
    if path is None and _in_notebook():
        # In a frame of its own: neither can disturb the other.
        frame = (
            f'<iframe sandbox="allow-scripts" width="100%" height="{_HEIGHT}" '
            f'style="border: 0" srcdoc="{escape(text)}"></iframe>'
        )
        display = sys.modules["IPython"].display
        display.display(display.HTML(frame))
        return None
    if path is None:
        path = Path(tempfile.mkdtemp(prefix="technic-")) / "report.html"
    write_bytes(path, text.encode("utf-8"))
    webbrowser.open(path.resolve().as_uri())
    return path
