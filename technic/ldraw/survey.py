"""What every reference of a document means, found once per section, before anything is expanded.

A `Plan` says for each reference of a section whether it is a part or a submodel. The survey over all
plans finds what must not be expanded: files that include themselves, and documents that would
unfold into more parts than memory has room for.
"""

from __future__ import annotations

import re
from collections import Counter
from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path
from typing import Final

import numpy as np

from technic.errors import InputError
from technic.geometry import Array
from technic.ldraw.flexible import FlexibleState, content_kind, segment_kind
from technic.ldraw.sections import Document, Notice, Section, read
from technic.ldraw.syntax import Drawing, Meta, Reference, normalise, number_of

__all__ = ["MAX_DEPTH", "MAX_PARTS", "Item", "Plan", "Surveyor"]

MAX_DEPTH: Final = 256
"""Deepest nesting of submodels. The deepest of 105 public models has fewer than 20 levels."""

MAX_PARTS: Final = 250_000
"""Most parts, and most submodel instances, of one model. The biggest public ones have about 50,000
parts; a file of 60 lines that doubles itself in each submodel would have 2^60."""

MAX_FILES: Final = 1000
"""Most files beside the model that are opened."""

SINGULAR: Final = 1e-6
"""A matrix is singular when its determinant is below this, relative to its columns' lengths: six
decimals, as files have them, cannot tell such a volume from none."""


@dataclass(frozen=True, slots=True, eq=False)
class Item:
    """A reference and what it means.

    Parameters
    ----------
    reference : Reference
    number : str
        Normalised part number.
    target : Section or None
        The submodel; None for a part.
    embedded : Section or None
        The part's own drawing.
    known, missing : bool
        See `document.Placement`.
    step : int
    kind : str or None
        What flexible thing it is a piece of.
    occurrence : int
        This is the n-th reference to that name in the section.
    """

    reference: Reference
    number: str
    target: Section | None
    embedded: Section | None
    known: bool
    missing: bool
    step: int
    kind: str | None
    occurrence: int


@dataclass(frozen=True, slots=True, eq=False)
class Plan:
    """The references of one section: ``matrices`` (k, 3, 3), ``positions`` (k, 3) in LDU."""

    items: tuple[Item, ...]
    matrices: Array
    positions: Array
    notices: tuple[Notice, ...]


_HIDDEN: Final = re.compile(r"[ \t]*0[ \t]+(?:0[ \t]+|MLCAD[ \t]+HIDE[ \t]+|GHOST[ \t]+)+1[ \t].*")


@dataclass(slots=True)
class _Shown:
    """References shown so far, newest first: a linked list, so that a buffer is stored in no time."""

    reference: Reference
    step: int
    state: tuple[str | None, str | None]
    before: _Shown | None


