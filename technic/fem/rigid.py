"""A part that does not deform: six unknowns, the twist of its centroid."""

from __future__ import annotations

import numpy as np

from technic.errors import InputError
from technic.fem.element import Element
from technic.geometry import Array, shift_twist
from technic.parts.definition import MassProperties

__all__ = ["rigid_element"]


def rigid_element(properties: MassProperties, attachments: Array) -> Element:
    """Return the element of a rigid part.

    Parameters
    ----------
    properties : MassProperties
    attachments : (m, 3) ndarray
        Points where joints and supports attach, part coordinates (m).

    Returns
    -------
    Element
        Its nodes are six points at the radii of gyration along the principal axes, so that every
        rotation shows in the unweighted measure too.

    Raises
    ------
    InputError
        The mass is not positive.
    """
    mass, centroid = properties.mass, properties.centroid
    if not mass > 0.0:
        raise InputError("a rigid part needs a positive mass")
    mass_matrix = np.zeros((6, 6))
    mass_matrix[:3, :3] = mass * np.eye(3)
    mass_matrix[3:, 3:] = properties.inertia
    moments, axes = np.linalg.eigh(properties.inertia)
    # second moments of mass along the principal axes, from the moments of inertia about them
    spread = np.sqrt(np.clip((moments.sum() / 2 - moments) / mass, 0.0, None))
    offsets = np.concatenate([axes.T * spread[:, None], -axes.T * spread[:, None]])
    frames = shift_twist(attachments - centroid)
    return Element(
        stiffness=np.zeros((6, 6)),
        mass=mass_matrix,
        rigid=np.eye(6),
        frames=frames.reshape(-1, 6, 6),
        frame_points=attachments,
        nodes=shift_twist(offsets)[:, :3, :],
        node_points=centroid + offsets,
    )
