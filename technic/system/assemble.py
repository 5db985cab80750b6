"""Assembly -> K, J, A, S, M: the code reads as section 2 of the design.

Unknowns stay in each part's own axes; the world enters in the joint rows only. ``K`` and ``M`` are block
diagonal with one block per part, so equal parts share one element.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property

import numpy as np
from numpy.typing import NDArray
from scipy import sparse

from technic.assembly.model import Assembly
from technic.fem.element import Element
from technic.geometry import Array, shift_twist, turn_twist
from technic.parts.definition import Body, MassProperties
from technic.system.part_models import (
    ElementFactory,
    element_of,
    rigid_element_of,
    solid_element_of,
)
from technic.system.plane import check_plane, in_plane
from technic.system.rows import HeldRows, held_rows, transfer

__all__ = [
    "ElementFactory",
    "Probe",
    "System",
    "assemble",
    "element_of",
    "rigid_element_of",
    "solid_element_of",
]


@dataclass(frozen=True, eq=False)
class System:
    """The matrices of an assembly, SI units.

    Parameters
    ----------
    assembly : Assembly
    elements : tuple of Element
        One per part; equal parts with equal attachments share the object.
    offsets : (p + 1,) ndarray of int
        Part i owns the unknowns ``offsets[i]:offsets[i + 1]``.
    K : (n, n) sparse
        Stiffness of the parts.
    A : (r, n) sparse
        Held relative motions: ``A x``.
    rows : HeldRows
        Joint, motion and stiffness of every row of `A`.
    mass_matrix : (n, n) sparse
        Consistent mass (kg and consistent).
    R : (n, 6 p) sparse
        Rigid motions: unknowns when each part moves by a twist about its centroid, world axes.
    probes : (6 q, n) sparse
        Twist of each probed point, world axes.
    """

    assembly: Assembly
    elements: tuple[Element, ...]
    offsets: NDArray[np.int64]
    K: sparse.csr_array
    A: sparse.csr_array
    rows: HeldRows
    mass_matrix: sparse.csr_array
    R: sparse.csr_array
    probes: sparse.csr_array

    @property
    def size(self) -> int:
        """Number of unknowns."""
        return int(self.offsets[-1])

    @cached_property
    def elastic(self) -> NDArray[np.bool_]:
        """Rows of finite stiffness, (r,); the others are held rigidly."""
        return np.isfinite(self.rows.stiffness)

    @cached_property
    def S(self) -> sparse.dia_array:
        """Diagonal matrix of the finite joint stiffnesses; rows held rigidly are left out."""
        return sparse.diags_array(self.rows.stiffness[self.elastic])

    @cached_property
    def J(self) -> sparse.csr_array:
        """Joint stiffness ``A^T S A`` of the rows of finite stiffness."""
        a = self.A[self.elastic]
        return sparse.csr_array(a.T @ self.S @ a)

    @cached_property
    def mass(self) -> float:
        """Mass of the assembly (kg)."""
        return float(sum(p.mass_properties.mass for p in self.assembly.parts))

    @cached_property
    def M(self) -> sparse.csr_array:
        """Mean square: ``x^T M x`` is the mass-weighted mean of ``|u|^2`` over the assembly (m2)."""
        return sparse.csr_array(self.mass_matrix / self.mass)

    def nodal(self) -> sparse.csr_array:
        """Return the unweighted measure of the paper: the sum of ``|u|^2`` over all nodes.

        Node displacements do not see rotations of nodes, such as a straight beam turning about
        itself; a billionth of the mean square is added so that every unknown has a measure.
        """
        squares = {id(e): np.einsum("pin,pim->nm", e.nodes, e.nodes) for e in self.elements}
        nodes = sum(len(e.nodes) for e in self.elements)
        seen = _block_diagonal([squares[id(e)] for e in self.elements])
        return sparse.csr_array(seen + 1e-9 * nodes * self.M)

    def part_slice(self, part: int) -> slice:
        """Return the unknowns of a part."""
        return slice(int(self.offsets[part]), int(self.offsets[part + 1]))


@dataclass(frozen=True, slots=True, eq=False)
class Probe:
    """A point of a part where a load acts or a displacement is asked for.

    Parameters
    ----------
    part : int
    point : (3,) array_like
        World coordinates (m).
    port : str or None
        The port it belongs to.
    """

    part: int
    point: Array
    port: str | None = None


def assemble(
    assembly: Assembly,
    *,
    element: ElementFactory = solid_element_of,
    probes: tuple[Probe, ...] = (),
) -> System:
    """Return the matrices of an assembly.

    Parameters
    ----------
    assembly : Assembly
    element : callable
        What a part becomes: a condensed solid model where one is shipped (`solid_element_of`), its
        own body (`element_of`: frame members, a mesh), or a rigid body (`rigid_element_of`).
    probes : tuple of Probe
        Points whose twist is wanted beside the joints'.

    Raises
    ------
    InputError
        A part cannot be meshed, or a part of a two-dimensional assembly leaves the plane z = 0.
    """
    if assembly.dimension == 2:
        check_plane(assembly)
    elements, frames, origins = _elements(assembly, element, probes)
    links = len(assembly.joints) + len(assembly.supports)
    offsets = np.concatenate([[0], np.cumsum([e.size for e in elements])]).astype(np.int64)
    rows = held_rows(assembly)
    side_a, side_b = transfer(assembly, origins[:links], world=False)
    n = int(offsets[-1])
    a = _joint_matrix(assembly, rows, (side_a, side_b), frames, offsets, n)
    if assembly.parts:
        turns = turn_twist(np.array([p.pose.rotation for p in assembly.parts]))
        rigid = [e.rigid @ t.T for e, t in zip(elements, turns, strict=True)]
    else:
        rigid = []
    return System(
        assembly=assembly,
        elements=elements,
        offsets=offsets,
        K=_block_diagonal([e.stiffness for e in elements]),
        A=a,
        rows=rows,
        mass_matrix=_block_diagonal([e.mass for e in elements]),
        R=_block_diagonal(rigid),
        probes=_probe_matrix(assembly, probes, frames[links:], origins[links:, 0], offsets, n),
    )


def _probe_matrix(
    assembly: Assembly,
    probes: tuple[Probe, ...],
    frames: list[tuple[Array | None, Array | None]],
    origins: Array,
    offsets: NDArray[np.int64],
    n: int,
) -> sparse.csr_array:
    """Return the twist of every probe in world axes."""
    out = sparse.lil_array((6 * len(probes), n))
    for k, (probe, (frame, _), origin) in enumerate(zip(probes, frames, origins, strict=True)):
        turn = turn_twist(assembly.parts[probe.part].pose.rotation)
        own = slice(int(offsets[probe.part]), int(offsets[probe.part + 1]))
        assert frame is not None  # every probe has one
        out[6 * k : 6 * k + 6, own] = shift_twist(np.asarray(probe.point) - origin) @ turn @ frame
    return sparse.csr_array(out)


def _elements(
    assembly: Assembly, element: ElementFactory, probes: tuple[Probe, ...]
) -> tuple[tuple[Element, ...], list[tuple[Array | None, Array | None]], Array]:
    """Build each part's element once per kind, and pick both frames of every joint and support."""
    links: list[tuple[Array, tuple[int, ...], tuple[str | None, ...]]] = []
    for joint in assembly.joints:
        links.append((joint.point, joint.parts, joint.ports or (None, None)))
    for support in assembly.supports:
        point = assembly.parts[support.part].centroid if support.point is None else support.point
        links.append((point, (support.part,), (None,)))
    links += [(probe.point, (probe.part,), (probe.port,)) for probe in probes]
    attached: list[list[tuple[int, str | None]]] = [[] for _ in assembly.parts]
    place: list[list[tuple[int, int]]] = []
    owners: list[int] = []
    points: list[Array] = []
    for point, parts, ports in links:
        row = []
        for index, port in zip(parts, ports, strict=True):
            attached[index].append((len(owners), port))
            owners.append(index)
            points.append(point)
            row.append((index, len(attached[index]) - 1))
        place.append(row)
    turns = np.array([p.pose.rotation for p in assembly.parts]).reshape(-1, 3, 3)
    shifts = np.array([p.pose.translation for p in assembly.parts]).reshape(-1, 3)
    local = np.array(points).reshape(-1, 3) - shifts[owners]
    # rounding to a nanometre makes equal parts share one element
    local = np.einsum("kji,kj->ki", turns[owners], local).round(9) + 0.0
    cache: dict[object, Element] = {}
    elements = []
    for part, items in zip(assembly.parts, attached, strict=True):
        at = local[[k for k, _ in items]]
        names = tuple(port for _, port in items)
        key = (_identity(part.body, part.mass_properties, part.number), names, at.tobytes())
        if key not in cache:
            made = element(part, at, names)
            cache[key] = in_plane(made) if assembly.dimension == 2 else made
        elements.append(cache[key])
    frames: list[tuple[Array | None, Array | None]] = []
    origins = np.zeros((len(links), 2, 3))
    for k, row in enumerate(place):
        pair: list[Array | None] = [None, None]
        for side, (index, slot) in enumerate(row):
            owner = elements[index]
            pair[side] = owner.frames[slot]
            origins[k, side] = turns[index] @ owner.frame_points[slot] + shifts[index]
        frames.append((pair[0], pair[1]))
    return tuple(elements), frames, origins


