"""Port frames on a mesh: the rigid motion that fits a bore's or a shaft's surface best.

The twist of a frame is the weighted least-squares fit to the displacement of the true surface of the
feature (quadrature on the exact cylinder, not on the nodes near it):

    q = argmin  sum_k w_k | u(x_k) - (t + theta x (x_k - p)) |^2   =   C u

Every sample is looked up in the mesh; where the feature has no material (the slot of a pin, the half
of a bore that another bore cuts away, the counterbore) it drops out.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from scipy import sparse

from technic.errors import InputError
from technic.fem.solid.cells import shape_functions
from technic.fem.solid.grid import Mesh
from technic.geometry import Array, axes_from, skew
from technic.parts.definition import Port, PortKind
from technic.units import LDU

__all__ = ["Samples", "frame_rows", "sample_port", "wall_rows"]

AROUND = 48
"""Samples around a circle: divisible by 16, so that coarse facets do not show."""

ALONG = 0.5 * LDU
"""Distance of samples along the axis: divides the depth of counterbores (2 LDU)."""

SEARCH = 0.9 * LDU
"""How far from the nominal surface material may lie: more than the play between part and model
(0.1 LDU) and the depth of a facet, less than the depth of a counterbore (2 LDU in radius)."""

LEAST_SHARE = 0.15
"""A port with material at fewer of its samples than this is refused: the shape does not have it."""

LEAST_SPREAD = 1e-3
"""Smallest accepted ratio of the eigenvalues of the (scaled) least-squares matrix."""


@dataclass(frozen=True, slots=True, eq=False)
class Samples:
    """Where a port's surface touches the mesh.

    Attributes
    ----------
    points : (k, 3) ndarray
        (m)
    weights : (k,) ndarray
        Area that each sample stands for (m2).
    elements : (k,) ndarray of int
    """

    points: Array
    weights: Array
    elements: NDArray[np.int64]


@dataclass(frozen=True, slots=True, eq=False)
class _Pattern:
    """Samples before they are looked up: points, unit vectors towards the material, weights, reach."""

    points: Array
    inward: Array
    weights: Array
    reach: float
    exact: bool
    """The sample stays on the nominal surface; otherwise it moves to where material begins."""


def _along(length: float) -> tuple[Array, float]:
    """Return midpoints along a feature, symmetric about 0, and their spacing."""
    count = max(2, 2 * round(length / ALONG / 2.0))
    return (np.arange(count) + 0.5) * length / count - length / 2.0, length / count


def _cylinder(port: Port, radius: float, sign: float, reach: float, exact: bool) -> _Pattern:
    """Return a cylinder about the port's axis; `sign` +1: the material is outside it."""
    frame = axes_from(port.axis)
    along, spacing = _along(port.length)
    angle = (np.arange(AROUND) + 0.5) * 2.0 * np.pi / AROUND
    radial = np.outer(np.cos(angle), frame[1]) + np.outer(np.sin(angle), frame[2])
    points = port.position + along[:, None, None] * frame[0] + radius * radial
    inward = np.broadcast_to(sign * radial, points.shape)
    weight = np.full(points.shape[:2], spacing * radius * 2.0 * np.pi / AROUND)
    return _Pattern(points.reshape(-1, 3), inward.reshape(-1, 3), weight.ravel(), reach, exact)


