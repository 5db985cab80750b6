"""Options that steer how a model file is read."""

from __future__ import annotations

from dataclasses import dataclass
from functools import partial
from pathlib import Path
from typing import Any, Literal

from technic.errors import UsageError

__all__ = ["ModelOptions", "reading"]


@dataclass(frozen=True, slots=True)
class ModelOptions:
    """How a model file is read: where unknown parts come from, and what moves.

    Parameters
    ----------
    library : Path or None
        LDraw parts library; None: the one that is found in the usual places, if there is one.
    no_library : bool
        Do not look for one.
    shadow : Path or None
        LDCad shadow library.
    gears : {"off", "on"}
        Whether gears in mesh turn each other.
    inner : {"held", "free"}
        Whether motors and actuators hold their position.
    overrides : Path or None
        File of corrections.
    """

    library: Path | None = None
    no_library: bool = False
    shadow: Path | None = None
    gears: Literal["off", "on"] = "off"
    inner: Literal["held", "free"] = "held"
    overrides: Path | None = None


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


def reading(
    model: Path,
    axle_slide: str,
    calibration: Path | None = None,
    more: ModelOptions | None = None,
) -> dict[str, Any]:
    """Return the options of the reader; an assembly file says itself what its joints hold.

    Parameters
    ----------
    model : Path
    axle_slide : {"held", "free"}
    calibration : Path, optional
        Stiffness table to use instead of the shipped one.
    more : ModelOptions, optional

    Raises
    ------
    UsageError
        An option is given that says nothing about this kind of file.
    TechnicError
        The stiffness table cannot be read.
    """
    if model.suffix.lower() == ".json":
        if axle_slide != "held":
            raise UsageError("--axle-slide is for LDraw models; an assembly file types its joints")
        if calibration is not None:
            raise UsageError(
                "--calibration is for LDraw models; an assembly file gives its own stiffnesses"
            )
        if more is not None and more != ModelOptions():
            raise UsageError(
                "--library, --shadow, --gears, --inner and --overrides are for LDraw models"
            )
        return {}
    options: dict[str, Any] = {"axle_slide": axle_slide}
    more = more or ModelOptions()
    options |= _sources(more)
    options["gears"] = more.gears
    options["inner"] = more.inner
    options["overrides"] = more.overrides
    if calibration is not None:
        from technic.assembly.stiffness import read_table

        options["table"] = read_table(calibration)
    return options
