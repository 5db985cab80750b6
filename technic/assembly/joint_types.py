"""Which of the six relative motions each joint type holds.

The order of the six is [axial, shear, shear, spin, tilt, tilt] in the joint's own axes: the first axis
is the line of a hinge, slider or cylindrical joint and the normal of a planar joint. For a universal
joint it is the common normal of its two axes, about which it holds the rotation. A slot is a hinge whose
pin can also slide across: the first axis is the pin's line, the second the direction of the slot. A mesh is
two gears with their teeth in each other: the first axis is the direction in which the teeth push.

In two dimensions only the motions in the plane z = 0 remain: a hinge about z holds both shears, a slider
along a line in the plane holds one shear and one tilt, a ball joint does what a hinge does.
"""

from __future__ import annotations

from enum import StrEnum
from typing import Final

__all__ = ["HELD", "MOTION_NAMES", "JointType"]

MOTION_NAMES: Final = ("axial", "shear", "shear", "spin", "tilt", "tilt")


class JointType(StrEnum):
    """The field's names for the joints."""

    FIXED = "fixed"
    HINGE = "hinge"
    SLIDER = "slider"
    CYLINDRICAL = "cylindrical"
    BALL = "ball"
    UNIVERSAL = "universal"
    PLANAR = "planar"
    SLOT = "slot"
    MESH = "mesh"


HELD: Final[dict[JointType, tuple[bool, bool, bool, bool, bool, bool]]] = {
    JointType.FIXED: (True, True, True, True, True, True),
    JointType.HINGE: (True, True, True, False, True, True),
    JointType.SLIDER: (False, True, True, True, True, True),
    JointType.CYLINDRICAL: (False, True, True, False, True, True),
    JointType.BALL: (True, True, True, False, False, False),
    JointType.UNIVERSAL: (True, True, True, True, False, False),
    JointType.PLANAR: (True, False, False, False, True, True),
    JointType.SLOT: (True, False, True, False, True, True),
    JointType.MESH: (True, False, False, False, False, False),
}
"""Held motions of each type in three dimensions."""