def _cross(port: Port, sign: float, turn: float) -> _Pattern:
    """Return the surface of an axle's cross: arms 12 LDU across, 4 to 5 LDU thick."""
    frame = axes_from(port.axis)
    half_length, half_width = 6.0 * LDU, 2.25 * LDU
    across = half_width + (np.arange(8) + 0.5) * (half_length - half_width) / 8.0
    tip = ((np.arange(8) + 0.5) / 4.0 - 1.0) * half_width
    flat, normal, weight = [], [], []
    for s in (-1.0, 1.0):
        flat.append(np.stack([across, np.full(8, s * half_width)], axis=1))
        normal.append(np.tile([0.0, s], (8, 1)))
        weight.append(np.full(8, (half_length - half_width) / 8.0))
    flat.append(np.stack([np.sqrt(half_length**2 - tip**2), tip], axis=1))
    normal.append(flat[-1] / half_length)
    weight.append(np.full(8, half_width / 4.0))
    plane, outward, w = np.concatenate(flat), np.concatenate(normal), np.concatenate(weight)
    all_points, all_normals = [], []
    for quarter in range(4):
        angle = turn + quarter * np.pi / 2.0
        rotation = np.array([[np.cos(angle), np.sin(angle)], [-np.sin(angle), np.cos(angle)]])
        all_points.append(plane @ rotation)
        all_normals.append(outward @ rotation)
    along, spacing = _along(port.length)
    ring = np.concatenate(all_points) @ frame[1:]
    points = port.position + along[:, None, None] * frame[0] + ring
    # A hole's material lies outwards of the cross, an axle's inwards: `sign` +1 and -1.
    inward = np.broadcast_to(sign * (np.concatenate(all_normals) @ frame[1:]), points.shape)
    weights = np.broadcast_to(np.tile(w, 4) * spacing, points.shape[:2])
    return _Pattern(
        points.reshape(-1, 3), inward.reshape(-1, 3), weights.reshape(-1), 1.5 * LDU, False
    )


def _sphere(port: Port, radius: float, sign: float, reach: float) -> _Pattern:
    """Return a sphere about the port's position (golden-angle spiral)."""
    count = 600
    height = 1.0 - (2.0 * np.arange(count) + 1.0) / count
    angle = np.arange(count) * np.pi * (3.0 - np.sqrt(5.0))
    rim = np.sqrt(1.0 - height**2)
    unit = np.stack([rim * np.cos(angle), rim * np.sin(angle), height], axis=1)
    weights = np.full(count, 4.0 * np.pi * radius**2 / count)
    return _Pattern(port.position + radius * unit, sign * unit, weights, reach, False)


def _patterns(port: Port) -> list[_Pattern]:
    """Return the candidate surfaces of a port; the one that finds most material is the right one."""
    match port.kind:
        case PortKind.PIN_HOLE:
            return [_cylinder(port, 6.0 * LDU, 1.0, SEARCH, True)]
        case PortKind.PIN | PortKind.STUD:
            return [_cylinder(port, 6.0 * LDU, -1.0, SEARCH, True)]
        case PortKind.AXLE_HOLE | PortKind.AXLE:
            sign = 1.0 if port.kind is PortKind.AXLE_HOLE else -1.0
            return [_cross(port, sign, k * np.pi / 24.0) for k in range(12)]
        case PortKind.BALL:
            return [_sphere(port, 10.0 * LDU, -1.0, 6.0 * LDU)]
        case PortKind.SOCKET:
            return [_sphere(port, 6.0 * LDU, 1.0, 6.0 * LDU)]
        case PortKind.TUBE:
            # A stud (radius 6) is gripped by walls and tubes around it.
            return [_cylinder(port, 5.0 * LDU, 1.0, 4.0 * LDU, False)]
        case PortKind.STOP:
            return [_cylinder(port, 12.0 * LDU, -1.0, 6.5 * LDU, False)]


def sample_port(mesh: Mesh, port: Port) -> Samples:
    """Find the surface of a port on a mesh.

    Parameters
    ----------
    mesh : Mesh
    port : Port

    Returns
    -------
    Samples

    Raises
    ------
    InputError
        The shape has no (or hardly any) material where the port should be.
    """
    best: Samples | None = None
    for pattern in _patterns(port):
        found = _look_up(mesh, pattern)
        share = found.weights.sum() / pattern.weights.sum()
        if share >= LEAST_SHARE and (best is None or found.weights.sum() > best.weights.sum()):
            best = found
    if best is None:
        raise InputError(
            f"port {port.name!r} ({port.kind}): the shape has no material there",
            remedy="check the port's position and axis against the shape",
        )
    return best


