"""What a set of small rigid motions is geometrically: rotation, translation, screw, or none of them."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from technic.geometry import Array, cross, shift_twist
from technic.rigidity.result import MotionType
from technic.tolerances import MOTION_KIND_CUT

__all__ = ["TwistShape", "describe_twists"]


@dataclass(frozen=True, slots=True, eq=False)
class TwistShape:
    """Type and axis of a motion; `pitch` is the advance per radian of a screw (m)."""

    type: MotionType
    point: Array | None
    direction: Array | None
    pitch: float


def describe_twists(points: Array, twists: Array, length: float) -> TwistShape:
    """Describe the motion of bodies.

    Parameters
    ----------
    points : (n, 3) ndarray
        Where the twists are taken (m).
    twists : (n, 6) ndarray
    length : float
        Length that makes rotations comparable with translations (m).

    Returns
    -------
    TwistShape
        "general" when the bodies do not move as one. The axis point is the point of the axis nearest
        to the bodies' middle.
    """
    middle = points.mean(axis=0)
    moved = twists
    if len(points) > 1:
        moved = np.einsum("nij,nj->ni", shift_twist(middle - points), twists)
    weight = np.array([1.0] * 3 + [length] * 3)
    size = float((np.abs(moved) * weight).max())
    if len(points) > 1 and (np.abs(moved - moved[0]) * weight).max() > MOTION_KIND_CUT * size:
        return TwistShape(MotionType.GENERAL, None, None, 0.0)
    u, theta = moved[0, :3], moved[0, 3:]
    angle = float(np.linalg.norm(theta))
    if length * angle < MOTION_KIND_CUT * size:
        return TwistShape(MotionType.TRANSLATION, None, u / np.linalg.norm(u), 0.0)
    direction = theta / angle
    pitch = float(u @ direction) / angle
    point = middle + cross(direction, u) / angle
    if abs(pitch) < MOTION_KIND_CUT * length:
        return TwistShape(MotionType.ROTATION, point, direction, 0.0)
    return TwistShape(MotionType.SCREW, point, direction, pitch)
