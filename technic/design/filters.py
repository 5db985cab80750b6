"""What may be suggested: between which parts, where, and of which parts."""

from __future__ import annotations

from collections import Counter
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace

import numpy as np

from technic.assembly.model import Assembly, Part
from technic.design.apply import Change
from technic.design.candidates import Candidate
from technic.units import LDU

__all__ = ["Filters", "allowed", "carried_over", "needs"]


@dataclass(frozen=True, slots=True)
class Filters:
    """What may be suggested.

    Parameters
    ----------
    between : (int, int) or None
        Parts that the new beam must tie together.
    box : pair of points or None
        Opposite corners of the space that the holes of the beam must lie in (m).
    lengths : tuple of int or None
        Lengths of straight beams.
    bent : bool
        Offer bent beams.
    thin, frames : bool
        Offer thin beams, frames.
    snug : float
        Largest mismatch of holes (m).
    inventory : mapping of str to int or None
        How many of each part there are, by the catalogue's ids; parts that it does not name are not
        there.
    max_parts : int or None
        Most new parts of one suggestion, pins included.
    keep_out : frozenset of int
        Parts that nothing may be tied to (wheels, steering).
    """

    between: tuple[int, int] | None = None
    box: tuple[tuple[float, float, float], tuple[float, float, float]] | None = None
    lengths: tuple[int, ...] | None = None
    bent: bool = True
    thin: bool = False
    frames: bool = False
    snug: float = 0.0
    inventory: Mapping[str, int] | None = None
    max_parts: int | None = None
    keep_out: frozenset[int] = frozenset()


def needs(candidate: Candidate) -> Counter[str]:
    """Return the new parts of a candidate by number."""
    need = Counter([candidate.number])
    need.update(a.fastening.pin for a in candidate.attachments if a.fastening.pin)
    return need


def allowed(found: Sequence[Candidate], filters: Filters) -> list[Candidate]:
    """Return the candidates that the filters let through."""
    kept = []
    for candidate in found:
        if filters.between is not None and not set(filters.between) <= set(candidate.parts):
            continue
        if filters.max_parts is not None and 1 + candidate.fasteners > filters.max_parts:
            continue
        if filters.inventory is not None and not _in_stock(candidate, filters.inventory):
            continue
        if filters.box is not None and not _inside(candidate, filters.box):
            continue
        kept.append(candidate)
    return kept


def _in_stock(candidate: Candidate, inventory: Mapping[str, int]) -> bool:
    return all(inventory.get(number, 0) >= n for number, n in needs(candidate).items())


def _inside(candidate: Candidate, box: Sequence[Sequence[float]]) -> bool:
    low, high = np.minimum(*np.array(box)), np.maximum(*np.array(box))
    world = candidate.pose.points(np.array([p.position for p in candidate.definition.ports]))
    return bool((world >= low - LDU).all() and (world <= high + LDU).all())


def carried_over(
    filters: Filters, old: Assembly, new: Assembly, candidate: Candidate, change: Change
) -> Filters:
    """Return the filters for a model that a candidate has changed.

    Parts are named by their index in the changed model, and the inventory is less what was used and
    more the pins that longer ones replaced.
    """
    place = {part.id: k for k, part in enumerate(new.parts)}
    ids = [part.id for part in old.parts]
    inventory = filters.inventory
    if inventory is not None:
        left = Counter(inventory)
        left.subtract(needs(candidate))
        left.update(_plain(part) for part in old.parts if part.id in change.removed)
        inventory = dict(left)
    between = filters.between
    if between is not None:
        between = (place[ids[between[0]]], place[ids[between[1]]])
    keep_out = frozenset(place[ids[k]] for k in filters.keep_out if ids[k] in place)
    return replace(filters, inventory=inventory, between=between, keep_out=keep_out)


def _plain(part: Part) -> str:
    """Return the number that the catalogue knows a part by."""
    return part.number if part.definition is None else part.definition.id
