"""From a document to a flat list of placed parts: nested submodels expanded, nothing lost.

`read` gives the document, `placements` its parts. Only submodels are entered; a reference to a part
(known to the caller, named ``.dat``, or embedded with a part's header) is a placement. Files that lie
beside the model are found too; nothing outside of the model's folder is ever opened.
"""

from __future__ import annotations

import re
from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass
from typing import Final

import numpy as np

from technic.errors import InputError
from technic.geometry import Array, Pose
from technic.ldraw.sections import Document, Notice, Section, document_from_text, read
from technic.ldraw.survey import MAX_DEPTH, MAX_PARTS, Item, Surveyor
from technic.tolerances import ROTATION_SCALED, ROTATION_WARNING
from technic.units import LDU

__all__ = [
    "MAX_DEPTH",
    "MAX_PARTS",
    "Document",
    "Notice",
    "Placement",
    "Placements",
    "Section",
    "document_from_text",
    "placements",
    "pose",
    "poses",
    "read",
]

_OMR: Final = re.compile(r"^\d+(-\d+)? - (?=\S)")

INHERIT: Final = 16
"""Colour code that means: the colour of the reference that leads here."""


@dataclass(frozen=True, slots=True, eq=False)
class Placement:
    r"""A part in its place in the world, in LDraw units and axes.

    Parameters
    ----------
    number : str
        Part number: the file name in lower case with ``/`` for ``\``, without ``.dat``.
    file_name : str
        As written.
    matrix : (3, 3) ndarray
        World from part, as the file has it: may be mirrored, askew or stretched.
    position : (3,) ndarray
        LDU.
    color : int
        Colour code after inheritance; 16 when nothing above says a colour.
    submodel : str
        Path of submodel names, the main model first. The second reference to the same submodel in
        a section is ``name#2``, so that the path is unique.
    line : int
        Line of the part in the file.
    chain : tuple of int
        Lines of the references that lead to its section, outermost first.
    step : int
        Building step within its section, counted from 1.
    section : Section
        The section it stands in.
    known : bool
        The caller knows this number.
    embedded : Section or None
        The part's own drawing, when the file (or one beside it) has it.
    missing : bool
        A submodel that is nowhere to be found.
    flexible : str or None
        Label of the flexible thing that it is a piece of; the same for all its pieces.
    scaled : bool
        The matrix stretches: no rigid part in a place.
    orthogonality_error : float
        Distance of the matrix to the nearest orthogonal one (largest |singular value - 1|).
    """

    number: str
    file_name: str
    matrix: Array
    position: Array
    color: int
    submodel: str
    line: int
    chain: tuple[int, ...]
    step: int
    section: Section
    known: bool
    embedded: Section | None
    missing: bool
    flexible: str | None
    scaled: bool
    orthogonality_error: float

    @property
    def lines(self) -> tuple[int, ...]:
        """Lines of the references that lead to the part, outermost first, its own line last."""
        return (*self.chain, self.line)

    @property
    def plain_number(self) -> str:
        """The number without a set number before it.

        The LDraw Official Model Repository embeds parts as ``<set> - <file>``: ``8002 - 33299a`` is
        part 33299a. Other numbers are returned as they are.
        """
        return _OMR.sub("", self.number)

    @property
    def id(self) -> str:
        """Stable and unique: ``<submodel path>/<line>:<part number>``."""
        return f"{self.submodel}/{self.line}:{self.number}"


@dataclass(frozen=True, slots=True, eq=False)
class Placements:
    """Parts of a document in file order (submodels where they are referenced), and notices."""

    parts: tuple[Placement, ...]
    notices: tuple[Notice, ...] = ()

    def __len__(self) -> int:
        return len(self.parts)

    def __iter__(self) -> Iterator[Placement]:
        return iter(self.parts)

    def __getitem__(self, index: int) -> Placement:
        return self.parts[index]

    @property
    def flexible(self) -> dict[str, tuple[Placement, ...]]:
        """Pieces of flexible things by label, in file order."""
        groups: dict[str, list[Placement]] = {}
        for part in self.parts:
            if part.flexible is not None:
                groups.setdefault(part.flexible, []).append(part)
        return {label: tuple(pieces) for label, pieces in groups.items()}


def pose(placement: Placement) -> tuple[Pose, float]:
    """Return the pose of a part in SI, its matrix projected to the nearest orthogonal one.

    Returns
    -------
    pose : Pose
        Rotation (or reflection) and translation in metres.
    error : float
        `Placement.orthogonality_error`.
    """
    return poses([placement])[0], placement.orthogonality_error


def poses(chosen: Sequence[Placement]) -> list[Pose]:
    """Return the poses of many parts; see `pose`."""
    if not chosen:
        return []
    u, _, vt = np.linalg.svd(np.stack([p.matrix for p in chosen]))
    rotations = u @ vt
    positions = np.stack([p.position for p in chosen]) * LDU
    return [Pose(q, t) for q, t in zip(rotations, positions, strict=True)]


# --- expansion --------------------------------------------------------------------------------
@dataclass(slots=True)
class _Frame:
    """A section in its place: one submodel instance while it is being expanded."""

    section: Section
    path: str
    chain: tuple[int, ...]
    color: int
    flexible: str | None
    items: tuple[Item, ...]
    matrices: Array
    positions: Array
    next: int = 0


@dataclass(frozen=True, slots=True)
class _Leaf:
    frame: _Frame
    index: int

    @property
    def item(self) -> Item:
        return self.frame.items[self.index]


