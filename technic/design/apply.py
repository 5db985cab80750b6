"""From a candidate to the model with it: as an assembly, and as the text of a model file.

Both come from the same places, rounded as a file writes them, and the same matching of pins and holes,
so a file read again gives what was promised.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Final

import numpy as np

from technic.assembly.model import Assembly, Part, Source
from technic.design.candidates import Candidate
from technic.design.sites import NEW
from technic.errors import UsageError
from technic.geometry import Pose, nearest_orthogonal
from technic.ldraw.document import read
from technic.ldraw.joining import rejoin
from technic.ldraw.sections import document_from_text
from technic.ldraw.syntax import Text
from technic.ldraw.write import DECIMALS, NewPart, append_parts, save
from technic.parts.catalogue import catalogue
from technic.units import LDU

__all__ = [
    "HIGHLIGHT",
    "Change",
    "change_of",
    "extend",
    "new_part",
    "reinforced_text",
    "write_reinforced",
]

HIGHLIGHT: Final = 25
"""Orange: the colour of new parts, rare enough in models to stand out."""


@dataclass(frozen=True, slots=True, eq=False)
class Change:
    """What a suggestion does to a model.

    Parameters
    ----------
    added : tuple of NewPart
        The beam first, then its pins.
    removed : tuple of str
        Ids of present pins that longer ones replace.
    """

    added: tuple[NewPart, ...]
    removed: tuple[str, ...]


def change_of(assembly: Assembly, candidate: Candidate, *, color: int = HIGHLIGHT) -> Change:
    """Return the parts that a candidate adds and removes."""
    added = [NewPart(candidate.number, color, candidate.pose)]
    removed = []
    for attachment in candidate.attachments:
        fastening = attachment.fastening
        if fastening.kind == "present":
            continue
        shift = fastening.center - float(np.dot(attachment.line_point, candidate.axis))
        place = np.asarray(attachment.line_point) + shift * candidate.axis
        turn = _pin_rotation(fastening.sign * candidate.axis)
        added.append(NewPart(fastening.pin, color, Pose(turn, place)))
        if fastening.kind == "exchange":
            removed.append(assembly.parts[fastening.old_pin].id)
    return Change(tuple(_as_written(part) for part in added), tuple(sorted(removed)))


def _pin_rotation(axis: np.ndarray) -> np.ndarray:
    """Return the rotation of a pin, which lies along its own x."""
    helper = np.zeros(3)
    helper[int(np.argmin(np.abs(axis).round(9)))] = 1.0
    across = np.cross(axis, helper)
    across /= np.linalg.norm(across)
    return np.column_stack([axis, across, np.cross(axis, across)]) + 0.0


def _as_written(part: NewPart) -> NewPart:
    """Return a part with the pose that reading its line gives."""
    rotation = nearest_orthogonal(part.pose.rotation.round(DECIMALS) + 0.0)
    translation = (part.pose.translation / LDU).round(DECIMALS) * LDU + 0.0
    return replace(part, pose=Pose(rotation, translation))


def extend(assembly: Assembly, changes: Sequence[Change]) -> Assembly:
    """Return the assembly with changes made, its connections found anew.

    Parameters
    ----------
    assembly : Assembly
        Read from an LDraw model.
    changes : sequence of Change
    """
    gone = {name for change in changes for name in change.removed}
    parts = [p for p in assembly.parts if p.id not in gone]
    steps = [p.source.step for p in parts if p.source is not None and not p.source.lines[1:]]
    step = max(steps, default=0) + 1
    number = 0
    for change in changes:
        for new in change.added:
            number += 1
            parts.append(new_part(new, number, step))
    return rejoin(assembly, parts)


def new_part(new: NewPart, number: int, step: int) -> Part:
    """Return a new part as reading its line gives it; `number` counts the new parts from 1."""
    entry = catalogue().resolve(new.number)
    if entry is None:
        raise UsageError(f"part {new.number} is not in the catalogue")
    definition, inner = entry
    return Part(
        id=f"{NEW}/{number}:{new.number}",
        number=new.number,
        name=definition.title,
        pose=new.pose @ inner,
        ports=definition.ports,
        body=definition.body,
        mass_properties=definition.mass_properties,
        fastener=definition.fastener,
        color=new.color,
        source=Source(NEW, number, step, (number,)),
        definition=definition,
    )


def reinforced_text(path: str | Path, assembly: Assembly, changes: Sequence[Change]) -> Text:
    """Return the model file's text with changes made.

    Lines stay as they are, but for those of exchanged pins: each becomes a comment that holds the old
    line, so that line numbers stay and nothing is lost.
    """
    document = read(path)
    gone = {name for change in changes for name in change.removed}
    lines = sorted(p.source.line for p in assembly.parts if p.id in gone and p.source is not None)
    if lines:
        pieces = document.source.text.splitlines(keepends=True)
        for line in lines:
            pieces[line - 1] = f"0 // exchanged for a longer pin: {pieces[line - 1]}"
        document = document_from_text(replace(document.source, text="".join(pieces)), path)
    return append_parts(document, [part for change in changes for part in change.added])


def write_reinforced(
    path: str | Path, target: str | Path, assembly: Assembly, changes: Sequence[Change]
) -> None:
    """Write the model with changes made.

    Raises
    ------
    UsageError
        The target is the model itself, or cannot be written.
    """
    if Path(target).resolve() == Path(path).resolve():
        raise UsageError("the reinforced model must not replace the model: name another file")
    save(target, reinforced_text(path, assembly, changes))
