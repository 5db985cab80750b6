"""From an LDraw file to an assembly: placements, part definitions, joints, and what was found.

Nothing gets lost: every placement of the file ends as a part, as an unknown part, or as a piece of
something flexible, and the assembly lists all three.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING

from technic.assembly.model import Assembly, Finding, FindingKind, Part, Source, UnknownPart
from technic.assembly.stiffness import StiffnessTable, default_table
from technic.errors import InputError, UsageError
from technic.geometry import Pose
from technic.ldraw.connect import AxleSlide, connect
from technic.ldraw.document import Document, Placement, placements, poses, read
from technic.parts.catalogue import catalogue
from technic.parts.definition import PartDefinition

if TYPE_CHECKING:
    from technic.ldraw.library import Library
    from technic.ldraw.shadow import ShadowLibrary

__all__ = ["Reading", "load_ldraw", "read_parts"]

Lookup = Callable[[str], tuple[PartDefinition, Pose] | None]


@dataclass(frozen=True, slots=True, eq=False)
class Reading:
    """The parts of a document before they are joined.

    Parameters
    ----------
    document : Document
    placements : tuple of Placement
        Everything that the file places.
    parts : tuple of Part
    unknown : tuple of UnknownPart
        By number, most frequent first.
    flexible : dict of str to tuple of Placement
        Pieces of flexible things, by what they are a piece of.
    findings : tuple of Finding
        About the file, not about connections.
    """

    document: Document
    placements: tuple[Placement, ...]
    parts: tuple[Part, ...]
    unknown: tuple[UnknownPart, ...]
    flexible: dict[str, tuple[Placement, ...]]
    findings: tuple[Finding, ...]


def load_ldraw(
    path: str | Path,
    *,
    axle_slide: AxleSlide = "held",
    table: StiffnessTable | None = None,
    library: Library | None = None,
    shadow: ShadowLibrary | None = None,
) -> Assembly:
    """Read an LDraw model and find its connections.

    Parameters
    ----------
    path : path-like
        ``.ldr``, ``.mpd``, ``.dat`` or a Studio archive ``.io``.
    axle_slide : {"held", "free"}
        Whether parts that grip an axle stay where they are on it.
    table : StiffnessTable, optional
        Default: the shipped one.
    library : Library, optional
        LDraw parts library for parts that the catalogue does not have.
    shadow : ShadowLibrary, optional
        LDCad shadow library: connectors of the library's parts.

    Returns
    -------
    Assembly

    Raises
    ------
    InputError
        The file cannot be understood, or has no part that is known.
    """
    reading = read_parts(read(path), lookup(library, shadow))
    if not reading.parts:
        raise InputError(
            _nothing_known(reading),
            path=path,
            line=reading.placements[0].line,
            remedy="Give an LDraw parts library, from which unknown parts can be read."
            if library is None
            else "The parts library does not have them either.",
        )
    joints, findings = connect(reading.parts, table or default_table(), axle_slide=axle_slide)
    document = reading.document
    return Assembly(
        name=Path(document.main.name).stem,
        parts=reading.parts,
        joints=joints,
        unknown=reading.unknown,
        findings=(*reading.findings, *findings),
        source={"path": str(path), "sha256": document.sha256, "format": "ldraw"},
    )


def lookup(library: Library | None = None, shadow: ShadowLibrary | None = None) -> Lookup:
    """Return the function that finds a part: in the catalogue, else in the library when given."""
    shipped = catalogue()
    if library is None and shadow is not None:
        raise UsageError("the shadow library adds to an LDraw library: give that too")
    if library is None:
        return shipped.resolve
    from technic.ldraw.imported import definition_from_library

    found: dict[str, tuple[PartDefinition, Pose] | None] = {}

    def resolve(number: str) -> tuple[PartDefinition, Pose] | None:
        if number not in found:
            entry = shipped.resolve(number)
            if entry is None:
                made = definition_from_library(library, number, shadow=shadow)
                entry = None if made is None else (made, Pose.identity())
            found[number] = entry
        return found[number]

    return resolve


def read_parts(document: Document, find: Lookup) -> Reading:
    """Return the parts of a document, and everything in it that is none.

    Parameters
    ----------
    document : Document
    find : callable
        From a part number to its definition and the pose of the definition's frame in the frame of
        that number; None for an unknown one.
    """
    placed = placements(document, lambda number: find(number) is not None)
    solid = [placement for placement in placed if placement.flexible is None]
    parts: list[Part] = []
    unknown: dict[str, list[Placement]] = {}
    for placement, pose in zip(solid, poses(solid), strict=True):
        entry = find(placement.number)
        if entry is None:
            unknown.setdefault(placement.number, []).append(placement)
        else:
            parts.append(_part(placement, *entry, pose))
    findings = [
        *(_flexible(label, pieces) for label, pieces in placed.flexible.items()),
        *(Finding(FindingKind.WARNING, _notice(n.message, n.lines)) for n in placed.notices),
    ]
    return Reading(
        document,
        tuple(placed),
        tuple(parts),
        tuple(
            UnknownPart(number, tuple(p.line for p in group), _reason(group[0]))
            for number, group in sorted(unknown.items(), key=lambda item: (-len(item[1]), item[0]))
        ),
        placed.flexible,
        tuple(findings),
    )


def _part(placement: Placement, definition: PartDefinition, inner: Pose, pose: Pose) -> Part:
    return Part(
        id=placement.id,
        number=placement.number,
        name=definition.title,
        pose=pose @ inner,
        ports=definition.ports,
        body=definition.body,
        mass_properties=definition.mass_properties,
        fastener=definition.fastener,
        color=placement.color,
        source=Source(placement.submodel, placement.line, placement.step, placement.lines),
        definition=definition,
    )


def _reason(placement: Placement) -> str:
    if placement.missing:
        return "submodel not found"
    if placement.embedded is not None:
        return "drawn in the file, its connectors are not known"
    return "no definition"


def _flexible(label: str, pieces: tuple[Placement, ...]) -> Finding:
    count = "1 piece" if len(pieces) == 1 else f"{len(pieces)} pieces"
    numbers = ", ".join(sorted({piece.number for piece in pieces}))
    kind, found, path = label.partition(" in ")
    where = f"{kind}{found}{path.rpartition('/')[2]}"
    lines = f"line {pieces[0].line}" + (f" to {pieces[-1].line}" if len(pieces) > 1 else "")
    message = f"{where}: flexible, not modelled ({count}: {numbers}; {lines})"
    return Finding(FindingKind.FLEXIBLE, message)


def _notice(message: str, lines: tuple[int, ...]) -> str:
    if not lines:
        return message
    shown = ", ".join(map(str, lines[:8]))
    more = f" and {len(lines) - 8} more" if len(lines) > 8 else ""
    return f"{message} (line {shown}{more})"


def _nothing_known(reading: Reading) -> str:
    numbers = ", ".join(f"{part.number} ({part.count}x)" for part in reading.unknown[:8])
    more = f" and {len(reading.unknown) - 8} more" if len(reading.unknown) > 8 else ""
    if not numbers:
        return "everything in the model is flexible: there is nothing to analyze"
    return f"none of the model's parts is known: {numbers}{more}"
