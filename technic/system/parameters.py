"""Stiffnesses as a table names them, and the rows of the joint matrix that each one decides."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from technic.assembly.stiffness import SLOTS
from technic.system.assemble import System

__all__ = ["Parameter", "parameter_rows"]


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
