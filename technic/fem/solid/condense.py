"""Condensation of a meshed part onto its port frames.

With isostatic springs (six, so that they carry nothing when the loads balance) the mesh gives the
flexibility ``F = C K^-1 C^T`` of the frames. Loads on the frames that balance are spanned by a basis
``N`` of the null space of ``P^T``, ``P`` = rigid motions of the frames, and the condensed stiffness is

    K_p = N (N^T F N)^-1 N^T

symmetric, and zero on the rigid motions to the last digit by construction. The mesh follows the
frames by ``u = X K_p q + R a``, ``X = K^-1 C^T``, ``R`` = rigid motions of the mesh, where `a` makes
``C u = q``; the mass is condensed with the same transformation.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from scipy import sparse
from scipy.linalg import eigh

from technic.errors import InputError
from technic.fem.solid.cells import (
    CELL_NODES,
    gauss_weights,
    packed_indices,
    sub_mass,
    sub_stiffness,
)
from technic.fem.solid.grid import Mesh, MeshSettings, mesh_part
from technic.fem.solid.ports import Samples, frame_rows, sample_port
from technic.fem.solid.solver import Factor, factorize
from technic.fem.solid.superelement import (
    CHECKED_MODES,
    SuperElement,
    project_rigid,
    rigid_motions,
)
from technic.geometry import Array, skew
from technic.parts.definition import Material, Port

__all__ = [
    "Solid",
    "build_super_element",
    "condense",
    "condense_and_lift",
    "element_stiffness",
    "factorized",
    "free_modes",
    "mass_and_centroid",
    "mass_matrix",
    "solid_of",
]

DEPENDENT = 1e-6
"""Two frames are dependent when a balanced load on them moves them less than this share of what the
most compliant one moves them by, lengths scaled. Independent frames at a pitch of 8 mm have 1e-4 and
more; frames that share their nodes 1e-12."""

COLUMNS, ROWS = 48, 20_000
"""Columns solved for, and rows transformed, at once."""

LENGTH = 4e-3
"""Length by which rotations are scaled where ports are compared (half a pitch) (m)."""


@dataclass(frozen=True, slots=True, eq=False)
class Solid:
    """A meshed part with its factorised stiffness.

    Attributes
    ----------
    mesh : Mesh
    material : Material
    factor : Factor
        Of the stiffness with isostatic springs.
    mass : (n, n) csr_array
        Consistent mass of one direction of displacement (kg).
    """

    mesh: Mesh
    material: Material
    factor: Factor
    mass: sparse.csr_array

    @property
    def rigid(self) -> Array:
        """Return the mesh's unknowns in rigid motions about the origin, (3 n, 6)."""
        points = self.mesh.points
        rows = np.zeros((len(points), 3, 6))
        rows[:, range(3), range(3)] = 1.0
        rows[:, :, 3:] = -skew(points)
        return rows.reshape(-1, 6)

    def apply_mass(self, x: Array) -> Array:
        """Return the mass matrix times columns over all unknowns, (3 n, m)."""
        wide = x.reshape(len(self.mesh.points), -1)
        return np.asarray(self.mass @ wide).reshape(x.shape)


def element_stiffness(mesh: Mesh, material: Material, elements: NDArray[np.int64]) -> Array:
    """Return stiffness matrices (m, 60, 60) of elements of a mesh (N/m)."""
    settings = mesh.settings
    parts = sub_stiffness(settings.divisions, settings.cell, material)
    rows, columns = packed_indices()
    weights = gauss_weights(mesh.fill[elements], mesh.moment[elements]).reshape(len(elements), -1)
    packed = (weights + settings.void * (0.125 - weights)) @ parts
    out = np.empty((len(elements), 3 * CELL_NODES, 3 * CELL_NODES))
    out[:, rows, columns] = packed
    out[:, columns, rows] = packed
    return out


def mass_matrix(mesh: Mesh, density: float) -> sparse.csr_array:
    """Return the consistent mass of one direction of displacement, (n, n) (kg)."""
    settings = mesh.settings
    parts = sub_mass(settings.divisions, settings.cell).reshape(-1, CELL_NODES**2)
    weights = gauss_weights(mesh.fill, mesh.moment).reshape(len(mesh.cells), -1)
    entries = density * (weights @ parts)
    row = np.repeat(mesh.nodes, CELL_NODES, axis=1)
    column = np.tile(mesh.nodes, (1, CELL_NODES))
    count = len(mesh.points)
    matrix = sparse.coo_array(
        (entries.ravel(), (row.ravel(), column.ravel())), shape=(count, count)
    )
    return matrix.tocsr()


