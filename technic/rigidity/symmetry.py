"""Is a body a wheel? Found from where its mass lies, not from its name."""

from __future__ import annotations

import numpy as np

from technic.assembly.model import Part
from technic.geometry import Array
from technic.tolerances import WHEEL_BALANCE, WHEEL_ROUNDNESS

__all__ = ["is_rotor"]


def is_rotor(parts: list[Part], point: Array, direction: Array) -> bool:
    """Tell whether a body that turns about a line is a wheel, gear or rotor rather than a lever.

    It is when it is balanced about the line and one of its parts that are not fasteners, or all of them
    together, is round: has the same moment of inertia about every axis across the line. A boom or a
    crank fixed to a gear is not balanced, and stays a lever.

    Parameters
    ----------
    parts : list of Part
    point, direction : (3,) ndarray
        The line, world coordinates (m).
    """
    solid = [p for p in parts if not p.fastener]
    if not _balanced(solid, point, direction):
        return False
    return _round(solid, direction) or any(
        _balanced([p], point, direction) and _round([p], direction) for p in solid
    )


def _balanced(parts: list[Part], point: Array, direction: Array) -> bool:
    mass, centroid, _ = _together(parts)
    if mass <= 0.0:
        return False
    arm = centroid - point
    return bool(np.linalg.norm(arm - (arm @ direction) * direction) <= WHEEL_BALANCE)


def _round(parts: list[Part], direction: Array) -> bool:
    _, _, inertia = _together(parts)
    # second moments of mass across the line: a round body has equal ones and no product
    across = np.linalg.svd(direction[None])[2][1:]
    second = across @ (np.trace(inertia) / 2 * np.eye(3) - inertia) @ across.T
    half, spread = np.trace(second) / 2, np.linalg.norm(second - np.trace(second) / 2 * np.eye(2))
    return bool(spread <= WHEEL_ROUNDNESS * half)


def _together(parts: list[Part]) -> tuple[float, Array, Array]:
    """Return mass, centroid and inertia about it of several parts, world axes."""
    mass = sum(p.mass_properties.mass for p in parts)
    centroid = sum((p.mass_properties.mass * p.centroid for p in parts), np.zeros(3)) / (
        mass or 1.0
    )
    inertia = np.zeros((3, 3))
    for p in parts:
        q = p.pose.rotation
        d = p.centroid - centroid
        inertia += q @ p.mass_properties.inertia @ q.T
        inertia += p.mass_properties.mass * ((d @ d) * np.eye(3) - np.outer(d, d))
    return mass, centroid, inertia
