"""From an LDraw file to an assembly: placements, part definitions, joints, and what was found.

Nothing gets lost: every placement of the file ends as a part, as an unknown part, or as a piece of
something flexible, and the assembly lists all three.
"""

from __future__ import annotations

from collections import Counter
from collections.abc import Callable, Mapping
from dataclasses import dataclass, replace
from pathlib import Path
from typing import TYPE_CHECKING, Literal

from technic.assembly.model import (
    Assembly,
    Finding,
    FindingKind,
    ImportedPart,
    ImportSummary,
    Joining,
    Part,
    Source,
    UnknownPart,
)
from technic.assembly.overrides import read_overrides
from technic.assembly.stiffness import StiffnessTable, default_table
from technic.errors import InputError, UsageError
from technic.geometry import Pose
from technic.ldraw.connect import AxleSlide
from technic.ldraw.document import Document, Placement, placements, poses, read
from technic.ldraw.finder import LibrarySource, PartFinder, ShadowSource
from technic.ldraw.hoses import beside_flexible
from technic.ldraw.inner import InnerMotion, divide
from technic.ldraw.joining import join
from technic.parts.definition import LIBRARY_FAMILY, PartDefinition

if TYPE_CHECKING:
    from technic.ldraw.imported import Solids

__all__ = ["Reading", "load_ldraw", "lookup", "read_parts"]

Gears = Literal["off", "on"]

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
    library: LibrarySource = None,
    shadow: ShadowSource = None,
    gears: Gears = "off",
    inner: InnerMotion = "held",
    overrides: str | Path | None = None,
    solids: Solids = "draft",
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
    library : Library or callable, optional
        LDraw parts library for parts that the catalogue does not have, or a function that opens it,
        called when the first such part is met.
    shadow : ShadowLibrary or callable, optional
        LDCad shadow library: connectors of the library's parts.
    gears : {"off", "on"}
        Whether gears in mesh turn each other, or each by itself.
    inner : {"held", "free"}
        Whether motors and actuators hold their position or move freely.
    overrides : path-like, optional
        File of corrections to what is found; see `assembly.overrides`.
    solids : {"draft", "fine", "off"}
        How finely parts of the library are meshed when an analysis wants solid models of parts; off:
        they are rigid bodies.

    Returns
    -------
    Assembly

    Raises
    ------
    InputError
        The file cannot be understood, or has no part that is known.
    """
    document = read(path)
    if solids not in ("draft", "fine", "off"):
        raise UsageError(f"solids is 'draft', 'fine' or 'off', not {solids!r}")
    find = PartFinder(library, shadow, document, solids=solids)
    if gears not in ("off", "on"):
        raise UsageError(f"gears is 'off' or 'on', not {gears!r}")
    if inner not in ("held", "free"):
        raise UsageError(f"inner is 'held' or 'free', not {inner!r}")
    reading = read_parts(document, find, find.refused)
    if not reading.parts:
        raise InputError(
            _nothing_known(reading),
            path=path,
            line=reading.placements[0].line,
            remedy="Give an LDraw parts library, from which unknown parts can be read."
            if find.library is None
            else "The parts library does not have them either.",
        )
    whole = divide(reading.parts, inner)
    assembly = Assembly(
        name=Path(document.main.name).stem,
        parts=whole.parts,
        joints=whole.joints,
        unknown=reading.unknown,
        findings=(*reading.findings, *whole.findings),
        source={"path": str(path), "sha256": document.sha256, "format": "ldraw"},
        imported=_summary(reading.parts, find, searched=library is not None),
    )
    corrections = None if overrides is None else read_overrides(overrides)
    how = Joining(table or default_table(), axle_slide, gears, corrections, str(overrides or ""))
    joined = join(assembly, how)
    return replace(joined, findings=beside_flexible(joined, reading.flexible))


def lookup(library: LibrarySource = None, shadow: ShadowSource = None) -> PartFinder:
    """Return what finds a part: in the catalogue, else in the library when given."""
    return PartFinder(library, shadow)


def _summary(parts: tuple[Part, ...], find: PartFinder, *, searched: bool) -> ImportSummary:
    counts: Counter[str] = Counter()
    definitions: dict[str, PartDefinition] = {}
    for part in parts:
        assert part.definition is not None  # the reader gives every part one
        if part.definition.family == LIBRARY_FAMILY:
            counts[part.definition.id] += 1
            definitions[part.definition.id] = part.definition
    library = find.library
    return ImportSummary(
        library="" if library is None else str(library.path),
        release="" if library is None else library.release(),
        shadow="" if find.shadow is None else str(find.shadow.store.path),
        searched=searched,
        catalogue=len(parts) - counts.total(),
        from_library=tuple(
            ImportedPart(number, definitions[number].title, count, definitions[number].source)
            for number, count in sorted(counts.items(), key=lambda item: (-item[1], item[0]))
        ),
    )


def read_parts(
    document: Document, find: Lookup, refused: Mapping[str, str] | None = None
) -> Reading:
    """Return the parts of a document, and everything in it that is none.

    Parameters
    ----------
    document : Document
    find : callable
        From a part number to its definition and the pose of the definition's frame in the frame of
        that number; None for an unknown one.
    refused : mapping, optional
        Why parts are unknown although there is a file of theirs; read after all were looked up.
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
            UnknownPart(number, tuple(p.line for p in group), _reason(group[0], refused))
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


def _reason(placement: Placement, refused: Mapping[str, str] | None) -> str:
    if refused and placement.number in refused:
        return refused[placement.number]
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
