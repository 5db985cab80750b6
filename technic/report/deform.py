"""Where the points of a part go: finite rotation of the part, and its bending from its nodes."""

from __future__ import annotations

import numpy as np

from technic.geometry import Array, shift_twist, skew

__all__ = ["bend_field", "move_rigidly", "rotation_matrix"]

_NEAREST = 8
"""Nodes that a point of a bent part listens to."""


def rotation_matrix(theta: Array) -> Array:
    """Return the rotation by a vector (rad) about its own direction (Rodrigues)."""
    angle = float(np.linalg.norm(theta))
    if angle == 0.0:
        return np.eye(3)
    k = skew(np.asarray(theta) / angle)
    return np.asarray(np.eye(3) + np.sin(angle) * k + (1.0 - np.cos(angle)) * (k @ k))


def move_rigidly(points: Array, center: Array, twist: Array) -> Array:
    """Return points of a part moved by a twist about `center`, the rotation taken as a finite one.

    A picture exaggerates; without the finite rotation parts would swell.
    """
    return (points - center) @ rotation_matrix(twist[3:]).T + center + twist[:3]


def bend_field(
    points: Array, center: Array, twist: Array, nodes: Array, displacements: Array
) -> Array:
    """Return the displacement of points by the bending of their part, its rigid movement taken off.

    Parameters
    ----------
    points : (n, 3) ndarray
        World coordinates, undeformed (m).
    center : (3,) ndarray
    twist : (6,) ndarray
        Rigid movement of the part about `center` (m, rad).
    nodes, displacements : (m, 3) ndarray
        The part's nodes, and their whole displacement (m), to first order.

    Returns
    -------
    (n, 3) ndarray
        Along a straight part: linear between neighbouring nodes. Else: mean of the nearest nodes,
        weighted by the inverse fourth power of their distance.
    """
    if len(nodes) < 2:
        return np.zeros_like(points)
    rigid = np.einsum("nij,j->ni", shift_twist(nodes - center)[:, :3], twist)
    rest = displacements - rigid
    middle = nodes.mean(axis=0)
    _, s, vt = np.linalg.svd(nodes - middle, full_matrices=False)
    if s[1] < 1e-6 * s[0]:
        along = (nodes - middle) @ vt[0]
        order = np.argsort(along, kind="stable")
        where = (points - middle) @ vt[0]
        return np.column_stack(
            [np.interp(where, along[order], rest[order, axis]) for axis in range(3)]
        )
    square = ((points[:, None, :] - nodes[None, :, :]) ** 2).sum(axis=2)
    near = np.argsort(square, axis=1, kind="stable")[:, :_NEAREST]
    weight = 1.0 / (np.take_along_axis(square, near, axis=1) + 1e-12) ** 2
    weight /= weight.sum(axis=1)[:, None]
    return np.asarray(np.einsum("nk,nkc->nc", weight, rest[near]))