def _look_up(mesh: Mesh, pattern: _Pattern) -> Samples:
    """Walk from each sample towards the material, in half sub-cubes, as far as the pattern reaches."""
    step = mesh.settings.sub / 2.0
    element = np.full(len(pattern.points), -1)
    points = pattern.points.copy()
    # A sample that begins inside the material belongs to another face, unless it is on the surface.
    if not pattern.exact:
        buried = mesh.element_at(points - 2.0 * step * pattern.inward) >= 0
    else:
        buried = np.zeros(len(points), dtype=bool)
    for k in range(int(np.ceil(pattern.reach / step)) + 1):
        moved = pattern.points + k * step * pattern.inward
        new = (element < 0) & ~buried
        found = mesh.element_at(moved)
        hit = new & (found >= 0)
        element[hit] = found[hit]
        if not pattern.exact:
            points[hit] = moved[hit]
    there = element >= 0
    return Samples(points[there], pattern.weights[there], element[there])


def _rigid_rows(points: Array, reference: Array) -> Array:
    """Return (k, 3, 6): displacement of points when the frame at `reference` moves by a twist."""
    rows = np.zeros((len(points), 3, 6))
    rows[:, range(3), range(3)] = 1.0
    rows[:, :, 3:] = -skew(points - reference)
    return rows


def frame_rows(mesh: Mesh, port: Port, samples: Samples) -> sparse.csr_array:
    """Return ``C`` of one port: from the mesh's unknowns to the twist of the port's frame.

    Parameters
    ----------
    mesh : Mesh
    port : Port
    samples : Samples

    Returns
    -------
    (6, 3 n) csr_array

    Raises
    ------
    InputError
        The samples do not determine a twist (they lie on a point or a line).
    """
    rows = _rigid_rows(samples.points, port.position)
    normal = np.einsum("k,kia,kib->ab", samples.weights, rows, rows)
    length = np.sqrt(max(np.trace(normal[3:, 3:]) / np.trace(normal[:3, :3]), 1e-30))
    scale = np.array([1.0, 1.0, 1.0, length, length, length])
    spread = np.linalg.eigvalsh(normal / np.outer(scale, scale))
    if spread[0] < LEAST_SPREAD * spread[-1]:
        raise InputError(f"port {port.name!r}: too little surface to tell how its frame turns")
    fit = np.linalg.solve(normal, np.einsum("k,kia->aki", samples.weights, rows).reshape(6, -1))
    fit = fit.reshape(6, -1, 3)
    values, _ = shape_functions(mesh.reference(samples.points, samples.elements))
    # Sum over samples of fit[a, k, i] N[k, m] at unknown 3 node(k, m) + i.
    entries = fit[:, :, None, :] * values[None, :, :, None]
    nodes = mesh.nodes[samples.elements]
    columns = (3 * nodes[:, :, None] + np.arange(3)).ravel()
    size = 3 * len(mesh.points)
    row = np.repeat(np.arange(6), len(columns))
    return sparse.coo_array((entries.ravel(), (row, np.tile(columns, 6))), shape=(6, size)).tocsr()


def wall_rows(mesh: Mesh, port: Port, samples: Samples) -> tuple[sparse.csr_array, Array, Array]:
    """Return what a rigid wall needs: displacement rows, rigid rows and weights of the samples.

    Returns
    -------
    displacement : (3 k, 3 n) csr_array
    rigid : (3 k, 6) ndarray
    weights : (3 k,) ndarray
    """
    values, _ = shape_functions(mesh.reference(samples.points, samples.elements))
    count = len(samples.points)
    nodes = mesh.nodes[samples.elements]
    columns = 3 * nodes[:, None, :] + np.arange(3)[None, :, None]
    entries = np.broadcast_to(values[:, None, :], columns.shape)
    row = np.broadcast_to(np.arange(3 * count).reshape(count, 3, 1), columns.shape)
    matrix = sparse.coo_array(
        (entries.ravel(), (row.ravel(), columns.ravel())), shape=(3 * count, 3 * len(mesh.points))
    ).tocsr()
    rigid = _rigid_rows(samples.points, port.position).reshape(-1, 6)
    return matrix, rigid, np.repeat(samples.weights, 3)