def placements(
    document: Document, knows: Callable[[str], bool], *, max_parts: int = MAX_PARTS
) -> Placements:
    """Return every part of the document in its place.

    Parameters
    ----------
    document : Document
    knows : callable
        Whether a part number (normalised, without ``.dat``) is a part that the caller has.
    max_parts : int
        Most parts and submodel instances to expand.

    Raises
    ------
    InputError
        A file includes itself; nested too deeply; too many parts; a singular matrix; no part at
        all; a file beside the model that cannot be understood.
    """
    surveyor = Surveyor(document, knows)
    surveyor.check(max_parts)
    with np.errstate(over="ignore", invalid="ignore"):  # looked for, and refused, in _finish
        leaves = _expand(document, surveyor)
    notices = [*document.notices, *surveyor.notices()]
    if not leaves:
        raise InputError(
            "the model has no parts",
            path=document.path,
            line=document.main.start,
            remedy="An LDraw part is a line '1 colour x y z a b c d e f g h i file'"
            + ("; the parts found are hidden or not used: " if notices else ".")
            + "; ".join(n.message for n in notices),
        )
    parts = _finish(leaves)
    askew = [p for p in parts if not p.scaled and p.orthogonality_error > ROTATION_WARNING]
    if askew:
        worst = max(p.orthogonality_error for p in askew)
        notices.append(
            Notice(
                f"{len(askew)} parts have a rotation matrix that is no rotation (off by up to "
                f"{worst:.2g}); straightened to the nearest rotation",
                tuple(p.line for p in askew),
            )
        )
    return Placements(parts, tuple(notices))


def _frame(
    surveyor: Surveyor,
    section: Section,
    path: str,
    chain: tuple[int, ...],
    color: int,
    flexible: str | None,
    matrix: Array,
    position: Array,
) -> _Frame:
    plan = surveyor.plan(section)
    return _Frame(
        section,
        path,
        chain,
        color,
        flexible,
        plan.items,
        matrix @ plan.matrices,
        plan.positions @ matrix.T + position,
    )


def _expand(document: Document, surveyor: Surveyor) -> list[_Leaf]:
    """Walk the submodels depth first, in file order, without recursion."""
    main = document.main
    stack = [
        _frame(surveyor, main, main.name, (), INHERIT, None, np.eye(3), np.zeros(3)),
    ]
    leaves: list[_Leaf] = []
    while stack:
        frame = stack[-1]
        if frame.next == len(frame.items):
            stack.pop()
            continue
        index = frame.next
        frame.next += 1
        item = frame.items[index]
        if item.target is None:
            leaves.append(_Leaf(frame, index))
            continue
        reference = item.reference
        color = frame.color if reference.color == INHERIT else reference.color
        path = f"{frame.path}/{reference.name}"
        if item.occurrence > 1:
            path += f"#{item.occurrence}"
        flexible = frame.flexible
        if flexible is None and item.kind is not None:
            flexible = f"{item.kind} in {frame.path}"
        stack.append(
            _frame(
                surveyor,
                item.target,
                path,
                (*frame.chain, reference.number),
                color,
                flexible,
                frame.matrices[index],
                frame.positions[index],
            )
        )
    return leaves


def _finish(leaves: list[_Leaf]) -> tuple[Placement, ...]:
    """Measure the matrices of all parts at once, group what is flexible, and build the objects."""
    matrices = np.stack([leaf.frame.matrices[leaf.index] for leaf in leaves])
    positions = np.stack([leaf.frame.positions[leaf.index] for leaf in leaves])
    finite = np.isfinite(matrices).all(axis=(1, 2)) & np.isfinite(positions).all(axis=1)
    if not finite.all():
        leaf = leaves[int(np.argmin(finite))]
        raise InputError(
            f"the nested matrices that lead to {leaf.item.reference.name!r} overflow",
            path=leaf.frame.section.path,
            line=leaf.item.reference.number,
            remedy="A submodel above it is scaled beyond reason; correct its line.",
        )
    matrices.setflags(write=False)
    positions.setflags(write=False)
    errors = np.abs(np.linalg.svd(matrices, compute_uv=False) - 1.0).max(axis=1)
    stretched = errors > ROTATION_SCALED
    # All pieces of one number in one submodel belong together when any of them is stretched: an
    # unstretched link of a band is still a link.
    bands = {
        (leaf.frame.path, leaf.item.number)
        for leaf, scaled in zip(leaves, stretched, strict=True)
        if scaled
    }
    parts = []
    for k, leaf in enumerate(leaves):
        frame, item = leaf.frame, leaf.item
        flexible = frame.flexible
        if flexible is None and item.kind is not None:
            flexible = f"{item.kind} in {frame.path}"
        if flexible is None and (frame.path, item.number) in bands:
            flexible = f"stretched pieces in {frame.path}"
        color = item.reference.color
        parts.append(
            Placement(
                number=item.number,
                file_name=item.reference.name,
                matrix=matrices[k],
                position=positions[k],
                color=frame.color if color == INHERIT else color,
                submodel=frame.path,
                line=item.reference.number,
                chain=frame.chain,
                step=item.step,
                section=frame.section,
                known=item.known,
                embedded=item.embedded,
                missing=item.missing,
                flexible=flexible,
                scaled=bool(stretched[k]),
                orthogonality_error=float(errors[k]),
            )
        )
    return tuple(parts)
