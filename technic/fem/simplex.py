"""Triangles (plane stress) and tetrahedra: stiffness and mass of a mesh, linear or quadratic.

Shape functions and quadrature of simplices: O. C. Zienkiewicz and R. L. Taylor, *The Finite Element
Method*, vol. 1, sections on area and volume coordinates.
"""

from __future__ import annotations

from itertools import combinations

import numpy as np
from numpy.typing import NDArray

from technic.errors import InputError
from technic.fem.element import Element
from technic.geometry import Array, shift_twist
from technic.parts.definition import MassProperties, Material

__all__ = ["PATCH", "mesh_element", "with_edge_nodes"]

PATCH = 1.0
"""A joint grips the nodes within this many mean edge lengths of its point: like a pin, it never pulls on
a single point of a continuum, where the displacement would grow without limit as the mesh is refined."""

LARGEST = 6000
"""Unknowns of one meshed part; its matrices are dense, this many take 300 MB each."""


def mesh_element(
    points: Array,
    cells: NDArray[np.int64],
    thickness: float,
    material: Material,
    properties: MassProperties,
    attachments: Array,
    *,
    quadratic: bool,
) -> Element:
    """Return the element of a mesh.

    Parameters
    ----------
    points : (n, 3) ndarray
        Corner nodes, part coordinates (m).
    cells : (m, 3) or (m, 4) ndarray of int
        Triangles in the plane z = 0, or tetrahedra.
    thickness : float
        Of triangles (m).
    material : Material
    properties : MassProperties
        The mass matrix is scaled to this mass, which the mesh of a curved outline misses a little.
    attachments : (m, 3) ndarray
        Part coordinates (m).
    quadratic : bool
        True for displacements that are quadratic in every cell: nodes are added on the edges.

    Returns
    -------
    Element
        Unknowns: 2 per node for triangles (in the plane), 3 for tetrahedra.

    Raises
    ------
    InputError
        A cell has no volume, or the mesh is too fine.
    """
    dim = cells.shape[1] - 1
    nodes, cells = with_edge_nodes(points, cells) if quadratic else (points, cells)
    size = dim * len(nodes)
    if size > LARGEST:
        raise InputError(
            f"a mesh of {len(nodes)} nodes is too fine for one part ({size} unknowns, at most {LARGEST})",
            remedy='Coarsen it, or give its shape "order": 1.',
        )
    stiffness = np.zeros((size, size))
    mass = np.zeros((size, size))
    depth = thickness if dim == 2 else 1.0
    blocks, inertias = _cell_matrices(nodes[:, :dim], cells, dim, material)
    dofs = (dim * cells[:, :, None] + np.arange(dim)).reshape(len(cells), -1)
    index = (dofs[:, :, None], dofs[:, None, :])
    np.add.at(stiffness, index, depth * blocks)
    np.add.at(mass, index, depth * inertias)
    stiffness = (stiffness + stiffness.T) / 2.0
    motions = shift_twist(nodes - properties.centroid)[:, :dim, :].reshape(size, 6)
    if dim == 2:
        motions[:, [2, 3, 4]] = 0.0
    mass *= properties.mass / float(motions[:, 0] @ mass @ motions[:, 0])
    fields = np.zeros((len(nodes), 3, size))
    for k in range(dim):
        fields[np.arange(len(nodes)), k, dim * np.arange(len(nodes)) + k] = 1.0
    edges = np.linalg.norm(points[cells[:, 0]] - points[cells[:, 1]], axis=1)
    reach = PATCH * float(edges.mean())
    frames = np.zeros((len(attachments), 6, size))
    for k, at in enumerate(attachments):
        frames[k] = _grip(nodes, at, reach, dim, size)
    return Element(
        stiffness=stiffness,
        mass=mass,
        rigid=motions,
        frames=frames,
        frame_points=attachments,
        nodes=fields,
        node_points=nodes,
    )


def with_edge_nodes(points: Array, cells: NDArray[np.int64]) -> tuple[Array, NDArray[np.int64]]:
    """Return points and cells with a node in the middle of every edge, after the corners."""
    corners = cells.shape[1]
    pairs = list(combinations(range(corners), 2))
    edges = np.sort(cells[:, pairs].reshape(-1, 2), axis=1)
    unique, inverse = np.unique(edges, axis=0, return_inverse=True)
    middle = points[unique].mean(axis=1)
    numbers = len(points) + inverse.reshape(len(cells), len(pairs))
    return np.vstack([points, middle]), np.hstack([cells, numbers]).astype(np.int64)


def _quadrature(dim: int, degree: int) -> tuple[Array, Array]:
    """Return barycentric points and weights of a simplex, exact to `degree` (weights sum to 1).

    Gauss points on the unit cube, folded onto the simplex (Duffy): simple, and exact to any degree.
    """
    count = degree // 2 + 2
    x, w = np.polynomial.legendre.leggauss(count)
    x, w = (x + 1.0) / 2.0, w / 2.0
    grid = np.stack(np.meshgrid(*[x] * dim, indexing="ij"), axis=-1).reshape(-1, dim)
    weights = np.prod(np.stack(np.meshgrid(*[w] * dim, indexing="ij"), axis=-1), axis=-1).ravel()
    rest = np.ones(len(grid))
    out = np.zeros((len(grid), dim + 1))
    for k in range(dim):
        out[:, k] = rest * grid[:, k]
        weights = weights * (1.0 - grid[:, k]) ** (dim - 1 - k)
        rest = rest * (1.0 - grid[:, k])
    out[:, dim] = rest
    return out, weights / weights.sum()