class Surveyor:
    """Plans of all sections of a document, each made when first asked for.

    Parameters
    ----------
    document : Document
    knows : callable
        Whether a part number is known.
    """

    def __init__(self, document: Document, knows: Callable[[str], bool]) -> None:
        self._document = document
        self._knows_number = knows
        self._known: dict[str, bool] = {}
        self._plans: dict[int, Plan] = {}
        self._reached: dict[int, Section] = {}
        self._files: dict[Path, Document] = {}
        self._folder: dict[Path, dict[str, Path]] = {}

    # --- one section --------------------------------------------------------------------------
    def plan(self, section: Section) -> Plan:
        """Return the plan of a section."""
        plan = self._plans.get(id(section))
        if plan is None:
            plan = self._plans[id(section)] = self._make(section)
        return plan

    def _knows(self, number: str) -> bool:
        known = self._known.get(number)
        if known is None:
            known = self._known[number] = bool(self._knows_number(number))
        return known

    def _make(self, section: Section) -> Plan:
        shown, notices = self._walk(section)
        whole = content_kind(section.lines)
        seen: Counter[str] = Counter()
        items = []
        for entry in shown:
            reference = entry.reference
            name = normalise(reference.name)
            number = number_of(name)
            seen[name] += 1
            known = self._knows(number)
            found = self._resolve(section, name, known)
            submodel = found is not None and not found.is_part
            items.append(
                Item(
                    reference=reference,
                    number=number,
                    target=found if submodel else None,
                    embedded=None if submodel else found,
                    known=known and not submodel,
                    missing=found is None and not known and not name.endswith(".dat"),
                    step=entry.step,
                    kind=whole or entry.state[known] or segment_kind(number),
                    occurrence=seen[name],
                )
            )
        matrices = np.array([i.reference.matrix for i in items], dtype=float).reshape(-1, 3, 3)
        positions = np.array([i.reference.position for i in items], dtype=float).reshape(-1, 3)
        self._refuse_singular(section, items, matrices)
        return Plan(tuple(items), matrices, positions, tuple(notices))

    def _walk(self, section: Section) -> tuple[list[_Shown], list[Notice]]:
        """Return the references that are part of the finished section, with step and block."""
        step = 1
        flexible = FlexibleState()
        last: _Shown | None = None
        buffers: dict[str, _Shown | None] = {}
        hidden, drawn, all_lines = [], [], set()
        for line in section.lines:
            if isinstance(line, Reference):
                number = number_of(line.name)
                state = (flexible.kind(number, False), flexible.kind(number, True))
                last = _Shown(line, step, state, last)
                all_lines.add(line.number)
            elif isinstance(line, Drawing):
                drawn.append(line.number)
            elif isinstance(line, Meta):
                words = line.words
                if not words:
                    continue
                if words[0] in ("STEP", "ROTSTEP"):
                    step += 1
                elif words[0] in ("SYNTH", "MLCAD", "GHOST"):
                    flexible.feed(line)
                    if _HIDDEN.fullmatch(line.text):
                        hidden.append(line.number)
                elif words[0] in ("BUFEXCHG", "BUFEXG") and len(words) > 2:
                    # A buffer shows parts held beside the model for a step or two; what stands
                    # between STORE and RETRIEVE is gone from the finished model.
                    if words[2] == "STORE":
                        buffers[words[1]] = last
                    elif words[2] == "RETRIEVE" and words[1] in buffers:
                        last = buffers[words[1]]
        shown: list[_Shown] = []
        while last is not None:
            shown.append(last)
            last = last.before
        shown.reverse()
        where = f"in {section.name!r}"
        notices = []
        held = sorted(all_lines - {entry.reference.number for entry in shown})
        if held:
            notices.append(
                Notice(
                    f"{len(held)} parts {where} are only shown between building steps (buffer "
                    "exchange) and are no part of the model",
                    tuple(held),
                )
            )
        if hidden:
            notices.append(
                Notice(
                    f"{len(hidden)} parts {where} are hidden (MLCAD HIDE or GHOST) and left out; "
                    "unhide those that belong to the model",
                    tuple(hidden),
                )
            )
        if drawn:
            notices.append(
                Notice(
                    f"{len(drawn)} drawn lines and surfaces {where} belong to no part and are "
                    "left out",
                    tuple(drawn),
                )
            )
        return shown, notices

    def _refuse_singular(self, section: Section, items: list[Item], matrices: Array) -> None:
        """Raise `InputError` for the first singular matrix of a part or submodel."""
        if not items:
            return
        lengths = np.linalg.norm(matrices, axis=1)
        unit = matrices / np.maximum(lengths, 1e-30)[:, None, :]
        volume = np.abs((unit[:, :, 0] * np.cross(unit[:, :, 1], unit[:, :, 2])).sum(axis=1))
        singular = (volume < SINGULAR) | (lengths < SINGULAR).any(axis=1)
        for k in np.flatnonzero(singular):
            if items[k].kind is None:  # pieces of a hose are no bodies: their matrix is not used
                raise InputError(
                    f"the matrix of {items[k].reference.name!r} is singular: it flattens the part",
                    path=section.path,
                    line=items[k].reference.number,
                    remedy="Delete the part in the editor and place it again.",
                )

    # --- names --------------------------------------------------------------------------------
    def _resolve(self, section: Section, name: str, known: bool) -> Section | None:
        """Return the section that a name means: of the same file, else a file beside the model."""
        found = section.scope.get(name)
        if found is None and not known:
            document = self._beside(section.path.parent, name)
            found = None if document is None else document.main
        return found

    def _beside(self, folder: Path, name: str) -> Document | None:
        """Return a file in the model's folder (or below it), whatever its case; never outside."""
        pieces = name.split("/")
        if not name.endswith((".ldr", ".mpd", ".dat", ".l3b")) or any(
            piece in ("", ".", "..") or ":" in piece or "\0" in piece for piece in pieces
        ):
            return None
        path = folder
        for piece in pieces:
            following = self._entries(path).get(piece)
            if following is None:
                return None
            path = following
        if not path.is_file() or not path.resolve().is_relative_to(folder.resolve()):
            return None
        if path.resolve() == self._document.path.resolve():
            return self._document
        document = self._files.get(path)
        if document is None:
            if len(self._files) >= MAX_FILES:
                raise InputError(
                    f"the model refers to more than {MAX_FILES} files",
                    path=self._document.path,
                    remedy="Put the submodels into one .mpd file.",
                )
            document = self._files[path] = read(path)
        return document

    def _entries(self, folder: Path) -> dict[str, Path]:
        entries = self._folder.get(folder)
        if entries is None:
            try:
                entries = {path.name.lower(): path for path in sorted(folder.iterdir())}
            except OSError:  # no folder, or not ours to list: then there are no files beside it
                entries = {}
            self._folder[folder] = entries
        return entries

    # --- the whole document -------------------------------------------------------------------
    def check(self, max_parts: int) -> None:
        """Refuse what must not be expanded.

        Raises
        ------
        InputError
            A file that includes itself (directly or through others), nesting deeper than
            `MAX_DEPTH`, or more than `max_parts` parts or submodel instances.
        """
        main = self._document.main
        size: dict[int, int] = {}  # parts + instances below and with a section; exact, unbounded
        depth: dict[int, int] = {}
        active: dict[int, int] = {id(main): 0}  # sections on the way, with their place in it
        way: list[tuple[Section, list[Item], int]] = [(main, self._inner(main), 0)]
        while way:
            section, inner, k = way.pop()
            self._reached[id(section)] = section
            if k == len(inner):
                plan = self.plan(section) if not self._drawn(section) else None
                entered = [] if plan is None else [i.target for i in plan.items if i.target]
                leaves = 0 if plan is None else len(plan.items) - len(entered)
                size[id(section)] = 1 + leaves + sum(size[id(s)] for s in entered)
                depth[id(section)] = 1 + max((depth[id(s)] for s in entered), default=0)
                del active[id(section)]
                if depth[id(section)] > MAX_DEPTH:
                    raise self._too_deep(section)
                continue
            item = inner[k]
            child = item.target or item.embedded
            assert child is not None
            way.append((section, inner, k + 1))
            if id(child) in active:
                raise self._cycle([w[0] for w in way][active[id(child)] :], section, item)
            if id(child) in size:
                continue
            if len(way) > MAX_DEPTH:
                raise self._too_deep(child)
            active[id(child)] = len(way)
            way.append((child, self._inner(child), 0))
        total = size[id(main)]
        if total > max_parts:
            raise InputError(
                f"the model unfolds into {_count(total)} parts and submodels; at most "
                f"{max_parts:,} are expanded",
                path=self._document.path,
                line=main.start,
                remedy="Look for submodels that are used many times within each other.",
            )

    def _drawn(self, section: Section) -> bool:
        return section is not self._document.main and section.is_part

    def _inner(self, section: Section) -> list[Item]:
        """Return the items of a section that lead to other sections."""
        if not self._drawn(section):
            items = self.plan(section).items
            return [item for item in items if item.target or item.embedded]
        # The drawing of an embedded part: never expanded here, but it must not include itself.
        inner = []
        for reference in section.references:
            name = normalise(reference.name)
            if (found := section.scope.get(name)) is not None:
                inner.append(
                    Item(reference, number_of(name), None, found, False, False, 1, None, 1)
                )
        return inner

    def _cycle(self, around: list[Section], section: Section, item: Item) -> InputError:
        names = [s.name for s in around]
        shown = names if len(names) <= 8 else [*names[:4], "...", *names[-3:]]
        return InputError(
            f"{names[0]!r} includes itself: {' > '.join([*shown, names[0]])}",
            path=section.path,
            line=item.reference.number,
            remedy="Delete this line, or let it name another submodel.",
        )

    def _too_deep(self, section: Section) -> InputError:
        return InputError(
            f"submodels are nested more than {MAX_DEPTH} deep",
            path=section.path,
            line=section.start,
            remedy="Real models have fewer than 20 levels; save the model again in its editor.",
        )

    def notices(self) -> list[Notice]:
        """Return what is worth saying about the sections in use, and about those that are not."""
        result: list[Notice] = []
        for section in self._reached.values():
            if not self._drawn(section):
                result += self.plan(section).notices
        for document in self._files.values():
            result += document.notices
        for section in self._document.sections:
            count = len(section.references)
            if id(section) not in self._reached and count and not section.is_part:
                result.append(
                    Notice(
                        f"submodel {section.name!r} is not used by the model: {count} lines left out",
                        (section.start,),
                    )
                )
        return result


def _count(total: int) -> str:
    return f"{total:,}" if total < 10**15 else "more than 10^15"
