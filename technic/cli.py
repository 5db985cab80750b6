"""The program `technic`: registers the commands, turns errors into messages and exit codes.

A new command is a module in `technic/commands` with one function, and one line here. Commands import
what they need when they run, so that ``technic --help`` stays fast.

Exit codes: 0 done; 1 done, but below what the caller demanded; 2 usage; 3 bad input; 4 a needed library
or system part is missing; 5 numerical failure.
"""

from __future__ import annotations

import os
import sys
from typing import Annotated

import typer

from technic import __version__
from technic.commands import (
    analyze,
    batch,
    calibrate,
    deflect,
    demo,
    doctor,
    optimize,
    paper,
    parts,
    suggest,
)
from technic.errors import TechnicError

__all__ = ["app", "main"]

# Plain help needs no rich, whose import alone costs a tenth of a second.
app = typer.Typer(
    name="technic",
    help="How rigid is a LEGO Technic model, which load does it resist least, and what helps?",
    rich_markup_mode=None,
    pretty_exceptions_enable=False,
    add_completion=False,
    no_args_is_help=True,
    context_settings={"help_option_names": ["-h", "--help"]},
)
app.command("analyze")(analyze.analyze)
app.command("deflect")(deflect.deflect)
app.command("batch")(batch.batch)
app.command("calibrate")(calibrate.calibrate)
app.command("demo")(demo.demo)
app.command("doctor")(doctor.doctor)
app.command("suggest")(suggest.suggest)
app.command("optimize")(optimize.optimize)
app.command("paper")(paper.paper)
app.add_typer(parts.app, name="parts")


def _version(asked: bool) -> None:
    if asked:
        typer.echo(f"technic {__version__}")
        raise typer.Exit


@app.callback()
def _root(
    version: Annotated[
        bool,
        typer.Option("--version", callback=_version, is_eager=True, help="Print the version."),
    ] = False,
) -> None:
    """How rigid is a LEGO Technic model, which load does it resist least, and what helps?"""


def main() -> None:
    """Run the program; never answer bad input with a traceback."""
    try:
        app(prog_name="technic")
    except TechnicError as error:
        sys.stdout.flush()
        typer.echo(f"technic: {error}", err=True)
        sys.exit(error.exit_code)
    except BrokenPipeError:
        # The reader (head, less) has what it wanted. Python would complain again at exit.
        os.dup2(os.open(os.devnull, os.O_WRONLY), sys.stdout.fileno())
        sys.exit(0)


if __name__ == "__main__":
    main()
