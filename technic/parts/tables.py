"""Tables of `parts_library` with a row for one or several part numbers."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from typing import Any, TypeVar

from technic.errors import SchemaError

__all__ = ["by_number"]

T = TypeVar("T")


def by_number(
    content: Mapping[str, Any], read: Callable[[Mapping[str, Any]], T], file: str
) -> dict[str, T]:
    """Return what the rows ``[[part]]`` of a parsed TOML file say, by every number in their ``ids``.

    Parameters
    ----------
    content : mapping
    read : callable
        Reads one row; it raises KeyError, TypeError or ValueError where the row is faulty.
    file : str
        Name of the file, for messages.

    Raises
    ------
    SchemaError
        With every fault.
    """
    faults: list[str] = []
    found: dict[str, T] = {}
    for n, row in enumerate(content.get("part", ()), 1):
        try:
            entry = read(row)
        except (KeyError, TypeError, ValueError) as error:
            faults.append(f"part {n}: {error!s} is missing or faulty")
            continue
        for number in row["ids"]:
            if number in found:
                faults.append(f"part {n}: {number} is given twice")
            found[number] = entry
    if faults:
        raise SchemaError(faults, path=file)
    return found