def _shape(coordinates: Array, quadratic: bool) -> tuple[Array, Array]:
    """Return shape functions (n,) and their derivatives by barycentric coordinates (n, d + 1)."""
    corners = len(coordinates)
    if not quadratic:
        return coordinates, np.eye(corners)
    pairs = list(combinations(range(corners), 2))
    values = [c * (2.0 * c - 1.0) for c in coordinates]
    slopes = np.zeros((corners + len(pairs), corners))
    slopes[:corners] = np.diag(4.0 * coordinates - 1.0)
    for k, (i, j) in enumerate(pairs, start=corners):
        values.append(4.0 * coordinates[i] * coordinates[j])
        slopes[k, i], slopes[k, j] = 4.0 * coordinates[j], 4.0 * coordinates[i]
    return np.array(values), slopes


def _cell_matrices(
    nodes: Array, cells: NDArray[np.int64], dim: int, material: Material
) -> tuple[Array, Array]:
    """Return stiffness and mass of every cell, per unit depth, (m, q, q) each."""
    quadratic = cells.shape[1] > dim + 1
    corner = nodes[cells[:, : dim + 1]]
    spans = corner[:, :dim] - corner[:, dim:]
    volume = np.abs(np.linalg.det(spans)) / (2.0 if dim == 2 else 6.0)
    longest = np.linalg.norm(corner[:, :, None] - corner[:, None], axis=-1).max(axis=(1, 2))
    bad = np.flatnonzero(volume < 1e-12 * longest**dim)
    if len(bad):
        raise InputError(f"cell {int(bad[0])} of the mesh has no volume")
    # gradients of the barycentric coordinates
    gradient = np.zeros((len(cells), dim + 1, dim))
    gradient[:, :dim] = np.swapaxes(np.linalg.inv(spans), 1, 2)
    gradient[:, dim] = -gradient[:, :dim].sum(axis=1)
    law = _law(dim, material)
    count = cells.shape[1]
    k = np.zeros((len(cells), dim * count, dim * count))
    for at, weight in zip(*_quadrature(dim, 2 if quadratic else 0), strict=True):
        slopes = _shape(at, quadratic)[1] @ gradient
        b = _strain(slopes, dim)
        k += weight * np.swapaxes(b, 1, 2) @ law @ b
    scalar = np.zeros((count, count))
    for at, weight in zip(*_quadrature(dim, 4 if quadratic else 2), strict=True):
        n = _shape(at, quadratic)[0]
        scalar += weight * np.outer(n, n)
    inertia = material.density * np.kron(scalar, np.eye(dim))
    return volume[:, None, None] * k, volume[:, None, None] * inertia


def _law(dim: int, material: Material) -> Array:
    """Return Hooke's law: plane stress in the plane, full in space (engineering shear strains)."""
    e, nu = material.young_pa, material.poisson
    if dim == 2:
        return (
            e / (1.0 - nu**2) * np.array([[1.0, nu, 0.0], [nu, 1.0, 0.0], [0.0, 0.0, (1 - nu) / 2]])
        )
    law = np.zeros((6, 6))
    law[:3, :3] = e * nu / ((1.0 + nu) * (1.0 - 2.0 * nu))
    law[:3, :3] += 2.0 * material.shear_pa * np.eye(3)
    law[3:, 3:] = material.shear_pa * np.eye(3)
    return law


def _strain(slopes: Array, dim: int) -> Array:
    """Return ``B`` of all cells from the slopes (m, n, d) of the shape functions."""
    m, n, _ = slopes.shape
    shears = [(0, 1)] if dim == 2 else [(0, 1), (1, 2), (0, 2)]
    b = np.zeros((m, dim + len(shears), n, dim))
    for i in range(dim):
        b[:, i, :, i] = slopes[:, :, i]
    for row, (i, j) in enumerate(shears, start=dim):
        b[:, row, :, i] = slopes[:, :, j]
        b[:, row, :, j] = slopes[:, :, i]
    return b.reshape(m, dim + len(shears), n * dim)


def _grip(nodes: Array, at: Array, reach: float, dim: int, size: int) -> Array:
    """Return ``W``: the least-squares rigid motion of the nodes around a point, (6, size)."""
    gaps = np.linalg.norm(nodes - at, axis=1)
    # the nearest few when the point lies outside or the mesh is coarse there
    near = np.flatnonzero(gaps <= max(reach, float(np.sort(gaps)[min(dim + 1, len(gaps) - 1)])))
    used = np.array([0, 1, 5]) if dim == 2 else np.arange(6)
    motions = shift_twist(nodes[near] - at)[:, :dim][:, :, used].reshape(-1, len(used))
    scale = np.where(used < 3, 1.0, 1.0 / max(reach, 1e-300))
    inverse = scale[:, None] * np.linalg.pinv(motions * scale)
    columns = (dim * near[:, None] + np.arange(dim)).ravel()
    out = np.zeros((6, size))
    out[np.ix_(used, columns)] = inverse
    return out
