"""Is a body a wheel? Found from where its mass lies, not from its name."""

from __future__ import annotations

import numpy as np

from technic.assembly.model import Part
from technic.geometry import Array
from technic.tolerances import WHEEL_BALANCE, WHEEL_ROUNDNESS

__all__ = ["is_rotor"]


def is_rotor(parts: list[Part], point: Array, direction: Array) -> bool:
    """Tell whether a body that turns about a line is a wheel, gear or rotor rather than a lever.

    It is when one of its parts that are not fasteners, or all of them together, is balanced about the
    line and has the same moment of inertia about every axis across it.

    Parameters
    ----------
    parts : list of Part
    point, direction : (3,) ndarray
        The line, world coordinates (m).
    """
    solid = [p for p in parts if not p.fastener]
    return any(_round([p], point, direction) for p in solid) or _round(solid, point, direction)


def _round(parts: list[Part], point: Array, direction: Array) -> bool:
    mass = sum(p.mass_properties.mass for p in parts)
    if mass <= 0.0:
        return False
    centroid = sum((p.mass_properties.mass * p.centroid for p in parts), np.zeros(3)) / mass
    arm = centroid - point
    if np.linalg.norm(arm - (arm @ direction) * direction) > WHEEL_BALANCE:
        return False
    inertia = np.zeros((3, 3))
    for p in parts:
        q = p.pose.rotation
        d = p.centroid - centroid
        inertia += q @ p.mass_properties.inertia @ q.T
        inertia += p.mass_properties.mass * ((d @ d) * np.eye(3) - np.outer(d, d))
    # second moments of mass across the line: a round body has equal ones and no product
    across = np.linalg.svd(direction[None])[2][1:]
    second = across @ (np.trace(inertia) / 2 * np.eye(3) - inertia) @ across.T
    half, spread = np.trace(second) / 2, np.linalg.norm(second - np.trace(second) / 2 * np.eye(2))
    return bool(spread <= WHEEL_ROUNDNESS * half)
