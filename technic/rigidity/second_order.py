"""Which motions stiffen at second order: the prestress test.

A motion that joints allow at first order is blocked at second order when a set of joint forces in
equilibrium with themselves (a self-stress) does work against it whichever way it goes. Where such forces
exist for every motion at once, the assembly is rigid although it shakes. The mathematics is derived in
``docs/decisions/0014-second-order.md``.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from scipy import sparse
from scipy.sparse import linalg as sparse_linalg

from technic.geometry import Array, skew
from technic.rigidity.finite import Links, body_links, jacobian, link_sides, start
from technic.rigidity.kinematics import ComponentMotions, Kinematics
from technic.rigidity.semidefinite import positive_combination
from technic.rigidity.structural import StructuralSpace
from technic.tolerances import MOTION_KIND_CUT

__all__ = ["SecondOrder", "row_curvature", "second_order"]

MOST_MOTIONS = 24
"""Structural motions up to which the test is made: it costs the fourth power of their number."""

STRESS = 1e-6
"""Singular values of the joint matrix below this count as none when self-stresses are computed."""

MISFIT = 10.0
"""Where joints do not line up, the cut for self-stresses is this many times their misfit."""

CLEAR = 30.0
"""What joints hold must be this far above that cut."""

PASSES = 3
"""Repetitions of the damped projection on self-stresses: what is held `CLEAR` times above the cut then leaks
in by 1e-9."""

RESISTED = 1e-4
"""Share of the curvature that a self-stress must resist to count: coordinates in files are rounded to
1e-5 of a part's size or so."""

FLAT, NEGATIVE = 1e-4, 1e-7
"""Eigenvalues of a self-stress on the motions, in units of the largest: below `FLAT` a motion is not counted
as blocked; below ``-NEGATIVE`` the stress proves nothing."""


@dataclass(frozen=True, slots=True, eq=False)
class SecondOrder:
    """The second-order test of one component.

    Parameters
    ----------
    unblocked : (s, n) ndarray
        Orthonormal, in coordinates of the structural basis: every finite motion starts in this space.
    independent : bool
        No joint's hold follows from the others: then every motion is finite, because the places that obey
        independent equations are a smooth surface.
    """

    unblocked: Array
    independent: bool
    _frame: _Frame
    _shares: Array

    def stiffens(self, share: Array) -> bool:
        """Tell whether a self-stress resists the motion with these coordinates in the structural basis."""
        values = np.linalg.lstsq(self._shares, share, rcond=1e-9)[0]
        bent = _curvature_of(self._frame, (self._frame.motions @ values)[:, None])
        size = float(np.linalg.norm(bent))
        resisted = float(np.linalg.norm(_stress_part(self._frame, bent)))
        return resisted > RESISTED * size


@dataclass(frozen=True, slots=True, eq=False)
class _Frame:
    """What one component brings to the test.

    Parameters
    ----------
    curvature : (rows, 12, 12) ndarray
        See `row_curvature`.
    owners : (rows, 2) ndarray of int
        Bodies of each row, -1 for the ground.
    motions : (6 * bodies, k) ndarray
        All motions of the component, scaled twists.
    held : (rows, n) sparse
        First derivatives of the held gaps.
    solve : callable
        Solves the damped normal equations of `held`.
    """

    curvature: Array
    owners: NDArray[np.int64]
    motions: Array
    held: sparse.csr_array
    solve: Callable[[Array], Array]


def second_order(
    kin: Kinematics, motions: ComponentMotions, component: int, space: StructuralSpace
) -> SecondOrder | None:
    """Make the test.

    Returns
    -------
    SecondOrder or None
        None when it was not made: no structural motion, too many of them, or joints that do not line up well
        enough.
    """
    clear = motions.smallest_kept > CLEAR * MISFIT * motions.largest_dropped
    if not (0 < space.size <= MOST_MOTIONS and clear):
        return None
    frame = _frame(kin, motions, component)
    # what each motion of the component is among the structural ones
    rest = space.field - space.removed @ (space.removed.T @ space.field)
    shares = space.basis.T @ rest
    rank = frame.held.shape[1] - motions.twists.shape[1]
    independent = frame.held.shape[0] == rank and not any(
        k in kin.meshes for k in kin.links_of(component)
    )
    unblocked = np.eye(space.size) if independent else _unblocked(frame, shares)
    return SecondOrder(unblocked, independent, frame, shares)


