"""The paper's construction of the joint matrix, beside ours.

The paper (Liu et al. 2022, section 4.1) selects a few nodes of both parts at the joint, collects how they
may move when the joint is respected (`A_allow`), and takes the null space of its transpose as the joint's
matrix. The columns of `A_allow` are the motions of both parts together, the freed motions of one part
against the other, and the deformations of the selected nodes of each part: they have more freedoms than a
rigid motion (4 against 3 in the plane, 9 against 6 in space), and a joint does not hold what a part does
in itself.

The rows of that null space are some orthonormal basis: none of them means one motion, so none can be given
a stiffness of its own. The program therefore writes the held motions down one by one
(`technic.system.rows`), and keeps this construction to prove, joint by joint, that both hold the same.
"""

from __future__ import annotations

import numpy as np
from scipy import linalg

from technic.assembly.model import Joint
from technic.geometry import Array, readonly, shift_twist
from technic.system.assemble import System

__all__ = [
    "allowed_motions",
    "held_combinations",
    "paper_rows",
    "rigid_displacements",
    "row_space",
    "select_nodes",
    "selected_nodes",
]

PLANE = np.array([0, 1, 5])

RANK = 1e-9
"""Singular values below this share of the largest are zero: lengths are divided by the distance of the
selected nodes, so that all entries are of order one and exact cases come out near 1e-16."""

ON_A_LINE = 1e-6
"""Nodes that leave a line by less than this share of the part's size do not fix its rotation about it."""


def select_nodes(points: Array, at: Array, dimension: int) -> list[int]:
    """Return nodes that represent a part at a joint: 2 in the plane, 3 not on a line in space.

    The node nearest to the joint comes first, then the nearest that determine a rigid motion with it.

    Parameters
    ----------
    points : (n, 3) ndarray
        Nodes of the part (m).
    at : (3,) ndarray
        The joint's point.
    dimension : int
        2 or 3.

    Returns
    -------
    list of int
        Fewer than `dimension` when all nodes coincide or lie on a line.
    """
    order = np.argsort(np.linalg.norm(points - at, axis=1).round(12), kind="stable")
    size = float(np.ptp(points, axis=0).max())
    chosen = [int(order[0])]
    for k in order[1:]:
        arms = points[[*chosen[1:], int(k)]] - points[chosen[0]]
        if np.linalg.svd(arms, compute_uv=False)[-1] > ON_A_LINE * size:
            chosen.append(int(k))
        if len(chosen) == dimension:
            break
    return chosen


def rigid_displacements(nodes: Array, at: Array, dimension: int) -> Array:
    """Return the displacements of nodes per twist about a point, (dimension * m, 6)."""
    return np.asarray(shift_twist(nodes - at)[:, :dimension, :].reshape(-1, 6))


def allowed_motions(joint: Joint, nodes_a: Array, nodes_b: Array, dimension: int) -> Array:
    """Return ``A_allow``: displacements of the selected nodes that the joint allows.

    Parameters
    ----------
    joint : Joint
    nodes_a, nodes_b : (m, 3) ndarray
        Selected nodes of both parts, world coordinates (m).
    dimension : int

    Returns
    -------
    (dimension * (m_a + m_b), k) ndarray
        Columns: the rigid motions of both parts together, each freed motion of the second alone, then
        the deformations of either selection.
    """
    length = _reach(nodes_a, nodes_b, joint.point)
    unit = np.diag([1.0] * 3 + [1.0 / length] * 3)
    move_a = rigid_displacements(nodes_a, joint.point, dimension) @ unit
    move_b = rigid_displacements(nodes_b, joint.point, dimension) @ unit
    free = linalg.block_diag(joint.axes, joint.axes)[np.logical_not(joint.held)].T
    used = np.arange(6)
    if dimension == 2:
        # motions out of the plane are neither held nor freed: there are none
        used = PLANE
        free = free[:, np.abs(free[PLANE]).max(axis=0, initial=0.0) > 0.5]
    alone = np.vstack([np.zeros((len(move_a), free.shape[1])), move_b @ free])
    bend = linalg.block_diag(
        held_combinations(move_a[:, used]).T, held_combinations(move_b[:, used]).T
    )
    return np.hstack([np.vstack([move_a, move_b])[:, used], alone, bend])


def held_combinations(allowed: Array) -> Array:
    """Return the null space of ``A_allow^T`` as orthonormal rows."""
    u, values, _ = np.linalg.svd(allowed, full_matrices=True)
    return np.asarray(u[:, int(np.sum(values > RANK * values[0])) :].T)


def row_space(matrix: Array) -> Array:
    """Return an orthonormal basis of the row space, as rows."""
    if matrix.size == 0:
        return np.zeros((0, matrix.shape[1]))
    _, values, vt = np.linalg.svd(matrix, full_matrices=False)
    return np.asarray(vt[values > RANK * max(float(values[0]), 1e-300)])


def selected_nodes(system: System, link: int, side: int) -> tuple[Array, Array]:
    """Return the nodes that represent one part of a joint, and how they follow from the unknowns.

    The nodes are those of the element. Where they lie on a line in space (a straight bar), points of the
    section at the joint join them: the frame there carries them.

    Parameters
    ----------
    system : System
    link : int
        Index of the joint.
    side : int
        0 or 1.

    Returns
    -------
    points : (m, 3) ndarray
        World coordinates (m).
    maps : (m, 3, n_i) ndarray
        From the part's unknowns to the displacements of the points, world axes.
    """
    assembly = system.assembly
    joint = assembly.joints[link]
    index = joint.parts[side]
    part, element = assembly.parts[index], system.elements[index]
    at = part.pose.to_local(joint.point)
    points, maps = element.node_points, element.nodes
    dimension = assembly.dimension
    chosen = select_nodes(points, at, dimension)
    if len(chosen) < dimension:
        slot = sum(index in other.parts for other in assembly.joints[:link])
        center, frame = element.frame_points[slot], element.frames[slot]
        size = float(np.ptp(points, axis=0).max())
        arms = size / 10.0 * np.vstack([np.eye(3), np.zeros((1, 3))])
        maps = np.concatenate([maps, (shift_twist(arms) @ frame)[:, :3]])
        points = np.concatenate([points, center + arms])
        chosen = select_nodes(points, at, dimension)
    turned = np.einsum("ij,mjn->min", part.pose.rotation, maps[chosen])
    return part.pose.points(points[chosen]), turned


def paper_rows(system: System, link: int) -> Array:
    """Return the paper's matrix of one joint in all unknowns of the assembly.

    Returns
    -------
    (r, n) ndarray
        Orthonormal in the displacements of the selected nodes.
    """
    joint, dimension = system.assembly.joints[link], system.assembly.dimension
    sides = [selected_nodes(system, link, side) for side in (0, 1)]
    held = held_combinations(allowed_motions(joint, sides[0][0], sides[1][0], dimension))
    out = np.zeros((len(held), system.size))
    start = 0
    for (_, maps), part in zip(sides, joint.parts, strict=True):
        flat = maps[:, :dimension].reshape(-1, maps.shape[2])
        out[:, system.part_slice(part)] += held[:, start : start + len(flat)] @ flat
        start += len(flat)
    return readonly(out)


def _reach(nodes_a: Array, nodes_b: Array, at: Array) -> float:
    """Return the distance that makes rotations comparable with translations."""
    arms = np.vstack([nodes_a, nodes_b]) - at
    return max(float(np.linalg.norm(arms, axis=1).max()), 1e-300)
