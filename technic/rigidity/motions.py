"""The internal motions of a component, sorted into four kinds and made readable.

Spinning, sliding and most idle motions belong to one cluster alone. What remains, seen on the clusters
that hold more than fasteners and with the main body standing still, is structural; its basis is chosen so
that each motion moves as few clusters as possible.
"""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np

from technic.geometry import Array, cross, shift_twist
from technic.rigidity.clusters import Cluster, LocalMotion, find_clusters
from technic.rigidity.kinematics import ComponentMotions, Kinematics, component_motions
from technic.rigidity.order import FIRST_ORDER, split_by_order
from technic.rigidity.result import Motion, MotionKind
from technic.rigidity.screw import describe_twists
from technic.rigidity.structural import structural_space
from technic.rigidity.symmetry import is_rotor
from technic.rigidity.trains import tie
from technic.tolerances import MOTION_KIND_CUT, SAME_LINE

__all__ = ["SortedMotions", "sort_motions"]


@dataclass(frozen=True, slots=True, eq=False)
class SortedMotions:
    """Counts per kind and the motions themselves (idle ones are listed where they are one part's own).

    Parameters
    ----------
    structural, spinning, sliding, idle : int
    motions : tuple of Motion
    clusters : tuple of Cluster
        Main body first.
    """

    structural: int
    spinning: int
    sliding: int
    idle: int
    motions: tuple[Motion, ...]
    clusters: tuple[Cluster, ...]


def sort_motions(kin: Kinematics, motions: ComponentMotions, component: int) -> SortedMotions:
    """Sort the internal motions of a component.

    Returns
    -------
    SortedMotions
        ``structural + spinning + sliding + idle`` is `motions.internal`.
    """
    links = kin.links_of(component, meshes=False)
    meshes = [k for k in kin.links_of(component) if k in kin.meshes]
    # Gears in mesh tie wheels that each turn by themselves otherwise: what a body is, is told
    # without them, and how much of its motion is left, with them.
    free = component_motions(kin, component, meshes=False) if meshes else motions
    clusters = find_clusters(kin, free, links)
    if motions.internal <= 0:
        return SortedMotions(0, 0, 0, 0, (), tuple(clusters))
    grounded = motions.rigid == 0
    local: list[tuple[MotionKind, Cluster, LocalMotion]] = []
    levers: list[tuple[Cluster, LocalMotion]] = []
    for n, cluster in enumerate(clusters):
        for motion in cluster.local:
            kind = _local_kind(kin, cluster, motion)
            if n == 0 and not grounded and kind is not MotionKind.IDLE:
                continue  # the main body stands still, unless it is a rod that turns about itself
            if kind is not MotionKind.STRUCTURAL:
                local.append((kind, cluster, motion))
            elif not cluster.fasteners_only:
                levers.append((cluster, motion))
    space = structural_space(
        kin,
        motions,
        clusters,
        [(c, m) for _, c, m in local],
        levers,
        grounded=grounded,
    )
    structural = split_by_order(kin, motions, component, space)
    kept, trains = tie(kin, meshes, local)
    spinning, sliding = kept[MotionKind.SPINNING], kept[MotionKind.SLIDING]
    idle = motions.internal - len(structural) - spinning - sliding
    out: list[Motion] = []
    for found in structural:
        twists = space.of_clusters(found.vector)
        moving = _motion(kin, component, MotionKind.STRUCTURAL, clusters, twists)
        if not moving.freed_by:
            # pins go along with what moves: their other ends give way
            lifted = space.lift(motions, found.vector.ravel()) * kin.units
            for along in (_with_fasteners(kin, moving.parts), list(motions.parts)):
                rows = np.searchsorted(motions.parts, along)
                freed_by = moving.freed_by or _freed_by(kin, along, lifted[rows])
                moving = replace(moving, freed_by=freed_by)
        out.append(replace(moving, order=found.order, second_order=found.second_order))
    for train in trains:
        out.append(_motion(kin, component, train.kind, list(train.clusters), train.twists))
    kinds = list(MotionKind)
    out.sort(key=lambda m: (kinds.index(m.kind), m.order == FIRST_ORDER, -len(m.parts)))
    return SortedMotions(len(structural), spinning, sliding, idle, tuple(out), tuple(clusters))


