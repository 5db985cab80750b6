"""Which parts move as one body in every motion of a component, and what each body can do by itself."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
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
    out = np.zeros((len(links), 6))
    if motions.twists.shape[1] == 0:
        return out
    owners = [kin.owners[k] for k in links]
    for count in (1, 2):
        rows = np.flatnonzero([len(owner) == count for owner in owners])
        if len(rows):
            chosen = [links[row] for row in rows]
            parts = np.array([owners[row] for row in rows])
            out[rows] = _largest(kin, motions, parts, kin.sides[chosen, :count])
    return out


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
    outer: list[list[int]] = [[] for _ in first]
    for k in links:
        homes = {home[p] for p in kin.owners[k]}
        if len(homes) > 1 or len(kin.owners[k]) == 1:
            for n in homes:
                outer[n].append(k)
    bonds = _bonds(kin, motions, first, outer, home)
    groups = connected_groups(range(len(first)), bonds)
    members = [tuple(sorted(p for n in group for p in first[n])) for group in groups]
    ties = []
    for group, parts in zip(groups, members, strict=True):
        inside = set(parts)
        ties.append(
            tuple(
                k
                for k in sorted({k for n in group for k in outer[n]})
                if len(kin.owners[k]) == 1 or not inside.issuperset(kin.owners[k])
            )
        )
    references = np.array([kin.origins[list(parts)].mean(axis=0) for parts in members])
    locals_ = _local_motions(kin, members, references, ties)
    clusters = [_cluster(kin, *row) for row in zip(members, references, ties, locals_, strict=True)]
    return sorted(clusters, key=lambda c: (c.fasteners_only, -c.mass, c.parts))


def _bonds(
    kin: Kinematics,
    motions: ComponentMotions,
    groups: list[tuple[int, ...]],
    outer: list[list[int]],
    home: dict[int, int],
) -> list[tuple[int, int]]:
    """Bond the neighbours of fasteners that move alike, and the fastener when all of them do."""
    around: dict[int, dict[int, int]] = {}
    for n, parts in enumerate(groups):
        if not all(kin.assembly.parts[p].fastener for p in parts):
            continue
        if any(len(kin.owners[k]) == 1 for k in outer[n]):
            continue
        neighbors: dict[int, int] = {}
        for k in outer[n]:
            for p in kin.owners[k]:
                if home[p] != n:
                    neighbors.setdefault(home[p], p)
        around[n] = neighbors
    pairs = [
        (n, a, b)
        for n, neighbors in around.items()
        for i, a in enumerate(sorted(neighbors))
        for b in sorted(neighbors)[i + 1 :]
    ]
    if not pairs:
        return []
    points = kin.origins[[groups[n][0] for n, _, _ in pairs]]
    parts_of = np.array([[around[n][a], around[n][b]] for n, a, b in pairs])
    arms = (points[:, None] - kin.origins[parts_of]) / kin.length
    blocks = shift_twist(arms) * np.array([1.0, -1.0])[:, None, None]
    apart = _largest(kin, motions, parts_of, blocks).max(axis=1)
    alike: dict[int, list[tuple[int, int]]] = {n: [] for n in around}
    for (n, a, b), gap in zip(pairs, apart, strict=True):
        if gap < MOTION_KIND_CUT:
            alike[n].append((a, b))
    bonds: list[tuple[int, int]] = []
    for n, neighbors in around.items():
        bonds += alike[n]
        if len(neighbors) > 1 and len(connected_groups(list(neighbors), alike[n])) == 1:
            bonds.append((n, min(neighbors)))
    return bonds


def _largest(
    kin: Kinematics, motions: ComponentMotions, parts: NDArray[np.int64], blocks: Array
) -> Array:
    """Return the largest size over all motions of sums of twists, (m, 6).

    Parameters
    ----------
    kin : Kinematics
    motions : ComponentMotions
    parts : (m, k) ndarray of int
        Whose twists are added, in each sum.
    blocks : (m, k, 6, 6) ndarray
        What each twist is multiplied with.
    """
    place = np.zeros(len(kin.assembly.parts), dtype=np.int64)
    place[list(motions.parts)] = np.arange(len(motions.parts))
    rows = (6 * np.arange(len(parts))[:, None] + np.arange(6))[:, None, :, None]
    columns = (6 * place[parts][..., None] + np.arange(6))[:, :, None, :]
    coordinates = tuple(a.ravel() for a in np.broadcast_arrays(rows, columns))
    shape = (6 * len(parts), 6 * len(motions.parts))
    matrix = sparse.csr_array((blocks.ravel(), coordinates), shape=shape)
    matrix.eliminate_zeros()
    sums = abs(matrix @ motions.twists)
    return np.asarray(sums.max(axis=1).toarray()).reshape(len(parts), 6)


def _cluster(
    kin: Kinematics,
    parts: tuple[int, ...],
    reference: Array,
    outer: tuple[int, ...],
    local: tuple[LocalMotion, ...],
) -> Cluster:
    members = [kin.assembly.parts[p] for p in parts]
    return Cluster(
        parts=parts,
        reference=reference,
        origin=kin.origins[parts[0]],
        outer=outer,
        fasteners_only=all(m.fastener for m in members),
        mass=sum(m.mass_properties.mass for m in members if not m.fastener),
        local=local,
    )


def _local_motions(
    kin: Kinematics,
    members: list[tuple[int, ...]],
    references: Array,
    outer: list[tuple[int, ...]],
) -> list[tuple[LocalMotion, ...]]:
    """Return the motions of each cluster alone, translations apart from rotations."""
    home = {p: n for n, parts in enumerate(members) for p in parts}
    sides = [
        (n, k, s, p)
        for n, links in enumerate(outer)
        for k in links
        for s, p in enumerate(kin.owners[k])
        if home.get(p) == n
    ]
    dofs = kin.dofs
    squares = np.zeros((len(members), len(dofs), len(dofs)))
    if sides:
        own, link, side, part = np.array(sides).T
        carry = shift_twist((kin.origins[part] - references[own]) / kin.length)
        rows = (kin.sides[link, side] * kin.held[link][..., None]) @ carry
        rows = rows[..., dofs]
        np.add.at(squares, own, np.swapaxes(rows, 1, 2) @ rows)
    values, vectors = np.linalg.eigh(squares)
    out = []
    for n, links in enumerate(outer):
        free = np.zeros((6, int(np.sum(values[n] < MOTION_KIND_CUT**2))))
        free[dofs] = vectors[n][:, values[n] < MOTION_KIND_CUT**2]
        out.append(_apart(free) if links else ())
    return out


def _apart(free: Array) -> tuple[LocalMotion, ...]:
    """Return motions, the columns of `free`, combined so that translations stand apart from rotations."""
    if free.shape[1] == 0:
        return ()
    _, turning, mix = np.linalg.svd(free[3:], full_matrices=True)
    turning = np.concatenate([turning, np.zeros(free.shape[1] - len(turning))])
    return tuple(
        LocalMotion(bool(t > MOTION_KIND_CUT), free @ combination)
        for t, combination in zip(turning, mix, strict=True)
    )
