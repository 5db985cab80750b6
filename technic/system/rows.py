"""The rows of the joint matrix: what each joint and support holds, as linear forms in twists."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from technic.assembly.model import Assembly
from technic.geometry import Array, shift_twist, turn_twist

__all__ = ["HeldRows", "held_rows", "transfer"]


@dataclass(frozen=True, slots=True, eq=False)
class HeldRows:
    """Held motions of all joints, then of all supports, one per row.

    Parameters
    ----------
    link : (r,) ndarray of int
        Joint index; supports count on after the joints.
    motion : (r,) ndarray of int
        Which of the six motions [axial, shear, shear, spin, tilt, tilt] the row holds.
    stiffness : (r,) ndarray
        N/m or N m/rad; infinite for a motion held rigidly.
    """

    link: NDArray[np.int64]
    motion: NDArray[np.int64]
    stiffness: Array


def held_rows(assembly: Assembly) -> HeldRows:
    """List the held motions. In two dimensions only motions in the plane z = 0 count."""
    held, stiffness = [], []
    for joint in assembly.joints:
        held.append(joint.held)
        stiffness.append(joint.stiffness)
    for support in assembly.supports:
        held.append(support.held)
        stiffness.append(np.full(6, np.inf))
    mask = np.array(held, dtype=bool).reshape(-1, 6)
    link, motion = np.nonzero(mask)
    values = np.array(stiffness, dtype=float).reshape(-1, 6)[link, motion]
    return HeldRows(link, motion, values)


def transfer(assembly: Assembly, origins: Array, *, world: bool) -> tuple[Array, Array]:
    """Return ``T`` of both sides of every joint and support.

    ``T`` turns the twist of a part's frame into relative motion in the joint's own axes at the joint's
    point (paper, section 4.1). Side b carries its minus sign; supports have no side b (zeros).

    Parameters
    ----------
    assembly : Assembly
    origins : (j + s, 2, 3) ndarray
        Reference point of the frame on each side, world coordinates (m).
    world : bool
        True when the frames' twists are in world axes, False when in part axes.

    Returns
    -------
    (j + s, 6, 6) ndarray, (j + s, 6, 6) ndarray
    """
    joints, supports = assembly.joints, assembly.supports
    if not joints and not supports:
        return np.zeros((0, 6, 6)), np.zeros((0, 6, 6))
    axes = np.array([j.axes for j in joints] + [np.eye(3)] * len(supports))
    points = np.array(
        [j.point for j in joints]
        + [assembly.parts[s.part].centroid if s.point is None else s.point for s in supports]
    )
    turn = np.zeros((len(axes), 6, 6))
    turn[:, :3, :3] = turn[:, 3:, 3:] = axes
    sides = []
    for side in (0, 1):
        t = turn @ shift_twist(points - origins[:, side])
        if not world:
            rotations = np.array(
                [assembly.parts[j.parts[side]].pose.rotation for j in joints]
                + [assembly.parts[s.part].pose.rotation for s in supports]
            )
            t = t @ turn_twist(rotations)
        sides.append(t)
    sides[1] = -sides[1]
    sides[1][len(joints) :] = 0.0
    return sides[0], sides[1]