def _identity(body: Body, properties: MassProperties, number: str) -> tuple[int, int, str]:
    return id(body), id(properties), number


_BATCH = 512
"""Frames multiplied at a time: enough to be fast, few enough to stay small."""


def _joint_matrix(
    assembly: Assembly,
    rows: HeldRows,
    sides: tuple[Array, Array],
    frames: list[tuple[Array | None, Array | None]],
    offsets: NDArray[np.int64],
    n: int,
) -> sparse.csr_array:
    """Return ``A``: row r is ``C_k (T_i W_i x_i - T_j W_j x_j)`` for its link k."""
    count = len(rows.link)
    owners = [j.parts for j in assembly.joints] + [(s.part, s.part) for s in assembly.supports]
    number = np.full((len(owners), 6), -1, dtype=np.int64)
    number[rows.link, rows.motion] = np.arange(count)
    # frames of equal width are multiplied together
    widths: dict[int, list[tuple[int, int]]] = {}
    for k, pair in enumerate(frames[: len(owners)]):
        for side, frame in enumerate(pair):
            if frame is not None:
                widths.setdefault(frame.shape[1], []).append((k, side))
    data, row_index, column_index = [], [], []
    both = np.stack(sides)
    for chosen in widths.values():
        for start in range(0, len(chosen), _BATCH):
            batch = chosen[start : start + _BATCH]
            link, side = np.array(batch).T
            stacked = np.array([frames[k][s] for k, s in batch])
            blocks = both[side, link] @ stacked
            row = np.broadcast_to(number[link][:, :, None], blocks.shape)
            used = (row >= 0) & (blocks != 0.0)
            first = offsets[[owners[k][s] for k, s in batch]]
            data.append(blocks[used])
            row_index.append(row[used])
            column_index.append((first[:, None, None] + np.arange(blocks.shape[2]) + 0 * row)[used])
    if not data:
        return sparse.csr_array((count, n))
    coordinates = (np.concatenate(row_index), np.concatenate(column_index))
    return sparse.csr_array((np.concatenate(data), coordinates), shape=(count, n))


def _block_diagonal(blocks: list[Array]) -> sparse.csr_array:
    """Return the block diagonal matrix; equal blocks (the same object) are read once."""
    pattern: dict[int, tuple[Array, NDArray[np.intp], NDArray[np.intp]]] = {}
    data, rows, columns = [], [], []
    row = column = 0
    for block in blocks:
        if id(block) not in pattern:
            i, j = np.nonzero(block)
            pattern[id(block)] = (block[i, j], i, j)
        values, i, j = pattern[id(block)]
        data.append(values)
        rows.append(i + row)
        columns.append(j + column)
        row += block.shape[0]
        column += block.shape[1]
    if not data:
        return sparse.csr_array((0, 0))
    coordinates = (np.concatenate(rows), np.concatenate(columns))
    return sparse.csr_array((np.concatenate(data), coordinates), shape=(row, column))
