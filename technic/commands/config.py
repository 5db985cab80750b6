"""The user's own settings: a file ``technic.toml`` beside the model, or in the user's folder for settings.

    calibration = "my_bricks.toml"

names the stiffness table to use, from where the file lies. What is nearest wins: ``--calibration``, then the
file beside the model, then the user's, then the shipped table (``--calibration shipped`` asks for it).
"""

from __future__ import annotations

import tomllib
from pathlib import Path
from typing import Final

from technic.assembly.stiffness import StiffnessTable, read_table
from technic.errors import InputError, SchemaError, UsageError
from technic.folders import config_folder

__all__ = ["NAME", "SHIPPED", "install_table", "table_in_force"]

NAME: Final = "technic.toml"

SHIPPED: Final = "shipped"
"""What ``--calibration`` takes for the table that comes with the program, whatever settings say."""

_INSTALLED: Final = "stiffness.toml"
"""The table that `technic calibrate --install` writes beside the user's settings."""

_KEYS: Final = ("calibration",)


def table_in_force(model: Path, given: Path | None) -> StiffnessTable | None:
    """Return the stiffness table that settings or the command line name; None for the shipped one.

    Parameters
    ----------
    model : Path
        The model's file.
    given : Path or None
        Of ``--calibration``.

    Raises
    ------
    InputError
        A settings file or table cannot be read; SchemaError when it says what nobody knows.
    """
    if given is not None:
        return None if str(given) == SHIPPED else read_table(given, found="given")
    for folder, found in (
        (model.parent, f"{NAME} beside the model"),
        (config_folder(), "the user's settings"),
    ):
        path = folder / NAME
        named = _named(path) if path.is_file() else None
        if named == SHIPPED:
            return None
        if named is not None:
            return read_table(path.parent / Path(named).expanduser(), found=found)
    return None


def _named(path: Path) -> str | None:
    """Return the table that a settings file names."""
    try:
        data = tomllib.loads(path.read_text(encoding="utf-8"))
    except OSError as error:
        raise InputError(f"cannot read the settings: {error.strerror}", path=path) from error
    except (UnicodeDecodeError, tomllib.TOMLDecodeError) as error:
        raise InputError(f"not a TOML file: {error}", path=path) from error
    faults = [f"{key}: unknown; known: {', '.join(_KEYS)}" for key in data if key not in _KEYS]
    named = data.get("calibration")
    if named is not None and (not isinstance(named, str) or not named):
        faults.append(f"calibration: expected the name of a file, found {named!r}")
    if faults:
        raise SchemaError(faults, path=path)
    return named


def install_table(text: str) -> list[Path]:
    """Write a table into the user's settings, for all models.

    Returns
    -------
    list of Path
        What was written.

    Raises
    ------
    UsageError
        The settings name another table, or cannot be written.
    """
    folder = config_folder()
    table, settings = folder / _INSTALLED, folder / NAME
    named = _named(settings) if settings.is_file() else None
    if named not in (None, _INSTALLED):
        raise UsageError(f"{settings} names the table {named!r} already; change it there")
    written = {table: text, settings: f'# Settings of technic.\ncalibration = "{_INSTALLED}"\n'}
    try:
        folder.mkdir(parents=True, exist_ok=True)
        for path, content in written.items():
            path.write_text(content, encoding="utf-8")
    except OSError as error:
        raise UsageError(f"{folder} cannot be written: {error.strerror}") from error
    return list(written)
