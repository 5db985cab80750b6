"""Constants of an arbitrary cross-section, the axle's cross among them: area, bending, torsion.

Torsion after Saint-Venant: the warping function ``w`` minimises ``integral |grad w + (-y, x)|^2`` over
the section, and the minimum is the torsion constant. Solved with bilinear elements on a square grid
whose elements are weighted by the share of their area inside (the plane form of the finite cell method
of `technic.fem.solid`); the outline needs no boundary condition. Timoshenko, Goodier, *Theory of
Elasticity*, 3rd ed., sections 104 and 109.
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from scipy import sparse
from scipy.sparse.linalg import splu

from technic.errors import InputError
from technic.geometry import Array
from technic.parts.definition import Section

__all__ = ["cross_outline", "section_of"]

SAMPLES = 5
"""Lines per element on which the outline is intersected; exact along each line."""


def section_of(loops: Sequence[Array], elements: int = 240, source: str = "") -> Section:
    """Return the constants of the area enclosed by loops (even-odd rule), about its centroid.

    Parameters
    ----------
    loops : sequence of (k, 2) array_like
        Closed polygons (y, z) in m: outlines and holes.
    elements : int
        Elements along the longer side. The torsion constant converges from above; the cross of an
        axle is within 0.5 % at 240.
    source : str

    Returns
    -------
    Section
        Shear areas are infinite (shear-rigid).

    Raises
    ------
    InputError
        A loop has fewer than three corners, or nothing is enclosed.
    """
    polygons = [np.asarray(loop, dtype=float) for loop in loops]
    if not polygons or any(p.ndim != 2 or p.shape[1] != 2 or len(p) < 3 for p in polygons):
        raise InputError("a section needs closed loops of at least three corners")
    corners = np.concatenate(polygons)
    low, high = corners.min(axis=0), corners.max(axis=0)
    size = float((high - low).max()) / elements
    if size <= 0.0:
        raise InputError("the section has no extent")
    counts = np.maximum(np.ceil((high - low) / size - 1e-9).astype(int), 1)
    share = _shares(polygons, low, size, counts)
    if not share.any():
        raise InputError("the loops enclose no area")
    area, centre, second = _moments(polygons, low, size, counts)
    torsion = _torsion(share, low - centre, size, counts)
    return Section(
        area=area,
        inertia_y=float(second[1]),
        inertia_z=float(second[0]),
        torsion=torsion,
        source=source or "Poisson solution on the outline",
    )


def _crossings(polygons: Sequence[Array], at: float) -> Array:
    """Return the sorted first coordinates where the line ``second = at`` crosses the loops."""
    found = []
    for polygon in polygons:
        a, b = polygon, np.roll(polygon, -1, axis=0)
        cut = (a[:, 1] > at) != (b[:, 1] > at)
        t = (at - a[cut, 1]) / (b[cut, 1] - a[cut, 1])
        found.append(a[cut, 0] + t * (b[cut, 0] - a[cut, 0]))
    return np.sort(np.concatenate(found))


def _lines(low: Array, size: float, counts: Array) -> Array:
    """Return the second coordinate of the sampling lines."""
    return np.asarray(low[1] + (np.arange(int(counts[1]) * SAMPLES) + 0.5) * size / SAMPLES)


def _shares(polygons: Sequence[Array], low: Array, size: float, counts: Array) -> Array:
    """Return the share of each element's area that is inside, (ny, nz)."""
    edges = low[0] + size * np.arange(int(counts[0]) + 1)
    out = np.zeros((int(counts[0]), int(counts[1])))
    for number, at in enumerate(_lines(low, size, counts)):
        ends = _crossings(polygons, float(at)).reshape(-1, 2)
        # Length inside to the left of each edge of the grid.
        length = np.clip(edges[:, None], ends[:, 0], ends[:, 1]) - ends[:, 0]
        out[:, number // SAMPLES] += np.diff(length.sum(axis=1)) / size / SAMPLES
    return out


def _moments(
    polygons: Sequence[Array], low: Array, size: float, counts: Array
) -> tuple[float, Array, Array]:
    """Return area, centroid and (integral of y^2, integral of z^2) about it, line by line."""
    step = size / SAMPLES
    sums = np.zeros(5)
    for at in _lines(low, size, counts):
        a, b = _crossings(polygons, float(at)).reshape(-1, 2).T
        width = (b - a).sum()
        strip = [
            width,
            (b**2 - a**2).sum() / 2.0,
            width * at,
            (b**3 - a**3).sum() / 3.0,
            width * (at**2 + step**2 / 12.0),
        ]
        sums += step * np.array(strip)
    centre = sums[1:3] / sums[0]
    return float(sums[0]), centre, sums[3:] - sums[0] * centre**2


def _torsion(share: Array, corner: Array, size: float, counts: Array) -> float:
    """Return the torsion constant (m4) from the warping function."""
    nz = int(counts[1])
    used = np.stack(np.nonzero(share > 0.0), axis=1)
    weight = share[used[:, 0], used[:, 1]]
    local = np.array([[0, 0], [1, 0], [1, 1], [0, 1]])
    nodes = (used[:, None, 0] + local[:, 0]) * (nz + 1) + used[:, None, 1] + local[:, 1]
    g = 0.5 / np.sqrt(3.0)
    stiffness = np.zeros((4, 4))
    load = np.zeros((len(used), 4))
    polar = 0.0
    for y in (0.5 - g, 0.5 + g):
        for z in (0.5 - g, 0.5 + g):
            grad = np.array([[z - 1, 1 - z, z, -z], [y - 1, -y, y, 1 - y]]) / size
            point = corner + (used + np.array([y, z])) * size
            twist = np.stack([-point[:, 1], point[:, 0]], axis=1)
            part = weight * size**2 / 4.0
            stiffness += grad.T @ grad * size**2 / 4.0
            load -= part[:, None] * (twist @ grad)
            polar += float((part * (twist**2).sum(axis=1)).sum())
    number, nodes = np.unique(nodes, return_inverse=True)
    nodes = nodes.reshape(-1, 4)
    entries = weight[:, None, None] * stiffness
    rows = np.repeat(nodes, 4, axis=1).ravel()
    columns = np.tile(nodes, (1, 4)).ravel()
    count = len(number)
    matrix = sparse.coo_array((entries.ravel(), (rows, columns)), shape=(count, count)).tocsc()
    right = np.bincount(nodes.ravel(), weights=load.ravel(), minlength=count)
    # The warping of each separate piece is free up to a constant: a weak spring fixes it.
    spring = 1e-9 * sparse.eye_array(count, format="csc")
    warping = splu((matrix + spring).tocsc(), permc_spec="MMD_AT_PLUS_A").solve(right)
    return float(polar - warping @ right)


def cross_outline(
    across: float = 4.8e-3, thickness: float = 1.8e-3, tip_points: int = 16
) -> list[Array]:
    """Return the outline of an axle: two crossed bars with ends rounded to the axle's circle.

    Parameters
    ----------
    across : float
        Diameter over the arms (m).
    thickness : float
        Of an arm (m).
    tip_points : int
        Corners of each rounded end.
    """
    radius, half = across / 2.0, thickness / 2.0
    angle = np.linspace(-np.arcsin(half / radius), np.arcsin(half / radius), tip_points)
    tip = radius * np.stack([np.cos(angle), np.sin(angle)], axis=1)
    arm = np.concatenate([tip, [[half, half]]])
    turn = np.array([[0.0, 1.0], [-1.0, 0.0]])
    return [np.concatenate([arm @ np.linalg.matrix_power(turn, k) for k in range(4)])]
