"""Which parts move as one body in every motion of a component, and what each body can do by itself."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from scipy import sparse

from technic.geometry import Array, shift_twist
from technic.groups import connected_groups
from technic.rigidity.kinematics import ComponentMotions, Kinematics
from technic.tolerances import MOTION_KIND_CUT

__all__ = ["Cluster", "LocalMotion", "find_clusters", "joint_slip"]


@dataclass(frozen=True, slots=True, eq=False)
class LocalMotion:
    """A motion of one cluster alone, everything else standing still.

    Parameters
    ----------
    rotation : bool
        False for a pure translation.
    twist : (6,) ndarray
        Scaled twist about the cluster's reference point, world axes, unit length.
    """

    rotation: bool
    twist: Array


@dataclass(frozen=True, slots=True, eq=False)
class Cluster:
    """Parts that never move relative to each other.

    Parameters
    ----------
    parts : tuple of int
    reference : (3,) ndarray
        Point about which twists of the cluster are taken (m).
    origin : (3,) ndarray
        Centroid of the first part (m).
    outer : tuple of int
        Joints and supports to anything outside.
    fasteners_only : bool
    mass : float
        Of its parts that are not fasteners (kg).
    local : tuple of LocalMotion
    """

    parts: tuple[int, ...]
    reference: Array
    origin: Array
    outer: tuple[int, ...]
    fasteners_only: bool
    mass: float
    local: tuple[LocalMotion, ...]


def joint_slip(kin: Kinematics, motions: ComponentMotions, links: list[int]) -> Array:
    """Return how much each joint moves in the motions, (len(links), 6): the largest over the basis."""
    place = {p: k for k, p in enumerate(motions.parts)}
    if not links or motions.twists.shape[1] == 0:
        return np.zeros((len(links), 6))
    data, rows, columns = [], [], []
    for row, k in enumerate(links):
        for side, part in enumerate(kin.owners[k]):
            data.append(kin.sides[k, side].ravel())
            rows.append(np.repeat(np.arange(6 * row, 6 * row + 6), 6))
            columns.append(np.tile(np.arange(6 * place[part], 6 * place[part] + 6), 6))
    shape = (6 * len(links), 6 * len(motions.parts))
    coordinates = (np.concatenate(rows), np.concatenate(columns))
    slip = sparse.csr_array((np.concatenate(data), coordinates), shape=shape) @ motions.twists
    return np.asarray(abs(slip).max(axis=1).toarray()).reshape(len(links), 6)


def find_clusters(kin: Kinematics, motions: ComponentMotions, links: list[int]) -> list[Cluster]:
    """Return the clusters of a component, the main body first, then by mass.

    A pin that turns in place does not part what it joins: neighbours of such a pin that share every
    motion belong together, and so does the pin then.
    """
    slip = joint_slip(kin, motions, links)
    still = [
        (kin.owners[k][0], kin.owners[k][1])
        for k, row in zip(links, slip, strict=True)
        if len(kin.owners[k]) == 2 and row.max() < MOTION_KIND_CUT
    ]
    first = connected_groups(motions.parts, still)
    home = {p: n for n, parts in enumerate(first) for p in parts}
    fasteners = {
        n for n, parts in enumerate(first) if all(kin.assembly.parts[p].fastener for p in parts)
    }
    outer: list[list[int]] = [[] for _ in first]
    for k in links:
        homes = {home[p] for p in kin.owners[k]}
        if len(homes) > 1 or len(kin.owners[k]) == 1:
            for n in homes:
                outer[n].append(k)
    rows = motions.twists.tocsr()
    bonds: list[tuple[int, int]] = []
    for n in sorted(fasteners):
        bonds += _bonds(kin, motions.parts, rows, first[n], outer[n], home, n)
    groups = connected_groups(range(len(first)), bonds)
    clusters = []
    for group in groups:
        parts = tuple(sorted(p for n in group for p in first[n]))
        inside = set(parts)
        ties = tuple(
            k
            for k in sorted({k for n in group for k in outer[n]})
            if len(kin.owners[k]) == 1 or not inside.issuperset(kin.owners[k])
        )
        clusters.append(_cluster(kin, parts, ties))
    return sorted(clusters, key=lambda c: (c.fasteners_only, -c.mass, c.parts))


def _bonds(
    kin: Kinematics,
    everyone: tuple[int, ...],
    rows: sparse.csr_array,
    parts: tuple[int, ...],
    outer: list[int],
    home: dict[int, int],
    own: int,
) -> list[tuple[int, int]]:
    """Bond the neighbours of a fastener that move alike, and the fastener when all of them do."""
    place = {p: k for k, p in enumerate(everyone)}
    neighbors: dict[int, int] = {}
    for k in outer:
        if len(kin.owners[k]) == 1:
            return []
        for p in kin.owners[k]:
            if p not in parts:
                neighbors.setdefault(home[p], p)
    point = kin.origins[parts[0]]
    twists = {}
    for n, p in neighbors.items():
        arm = (point - kin.origins[p]) / kin.length
        twists[n] = shift_twist(arm) @ rows[6 * place[p] : 6 * place[p] + 6].toarray()
    order = sorted(neighbors)
    alike = [
        (a, b)
        for i, a in enumerate(order)
        for b in order[i + 1 :]
        if np.abs(twists[a] - twists[b]).max(initial=0.0) < MOTION_KIND_CUT
    ]
    if len(order) > 1 and len(connected_groups(order, alike)) == 1:
        alike.append((own, order[0]))
    return alike


def _cluster(kin: Kinematics, parts: tuple[int, ...], outer: tuple[int, ...]) -> Cluster:
    members = [kin.assembly.parts[p] for p in parts]
    reference = kin.origins[list(parts)].mean(axis=0)
    return Cluster(
        parts=parts,
        reference=reference,
        origin=kin.origins[parts[0]],
        outer=outer,
        fasteners_only=all(m.fastener for m in members),
        mass=sum(m.mass_properties.mass for m in members if not m.fastener),
        local=_local_motions(kin, set(parts), reference, outer),
    )


def _local_motions(
    kin: Kinematics, parts: set[int], reference: Array, outer: tuple[int, ...]
) -> tuple[LocalMotion, ...]:
    """Return the motions of the cluster alone, translations apart from rotations."""
    blocks = []
    for k in outer:
        for side, p in enumerate(kin.owners[k]):
            if p in parts:
                arm = (kin.origins[p] - reference) / kin.length
                blocks.append(kin.sides[k, side][kin.held[k]] @ shift_twist(arm))
    if not blocks:
        return ()
    dofs = kin.dofs
    rows = np.vstack(blocks)[:, dofs]
    _, values, vt = np.linalg.svd(rows, full_matrices=True)
    values = np.concatenate([values, np.zeros(len(dofs) - len(values))])
    free = np.zeros((6, int(np.sum(values < MOTION_KIND_CUT))))
    free[dofs] = vt[values < MOTION_KIND_CUT].T
    if free.shape[1] == 0:
        return ()
    _, turning, mix = np.linalg.svd(free[3:], full_matrices=True)
    turning = np.concatenate([turning, np.zeros(free.shape[1] - len(turning))])
    motions = []
    for t, combination in zip(turning, mix, strict=True):
        twist = free @ combination
        motions.append(LocalMotion(bool(t > MOTION_KIND_CUT), twist))
    return tuple(motions)
