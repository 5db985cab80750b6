"""Options that steer how a model file is read; every command that reads one takes them from here.

A command has one parameter ``how: ModelOptions`` and the decorator `model_options`, which gives it
``--library``, ``--gears``, ``--overrides`` and the others in its place.
"""

from __future__ import annotations

import inspect
from collections.abc import Callable
from dataclasses import fields
from functools import partial, wraps
from pathlib import Path
from typing import TYPE_CHECKING, Any, Final, get_type_hints

from technic.commands.options import (
    AxleSlideOption,
    CalibrationOption,
    GearsOption,
    InnerOption,
    LibraryOption,
    LibrarySolidsOption,
    ModelOptions,
    NoLibraryOption,
    OverridesOption,
    ShadowOption,
)
from technic.errors import UsageError

if TYPE_CHECKING:
    from technic.assembly.model import Assembly

__all__ = ["check_table", "model_options", "reading"]


_OPTIONS: Final[dict[str, Any]] = {
    "axle_slide": AxleSlideOption,
    "calibration": CalibrationOption,
    "gears": GearsOption,
    "inner": InnerOption,
    "overrides": OverridesOption,
    "library": LibraryOption,
    "no_library": NoLibraryOption,
    "library_solids": LibrarySolidsOption,
    "shadow": ShadowOption,
}
"""The command-line option of each field of `ModelOptions`."""


def model_options(command: Callable[..., None]) -> Callable[..., None]:
    """Give a command the options of `ModelOptions` in place of its parameter ``how``."""

    @wraps(command)
    def run(**given: Any) -> None:
        chosen = {name: given.pop(name) for name in _OPTIONS if name in given}
        command(how=ModelOptions(**chosen), **given)

    hints = get_type_hints(command, include_extras=True)
    parameters = []
    for name, parameter in inspect.signature(command).parameters.items():
        if name == "how":
            parameters += [
                inspect.Parameter(
                    field.name,
                    inspect.Parameter.KEYWORD_ONLY,
                    default=field.default,
                    annotation=_OPTIONS[field.name],
                )
                for field in fields(ModelOptions)
            ]
        else:
            parameters.append(
                parameter.replace(kind=inspect.Parameter.KEYWORD_ONLY, annotation=hints[name])
            )
    signature = inspect.Signature(parameters)
    run.__annotations__ = {p.name: p.annotation for p in parameters}
    run.__signature__ = signature  # type: ignore[attr-defined]
    return run


def _sources(options: ModelOptions) -> dict[str, Any]:
    """Return the reader's `library` and `shadow`; both are opened when a part needs them.

    What is named must exist, whether it is needed or not: a wrong path is not passed over.
    """
    import os

    if options.no_library:
        if options.library is not None or options.shadow is not None:
            raise UsageError("--no-library contradicts --library and --shadow")
        return {}
    from technic.ldraw.library import find_library
    from technic.ldraw.shadow import find_shadow

    if options.library is not None or os.environ.get("LDRAWDIR"):
        library = find_library(options.library)
        shadow = find_shadow(options.shadow)
        return {"library": library, "shadow": shadow}
    if options.shadow is not None and find_library() is None:
        raise UsageError(
            "--shadow adds to an LDraw parts library, and none was found: give --library"
        )
    return {"library": find_library, "shadow": partial(find_shadow, options.shadow)}


def reading(model: Path, how: ModelOptions) -> dict[str, Any]:
    """Return the options of the reader; an assembly file says itself what its joints hold.

    A stiffness table that settings name is used as if it had been given; see `technic.commands.config`.

    Parameters
    ----------
    model : Path
    how : ModelOptions

    Raises
    ------
    UsageError
        An option is given that says nothing about this kind of file.
    TechnicError
        The stiffness table cannot be read.
    """
    from technic.commands.config import table_in_force

    table = table_in_force(model, how.calibration)
    if model.suffix.lower() == ".json":
        if how.axle_slide != "held":
            raise UsageError("--axle-slide is for LDraw models; an assembly file types its joints")
        if how != ModelOptions(no_library=how.no_library, calibration=how.calibration):
            raise UsageError(
                "--library, --library-solids, --shadow, --gears, --inner and --overrides are for "
                "LDraw models"
            )
        return {} if table is None else {"table": table}
    options: dict[str, Any] = {
        "axle_slide": how.axle_slide,
        "gears": how.gears,
        "inner": how.inner,
        "overrides": how.overrides,
        "solids": how.library_solids,
        **_sources(how),
    }
    if table is not None:
        options["table"] = table
    return options


def check_table(assembly: Assembly, options: dict[str, Any]) -> None:
    """Refuse a stiffness table that says nothing about an assembly file.

    Parameters
    ----------
    assembly : Assembly
    options : dict
        From `reading`.

    Raises
    ------
    UsageError
        A table was asked for, and no joint of the file names a connection.
    """
    table = options.get("table")
    if table is None or table.found != "given" or assembly.source.get("format") == "ldraw":
        return  # a table of the settings is not meant for every file
    if not any(joint.connection in table.connections for joint in assembly.joints):
        raise UsageError(
            "--calibration changes nothing here: no joint of the assembly file names a connection, "
            'such as "connection": "pin/pin_hole", so they keep the stiffnesses that the file gives'
        )
