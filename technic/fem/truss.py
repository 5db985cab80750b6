"""Truss bars: straight members that resist stretching only."""

from __future__ import annotations

from math import pi

import numpy as np

from technic.errors import InputError
from technic.fem.element import Element
from technic.geometry import Array, shift_twist, skew
from technic.parts.definition import MassProperties, TrussBody

__all__ = ["truss_element"]


def truss_element(body: TrussBody, properties: MassProperties, attachments: Array) -> Element:
    """Return the element of a truss bar: the displacements of its ends, and its spin.

    The spin (rotation about the bar's own axis) costs no energy. It is an unknown of its own because the
    ends alone do not show it, and between two ball joints it is a motion. The mass is consistent with
    displacements that are linear along the bar; the spin carries the polar inertia of a round bar.

    Parameters
    ----------
    body : TrussBody
    properties : MassProperties
    attachments : (m, 3) ndarray
        Part coordinates (m); a point off the axis is carried as by a rigid arm.

    Returns
    -------
    Element
        With 7 unknowns: translations of both ends (m), spin (rad).

    Raises
    ------
    InputError
        The bar has no length.
    """
    p, q = body.points
    length = float(np.linalg.norm(q - p))
    if not length > 0.0:
        raise InputError("a truss bar has no length")
    d = (q - p) / length
    stiffness = np.zeros((7, 7))
    axial = body.material.young_pa * body.area / length * np.outer(d, d)
    stiffness[:6, :6] = np.kron([[1.0, -1.0], [-1.0, 1.0]], axial)
    mass = np.zeros((7, 7))
    mass[:6, :6] = properties.mass / 6.0 * np.kron([[2.0, 1.0], [1.0, 2.0]], np.eye(3))
    mass[6, 6] = properties.mass * body.area / (2.0 * pi)
    rigid = np.zeros((7, 6))
    rigid[:6] = shift_twist(body.points - properties.centroid)[:, :3, :].reshape(6, 6)
    rigid[6, 3:] = d
    station = np.clip((attachments - p) @ d / length, 0.0, 1.0)
    frames = np.zeros((len(attachments), 6, 7))
    frames[:, :3, :3] = (1.0 - station)[:, None, None] * np.eye(3)
    frames[:, :3, 3:6] = station[:, None, None] * np.eye(3)
    # the ends' relative displacement turns the bar about the axes across it: d x (u_q - u_p) / L
    frames[:, 3:, :3] = -skew(d) / length
    frames[:, 3:, 3:6] = skew(d) / length
    frames[:, 3:, 6] = d
    nodes = np.zeros((2, 3, 7))
    nodes[0, :, :3] = nodes[1, :, 3:6] = np.eye(3)
    return Element(
        stiffness=stiffness,
        mass=mass,
        rigid=rigid,
        frames=frames,
        frame_points=p + station[:, None] * (q - p),
        nodes=nodes,
        node_points=body.points,
    )
