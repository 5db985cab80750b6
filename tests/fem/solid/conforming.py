"""A plain liftarm as a structured mesh of 20-node bricks that follows bores and outline exactly.

Around every bore the plane is mapped by rays: from the bore's circle over the counterbore's circle to
the outline (a square of one module, or a half circle at the ends). It shares nothing with the finite
cells but the element's polynomials, and CalculiX brings its own.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.polynomial.legendre import leggauss
from numpy.typing import NDArray

from technic.fem.solid.cells import OFFSETS, shape_functions
from technic.geometry import Array, skew
from technic.units import MM, PITCH

CORNER = np.arctan2(3.6, 4.0)
"""Direction of the corner of a module's square: a ray must run through it."""


@dataclass(frozen=True)
class Bricks:
    """Nodes (m), elements (nodes in the order of `OFFSETS`) and the elements at each bore's wall."""

    points: Array
    elements: NDArray[np.int64]
    walls: list[NDArray[np.int64]]


def _outline(angle: Array, left: bool, right: bool) -> Array:
    """Return points of the outline in the directions `angle`; rounded on the given sides."""
    c, s = np.cos(angle), np.sin(angle)
    reach = np.minimum(4.0 / np.maximum(np.abs(c), 1e-12), 3.6 / np.maximum(np.abs(s), 1e-12))
    rounded = (left & (c < -1e-9)) | (right & (c > 1e-9))
    return np.where(rounded, 3.6, reach)


def liftarm_bricks(
    modules: int, around: int = 4, inner: int = 1, outer: int = 2, deep: int = 5, lip: int = 1
) -> Bricks:
    """Return the mesh of `plain_liftarm` (first bore at the origin, bores along z).

    Parameters
    ----------
    modules : int
    around : int
        Elements from the direction of x to the corner's, and from there to y.
    inner, outer : int
        Elements from bore to counterbore and on to the outline.
    deep, lip : int
        Elements along the bore and along each counterbore.
    """
    quarter = np.concatenate(
        [np.linspace(0, CORNER, 2 * around + 1), np.linspace(CORNER, np.pi / 2, 2 * around + 1)[1:]]
    )
    half = np.concatenate([quarter, np.pi - quarter[-2::-1]])
    angle = np.concatenate([half, half[1:-1] + np.pi])
    z = np.concatenate(
        [
            np.linspace(-4.0, -3.2, 2 * lip + 1),
            np.linspace(-3.2, 3.2, 2 * deep + 1)[1:],
            np.linspace(3.2, 4.0, 2 * lip + 1)[1:],
        ]
    )
    rays, layers = len(angle), len(z) // 2
    rings = inner + outer
    all_points, all_elements, walls = [], [], []
    count = 0
    for hole in range(modules):
        edge = _outline(angle, hole == 0, hole == modules - 1)
        stations = [np.full(rays, 2.4 + 0.8 * t) for t in np.linspace(0, 1, 2 * inner + 1)]
        stations += [3.2 + (edge - 3.2) * t for t in np.linspace(0, 1, 2 * outer + 1)[1:]]
        radius = np.array(stations)
        x = hole * PITCH / MM + radius * np.cos(angle)
        y = radius * np.sin(angle)
        grid = np.empty((*radius.shape, len(z), 3))
        grid[..., 0], grid[..., 1], grid[..., 2] = x[..., None], y[..., None], z
        number = np.arange(grid[..., 0].size).reshape(grid.shape[:3]) + count
        count += number.size
        all_points.append(grid.reshape(-1, 3))
        mine = []
        for layer in range(layers):
            bore = lip <= layer < lip + deep
            for ring in range(0 if bore else inner, rings):
                for ray in range(rays // 2):
                    i = 2 * ring + OFFSETS[:, 0]
                    j = (2 * ray + OFFSETS[:, 1]) % rays
                    k = 2 * layer + OFFSETS[:, 2]
                    if ring == 0:
                        mine.append(len(all_elements))
                    all_elements.append(number[i, j, k])
        walls.append(np.array(mine))
    points, elements = np.concatenate(all_points), np.array(all_elements)
    key = np.round(points * 1e5).astype(np.int64)
    _, first, same = np.unique(key, axis=0, return_index=True, return_inverse=True)
    used, compact = np.unique(same.ravel()[elements], return_inverse=True)
    return Bricks(points[first][used] * MM, compact.reshape(-1, 20), walls)


def wall_frame(mesh: Bricks, hole: int, reference: Array) -> Array:
    """Return ``C`` (6, 3 n): least-squares twist of a bore's wall about a point."""
    abscissae, weights = leggauss(3)
    eta, zeta = (g.ravel() for g in np.meshgrid(abscissae, abscissae, indexing="ij"))
    w = np.outer(weights, weights).ravel()
    values, gradients = shape_functions(np.stack([np.full(9, -1.0), eta, zeta], axis=1))
    total = np.zeros((6, 3 * len(mesh.points)))
    normal = np.zeros((6, 6))
    for element in mesh.walls[hole]:
        nodes = mesh.elements[element]
        corner = mesh.points[nodes]
        x = values @ corner
        along = np.einsum("kna,ni->kai", gradients[:, :, 1:], corner)
        area = np.linalg.norm(np.cross(along[:, 0], along[:, 1]), axis=1) * w
        rows = np.zeros((9, 3, 6))
        rows[:, range(3), range(3)] = 1.0
        rows[:, :, 3:] = -skew(x - reference)
        normal += np.einsum("k,kia,kib->ab", area, rows, rows)
        part = np.einsum("k,kia,kn->ani", area, rows, values).reshape(6, -1)
        total[:, (3 * nodes[:, None] + np.arange(3)).ravel()] += part
    return np.linalg.solve(normal, total)
