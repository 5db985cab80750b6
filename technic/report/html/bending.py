"""The bending of a part as a polynomial: few numbers, evaluated by the browser's graphics card.

The nodes of a part say how it bends. The page draws hundreds of vertices per part, the same for each
part of a type; so it gets, for each part, a cubic polynomial in part coordinates that fits the nodes'
displacements (rigid movement taken off), and no vertex twice.
"""

from __future__ import annotations

from itertools import combinations_with_replacement

import numpy as np

from technic.geometry import Array, shift_twist

__all__ = ["POWERS", "bending_of", "monomials"]

POWERS: tuple[tuple[int, int, int], ...] = tuple(
    (factors.count(0), factors.count(1), factors.count(2))
    for degree in range(4)
    for factors in combinations_with_replacement(range(3), degree)
)
"""Powers of x, y, z of the 20 monomials up to the third degree, in the order of the shader."""

_PENALTY = 1e-4
"""Weight of the coefficients beside the misfit, growing with the degree: where few nodes leave the
polynomial undetermined, the plainest one is taken, and it does not swing beyond the last node."""


def monomials(points: Array) -> Array:
    """Return the 20 monomials at points (n, 3) of size about 1, (n, 20)."""
    x, y, z = (np.array([np.ones(len(points)), p, p**2, p**3]) for p in points.T)
    return np.column_stack([x[a] * y[b] * z[c] for a, b, c in POWERS])


def bending_of(
    local: Array, nodes: Array, displacements: Array, center: Array, twist: Array, size: float
) -> Array:
    """Return the coefficients of the bending displacement of one part.

    Parameters
    ----------
    local : (m, 3) ndarray
        Nodes in part coordinates relative to the part's centroid (m).
    nodes, displacements : (m, 3) ndarray
        The same nodes in world coordinates (m), and their whole displacement.
    center : (3,) ndarray
        Centroid in world coordinates (m).
    twist : (6,) ndarray
        Rigid movement about the centroid, to be taken off.
    size : float
        Length that coordinates are divided by (m).

    Returns
    -------
    (20, 3) ndarray
        World components of the displacement, in the unit of `displacements`, for `POWERS` of
        ``local / size``.
    """
    rigid = np.einsum("nij,j->ni", shift_twist(nodes - center)[:, :3], twist)
    basis = monomials(local / size)
    weight = np.sqrt(_PENALTY) * np.array([float(sum(power)) for power in POWERS])
    system = np.concatenate([basis, np.diag(weight)])
    right = np.concatenate([displacements - rigid, np.zeros((len(POWERS), 3))])
    return np.asarray(np.linalg.lstsq(system, right, rcond=None)[0])