def isostatic_springs(mesh: Mesh, material: Material) -> Array:
    """Return six springs (on the diagonal) that hold the body and carry nothing under balanced loads.

    Three nodes of well filled cells, far apart: one held in three directions, one in the two across
    the line between them, one out of their plane.

    Returns
    -------
    (3 n,) ndarray
        (N/m)
    """
    filled = mesh.fill.mean(axis=1)
    corners = np.unique(mesh.nodes[filled >= 0.5 * filled.max(), :8])
    points = mesh.points[corners]
    first = int(np.argmin(points.sum(axis=1)))
    offset = points - points[first]
    second = int(np.argmax((offset**2).sum(axis=1)))
    line = int(np.argmax(np.abs(offset[second])))
    direction = offset[second] / np.linalg.norm(offset[second])
    aside = offset - np.outer(offset @ direction, direction)
    # The held direction of the third node must turn the body about the line: take the choice that
    # gives the largest moment.
    others = [axis for axis in range(3) if axis != line]
    moment = np.cross(direction, aside)[:, others]
    third, which = np.unravel_index(int(np.argmax(np.abs(moment))), moment.shape)
    out = np.zeros(3 * len(mesh.points))
    stiffness = material.young_pa * mesh.settings.cell
    out[3 * corners[first] + np.arange(3)] = stiffness
    out[3 * corners[second] + np.array(others)] = stiffness
    out[3 * corners[third] + others[which]] += stiffness
    return out


def solid_of(triangles: Array, material: Material, settings: MeshSettings) -> Solid:
    """Mesh a surface and factorise its stiffness.

    Parameters
    ----------
    triangles : (m, 3, 3) array_like
        (m)
    material : Material
    settings : MeshSettings

    Returns
    -------
    Solid

    Raises
    ------
    InputError
        See `technic.fem.solid.grid.mesh_part`.
    """
    return factorized(mesh_part(triangles, settings), material)


def factorized(mesh: Mesh, material: Material) -> Solid:
    """Factorise the stiffness of a mesh."""
    factor = factorize(
        mesh.cells,
        mesh.nodes,
        lambda elements: element_stiffness(mesh, material, elements),
        isostatic_springs(mesh, material),
    )
    return Solid(mesh, material, factor, mass_matrix(mesh, material.density))


def build_super_element(
    part_id: str,
    triangles: Array,
    ports: Sequence[Port],
    material: Material,
    settings: MeshSettings | None = None,
    *,
    key: str = "",
) -> SuperElement:
    """Condense a part onto its ports.

    Parameters
    ----------
    part_id : str
    triangles : (m, 3, 3) array_like
        Surface in part coordinates (m).
    ports : sequence of Port
    material : Material
    settings : MeshSettings, optional
    key : str
        Stored with the result.

    Returns
    -------
    SuperElement

    Raises
    ------
    InputError
        The surface is not one body, a port has no material, or frames depend on each other and are
        not at the same place.
    """
    if not ports:
        raise InputError(f"part {part_id}: a super-element needs at least one port")
    solid = solid_of(triangles, material, settings or MeshSettings())
    return condense(part_id, solid, ports, key=key)


def condense(part_id: str, solid: Solid, ports: Sequence[Port], *, key: str = "") -> SuperElement:
    """Condense a factorised part onto its ports; parameters as for `build_super_element`."""
    return condense_and_lift(part_id, solid, ports, key=key)[0]


def condense_and_lift(
    part_id: str, solid: Solid, ports: Sequence[Port], *, key: str = ""
) -> tuple[SuperElement, Array]:
    """Condense a factorised part, and say how its mesh follows the frames.

    Returns
    -------
    element : SuperElement
    lift : (3 n, 6 p) ndarray
        The mesh's unknowns for unit twists of the frames.
    """
    mesh = solid.mesh
    samples = [sample_port(mesh, port) for port in ports]
    kept, merged = _merge_shared(ports, samples)
    chosen = [ports[i] for i in kept]
    rows = sparse.vstack([frame_rows(mesh, ports[i], samples[i]) for i in kept]).tocsr()
    # A few columns at a time, and in place below: with dozens of ports this array is the largest.
    unknowns = rows.shape[0]
    shapes = np.empty((rows.shape[1], unknowns))
    for begin in range(0, unknowns, COLUMNS):
        part = slice(begin, begin + COLUMNS)
        shapes[:, part] = solid.factor.solve(rows[part].T.toarray())
    flexibility = np.asarray(rows @ shapes)
    flexibility = (flexibility + flexibility.T) / 2.0
    points = np.array([port.position for port in chosen])
    _, centroid = mass_and_centroid(solid.mesh, solid.mass)
    motion = rigid_motions(points, np.zeros(3))
    stiffness, fineness = _invert(flexibility, motion, chosen, part_id)

    # u = shapes K_p q + R a(q), with a(q) from C u = q in the least-squares sense (it is exact).
    scale = np.tile([1.0, 1.0, 1.0, LENGTH, LENGTH, LENGTH], len(chosen))
    left = np.linalg.pinv(motion * scale[:, None]) * scale
    follow = left @ (np.eye(len(motion)) - flexibility @ stiffness)
    rigid = solid.rigid
    lift = shapes
    for begin in range(0, len(lift), ROWS):
        part = slice(begin, begin + ROWS)
        lift[part] = shapes[part] @ stiffness + rigid[part] @ follow
    mass = np.empty((unknowns, unknowns))
    for begin in range(0, unknowns, COLUMNS):
        part = slice(begin, begin + COLUMNS)
        mass[:, part] = lift.T @ solid.apply_mass(np.ascontiguousarray(lift[:, part]))
    mass = (mass + mass.T) / 2.0
    error = _mass_error(solid, lift, stiffness, mass)
    element = SuperElement(
        id=part_id,
        ports=tuple(port.name for port in chosen),
        points=points,
        stiffness=stiffness,
        mass=mass,
        centroid=centroid,
        merged=merged,
        condensation_error=error,
        fineness=fineness,
        cell=mesh.settings.cell,
        key=key,
    )
    return element, lift


