"""Find a part or a port by what a person types: an id, the end of an id, a part number."""

from __future__ import annotations

import difflib
from dataclasses import dataclass

from technic.assembly.model import Assembly, Part, Support
from technic.errors import UsageError

__all__ = ["PartChoice", "find_part", "find_parts", "find_place", "parse_fix"]

_SHOWN = 8
"""Candidates listed in an error message: enough to choose from, few enough to read."""


@dataclass(frozen=True, slots=True)
class PartChoice:
    """A part of an assembly and, when asked for, one of its ports (by name)."""

    part: int
    port: str | None = None


def _describe(part: Part) -> str:
    return f"{part.id}  ({part.name})" if part.name else part.id


def _listing(parts: list[Part]) -> str:
    lines = [f"  {_describe(part)}" for part in parts[:_SHOWN]]
    if len(parts) > _SHOWN:
        lines.append(f"  and {len(parts) - _SHOWN} more")
    return "\n".join(lines)


def _numbers(part: Part) -> set[str]:
    numbers = {part.number.lower()}
    if part.definition is not None:
        numbers |= {part.definition.id.lower(), *(a.lower() for a in part.definition.aliases)}
    return numbers - {""}


def _matches(assembly: Assembly, text: str) -> list[int]:
    """Return the parts that `text` can mean, by the strictest rule that any part obeys."""
    wanted = text.strip().lower()
    ids = [part.id.lower() for part in assembly.parts]
    exact = [k for k, name in enumerate(ids) if name == wanted]
    if exact:
        return exact
    if not wanted:
        return []
    # An id is a path; its end counts only from a border, so that "2:32524" is not "12:32524".
    ends = [k for k, name in enumerate(ids) if name.endswith("/" + wanted)]
    if ends:
        return ends
    return [k for k, part in enumerate(assembly.parts) if wanted in _numbers(part)]


def find_parts(assembly: Assembly, text: str) -> list[int]:
    """Return all parts that `text` can mean: one by its id, or every part of a number.

    Raises
    ------
    UsageError
        There is none.
    """
    return _matches(assembly, text) or [find_part(assembly, text)]


def find_part(assembly: Assembly, text: str) -> int:
    """Return the index of the part that `text` names.

    Parameters
    ----------
    assembly : Assembly
    text : str
        The part's id, the end of its id from a ``/`` on, or a part number that the model has once.
        Upper and lower case are the same.

    Returns
    -------
    int
        Index into ``assembly.parts``.

    Raises
    ------
    UsageError
        When no part, or more than one, is meant; the message lists what could be meant.
    """
    found = _matches(assembly, text)
    if len(found) == 1:
        return found[0]
    if found:
        raise UsageError(
            f"{text!r} can mean {len(found)} parts; say which one by its id:\n"
            + _listing([assembly.parts[k] for k in found])
        )
    by_word: dict[str, Part] = {}
    for part in assembly.parts:
        for word in (part.id, part.id.rpartition("/")[2], part.number):
            by_word.setdefault(word.lower(), part)
    close = difflib.get_close_matches(text.lower(), by_word, n=_SHOWN, cutoff=0.5)
    near = list({by_word[word].id: by_word[word] for word in close}.values())
    if near:
        raise UsageError(f"no part is called {text!r}; did you mean:\n{_listing(near)}")
    raise UsageError(
        f"no part is called {text!r}; the model's parts are, for example:\n"
        + _listing(list(assembly.parts))
    )


def find_place(assembly: Assembly, text: str) -> PartChoice:
    """Return the part, or the port of a part, that ``PART`` or ``PART:PORT`` names.

    Ids contain colons themselves, so the whole text is tried as a part first.

    Raises
    ------
    UsageError
        When the part is unknown or ambiguous, or has no such port.
    """
    if len(_matches(assembly, text)) == 1:
        return PartChoice(find_part(assembly, text))
    head, colon, tail = text.rpartition(":")
    if not colon or not _matches(assembly, head):
        return PartChoice(find_part(assembly, text))
    index = find_part(assembly, head)
    part = assembly.parts[index]
    names = [port.name for port in part.ports]
    for name in names:
        if name.lower() == tail.strip().lower():
            return PartChoice(index, name)
    has = ", ".join(names) if names else "none"
    raise UsageError(f"part {part.id} has no port called {tail!r}; its ports are: {has}")


def parse_fix(assembly: Assembly, text: str) -> Support:
    """Return the support that ``--fix PART`` or ``--fix PART:PORT`` asks for.

    A part is held as a whole, at its centroid; a port is held at its middle, in all six motions.

    Raises
    ------
    UsageError
        As `find_place`.
    """
    place = find_place(assembly, text)
    if place.port is None:
        return Support(place.part)
    part = assembly.parts[place.part]
    port = next(port for port in part.ports if port.name == place.port)
    return Support(place.part, point=part.pose.points(port.position))
