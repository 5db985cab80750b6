"""Finite motion: move parts a real step, put the joints back together, count again.

At first order a frame may seem to move where it only shakes: its joints allow a velocity but no path. The
step is taken along the velocity, the joints are closed again by Gauss-Newton with the constraints written
exactly (rotations are finite), and what can still move there is counted.
"""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray
from scipy import sparse
from scipy.sparse import linalg as sparse_linalg

from technic.assembly.joint_types import JointType
from technic.assembly.model import Assembly
from technic.geometry import Array, Pose, rotation_matrix, rotation_vector, skew
from technic.rigidity.kinematics import Kinematics, merge_fixed, needed_links

__all__ = [
    "Links",
    "Placement",
    "body_links",
    "close_joints",
    "jacobian",
    "joint_gaps",
    "link_arrays",
    "link_sides",
    "placed_assembly",
    "start",
    "step",
]

CLOSED = 1e-9
"""Joints are closed when no held motion is off by more than this (scaled lengths, radians)."""

NEARLY = 1e3
"""Where joints contradict each other a little, gaps this many times as wide are as good as it gets."""

STALLED = 0.8
"""No more is to be gained when the widest gap shrinks by less than this: on a path it falls a thousandfold,
elsewhere to a quarter."""

ITERATIONS = 40
"""Gauss-Newton steps: on a path it takes five; where there is none each step halves the distance."""

DAMPING = 1e-11
"""Relative damping of the normal equations: just above rounding, so that free motions stay put."""

CAUTION = 30.0
"""More damping while joints gape, this times the square of the widest gap. In overconstrained linkages
(Bennett's, Bricard's) the joints seem to hold a motion as long as they gape, and undamped steps run away
along it. Damping by the square of the residual keeps convergence quadratic wherever there is a path
(Yamashita and Fukushima, Computing Supplement 15, 2001, 239-249)."""


@dataclass(frozen=True, slots=True, eq=False)
class Placement:
    """Where the parts of a component are after a finite motion.

    Parameters
    ----------
    origins : (n, 3) ndarray
        Centroids (m).
    turns : (n, 3, 3) ndarray
        Rotation of each part since the start.
    """

    origins: Array
    turns: Array


@dataclass(frozen=True, slots=True, eq=False)
class Links:
    """Joints and supports of a component as arrays: side 0 and 1 (for supports the ground).

    Parameters
    ----------
    parts : (n, 2) ndarray of int
        Number of the body on either side; -1 for the ground.
    points : (n, 3) ndarray
        In the world (m).
    axes : (n, 3, 3) ndarray
        Rows: the axes of the link in the world.
    arms : (n, 2, 3) ndarray
        From the body's reference point, or the world's origin, to the point (m).
    held : (n, 6) ndarray of bool
    universal : (n,) ndarray of bool
    """

    parts: NDArray[np.int64]
    points: Array
    axes: Array
    arms: Array
    held: NDArray[np.bool_]
    universal: NDArray[np.bool_]


def start(kin: Kinematics, parts: tuple[int, ...]) -> Placement:
    """Return the placement in which the model was read."""
    return Placement(kin.origins[list(parts)].copy(), np.tile(np.eye(3), (len(parts), 1, 1)))


def step(placement: Placement, twists: Array) -> Placement:
    """Return the placement after every part moved by a finite twist about its centroid (m, rad)."""
    return Placement(
        placement.origins + twists[:, :3],
        rotation_matrix(twists[:, 3:]) @ placement.turns,
    )


def link_arrays(
    kin: Kinematics, bodies: tuple[int, ...], links: list[int], place: dict[int, int]
) -> Links:
    """Return links as arrays; `place` says which of the bodies, given by a part each, a part is of."""
    joints, supports = kin.assembly.joints, kin.assembly.supports
    count = len(joints)
    points = np.zeros((len(links), 3))
    axes = np.tile(np.eye(3), (len(links), 1, 1))
    owner = np.full((len(links), 2), -1)
    universal = np.zeros(len(links), dtype=bool)
    for row, k in enumerate(links):
        owner[row, : len(kin.owners[k])] = [place[p] for p in kin.owners[k]]
        if k < count:
            points[row], axes[row] = joints[k].point, joints[k].axes
            universal[row] = joints[k].type is JointType.UNIVERSAL
        else:
            support = supports[k - count]
            points[row] = kin.origins[support.part] if support.point is None else support.point
    origins = kin.origins[list(bodies)]
    arms = points[:, None, :] - np.where(owner[..., None] < 0, 0.0, origins[owner])
    return Links(owner, points, axes, arms, kin.held[links], universal)


def body_links(
    kin: Kinematics, parts: tuple[int, ...], links: list[int]
) -> tuple[tuple[int, ...], NDArray[np.int64], Links]:
    """Return the links between bodies: parts fixed to each other are one; links that follow from others
    are left out.

    Returns
    -------
    bodies : tuple of int
        The part that stands for each body, sorted.
    body : (n,) ndarray of int
        Body of each part.
    links : Links
    """
    heads = merge_fixed(kin, parts, links)
    bodies = tuple(sorted(set(heads.values())))
    number = {h: k for k, h in enumerate(bodies)}
    place = {p: number[heads[p]] for p in parts}
    outer = [
        k
        for k in needed_links(kin, links)
        if len({place[p] for p in kin.owners[k]}) == len(kin.owners[k])
    ]
    return bodies, np.array([place[p] for p in parts]), link_arrays(kin, bodies, outer, place)


