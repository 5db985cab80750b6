"""Strain energy per part: its own bending and half of each of its joints."""

from __future__ import annotations

import numpy as np

from technic.geometry import Array
from technic.rigidity.result import RigidityReport

__all__ = ["energy_shares"]


def energy_shares(report: RigidityReport) -> Array:
    """Return the share of the worst mode's strain energy that each part stands for, (p,).

    A joint belongs to two parts and its energy is split between them, so that the shares add up to
    1 as those of the weak spots do. All zero when there is no elastic mode.
    """
    shares = np.zeros(len(report.assembly.parts))
    for spot in report.weak_spots:
        for k in spot.parts:
            shares[k] += spot.energy_share / len(spot.parts)
    return shares
