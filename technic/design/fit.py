"""Can a candidate be built: what is in the way, and from where its pins go in."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from technic.assembly.model import Assembly
from technic.design.apply import Change
from technic.design.candidates import Candidate
from technic.design.collide import Surroundings, pin_length, push_side, solid_overlaps
from technic.design.sites import SHORT_PIN
from technic.errors import UsageError
from technic.geometry import Array
from technic.parts.catalogue import catalogue

__all__ = ["Fit", "fit", "still_apart"]


@dataclass(frozen=True, slots=True)
class Fit:
    """Whether a candidate can be built.

    Parameters
    ----------
    reason : str
        Why not; empty when it can.
    sides : tuple of str
        For each new pin the side from which it can be pushed in: ``"+x"`` to ``"-z"``.
    """

    reason: str = ""
    sides: tuple[str, ...] = ()

    def __bool__(self) -> bool:
        return not self.reason


def fit(surroundings: Surroundings, candidate: Candidate, change: Change) -> Fit:
    """Return whether a candidate can be built among the parts of the model."""
    old = {a.fastening.old_pin for a in candidate.attachments} - {-1}
    if surroundings.hits(candidate.definition, change.added[0].pose, old):
        return Fit("a part is in the way of the beam")
    sides = []
    new_pins = iter(change.added[1:])
    for attachment in candidate.attachments:
        fastening = attachment.fastening
        if fastening.kind == "present":
            continue
        pin = next(new_pins)
        definition = catalogue().get(pin.number)
        if definition is None:
            raise UsageError(f"part {pin.number} is not in the catalogue")
        if surroundings.hits(definition, pin.pose, {*fastening.parts, *old}):
            return Fit("a part is in the way of a pin")
        middle = pin.pose.translation
        # a pin with unlike ends has its collar between them: it goes in from its short end's side
        ways = (fastening.sign,) if pin.number == SHORT_PIN else (1, -1)
        side = push_side(
            surroundings, middle, candidate.axis, pin_length(pin.number), old, ways=ways
        )
        if side == 0:
            return Fit("a pin cannot be pushed in from either side")
        sides.append(_side(side * candidate.axis))
    return Fit(sides=tuple(sides))


def _side(direction: Array) -> str:
    axis = int(np.argmax(np.abs(direction).round(9)))
    return f"{'+' if direction[axis] > 0 else '-'}{'xyz'[axis]}"


def still_apart(made: Assembly, added: int) -> bool:
    """Return whether the last `added` parts of a reinforced model share no space with any other."""
    count = len(made.parts)
    return not solid_overlaps(made, range(count - added, count))
