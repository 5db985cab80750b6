"""Plates: a simple polygon divided into triangles, in space into tetrahedra."""

from __future__ import annotations

from itertools import pairwise

import numpy as np
from numpy.typing import NDArray

from technic.errors import InputError
from technic.geometry import Array, plane_axes

__all__ = ["divide", "inside", "slab"]

ROUNDS = 5
"""How often the edge length is halved until the triangles follow the outline."""

CLEARANCE = 0.6
"""Inner points keep this share of the edge length from the outline: nearer ones make flat triangles."""


def divide(outline: Array, size: float) -> tuple[Array, NDArray[np.int64]]:
    """Divide a simple polygon into triangles with edges of about `size`.

    Points on a hexagonal grid and along the outline are joined by a Delaunay triangulation; triangles
    outside are dropped. Where the outline is too narrow for the edge length, it is halved.

    Parameters
    ----------
    outline : (n, 3) ndarray
        Corners in order; z is ignored (m).
    size : float
        (m)

    Returns
    -------
    (p, 3) ndarray, (m, 3) ndarray of int

    Raises
    ------
    InputError
        The triangles do not fill the polygon: it crosses itself, or is too narrow somewhere.
    """
    from scipy.spatial import Delaunay, QhullError

    corners = outline[:, :2]
    area = abs(_area(corners))
    for _ in range(ROUNDS):
        points = np.vstack([_along(corners, size), _grid(corners, size)])
        try:
            triangles = Delaunay(points).simplices
        except QhullError as error:
            raise InputError(f"the polygon has no area: {error}") from error
        shape = points[triangles]
        own = np.abs(np.linalg.det(shape[:, 1:] - shape[:, :1])) / 2.0
        keep = inside(corners, shape.mean(axis=1)) & (own > 1e-9 * size**2)
        if abs(own[keep].sum() - area) < 1e-9 * area:
            used, cells = np.unique(triangles[keep], return_inverse=True)
            flat = np.column_stack([points[used], np.zeros(len(used))])
            return flat, cells.reshape(-1, 3).astype(np.int64)
        size /= 2.0
    raise InputError("the polygon crosses itself, or is too narrow to be divided into triangles")


def slab(outline: Array, thickness: float, size: float) -> tuple[Array, NDArray[np.int64]]:
    """Divide a flat plate in space into tetrahedra, one layer of them through the thickness.

    Parameters
    ----------
    outline : (n, 3) ndarray
        Corners in order, in one plane: the middle of the thickness (m).
    thickness, size : float
        (m)

    Returns
    -------
    (p, 3) ndarray, (m, 4) ndarray of int

    Raises
    ------
    InputError
        The triangles do not fill the polygon.
    """
    axes = plane_axes(outline)
    middle = outline.mean(axis=0)
    flat, triangles = divide((outline - middle) @ axes.T, size)
    count = len(flat)
    half = np.array([0.0, 0.0, thickness / 2.0])
    points = np.vstack([flat - half, flat + half])
    # Cut along the diagonals from the lower of two numbers at the bottom: neighbours agree on them.
    a, b, c = np.sort(triangles, axis=1).T
    cells = np.concatenate(
        [
            np.column_stack([a, b, c, c + count]),
            np.column_stack([a, b, b + count, c + count]),
            np.column_stack([a, a + count, b + count, c + count]),
        ]
    )
    spans = points[cells[:, :3]] - points[cells[:, 3:]]
    turned = np.linalg.det(spans) < 0.0
    cells[np.ix_(turned, [0, 1])] = cells[np.ix_(turned, [1, 0])]
    return points @ axes + middle, cells.astype(np.int64)


def _area(corners: Array) -> float:
    x, y = corners.T
    return float(x @ np.roll(y, -1) - y @ np.roll(x, -1)) / 2.0


def _along(corners: Array, size: float) -> Array:
    out = []
    for p, q in pairwise([*corners, corners[0]]):
        pieces = max(1, int(np.ceil(np.linalg.norm(q - p) / size - 1e-9)))
        out.append(p + np.arange(pieces)[:, None] / pieces * (q - p))
    return np.vstack(out)


def _grid(corners: Array, size: float) -> Array:
    low, high = corners.min(axis=0), corners.max(axis=0)
    rise = size * np.sqrt(3.0) / 2.0
    rows = np.arange(low[1], high[1] + rise, rise)
    columns = np.arange(low[0] - size, high[0] + size, size)
    points = np.array([[x + size / 2 * (k % 2), y] for k, y in enumerate(rows) for x in columns])
    points = points[inside(corners, points)]
    return points[_distance(corners, points) > CLEARANCE * size]


def inside(corners: Array, points: Array) -> NDArray[np.bool_]:
    """Tell which points lie inside a polygon (even-odd rule); on the outline either is possible."""
    p, q = corners, np.roll(corners, -1, axis=0)
    x, y = points[:, None, 0], points[:, None, 1]
    rise = q[:, 1] - p[:, 1]
    between = (p[:, 1] > y) != (q[:, 1] > y)
    cross = p[:, 0] + (y - p[:, 1]) * (q[:, 0] - p[:, 0]) / np.where(rise == 0.0, 1.0, rise)
    return np.asarray((between & (x < cross)).sum(axis=1) % 2 == 1)


def _distance(corners: Array, points: Array) -> Array:
    """Return the distance of each point from the outline."""
    span = np.roll(corners, -1, axis=0) - corners
    arm = points[:, None] - corners
    t = np.clip((arm * span).sum(axis=2) / (span**2).sum(axis=1), 0.0, 1.0)
    gap = np.linalg.norm(arm - t[..., None] * span, axis=2)
    return np.asarray(gap.min(axis=1)) if len(points) else np.zeros(0)