def _unblocked(frame: _Frame, shares: Array) -> Array:
    """Take away, again and again, the motions that one self-stress resists while it resists none the other
    way.
    """
    left = np.eye(shares.shape[1])
    while True:
        u, values, vt = np.linalg.svd(shares @ left, full_matrices=False)
        count = int(np.sum(values > MOTION_KIND_CUT * max(1.0, float(values.max(initial=0.0)))))
        directions = np.asarray(u[:, :count])
        if count == 0:
            return directions
        weights = _certificate(frame, frame.motions @ (left @ (vt[:count].T / values[:count])))
        if weights is None:
            return directions
        carried = frame.motions @ left
        form = carried.T @ (_weighted(frame, weights) @ carried)
        squares, vectors = np.linalg.eigh((form + form.T) / 2)
        largest = float(np.abs(squares).max())
        flat = squares < FLAT * largest
        if squares[0] < -NEGATIVE * largest or flat.all():
            return directions
        left = left @ vectors[:, flat]


def _frame(kin: Kinematics, motions: ComponentMotions, component: int) -> _Frame:
    # teeth give no stress: where they touch is no point of either gear
    bodies, _, links = body_links(kin, motions.parts, kin.links_of(component, meshes=False))
    held = jacobian(links, start(kin, bodies), kin.length, kin.dofs)
    damping = max(STRESS, MISFIT * motions.largest_dropped) ** 2
    normal = sparse.csc_array(held.T @ held)
    factor = sparse_linalg.splu(
        sparse.csc_array(normal + damping * sparse.eye_array(normal.shape[0])),
        permc_spec="MMD_AT_PLUS_A",
        diag_pivot_thresh=0.0,
        options={"SymmetricMode": True},
    )
    rows = (6 * np.searchsorted(motions.parts, bodies)[:, None] + np.arange(6)).ravel()
    return _Frame(
        curvature=row_curvature(links, kin, bodies),
        owners=np.repeat(links.parts, links.held.sum(axis=1), axis=0),
        motions=motions.twists.tocsr()[rows].toarray(),
        held=held,
        solve=factor.solve,
    )


def row_curvature(links: Links, kin: Kinematics, bodies: tuple[int, ...]) -> Array:
    """Return the second derivative of every held gap along constant twists.

    Returns
    -------
    (rows, 12, 12) ndarray
        Symmetric, for the scaled twists of side 0 and side 1; rows in the order of `finite.jacobian`.
    """
    placement = start(kin, bodies)
    points, axes = link_sides(links, placement)
    origins = np.where(links.parts[..., None] < 0, points, placement.origins[links.parts])
    arms = (points - origins) / kin.length
    link, motion = np.nonzero(links.held)
    out = np.zeros((len(link), 12, 12))
    e = axes[link, 1, motion % 3]
    cross = skew(e)
    u0, t0, u1, t1 = (slice(k, k + 3) for k in (0, 3, 6, 9))

    moves = motion < 3
    r0, r1 = arms[link, 0], arms[link, 1]
    out[moves, t1, u0] = cross[moves]
    out[moves, t1, u1] = -cross[moves]
    out[moves, t1, t0] = -(cross @ skew(r0))[moves]
    swing = cross @ skew(r1)
    out[moves, t0, t0] = _swing(r0, e)[moves]
    out[moves, t1, t1] = (swing + np.swapaxes(swing, 1, 2) - _swing(r1, e))[moves]

    turns = ~moves
    out[turns, t1, t0] = cross[turns] / 2

    universal = (motion == 3) & links.universal[link]
    b, c = axes[link, 0, 1], axes[link, 1, 2]
    out[universal, t0, t0] = out[universal, t1, t1] = _swing(b, c)[universal]
    out[universal, t1, t0] = np.swapaxes(np.swapaxes(skew(b), 1, 2) @ skew(c), 1, 2)[universal]

    for low, high in ((u0, t1), (u1, t1), (t0, t1)):
        out[:, low, high] = np.swapaxes(out[:, high, low], 1, 2)
    ground = links.parts[link] < 0
    for side in (0, 1):
        rows = np.flatnonzero(ground[:, side])
        out[rows, 6 * side : 6 * side + 6] = 0.0
        out[rows, :, 6 * side : 6 * side + 6] = 0.0
    return out


