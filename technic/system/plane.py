"""Two dimensions: what is left of a part when everything lies and moves in the plane z = 0."""

from __future__ import annotations

import numpy as np

from technic.assembly.model import Assembly
from technic.errors import InputError
from technic.fem.element import Element

__all__ = ["check_plane", "in_plane"]

PLANE = np.array([0, 1, 5])
"""Motions of a twist that stay in the plane z = 0."""

FLAT = 1e-9
"""A pose keeps the plane when its entries that would leave it are smaller than this."""


def check_plane(assembly: Assembly) -> None:
    """Make sure that the parts of a two-dimensional assembly lie in the plane z = 0.

    Raises
    ------
    InputError
        A part is turned or moved out of the plane.
    """
    for part in assembly.parts:
        turn = part.pose.rotation
        off = max(np.abs(turn[2, :2]).max(), np.abs(turn[:2, 2]).max(), abs(part.centroid[2]))
        if off > FLAT:
            raise InputError(f"part {part.id!r} leaves the plane z = 0 of a two-dimensional model")


def in_plane(element: Element) -> Element:
    """Return the element without the unknowns that leave the plane.

    An unknown stays when some rigid motion in the plane uses it. The others (deflection out of the plane,
    bending about axes in it, torsion) are held, not merely left out of sight: no joint of a
    two-dimensional model would hold them, so they would show as motions.
    """
    stay = np.flatnonzero(np.any(element.rigid[:, PLANE] != 0.0, axis=1))
    rigid = np.zeros((len(stay), 6))
    rigid[:, PLANE] = element.rigid[np.ix_(stay, PLANE)]
    return Element(
        stiffness=element.stiffness[np.ix_(stay, stay)],
        mass=element.mass[np.ix_(stay, stay)],
        rigid=rigid,
        frames=element.frames[:, :, stay],
        frame_points=element.frame_points,
        nodes=element.nodes[:, :, stay],
        node_points=element.node_points,
    )
