"""The structural motions of a component: a space, a readable basis of it, and what moves along.

Seen on the clusters that hold more than fasteners, the main body standing still, what remains when
spinning and sliding are taken away.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from technic.geometry import Array, shift_twist
from technic.groups import connected_groups
from technic.rigidity.clusters import Cluster, LocalMotion
from technic.rigidity.kinematics import ComponentMotions, Kinematics
from technic.tolerances import MOTION_KIND_CUT

__all__ = ["StructuralSpace", "cluster_field", "sparse_basis", "structural_space"]

HELD = 1e-9
"""A body that moves less than this in every motion that is left is held already."""


@dataclass(frozen=True, slots=True, eq=False)
class StructuralSpace:
    """Structural motions as scaled twists of clusters about their reference points.

    Parameters
    ----------
    clusters : tuple of Cluster
        Main body first.
    bodies : tuple of int
        Clusters that hold more than fasteners.
    basis : (6 * len(bodies), s) ndarray
        Orthonormal.
    removed : (6 * len(bodies), r) ndarray
        Spinning, sliding and idling of single clusters, orthonormal, taken out of `basis`.
    simple : (6 * len(bodies), q) ndarray
        Orthonormal motions in `basis` that move one cluster only.
    field : (6 * len(bodies), k) ndarray
        The same clusters in every motion of the component, the main body standing still (unless the
        component is grounded).
    """

    clusters: tuple[Cluster, ...]
    bodies: tuple[int, ...]
    basis: Array
    removed: Array
    simple: Array
    field: Array

    @property
    def size(self) -> int:
        """Number of structural motions."""
        return int(self.basis.shape[1])

    def of_clusters(self, vector: Array) -> Array:
        """Return a vector of the space as twists of all clusters, (clusters, 6)."""
        out = np.zeros((len(self.clusters), 6))
        out[list(self.bodies)] = vector.reshape(-1, 6)
        return out

    def lift(self, motions: ComponentMotions, vector: Array) -> Array:
        """Return the motion of every part that goes with a vector of the space.

        Returns
        -------
        (n, 6) ndarray
            Scaled twists about the parts' centroids, fasteners included; the main body may move.
        """
        used = np.flatnonzero(np.abs(self.field).max(axis=0) > 0.0)
        columns = np.hstack([self.field[:, used], self.removed])
        share = np.linalg.lstsq(columns, vector, rcond=1e-9)[0][: len(used)]
        return np.asarray(motions.twists[:, used] @ share).reshape(-1, 6)


def structural_space(
    kin: Kinematics,
    motions: ComponentMotions,
    clusters: list[Cluster],
    local: list[tuple[Cluster, LocalMotion]],
    levers: list[tuple[Cluster, LocalMotion]],
    *,
    grounded: bool,
) -> StructuralSpace:
    """Return the structural motions.

    Parameters
    ----------
    kin : Kinematics
    motions : ComponentMotions
    clusters : list of Cluster
        Main body first.
    local : list of (Cluster, LocalMotion)
        Spinning, sliding and idle motions, which are not structural.
    levers : list of (Cluster, LocalMotion)
        Structural motions of single clusters other than the main body.
    grounded : bool
        The component has a support; then the main body may move too.
    """
    bodies = [n for n, c in enumerate(clusters) if not c.fasteners_only]
    own = {id(c): bodies.index(n) for n, c in enumerate(clusters) if n in set(bodies)}
    field = cluster_field(kin, motions, clusters)
    if not grounded:
        arms = np.array([(c.reference - clusters[0].reference) / kin.length for c in clusters])
        field = field - shift_twist(arms) @ field[0]
    flat = field[bodies].reshape(6 * len(bodies), -1)
    removed = np.zeros((6 * len(bodies), 0))
    for cluster, motion in local:
        if id(cluster) in own:
            column = np.zeros((len(bodies), 6))
            column[own[id(cluster)]] = motion.twist
            if cluster is clusters[0] and not grounded:
                # a rod that turns about itself: seen from it, everything else turns
                column = (shift_twist(arms) @ motion.twist)[bodies]
                column[own[id(cluster)]] = 0.0
            removed = np.column_stack([removed, column.ravel()])
    removed, _ = np.linalg.qr(removed)
    rest = flat - removed @ (removed.T @ flat)
    u, values, _ = np.linalg.svd(rest, full_matrices=False)
    kept = values > MOTION_KIND_CUT * max(1.0, float(values.max(initial=0.0)))
    basis = u[:, kept]
    simple = np.zeros((len(basis), len(levers)))
    for k, (cluster, motion) in enumerate(levers):
        place = 6 * own[id(cluster)]
        simple[place : place + 6, k] = motion.twist
    inside = np.linalg.norm(simple - basis @ (basis.T @ simple), axis=0) < MOTION_KIND_CUT
    return StructuralSpace(tuple(clusters), tuple(bodies), basis, removed, simple[:, inside], flat)


def cluster_field(
    kin: Kinematics,
    motions: ComponentMotions,
    clusters: list[Cluster],
    *,
    at_part: bool = False,
) -> Array:
    """Return the scaled twist of every cluster in every motion, (clusters, 6, k).

    About its reference point, or about the centroid of its first part (`at_part`).
    """
    first = np.array([cluster.parts[0] for cluster in clusters])
    rows = 6 * np.searchsorted(motions.parts, first)[:, None] + np.arange(6)
    field = motions.twists.tocsr()[rows.ravel()].toarray().reshape(len(clusters), 6, -1)
    if at_part:
        return np.asarray(field)
    references = np.array([cluster.reference for cluster in clusters])
    return np.asarray(shift_twist((references - kin.origins[first]) / kin.length) @ field)


def sparse_basis(space: Array, bodies: int, simple: Array | None = None) -> list[Array]:
    """Return a basis whose vectors move as few bodies as a greedy search finds, each (bodies, 6).

    Motions of one body (`simple`, orthonormal, in the space) come first; the search covers what is
    left. For each body in turn, the largest last, other bodies are held still one after another as long as
    some motion of this body is left; the shortest independent results are kept.
    """
    if simple is not None and simple.shape[1]:
        first = [v.reshape(bodies, 6) / np.abs(v).max() for v in simple.T]
        rest = space - simple @ (simple.T @ space)
        u, values, _ = np.linalg.svd(rest, full_matrices=False)
        return first + sparse_basis(u[:, values > MOTION_KIND_CUT], bodies)
    if space.shape[1] == 1:
        return [space.reshape(bodies, 6) / np.abs(space).max()]
    out: list[Array] = []
    for group in _independent(space, bodies):
        rows = (6 * np.array(group)[:, None] + np.arange(6)).ravel()
        u, values, _ = np.linalg.svd(space[rows], full_matrices=False)
        for vector in _search(u[:, values > 0.5], len(group)):
            whole = np.zeros((bodies, 6))
            whole[list(group)] = vector
            out.append(whole)
    return out


def _independent(space: Array, bodies: int) -> list[tuple[int, ...]]:
    """Return groups of bodies such that the space is the direct sum of its parts on the groups."""
    projector = space @ space.T
    ties = np.abs(projector).reshape(bodies, 6, bodies, 6).max(axis=(1, 3)) > MOTION_KIND_CUT**2
    moving = np.diagonal(ties)
    pairs = np.argwhere(np.triu(ties & moving & moving[:, None], 1))
    return connected_groups(np.flatnonzero(moving).tolist(), ((int(a), int(b)) for a, b in pairs))


def _hold_others(blocks: Array, body: int, moving: list[int]) -> Array:
    """Return the motions, (count, r), left when as many other bodies are held, one after another, as leave
    `body` a motion.

    Bodies are held in groups that grow while that succeeds and are halved when it does not: the outcome is
    that of holding them one at a time.
    """
    still = np.eye(blocks.shape[2])
    waiting = np.array([b for b in moving if b != body], dtype=np.int64)
    group = 1
    while len(waiting) and still.shape[1] > 1:
        rows = (blocks[waiting[:group]] @ still).reshape(-1, still.shape[1])
        if np.abs(rows).max() <= HELD:
            waiting = waiting[group:]
            group *= 2
            continue
        squares, vectors = np.linalg.eigh(rows.T @ rows)
        trial = still @ vectors[:, squares < MOTION_KIND_CUT**2]
        if trial.shape[1] and np.abs(blocks[body] @ trial).max() > MOTION_KIND_CUT:
            still = trial
            waiting = waiting[group:]
            group *= 2
        elif group == 1:
            waiting = waiting[1:]
        else:
            group //= 2
    return still


def _unlike(blocks: Array, moving: list[int]) -> list[int]:
    """Return one of each set of bodies that stand still in the same motions: held one, held all."""
    _, values, rows = np.linalg.svd(blocks[moving], full_matrices=False)
    rows = rows * (values >= MOTION_KIND_CUT)[..., None]
    probe = np.cos(np.arange(2.0 * blocks.shape[2]) ** 2).reshape(-1, 2)
    marks = np.round(np.swapaxes(rows, 1, 2) @ (rows @ probe), 6) + 0.0
    first: dict[bytes, int] = {}
    for body, mark in zip(moving, marks, strict=True):
        first.setdefault(mark.tobytes(), body)
    return list(first.values())


def _search(space: Array, bodies: int) -> list[Array]:
    """Return a basis of a space that does not fall apart; see `sparse_basis`."""
    count = space.shape[1]
    if count == 0:
        return []
    blocks = space.reshape(bodies, 6, count)
    size = np.linalg.norm(blocks, axis=(1, 2))
    moving = _unlike(blocks, [b for b in range(bodies) if size[b] > MOTION_KIND_CUT])
    found: list[Array] = []
    for body in moving:
        still = _hold_others(blocks, body, moving)
        _, values, vt = np.linalg.svd(blocks[body] @ still, full_matrices=False)
        for share in vt[values > MOTION_KIND_CUT]:
            vector = (space @ (still @ share)).reshape(bodies, 6)
            found.append(vector / np.abs(vector).max())
    found.sort(key=lambda v: int(np.sum(np.linalg.norm(v, axis=1) > MOTION_KIND_CUT)))
    chosen: list[Array] = []
    taken = np.zeros((space.shape[0], 0))
    for vector in found:
        rest = vector.ravel() / np.linalg.norm(vector)
        for _ in range(2):
            rest = rest - taken @ (taken.T @ rest)
        if np.linalg.norm(rest) > MOTION_KIND_CUT:
            chosen.append(vector)
            taken = np.column_stack([taken, rest / np.linalg.norm(rest)])
        if len(chosen) == count:
            break
    for column in (space - taken @ (taken.T @ space)).T:  # what the search did not reach
        if len(chosen) == count:
            break
        rest = column - taken @ (taken.T @ column)
        if np.linalg.norm(rest) > MOTION_KIND_CUT:
            chosen.append(rest.reshape(bodies, 6) / np.abs(rest).max())
            taken = np.column_stack([taken, rest / np.linalg.norm(rest)])
    return chosen
