"""Every error that the program raises on purpose, and the exit code each one means.

The tree::

    TechnicError
    ├── UsageError            2   the caller asked for something that does not exist
    ├── InputError            3   a file, or a line of it, cannot be understood
    │   └── SchemaError       3   a structured file breaks its schema (one message per fault)
    ├── MissingDependency     4   an optional library or a system package is needed
    └── NumericalError        5   a factorisation or an iteration did not succeed
"""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path

__all__ = [
    "InputError",
    "MissingDependency",
    "NumericalError",
    "SchemaError",
    "TechnicError",
    "UsageError",
]


class TechnicError(Exception):
    """Base class; its message is fit to be shown to a user as it stands."""

    exit_code = 1


class UsageError(TechnicError):
    """The caller named a part, port, option or combination that does not exist."""

    exit_code = 2


class InputError(TechnicError):
    """A file cannot be understood.

    Parameters
    ----------
    message : str
        What is wrong.
    path : path-like, optional
        The file.
    line : int, optional
        The line in it, counted from 1.
    remedy : str, optional
        What the user can do about it.
    """

    exit_code = 3

    def __init__(
        self,
        message: str,
        *,
        path: str | Path | None = None,
        line: int | None = None,
        remedy: str | None = None,
    ) -> None:
        self.message = message
        self.path = None if path is None else str(path)
        self.line = line
        self.remedy = remedy
        where = "" if path is None else f"{path}: " if line is None else f"{path}:{line}: "
        advice = "" if remedy is None else f"\n  {remedy}"
        super().__init__(f"{where}{message}{advice}")


class SchemaError(InputError):
    """A structured file (JSON, TOML, CSV) breaks its schema.

    Parameters
    ----------
    faults : sequence of str
        One message per fault, each with the path of the faulty value.
    path : path-like, optional
        The file.
    """

    def __init__(self, faults: Sequence[str], *, path: str | Path | None = None) -> None:
        self.faults = tuple(faults)
        count = "1 fault" if len(self.faults) == 1 else f"{len(self.faults)} faults"
        super().__init__("\n  ".join([count, *self.faults]), path=path)


class MissingDependency(TechnicError):
    """An optional library or a system package is needed; the message says how to get it."""

    exit_code = 4


class NumericalError(TechnicError):
    """A factorisation or an iteration did not succeed."""

    exit_code = 5
