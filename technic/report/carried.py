"""Fasteners go along with what they hold: the twists of a motion, for pictures, with its pins.

A motion lists the bodies that it is about. A pin between two of them may turn in either, so it is in
neither's list; in a picture it must not stay behind in the air.
"""

from __future__ import annotations

from collections import defaultdict

import numpy as np

from technic.assembly.model import Assembly
from technic.geometry import Array, shift_twist
from technic.rigidity.result import Motion

__all__ = ["carried_twists"]


def carried_twists(assembly: Assembly, motion: Motion) -> Array:
    """Return the twist of every part about its centroid in a motion, fasteners carried along, (p, 6).

    A fastener that is not listed goes with a moving part it is joined to, unless it also sits in a
    part that stands still: at a joint both go the same way, up to the turning of the pin.
    """
    parts = assembly.parts
    twists = np.zeros((len(parts), 6))
    twists[list(motion.parts)] = motion.twists
    moving = set(motion.parts)
    neighbours: dict[int, list[int]] = defaultdict(list)
    for joint in assembly.joints:
        one, other = joint.parts
        neighbours[one].append(other)
        neighbours[other].append(one)

    def stands(k: int) -> bool:
        return k not in moving and not parts[k].fastener

    front = sorted(moving)
    while front:
        reached: list[int] = []
        for k in front:
            for pin in neighbours[k]:
                if pin in moving or not parts[pin].fastener:
                    continue
                if any(stands(other) for other in neighbours[pin]):
                    continue
                arm = parts[pin].centroid - parts[k].centroid
                twists[pin] = shift_twist(arm) @ twists[k]
                moving.add(pin)
                reached.append(pin)
        front = reached
    return twists
