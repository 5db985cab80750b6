"""The 20-node hexahedron (serendipity) on a cube, integrated over sub-cubes.

The finite cell method (Parvizian, Düster, Rank 2007; Düster et al. 2008): the mesh is a regular grid
that need not follow the surface; the integrand of a cell is weighted by the share of each sub-cube
that is inside the part. For cubes the stiffness of each sub-cube is the same in every cell, so a
cell's matrix is a weighted sum of matrices that are computed once.

In a sub-cube that the surface cuts, the weights of the Gauss points are chosen so that they have the
volume and the centroid of the material in it. Volume alone puts the material at the middle of the
sub-cube, i.e. partly outside the part, and makes parts about 1 % too stiff.
"""

from __future__ import annotations

from functools import lru_cache
from itertools import product
from typing import Any

import numpy as np
from numpy.polynomial.legendre import leggauss
from numpy.typing import NDArray

from technic.geometry import Array, readonly
from technic.parts.definition import Material

__all__ = [
    "CELL_NODES",
    "OFFSETS",
    "elasticity",
    "gauss_weights",
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
        [
            factor[..., 1] * factor[..., 2],
            factor[..., 0] * factor[..., 2],
            factor[..., 0] * factor[..., 1],
        ],
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


def packed_indices() -> tuple[NDArray[np.int64], NDArray[np.int64]]:
    """Return rows and columns of the lower triangle of a (60, 60) matrix, in packed order."""
    rows, columns = np.tril_indices(3 * CELL_NODES)
    return rows.astype(np.int64), columns.astype(np.int64)


def gauss_weights(fill: Array, moment: NDArray[np.floating[Any]]) -> Array:
    """Return weights of the eight Gauss points of sub-cubes that are partly filled.

    The weights sum to the share that is filled, have its centroid and are not negative. A centroid
    further from the middle than a Gauss point (a sliver at a face) is moved to the Gauss point.

    Parameters
    ----------
    fill : (...) ndarray
        Share inside, 0 to 1.
    moment : (..., 3) ndarray
        Share times offset of the centroid from the middle, in edges of the sub-cube.

    Returns
    -------
    (..., 8) ndarray
        Weights relative to the volume of the sub-cube; points ordered as in `sub_stiffness`.
    """
    offset = moment / np.maximum(fill, 1e-12)[..., None]
    along = np.clip(offset * (2.0 * np.sqrt(3.0)), -1.0, 1.0)
    sides = np.stack([1.0 - along, 1.0 + along], axis=-1) / 2.0
    weights = np.einsum("...i,...j,...k->...ijk", *(sides[..., axis, :] for axis in range(3)))
    return np.asarray(fill[..., None] * weights.reshape(*fill.shape, 8))


def _gauss_points(divisions: int) -> Array:
    """Return the Gauss points of every sub-cube in the reference cell, (divisions**3 * 8, 3)."""
    abscissae, _ = leggauss(2)
    centres = (np.arange(divisions) + 0.5) * 2.0 / divisions - 1.0
    line = centres[:, None] + abscissae / divisions
    grid = np.stack(np.meshgrid(*[np.arange(divisions)] * 3, indexing="ij"), -1).reshape(-1, 3)
    local = np.stack(np.meshgrid(*[np.arange(2)] * 3, indexing="ij"), -1).reshape(-1, 3)
    return line[grid[:, None, :], local[None, :, :]].reshape(-1, 3)


@lru_cache(maxsize=4)
def sub_stiffness(divisions: int, size: float, material: Material) -> Array:
    """Return what each Gauss point of each sub-cube adds to the cell's stiffness, for weight 1.

    Two points a direction in each sub-cube: exact to degree three in the sub-cube, where the integrand
    has degree four; the rest is of order ``divisions**-4``.

    Parameters
    ----------
    divisions : int
        Sub-cubes along an edge of the cell.
    size : float
        Edge of the cell (m).
    material : Material

    Returns
    -------
    (divisions**3 * 8, 1830) ndarray
        Lower triangles, packed row by row (N/m); unknowns ordered node by node.
    """
    points = _gauss_points(divisions)
    volume = (size / divisions) ** 3
    hooke = elasticity(material)
    rows, columns = packed_indices()
    out = np.empty((len(points), len(rows)))
    for begin in range(0, len(points), 64):
        _, gradient = shape_functions(points[begin : begin + 64])
        g = gradient * 2.0 / size
        strain = np.zeros((len(g), 6, CELL_NODES, 3))
        for axis in range(3):
            strain[:, axis, :, axis] = g[:, :, axis]
        for row, (a, b) in enumerate(((1, 2), (2, 0), (0, 1)), start=3):
            strain[:, row, :, a] = g[:, :, b]
            strain[:, row, :, b] = g[:, :, a]
        flat = strain.reshape(len(g), 6, -1)
        matrix = volume * (flat.transpose(0, 2, 1) @ (hooke @ flat))
        out[begin : begin + 64] = matrix[:, rows, columns]
    out.setflags(write=False)
    return out


@lru_cache(maxsize=4)
def sub_mass(divisions: int, size: float) -> Array:
    """Return what each Gauss point adds to the cell's mass matrix, for weight and density 1.

    Returns
    -------
    (divisions**3 * 8, 20, 20) ndarray
        In m3; one direction of displacement.
    """
    values, _ = shape_functions(_gauss_points(divisions))
    out = (size / divisions) ** 3 * values[:, :, None] * values[:, None, :]
    out.setflags(write=False)
    return out
