"""What a moving model consists of: groups of members, truss bars, sides of links, matrices."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray
from scipy import sparse

from technic.geometry import Array, cross
from technic.parts.definition import Material, Section

__all__ = [
    "Index",
    "Matrices",
    "Members",
    "Sides",
    "Trusses",
    "add_blocks",
    "sides_of",
    "turn_of",
]

Index = NDArray[np.int64]


@dataclass(frozen=True, slots=True, eq=False)
class Members:
    """Frame elements of one section and material: nodes at both ends, unknowns (-1: held)."""

    first: Index
    last: Index
    normals: Array
    section: Section
    material: Material
    dofs: Index


@dataclass(frozen=True, slots=True, eq=False)
class Trusses:
    """Truss bars: vertices at both ends, unknowns (-1: held)."""

    first: Index
    last: Index
    areas: Array
    materials: tuple[Material, ...]
    dofs: Index


@dataclass(frozen=True, slots=True, eq=False)
class Sides:
    """Sides of links on one kind of part.

    Parameters
    ----------
    link : (s,) ndarray of int
    sign : (s,) ndarray
        1, or -1 for the second part of a joint.
    owner : (s,) ndarray of int
        Node of a frame, number of a truss bar, or number of a constant map.
    share : (s,) ndarray
        For truss bars: how far along the bar.
    dofs : (s, n) ndarray of int
    """

    link: Index
    sign: Array
    owner: Index
    share: Array
    dofs: Index


@dataclass(frozen=True, slots=True, eq=False)
class Matrices:
    """Matrices at one set of positions.

    Parameters
    ----------
    stiffness : (n, n) sparse
        ``K + J``.
    measure : (n, n) sparse
        ``M``: mass matrix over the mass.
    constraints : (c, n) sparse
        Rows held rigidly.
    rows : (r, n) sparse
        All held motions, ``A``.
    mass : float
        kg.
    """

    stiffness: sparse.csr_array
    measure: sparse.csr_array
    constraints: sparse.csr_array
    rows: sparse.csr_array
    mass: float


def turn_of(spans: Array, normals: Array) -> Array:
    """Return members' own axes as rows, (m, 3, 3); spans may be complex."""
    x = spans / np.sqrt(np.sum(spans * spans, axis=1))[:, None]
    z = normals - np.sum(normals * x, axis=1)[:, None] * x
    z = z / np.sqrt(np.sum(z * z, axis=1))[:, None]
    return np.stack([x, cross(z, x), z], axis=1)


def sides_of(rows: list[Any], width: int) -> Sides:
    """Return rows of (link, sign, owner, share, unknowns) as arrays."""
    return Sides(
        np.array([r[0] for r in rows], dtype=np.int64),
        np.array([r[1] for r in rows], dtype=float),
        np.array([r[2] for r in rows], dtype=np.int64),
        np.array([r[3] for r in rows], dtype=float),
        np.array([r[4] for r in rows], dtype=np.int64).reshape(-1, width),
    )


def add_blocks(blocks: list[tuple[Array, Index]], size: int) -> sparse.csr_array:
    """Add blocks at their unknowns."""
    data, rows, columns = [np.zeros(0)], [np.zeros(0, np.int64)], [np.zeros(0, np.int64)]
    for values, dofs in blocks:
        i = np.broadcast_to(dofs[:, :, None], values.shape)
        j = np.broadcast_to(dofs[:, None, :], values.shape)
        keep = (i >= 0) & (j >= 0) & (values != 0.0)
        data.append(values[keep])
        rows.append(i[keep])
        columns.append(j[keep])
    place = (np.concatenate(rows), np.concatenate(columns))
    return sparse.csr_array((np.concatenate(data), place), shape=(size, size))