def link_sides(links: Links, placement: Placement) -> tuple[Array, Array]:
    """Return points (links, 2, 3) and axes (links, 2, 3, 3) of both sides; the ground stays."""
    ground = links.parts < 0
    turns = np.where(ground[..., None, None], np.eye(3), placement.turns[links.parts])
    origins = np.where(ground[..., None], 0.0, placement.origins[links.parts])
    points = origins + np.einsum("kscd,ksd->ksc", turns, links.arms)
    axes = np.einsum("kad,kscd->ksac", links.axes, turns)
    return points, axes


def joint_gaps(links: Links, placement: Placement, length: float) -> Array:
    """Return the six relative motions of every link, scaled, exact for finite motions."""
    points, axes = link_sides(links, placement)
    out = np.zeros((len(links.parts), 6))
    # axes of side 1, because that is the ground for supports
    out[:, :3] = np.einsum("kac,kc->ka", axes[:, 1], points[:, 0] - points[:, 1]) / length
    relative = axes[:, 1] @ np.swapaxes(axes[:, 0], 1, 2)
    out[:, 3:] = rotation_vector(relative)
    # a universal joint keeps its two axes at the angle they had, whatever it turns about them
    cross = np.einsum("kc,kc->k", axes[:, 0, 1], axes[:, 1, 2])
    out[links.universal, 3] = cross[links.universal]
    return out


def jacobian(
    links: Links, placement: Placement, length: float, dofs: NDArray[np.int64]
) -> sparse.csr_array:
    """Return the derivative of the held gaps with respect to scaled twists, one row per held motion."""
    points, axes = link_sides(links, placement)
    width = len(dofs)
    index = np.cumsum(links.held.ravel()).reshape(links.held.shape) - 1
    e = axes[:, 1]
    data, rows, columns = [], [], []
    for side in (0, 1):
        there = np.flatnonzero(links.parts[:, side] >= 0)
        part = links.parts[there, side]
        arm = (points[there, 0] - placement.origins[part]) / length
        block = np.zeros((len(there), 6, 6))
        block[:, :3, :3] = block[:, 3:, 3:] = e[there]
        block[:, :3, 3:] = -e[there] @ skew(arm)
        k, motion = np.nonzero(links.held[there])
        data.append((1.0 - 2.0 * side) * block[k, motion][:, dofs].ravel())
        rows.append(np.repeat(index[there[k], motion], width))
        columns.append((width * part[k][:, None] + np.arange(width)).ravel())
    shape = (int(links.held.sum()), width * len(placement.origins))
    return sparse.csr_array(
        (np.concatenate(data), (np.concatenate(rows), np.concatenate(columns))), shape=shape
    )


def close_joints(
    kin: Kinematics, parts: tuple[int, ...], links: list[int], moved: Placement
) -> Placement | None:
    """Return the placement near `moved` in which every joint is closed as well as at the start.

    Returns
    -------
    Placement or None
        None when the joints could not be closed.
    """
    bodies, body, arrays = body_links(kin, parts, links)
    first = np.searchsorted(parts, bodies)
    here = _close(
        kin,
        arrays,
        joint_gaps(arrays, start(kin, bodies), kin.length),
        Placement(moved.origins[first], moved.turns[first]),
    )
    if here is None:
        return None
    turns = here.turns[body]
    arms = kin.origins[list(parts)] - kin.origins[list(bodies)][body]
    return Placement(here.origins[body] + np.einsum("kij,kj->ki", turns, arms), turns)


def _close(kin: Kinematics, arrays: Links, target: Array, moved: Placement) -> Placement | None:
    """Return the placement near `moved` in which the gaps of all joints are those of `target`."""
    dofs = kin.dofs
    here = moved
    before = np.inf
    for _ in range(ITERATIONS):
        gaps = (joint_gaps(arrays, here, kin.length) - target)[arrays.held]
        widest = float(np.abs(gaps).max(initial=0.0))
        if widest < CLOSED or NEARLY * CLOSED > widest > STALLED * before:
            return here
        before = widest
        j = jacobian(arrays, here, kin.length, dofs)
        normal = sparse.csc_array(j.T @ j)
        damping = max(DAMPING * float(normal.diagonal().max()), CAUTION * widest**2)
        matrix = sparse.csc_array(normal + damping * sparse.eye_array(normal.shape[0]))
        try:
            factor = sparse_linalg.splu(
                matrix,
                permc_spec="MMD_AT_PLUS_A",
                diag_pivot_thresh=0.0,
                options={"SymmetricMode": True},
            )
        except RuntimeError:
            return None
        twists = np.zeros((len(here.origins), 6))
        twists[:, dofs] = factor.solve(-(j.T @ gaps)).reshape(len(twists), -1)
        here = step(here, twists * kin.units)
    gaps = (joint_gaps(arrays, here, kin.length) - target)[arrays.held]
    return here if np.abs(gaps).max(initial=0.0) < NEARLY * CLOSED else None


def placed_assembly(
    kin: Kinematics, parts: tuple[int, ...], links: list[int], placement: Placement
) -> Assembly:
    """Return the assembly with a component moved to a placement; other components stay."""
    arrays = link_arrays(kin, parts, links, {p: k for k, p in enumerate(parts)})
    points, axes = link_sides(arrays, placement)
    new_parts = list(kin.assembly.parts)
    for k, p in enumerate(parts):
        old = new_parts[p].pose
        turn = placement.turns[k]
        translation = placement.origins[k] + turn @ (old.translation - kin.origins[p])
        new_parts[p] = replace(new_parts[p], pose=Pose(turn @ old.rotation, translation))
    joints = list(kin.assembly.joints)
    for row, k in enumerate(links):
        if k < len(joints):
            joints[k] = replace(joints[k], point=points[row, 0], axes=axes[row, 0])
    return replace(kin.assembly, parts=tuple(new_parts), joints=tuple(joints))