def _swing(arm: Array, direction: Array) -> Array:
    """Return ``S`` with ``w^T S w = e . (w x (w x r))``: how a point on an arm bends inwards."""
    outer = arm[:, :, None] * direction[:, None, :]
    inner = np.einsum("ki,ki->k", arm, direction)
    return np.asarray((outer + np.swapaxes(outer, 1, 2)) / 2 - inner[:, None, None] * np.eye(3))


def _curvature_of(frame: _Frame, lifts: Array) -> Array:
    """Return how the held gaps bend along pairs of motions, (rows, pairs): the upper triangle, by rows."""
    count = lifts.shape[1]
    twists = np.concatenate([lifts.reshape(-1, 6, count), np.zeros((1, 6, count))])
    both = twists[frame.owners].reshape(len(frame.owners), 12, count)  # -1 is the ground: zeros
    bent = np.swapaxes(both, 1, 2) @ (frame.curvature @ both)
    return np.asarray(bent[:, *np.triu_indices(count)])


def _certificate(frame: _Frame, lifts: Array) -> Array | None:
    """Return the self-stress, (rows,), that resists all of some motions as far as any does, or None."""
    count = lifts.shape[1]
    bent = _curvature_of(frame, lifts)
    u, values, vt = np.linalg.svd(_stress_part(frame, bent), full_matrices=False)
    kept = values > RESISTED * float(np.linalg.norm(bent))
    if not kept.any():
        return None
    forms = np.zeros((int(kept.sum()), count, count))
    rows, columns = np.triu_indices(count)
    forms[:, rows, columns] = forms[:, columns, rows] = (values[:, None] * vt)[kept]
    share = _search(forms)
    return None if share is None else np.asarray(u[:, kept] @ share)


def _search(forms: Array) -> Array | None:
    """Return a combination that is positive on all motions on which not every form vanishes."""
    count = forms.shape[1]
    _, values, vt = np.linalg.svd(forms.reshape(-1, count))
    used = vt[: int(np.sum(values > FLAT * values[0]))]
    return positive_combination(used @ forms @ used.T)


def _stress_part(frame: _Frame, loads: Array) -> Array:
    """Return the part of load vectors, one per column, that lies in the space of self-stresses."""
    rest = loads
    for _ in range(PASSES):
        rest = rest - frame.held @ frame.solve(frame.held.T @ rest)
    return np.asarray(rest)


def _weighted(frame: _Frame, weights: Array) -> sparse.csr_array:
    """Return the curvature weighted by a self-stress, as a matrix on the twists of all bodies."""
    blocks = weights[:, None, None] * frame.curvature
    index = (6 * frame.owners[:, :, None] + np.arange(6)).reshape(-1, 12)
    inside = np.repeat(frame.owners >= 0, 6, axis=1)
    rows = np.broadcast_to(index[:, :, None], blocks.shape)
    columns = np.broadcast_to(index[:, None, :], blocks.shape)
    used = inside[:, :, None] & inside[:, None, :]
    size = frame.motions.shape[0]
    return sparse.csr_array((blocks[used], (rows[used], columns[used])), shape=(size, size))