def _local_kind(kin: Kinematics, cluster: Cluster, motion: LocalMotion) -> MotionKind:
    one_line = _one_line(kin, cluster)
    if not motion.rotation:
        return MotionKind.SLIDING if one_line else MotionKind.STRUCTURAL
    if cluster.fasteners_only:
        return MotionKind.IDLE
    parts = [kin.assembly.parts[p] for p in cluster.parts]
    axis = motion.twist[3:] / np.linalg.norm(motion.twist[3:])
    point = cluster.reference + kin.length * cross(axis, motion.twist[:3]) / np.linalg.norm(
        motion.twist[3:]
    )
    balls = _ball_centers(kin, cluster)
    if balls is not None and len(balls) >= 2:
        return MotionKind.IDLE  # a rod between two balls turns about itself
    if one_line and is_rotor(parts, point, axis):
        return MotionKind.SPINNING
    return MotionKind.STRUCTURAL


def _ball_centers(kin: Kinematics, cluster: Cluster) -> set[tuple[float, ...]] | None:
    """Return the distinct centres when all joints of the cluster are balls, else None."""
    joints, outer = kin.assembly.joints, list(cluster.outer)
    if not outer or max(outer) >= len(joints) or kin.held[outer, 3:].any():
        return None
    points = np.array([joints[k].point for k in cluster.outer]).reshape(-1, 3)
    return set(map(tuple, (points.round(6) + 0.0).tolist()))


def _one_line(kin: Kinematics, cluster: Cluster) -> bool:
    """Tell whether all joints of the cluster share one line."""
    joints, outer = kin.assembly.joints, cluster.outer
    if max(outer) >= len(joints):
        return False
    first = joints[outer[0]]
    line = first.axes[0]
    points = np.array([joints[k].point for k in outer]) - first.point
    axes = np.array([joints[k].axes[0] for k in outer])
    off = np.linalg.norm(points - (points @ line)[:, None] * line, axis=1)
    return bool(off.max() <= SAME_LINE and np.abs(axes @ line).min() >= 1.0 - MOTION_KIND_CUT)


def _motion(
    kin: Kinematics,
    component: int,
    kind: MotionKind,
    clusters: list[Cluster],
    twists: Array,
) -> Motion:
    """Turn twists of clusters into a record: parts, type, axis, freeing joints."""
    parts: list[int] = []
    part_twists: list[Array] = []
    for cluster, twist in zip(clusters, twists, strict=True):
        if np.abs(twist).max() < MOTION_KIND_CUT * np.abs(twists).max():
            continue
        arms = (kin.origins[list(cluster.parts)] - cluster.reference) / kin.length
        parts += cluster.parts
        part_twists.append((shift_twist(arms) @ twist) * kin.units)
    moved = np.concatenate(part_twists)
    moved /= max(
        float(np.linalg.norm(moved[:, :3], axis=1).max()),
        kin.length * float(np.linalg.norm(moved[:, 3:], axis=1).max()),
    )
    shape = describe_twists(kin.origins[parts], moved, kin.length)
    return Motion(
        kind=kind,
        type=shape.type,
        parts=tuple(parts),
        freed_by=_freed_by(kin, parts, moved),
        twists=moved,
        axis_point=shape.point,
        axis_direction=shape.direction,
        pitch=shape.pitch,
        component=component,
    )


def _with_fasteners(kin: Kinematics, parts: tuple[int, ...]) -> list[int]:
    """Return the parts and the fasteners joined to them."""
    near = {p for k in {k for p in parts for k in kin.touching[p]} for p in kin.owners[k]}
    return sorted({*parts, *(p for p in near if kin.assembly.parts[p].fastener)})


def _freed_by(kin: Kinematics, parts: list[int], twists: Array) -> tuple[int, ...]:
    """Return the joints in which the motion takes place.

    A joint to a fastener that is not itself listed counts when the listed part moves there.
    """
    moved = np.zeros((len(kin.assembly.parts) + 1, 6))
    moved[parts] = twists / kin.units
    links = np.array(
        sorted({k for p in parts for k in kin.touching[p]} - kin.meshes), dtype=np.int64
    )
    links = links[links < len(kin.assembly.joints)]
    slip = np.einsum("ksij,ksj->ki", kin.sides[links], moved[kin.pairs[links]])
    slip[kin.held[links]] = 0.0
    far = np.abs(slip).max(axis=1, initial=0.0) > MOTION_KIND_CUT * float(np.abs(moved).max())
    return tuple(links[far].tolist())
