"""Gear trains: motions of single bodies that teeth tie to each other.

Without the teeth every shaft turns by itself. Each mesh ties two of these motions; what is left of n
tied motions are n minus the rank of the ties.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from technic.geometry import Array, shift_twist
from technic.groups import connected_groups
from technic.rigidity.clusters import Cluster, LocalMotion
from technic.rigidity.kinematics import Kinematics
from technic.rigidity.result import MotionKind
from technic.tolerances import MOTION_KIND_CUT

__all__ = ["Train", "tie"]

_ORDER = (MotionKind.SPINNING, MotionKind.SLIDING, MotionKind.IDLE)


@dataclass(frozen=True, slots=True, eq=False)
class Train:
    """A motion of one or more bodies, tied by teeth.

    Parameters
    ----------
    kind : MotionKind
    clusters : tuple of Cluster
    twists : (len(clusters), 6) ndarray
        Scaled twists about the clusters' reference points.
    """

    kind: MotionKind
    clusters: tuple[Cluster, ...]
    twists: Array


def tie(
    kin: Kinematics,
    meshes: Sequence[int],
    local: Sequence[tuple[MotionKind, Cluster, LocalMotion]],
) -> tuple[dict[MotionKind, int], list[Train]]:
    """Return how many motions of single bodies of each kind are left, and those motions.

    Parameters
    ----------
    kin : Kinematics
    meshes : sequence of int
        Links that are gears in mesh.
    local : sequence of (MotionKind, Cluster, LocalMotion)
        Motions of single bodies when the teeth do not count.
    """
    rows = _rows(kin, meshes, local)
    kept: dict[MotionKind, int] = {}
    before = columns = 0
    for kind in _ORDER:
        columns += sum(k is kind for k, _, _ in local)
        chosen = [n for n, (k, _, _) in enumerate(local) if _ORDER.index(k) <= _ORDER.index(kind)]
        left = columns - _rank(rows[:, chosen])
        kept[kind] = left - before
        before = left
    touched = np.abs(rows) > MOTION_KIND_CUT
    pairs = [
        (int(a), int(b))
        for row in touched
        for a, b in zip(np.flatnonzero(row)[:-1], np.flatnonzero(row)[1:], strict=True)
    ]
    trains: list[Train] = []
    for group in connected_groups(range(len(local)), pairs):
        ties = rows[:, list(group)]
        for share in _null(ties[np.abs(ties).max(axis=1, initial=0.0) > MOTION_KIND_CUT]).T:
            members = [local[n] for n in group]
            kind = min((k for k, _, _ in members), key=_ORDER.index)
            homes = list({id(c): c for _, c, _ in members}.values())
            twists = np.zeros((len(homes), 6))
            for amount, (_, cluster, motion) in zip(share, members, strict=True):
                at = next(n for n, home in enumerate(homes) if home is cluster)
                twists[at] += amount * motion.twist
            trains.append(Train(kind, tuple(homes), twists))
    return kept, trains


def _rows(
    kin: Kinematics,
    meshes: Sequence[int],
    local: Sequence[tuple[MotionKind, Cluster, LocalMotion]],
) -> Array:
    """Return how far the teeth of each mesh would move through each other, (meshes, motions)."""
    rows = np.zeros((len(meshes), len(local)))
    for row, k in enumerate(meshes):
        for side, part in enumerate(kin.owners[k]):
            for n, (_, cluster, motion) in enumerate(local):
                if part in cluster.parts:
                    arm = (kin.origins[part] - cluster.reference) / kin.length
                    twist = shift_twist(arm) @ motion.twist
                    rows[row, n] += float(kin.sides[k, side, 0] @ twist)
    return rows


def _rank(rows: Array) -> int:
    values = np.linalg.svd(rows, compute_uv=False) if rows.size else np.zeros(0)
    return int(np.sum(values > MOTION_KIND_CUT))


def _null(rows: Array) -> Array:
    """Return an orthonormal basis, one motion per column, of what the rows leave free."""
    count = rows.shape[1]
    if not len(rows):
        return np.eye(count)
    _, values, vt = np.linalg.svd(rows)
    return np.asarray(vt[int(np.sum(values > MOTION_KIND_CUT)) :].T)
