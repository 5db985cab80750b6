"""Which structural motions are real mechanisms and which exist at first order only."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from technic.geometry import Array, shift_twist
from technic.rigidity.finite import Placement, close_joints, placed_assembly, start, step
from technic.rigidity.kinematics import (
    ComponentMotions,
    Kinematics,
    component_motions,
    kinematics,
)
from technic.rigidity.second_order import second_order
from technic.rigidity.structural import StructuralSpace, cluster_field, sparse_basis
from technic.tolerances import MOBILITY_CUT, MOTION_KIND_CUT

__all__ = ["FINITE", "FIRST_ORDER", "STIFFENS", "UNDECIDED", "OrderedMotion", "split_by_order"]

FINITE = "finite"
FIRST_ORDER = "first-order"

STIFFENS = "stiffens"
UNDECIDED = "undecided"

STEPS = (0.2, 0.05)
"""How far the part that goes furthest is moved (scaled: 8 LDU, or 0.2 rad): far enough that what stiffens
does so well above the tolerance for motions. Where the path is so bent that the joints close near the start
again, a quarter of that."""

MOVED = 0.1
"""A step counts as made when this share of it is left after the joints are closed: on a path nearly all
is left, elsewhere each iteration halves it."""

CUT = 1e-7
"""Singular values below this are motions at the place reached: the joints are closed there to 1e-9, and
what stiffens does so with the square of the step in the worst case (on the beam cubes 4e-6). Where the
joints of the file do not line up, ten times their misfit."""

TRIALS = 3
"""Random directions tried: where several paths leave one configuration, the one of most freedom counts."""


@dataclass(frozen=True, slots=True, eq=False)
class OrderedMotion:
    """A structural motion.

    Parameters
    ----------
    vector : (bodies, 6) ndarray
        Scaled twists in the structural space.
    order : str
        "finite" or "first-order".
    second_order : str or None
        Of a first-order motion: "stiffens" when a self-stress resists it, "undecided" when none does; None
        when the test was not made.
    """

    vector: Array
    order: str
    second_order: str | None = None


def split_by_order(
    kin: Kinematics, motions: ComponentMotions, component: int, space: StructuralSpace
) -> list[OrderedMotion]:
    """Return a readable basis of the structural motions with the order of each.

    Returns
    -------
    list of OrderedMotion
        As many as `space` has dimensions; "finite" ones span what can really move.
    """
    bodies = len(space.bodies)
    if space.size == 0:
        return []
    readable = sparse_basis(space.basis, bodies, space.simple)
    test = second_order(kin, motions, component, space)
    if test is not None and test.independent:
        return [OrderedMotion(v, FINITE) for v in readable]
    if test is not None and test.unblocked.shape[1] == 0:
        finite = np.zeros((len(space.basis), 0))
    else:
        finite = _finite_directions(kin, motions, component, space)
    count = finite.shape[1]
    if count == space.size:
        return [OrderedMotion(v, FINITE) for v in readable]

    def shaking(vector: Array) -> OrderedMotion:
        if test is None:
            return OrderedMotion(vector, FIRST_ORDER)
        resisted = test.stiffens(space.basis.T @ vector.ravel())
        return OrderedMotion(vector, FIRST_ORDER, STIFFENS if resisted else UNDECIDED)

    if count == 0:
        return [shaking(v) for v in readable]
    taken, _ = np.linalg.qr(finite)
    outside = space.simple - taken @ (taken.T @ space.simple)
    simple = space.simple[:, np.linalg.norm(outside, axis=0) < MOTION_KIND_CUT]
    out = [OrderedMotion(v, FINITE) for v in sparse_basis(taken, bodies, simple)]
    for vector in readable:
        flat = vector.ravel() / np.linalg.norm(vector)
        for _ in range(2):
            flat = flat - taken @ (taken.T @ flat)
        if len(out) < space.size and np.linalg.norm(flat) > MOTION_KIND_CUT:
            out.append(shaking(vector))
            taken = np.column_stack([taken, flat / np.linalg.norm(flat)])
    return out


def _finite_directions(
    kin: Kinematics, motions: ComponentMotions, component: int, space: StructuralSpace
) -> Array:
    """Return an orthonormal basis, (6 * bodies, f), of the motions that have a path."""
    links = kin.links_of(component)
    # Teeth roll on each other: where they touch is no point of either gear, so they are not closed.
    closing = kin.links_of(component, meshes=False)
    best = np.zeros((len(space.basis), 0))
    cut = min(max(CUT, 10.0 * motions.largest_dropped), MOBILITY_CUT)
    for trial in range(TRIALS):
        share = np.random.default_rng(trial).normal(size=space.size)
        twists = space.lift(motions, space.basis @ share)
        placement = _reached(kin, motions.parts, closing, twists / np.abs(twists).max())
        if placement is None:
            continue
        moved = kinematics(placed_assembly(kin, motions.parts, links, placement))
        later = component_motions(moved, component, cut)
        count = space.size - (motions.internal - later.internal)
        if count > best.shape[1]:
            best = _tangent(moved, later, placement, motions.parts, space, count)
        if best.shape[1] == space.size:
            break
    return best


def _reached(
    kin: Kinematics, parts: tuple[int, ...], closing: list[int], twists: Array
) -> Placement | None:
    """Return where a real step along scaled twists ends, or None when it leads nowhere."""
    begin = start(kin, parts)
    for size in STEPS:
        there = step(begin, size * twists * kin.units)
        placement = close_joints(kin, parts, closing, there)
        if placement is not None and _progress(kin, begin, placement, there) >= MOVED:
            return placement
    return None


def _progress(kin: Kinematics, begin: Placement, placement: Placement, aim: Placement) -> float:
    """Return how much of the step is left: the movement along it, as a share."""
    wanted = np.hstack(
        [(aim.origins - begin.origins) / kin.length, (aim.turns - begin.turns).reshape(-1, 9)]
    )
    made = np.hstack(
        [
            (placement.origins - begin.origins) / kin.length,
            (placement.turns - begin.turns).reshape(-1, 9),
        ]
    )
    return float(np.sum(wanted * made) / np.sum(wanted**2))


def _tangent(
    moved: Kinematics,
    later: ComponentMotions,
    placement: Placement,
    parts: tuple[int, ...],
    space: StructuralSpace,
    count: int,
) -> Array:
    """Return the motions at the place reached, seen from the start: the `count` nearest directions."""
    place = {p: k for k, p in enumerate(parts)}
    clusters = list(space.clusters)
    turns = np.array([placement.turns[place[c.parts[0]]] for c in clusters])
    # twists about the first part's centroid, which is where `moved` knows each cluster to be
    field = cluster_field(moved, later, clusters, at_part=True)
    arms = np.zeros((len(clusters), 3))
    references = np.zeros((len(clusters), 3))
    for n, c in enumerate(clusters):
        p = c.parts[0]
        before = c.origin
        arms[n] = turns[n] @ (c.reference - before) / moved.length
        references[n] = placement.origins[place[p]] + turns[n] @ (c.reference - before)
    field = shift_twist(arms) @ field
    main = (references - references[0]) / moved.length
    field = field - shift_twist(main) @ field[0]
    back = turns[0].T
    field = np.concatenate([back @ field[:, :3], back @ field[:, 3:]], axis=1)
    flat = field[list(space.bodies)].reshape(len(space.basis), -1)
    u, _, _ = np.linalg.svd(space.basis.T @ flat, full_matrices=True)
    return np.asarray(space.basis @ u[:, :count])
