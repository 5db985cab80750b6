"""Stiffnesses as a table names them, and the rows of the joint matrix that each one decides."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from technic.assembly.joint_types import MOTION_NAMES, JointType
from technic.assembly.model import Joint
from technic.assembly.stiffness import SLOTS
from technic.geometry import Array
from technic.system.assemble import System

__all__ = ["Parameter", "parameter_rows", "parameter_shares"]


@dataclass(frozen=True, slots=True, order=True)
class Parameter:
    """A stiffness that can be measured: the motion of a connection, e.g. shear of pin/pin_hole."""

    connection: str
    motion: str

    def __str__(self) -> str:
        return f"{self.motion} of {self.connection}"


def parameter_rows(
    system: System, parameters: Sequence[Parameter]
) -> tuple[NDArray[np.int64], NDArray[np.int64]]:
    """Return the rows of ``A`` that a parameter decides, and which one, each (r,)."""
    index = {(p.connection, slot): k for k, p in enumerate(parameters) for slot in SLOTS[p.motion]}
    joints = system.assembly.joints
    found = [
        (row, index[joints[link].connection, int(motion)])
        for row, (link, motion) in enumerate(zip(system.rows.link, system.rows.motion, strict=True))
        if link < len(joints) and (joints[link].connection, int(motion)) in index
    ]
    chosen = np.array(found, dtype=np.int64).reshape(-1, 2)
    return chosen[:, 0], chosen[:, 1]


def parameter_shares(
    system: System, parameters: Sequence[Parameter]
) -> tuple[NDArray[np.int64], NDArray[np.int64], Array]:
    """Return rows of finite stiffness, the parameter that each is made of, and how much of it, each (r,).

    Most rows have the stiffness of one parameter. Several studs between the same two parts act through
    their lever arms: ``spin = k_shear sum(r^2)`` and ``tilt = n k_tilt + k_axial sum(z^2)``
    (`technic.ldraw.connect`), so that the rows of their rotations are made of two, and stand here twice.
    """
    index = {(p.connection, p.motion): k for k, p in enumerate(parameters)}
    joints, elastic = system.assembly.joints, system.elastic
    found = []
    for row, (link, motion) in enumerate(zip(system.rows.link, system.rows.motion, strict=True)):
        if link >= len(joints) or not elastic[row]:
            continue
        joint = joints[link]
        for name, share in _made_of(joint, int(motion)):
            if share > 0.0 and (joint.connection, name) in index:
                found.append((row, index[joint.connection, name], share))
    chosen = np.array(found, dtype=float).reshape(-1, 3)
    return chosen[:, 0].astype(np.int64), chosen[:, 1].astype(np.int64), chosen[:, 2]


def _made_of(joint: Joint, slot: int) -> list[tuple[str, float]]:
    """Return the motions of a single connection that a joint's stiffness is made of, and their shares."""
    k = joint.stiffness
    several = joint.connection == "stud/tube" and joint.type is JointType.FIXED
    if slot < 3 or not several or not np.isfinite(k).all() or k[1] <= 0.0:
        return [(MOTION_NAMES[slot], 1.0)]
    if slot == 3:
        return [("shear", 1.0)]
    # the sum of both tilts is 2 n k_tilt + k_axial sum(r^2), and k[0] / k[1] is k_axial / k_shear
    own = 0.5 * float(k[4] + k[5] - k[3] * k[0] / k[1])
    tilt = min(max(own / float(k[slot]), 0.0), 1.0)
    return [("tilt", tilt), ("axial", 1.0 - tilt)]