def mass_and_centroid(mesh: Mesh, mass: sparse.csr_array) -> tuple[float, Array]:
    """Return the mass (kg) and its centre (m)."""
    per_node = np.asarray(mass.sum(axis=0)).ravel()
    total = float(per_node.sum())
    return total, per_node @ mesh.points / total


def free_modes(solid: Solid, start: Array, rounds: int = 2) -> tuple[Array, Array]:
    """Return free vibration modes of the fine mesh near a subspace, by inverse iteration.

    Parameters
    ----------
    solid : Solid
    start : (3 n, k) ndarray
        Approximate modes; rigid motions in them are removed.
    rounds : int
        Each reduces the error of a mode by the ratio of its eigenvalue to the first one left out.

    Returns
    -------
    eigenvalues : (k,) ndarray
        (rad2/s2), ascending.
    modes : (3 n, k) ndarray
    """
    rigid = solid.rigid
    mass_rigid = solid.apply_mass(rigid)
    gram = rigid.T @ mass_rigid

    def clean(x: Array) -> Array:
        return np.asarray(x - rigid @ np.linalg.solve(gram, mass_rigid.T @ x))

    x = clean(start)
    values = np.zeros(x.shape[1])
    for _ in range(rounds):
        # The springs carry nothing under loads that balance: then K y = M x up to a rigid motion.
        load = solid.apply_mass(x)
        y = clean(solid.factor.solve(load))
        energy = y.T @ load
        inertia = y.T @ solid.apply_mass(y)
        values, turn = eigh((energy + energy.T) / 2.0, (inertia + inertia.T) / 2.0)
        x = y @ turn
    return values, x


def _mass_error(solid: Solid, lift: Array, stiffness: Array, mass: Array) -> float:
    """Return how far the lowest elastic eigenvalues of the condensed part are off the fine mesh's."""
    if len(stiffness) < 12:
        return 0.0
    values, modes = eigh(stiffness, mass, subset_by_index=(6, 6 + 2 * CHECKED_MODES - 1))
    exact, _ = free_modes(solid, lift @ modes)
    low = slice(0, CHECKED_MODES)
    return float(np.abs(values[low] / exact[low] - 1.0).max())


def _merge_shared(
    ports: Sequence[Port], samples: Sequence[Samples]
) -> tuple[list[int], tuple[tuple[str, str], ...]]:
    """Merge ports whose frames are the same motion: same place, measured on the same elements.

    Such pairs occur in real parts (the two ends of a very short bore); their frames would be
    dependent.
    """
    kept: list[int] = []
    merged: list[tuple[str, str]] = []
    for i, port in enumerate(ports):
        mine = set(samples[i].elements.tolist())
        for j in kept:
            other = set(samples[j].elements.tolist())
            near = np.linalg.norm(port.position - ports[j].position) < LENGTH / 8.0
            if near and len(mine & other) >= 0.9 * min(len(mine), len(other)):
                merged.append((port.name, ports[j].name))
                break
        else:
            kept.append(i)
    return kept, tuple(merged)


def _invert(
    flexibility: Array, motion: Array, ports: Sequence[Port], part_id: str
) -> tuple[Array, float]:
    """Return the port stiffness and how independent the frames are.

    Raises
    ------
    InputError
        Names the ports whose frames depend on each other.
    """
    count = len(ports)
    if count == 1:
        return np.zeros((6, 6)), 1.0
    scale = np.tile([1.0, 1.0, 1.0, LENGTH, LENGTH, LENGTH], count)
    scaled = flexibility * np.outer(scale, scale)
    full, _ = np.linalg.qr(motion * scale[:, None], mode="complete")
    basis = full[:, 6:]
    balanced = basis.T @ scaled @ basis
    values, vectors = np.linalg.eigh((balanced + balanced.T) / 2.0)
    fineness = float(values[0] / values[-1])
    local = np.median(np.diag(scaled))
    if values[0] < DEPENDENT * min(values[-1], local):
        load = np.abs(basis @ vectors[:, 0]).reshape(count, 6).max(axis=1)
        names = [
            port.name for port, size in zip(ports, load, strict=True) if size > 0.1 * load.max()
        ]
        raise InputError(
            f"part {part_id}: the frames of ports {', '.join(names)} depend on each other",
            remedy="use smaller cells, or leave one of these ports out",
        )
    inverse = basis @ ((vectors / values) @ vectors.T) @ basis.T
    stiffness = inverse * np.outer(scale, scale)
    return project_rigid(stiffness, motion), fineness
