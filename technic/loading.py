"""Read a model file, whatever its format, into an assembly; write assembly files."""

from __future__ import annotations

from importlib import import_module
from pathlib import Path
from typing import Any

from technic.assembly.model import Assembly
from technic.errors import InputError, UsageError

__all__ = ["READERS", "load", "save"]

READERS: dict[str, tuple[str, str]] = {
    ".ldr": ("technic.ldraw.reader", "load_ldraw"),
    ".mpd": ("technic.ldraw.reader", "load_ldraw"),
    ".dat": ("technic.ldraw.reader", "load_ldraw"),
    ".io": ("technic.ldraw.reader", "load_ldraw"),
    ".json": ("technic.assembly.file", "load_assembly"),
}
"""Module and function that read each kind of file, by suffix."""


def load(path: str | Path, **options: Any) -> Assembly:
    """Read a model file.

    Parameters
    ----------
    path : path-like
        LDraw (``.ldr``, ``.mpd``, ``.dat``) or an assembly file (``.json``).
    **options
        Passed on to the reader of the format, e.g. ``axle_slide="free"`` for LDraw files.

    Returns
    -------
    Assembly

    Raises
    ------
    InputError
        When the file is missing, is no file, has an unknown suffix, or cannot be understood.
    """
    path = Path(path)
    if not path.exists():
        raise InputError("no such file", path=path, remedy="Check the spelling of the path.")
    if path.is_dir():
        raise InputError(
            "this is a directory",
            path=path,
            remedy="Name a model file in it (.ldr, .mpd or .json).",
        )
    entry = READERS.get(path.suffix.lower())
    if entry is None:
        raise InputError(
            f"files ending in {path.suffix or 'nothing'!r} are not known",
            path=path,
            remedy="Known are: " + ", ".join(sorted(READERS)) + ".",
        )
    module, function = entry
    try:
        assembly: Assembly = getattr(import_module(module), function)(path, **options)
    except OSError as error:
        reason = error.strerror or str(error)
        raise InputError(f"cannot be read: {reason}", path=error.filename or path) from error
    return assembly


def save(assembly: Assembly, path: str | Path) -> None:
    """Write an assembly file (``.json``); `load` gives the same assembly back.

    Raises
    ------
    UsageError
        The suffix is another one, or the assembly has LEGO parts, which only LDraw files describe.
    InputError
        The file cannot be written.
    """
    path = Path(path)
    if path.suffix.lower() != ".json":
        raise UsageError(f"an assembly is written as .json, not as {path.suffix or 'nothing'!r}")
    from technic.assembly.writing import save_assembly

    try:
        save_assembly(assembly, path)
    except OSError as error:
        raise InputError(f"cannot be written: {error.strerror or error}", path=path) from error
