"""The 20-node hexahedron (serendipity) on a cube, integrated over sub-cubes.

The finite cell method (Parvizian, Düster, Rank 2007; Düster et al. 2008): the mesh is a regular grid
that need not follow the surface; the integrand of a cell is weighted by the share of each sub-cube
that is inside the part. For cubes the stiffness of each sub-cube is the same in every cell, so a
cell's matrix is a weighted sum of matrices that are computed once.
"""

from __future__ import annotations

from functools import lru_cache
from itertools import product

import numpy as np
from numpy.polynomial.legendre import leggauss

from technic.geometry import Array, readonly
from technic.parts.definition import Material

__all__ = [
    "CELL_NODES",
    "OFFSETS",
    "elasticity",
    "packed_indices",
    "shape_functions",
    "sub_mass",
    "sub_stiffness",
]


def _node_offsets() -> Array:
    """Return the nodes on the half-grid of the cell: corners, then middles of edges."""
    points = [p for p in product((0, 1, 2), repeat=3) if p.count(1) <= 1]
    points.sort(key=lambda p: (p.count(1), p))
    return readonly(points, dtype=np.int64)


OFFSETS = _node_offsets()
"""(20, 3) position of each node in half-cells: 0, 1 or 2 along each axis."""

CELL_NODES = 20
"""Nodes of a cell."""


def shape_functions(xi: Array) -> tuple[Array, Array]:
    """Return values and gradients of the shape functions.

    Parameters
    ----------
    xi : (k, 3) ndarray
        Points in the reference cell, each coordinate from -1 to 1.

    Returns
    -------
    values : (k, 20) ndarray
    gradients : (k, 20, 3) ndarray
        Derivatives with respect to `xi`.
    """
    xi = np.asarray(xi, dtype=float)
    node = OFFSETS - 1.0
    corner = (OFFSETS != 1).all(axis=1)
    # One factor per direction: (1 + x xi) at a corner's coordinate, (1 - x^2) at an edge's middle.
    factor = np.where(OFFSETS == 1, 1.0 - xi[:, None, :] ** 2, 1.0 + xi[:, None, :] * node)
    slope = np.where(OFFSETS == 1, -2.0 * xi[:, None, :], node)
    body = np.prod(factor, axis=2)
    others = np.stack(
        [factor[..., 1] * factor[..., 2], factor[..., 0] * factor[..., 2], factor[..., 0] * factor[..., 1]],
        axis=2,
    )
    gradient = slope * others
    extra = (xi[:, None, :] * node).sum(axis=2) - 2.0
    values = np.where(corner, body * extra / 8.0, body / 4.0)
    gradients = np.where(
        corner[:, None],
        (gradient * extra[..., None] + body[..., None] * node) / 8.0,
        gradient / 4.0,
    )
    return values, gradients


def elasticity(material: Material) -> Array:
    """Return Hooke's matrix (6, 6) for strains (xx, yy, zz, yz, zx, xy), shears as angles (Pa)."""
    e, nu = material.young_pa, material.poisson
    lame = e * nu / ((1.0 + nu) * (1.0 - 2.0 * nu))
    shear = material.shear_pa
    matrix = np.zeros((6, 6))
    matrix[:3, :3] = lame
    matrix[range(3), range(3)] += 2.0 * shear
    matrix[range(3, 6), range(3, 6)] = shear
    return matrix


def packed_indices() -> tuple[Array, Array]:
    """Return rows and columns of the lower triangle of a (60, 60) matrix, in packed order."""
    return np.tril_indices(3 * CELL_NODES)


def _sub_points(divisions: int, order: int) -> tuple[Array, Array]:
    """Return Gauss points of every sub-cube, (divisions**3, order**3, 3), and weights (volume 8)."""
    abscissae, weights = leggauss(order)
    centres = (np.arange(divisions) + 0.5) * 2.0 / divisions - 1.0
    line = centres[:, None] + abscissae / divisions
    w = weights / divisions
    grid = np.stack(np.meshgrid(*[np.arange(divisions)] * 3, indexing="ij"), -1).reshape(-1, 3)
    local = np.stack(np.meshgrid(*[np.arange(order)] * 3, indexing="ij"), -1).reshape(-1, 3)
    points = line[grid[:, None, :], local[None, :, :]]
    return points, np.prod(w[local], axis=1)


@lru_cache(maxsize=8)
def sub_stiffness(divisions: int, size: float, material: Material) -> Array:
    """Return the share of the cell's stiffness that comes from each sub-cube.

    The rule (three points a direction) is exact: the integrand has degree four in each direction.

    Parameters
    ----------
    divisions : int
        Sub-cubes along an edge of the cell.
    size : float
        Edge of the cell (m).
    material : Material

    Returns
    -------
    (divisions**3, 1830) ndarray
        Lower triangles, packed row by row (N/m); unknowns ordered node by node.
    """
    points, weights = _sub_points(divisions, 3)
    hooke = elasticity(material)
    rows, columns = packed_indices()
    out = np.empty((len(points), len(rows)))
    for k, cloud in enumerate(points):
        _, gradient = shape_functions(cloud)
        g = gradient * 2.0 / size
        strain = np.zeros((len(cloud), 6, CELL_NODES, 3))
        for axis in range(3):
            strain[:, axis, :, axis] = g[:, :, axis]
        for row, (a, b) in enumerate(((1, 2), (2, 0), (0, 1)), start=3):
            strain[:, row, :, a] = g[:, :, b]
            strain[:, row, :, b] = g[:, :, a]
        b = strain.reshape(len(cloud), 6, -1)
        scaled = weights[:, None, None] * (size / 2.0) ** 3 * (hooke @ b)
        matrix = np.einsum("kia,kib->ab", b, scaled, optimize=True)
        out[k] = matrix[rows, columns]
    out.setflags(write=False)
    return out


@lru_cache(maxsize=8)
def sub_mass(divisions: int, size: float) -> Array:
    """Return the share of the cell's mass matrix that comes from each sub-cube, for density 1.

    Returns
    -------
    (divisions**3, 20, 20) ndarray
        In m3; one direction of displacement.
    """
    points, weights = _sub_points(divisions, 4)
    values, _ = shape_functions(points.reshape(-1, 3))
    n = values.reshape(*points.shape[:2], CELL_NODES)
    out = np.einsum("ska,k,skb->sab", n, weights * (size / 2.0) ** 3, n, optimize=True)
    out.setflags(write=False)
    return out
