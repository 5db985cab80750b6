"""Derivatives of eigenvalues by the vertices' positions: exact, element by element, no dense algebra.

For a mode u with ``u^T M u = 1``: ``d lambda = u^T (dK + dJ - lambda dM) u + 2 mu^T dB u``, where B are
the rows held rigidly and mu their forces. Unknowns stay, matrices move. A member's matrices depend on
its length and its direction only: the derivative by the length is a complex step (exact to rounding,
no difference is formed), and so is that of its axes.

Source of the formula: R. L. Fox and M. P. Kapoor, *Rates of change of eigenvalues and eigenvectors*,
AIAA Journal 6 (1968); complex step: W. Squire and G. Trapp, SIAM Review 40 (1998).
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any, Final

import numpy as np
from numpy.typing import NDArray
from scipy import sparse
from scipy.sparse import linalg as sparse_linalg

from technic.design.optimize.moving import Model
from technic.design.optimize.pieces import Matrices, Members, turn_of
from technic.fem.frame import local_mass, local_stiffness
from technic.geometry import Array, cross

__all__ = ["eigenvalue_gradients", "length_gradient", "skew_of"]

STEP: Final = 1e-30
"""Imaginary step, relative to a length: far below rounding, far above the smallest number."""


def skew_of(r: Any) -> Any:
    """Return ``[r]x`` of vectors (n, 3), which may be complex."""
    zero = np.zeros_like(r[:, 0])
    x, y, z = r.T
    rows = [[zero, -z, y], [z, zero, -x], [-y, x, zero]]
    return np.moveaxis(np.array(rows), 2, 0)


@dataclass(slots=True)
class _Slopes:
    """Derivatives so far: by vertices, by nodes of frames and by points of links, (k, ., 3)."""

    vertices: Array
    nodes: Array
    points: Array


def eigenvalue_gradients(
    model: Model, positions: Array, matrices: Matrices, values: Array, vectors: Array
) -> Array:
    """Return the derivatives of eigenvalues by the positions of the vertices.

    Parameters
    ----------
    model : Model
    positions : (v, 3) ndarray
    matrices : Matrices
        At these positions.
    values : (k,) ndarray
        Eigenvalues (N/m).
    vectors : (n, k) ndarray
        Their modes, M-orthonormal. Of a repeated eigenvalue each single derivative depends on the
        choice of modes; symmetric functions of the cluster do not.

    Returns
    -------
    (k, v, 3) ndarray
    """
    k = len(values)
    slopes = _Slopes(
        np.zeros((k, len(positions), 3)),
        np.zeros((k, model.nodes.shape[0], 3)),
        np.zeros((k, len(model.owners), 3)),
    )
    full = np.vstack([vectors, np.zeros((1, k))])  # unknowns that are held (-1) read a zero
    nodes = model.nodes @ positions
    for group in model.members:
        _add_members(slopes, group, nodes, full, values, matrices.mass)
    _add_trusses(slopes, model, positions, full, values, matrices.mass)
    _add_links(slopes, model, positions, full, _forces(model, matrices, values, vectors))
    for owners, total in ((model.nodes, slopes.nodes), (model.geometry.link_points, slopes.points)):
        flat = np.moveaxis(total, 0, 1).reshape(owners.shape[0], 3 * k)
        by_vertex = (owners.T @ flat).reshape(len(positions), k, 3)
        slopes.vertices += np.moveaxis(by_vertex, 1, 0)
    return slopes.vertices


def _add(total: Array, where: Any, slope: Array) -> None:
    """Add derivatives (k, m, 3) at places (m,) of a total (k, n, 3); places may come up again."""
    everywhere: Any = slice(None)
    np.add.at(total, (everywhere, where), slope)


def _spread(total: Array, first: Any, last: Any, slope: Array) -> None:
    """Add derivatives by spans (k, m, 3) to both of their ends."""
    _add(total, last, slope)
    _add(total, first, -slope)


def _add_members(
    slopes: _Slopes, group: Members, nodes: Array, full: Array, values: Array, mass: float
) -> None:
    spans = nodes[group.last] - nodes[group.first]
    lengths = np.linalg.norm(spans, axis=1)
    section, material = group.section, group.material
    triples = full[group.dofs].reshape(len(spans), 4, 3, -1)
    local = turn_of(spans, group.normals)[:, None] @ triples
    flat = local.reshape(len(spans), 12, -1)
    step = lengths * (1.0 + STEP * 1j)
    k, m = local_stiffness(step, section, material), local_mass(step, section, material) / mass
    size = (STEP * lengths)[:, None]
    # kg per metre of length, and what the mass of the whole does to the mean square
    line = values[None, :] * material.density * section.area / mass
    along = np.sum(flat * (k.imag @ flat - values * (m.imag @ flat)), axis=1) / size + line
    force = (k.real @ flat - values * (m.real @ flat)).reshape(local.shape)
    slope = along.T[:, :, None] * (spans / lengths[:, None])
    for c in range(3):
        probe = spans.astype(complex)
        probe[:, c] += 1j * STEP
        change = turn_of(probe, group.normals).imag / STEP
        slope[:, :, c] += 2.0 * np.sum(force * (change[:, None] @ triples), axis=(1, 2)).T
    _spread(slopes.nodes, group.first, group.last, slope)


def _add_trusses(
    slopes: _Slopes, model: Model, positions: Array, full: Array, values: Array, mass: float
) -> None:
    bars = model.trusses
    if not len(bars.first):
        return
    spans = positions[bars.last] - positions[bars.first]
    lengths = np.linalg.norm(spans, axis=1)
    d = spans / lengths[:, None]
    young = np.array([m.young_pa for m in bars.materials]) * bars.areas
    line = np.array([m.density for m in bars.materials]) * bars.areas / mass
    own = full[bars.dofs]
    p, q, spin = own[:, :3], own[:, 3:6], own[:, 6]
    apart = q - p
    stretch = np.einsum("mi,mik->mk", d, apart)
    # E A / L (d . w)^2 with d = s / L
    slope = 2.0 * (young / lengths**2)[:, None, None] * stretch[:, None, :] * apart
    slope -= 3.0 * (young / lengths**2)[:, None, None] * (stretch**2)[:, None, :] * d[:, :, None]
    square = np.sum(p * p + p * q + q * q, axis=1) / 3.0
    square = square + (bars.areas / (2.0 * np.pi))[:, None] * spin**2
    slope += (values * line[:, None] * (1.0 - square))[:, None, :] * d[:, :, None]
    _spread(slopes.vertices, bars.first, bars.last, np.moveaxis(slope, 2, 0))


def _forces(model: Model, matrices: Matrices, values: Array, vectors: Array) -> Array:
    """Return the force of every held motion, (r, k): spring times motion, or what holds it rigidly."""
    forces = model.springs[:, None] * (matrices.rows @ vectors)
    rigid = matrices.constraints
    if rigid.shape[0]:
        rest = values * (matrices.measure @ vectors) - matrices.stiffness @ vectors
        gram = sparse.csc_array(rigid @ rigid.T)
        # rows may depend on each other: any of the forces that balance will do
        soft = 1e-10 * float(gram.diagonal().max())
        solve = sparse_linalg.splu(
            sparse.csc_array(gram + soft * sparse.eye_array(gram.shape[0]))
        ).solve
        held = np.zeros((rigid.shape[0], len(values)))
        for _ in range(3):
            held += solve(rigid @ (rest - rigid.T @ held))
        forces[~model.elastic] = held
    return np.asarray(forces)


def _add_links(slopes: _Slopes, model: Model, positions: Array, full: Array, forces: Array) -> None:
    """Add what turns and shifts the held motions: arms of joints, truss bars' turning, sliding lines."""
    links, modes = len(model.owners), forces.shape[1]
    if not links:
        return
    axes = model.axes(positions)
    six = np.zeros((links, 6, modes))
    six[model.held_link, model.held_motion] = forces
    push = np.einsum("lai,lak->lik", axes, six[:, :3])
    twist = np.einsum("lai,lak->lik", axes, six[:, 3:])
    at = model.geometry.link_points @ positions
    nodes = model.nodes @ positions
    relative = np.zeros((links, 6, modes))
    s = model.frame_sides
    if len(s.link):
        own = full[s.dofs]
        arm = at[s.link] - nodes[s.owner]
        _add_arms(slopes, s.link, s.sign, push, own[:, 3:])
        turned = _cross(own[:, 3:], arm[:, :, None])
        both = np.concatenate([own[:, :3] + turned, own[:, 3:]], axis=1)
        np.add.at(relative, s.link, s.sign[:, None, None] * both)
        slope = -2.0 * s.sign[:, None, None] * _cross(push[s.link], own[:, 3:])
        _add(slopes.nodes, s.owner, np.moveaxis(slope, 2, 0))
    s = model.truss_sides
    if len(s.link):
        bars = model.trusses
        first, last = bars.first[s.owner], bars.last[s.owner]
        spans = positions[last] - positions[first]
        arm = at[s.link] - (positions[first] + s.share[:, None] * spans)
        own = full[s.dofs]
        turn = np.einsum("sij,sjk->sik", model.truss_turn(spans), own)
        _add_arms(slopes, s.link, s.sign, push, turn)
        place = (1.0 - s.share)[:, None, None] * own[:, :3] + s.share[:, None, None] * own[:, 3:6]
        turned = _cross(turn, arm[:, :, None])
        moment = twist[s.link] + _cross(arm[:, :, None], push[s.link])
        changes = []
        for c in range(3):
            probe = spans.astype(complex)
            probe[:, c] += 1j * STEP
            changes.append(np.einsum("sij,sjk->sik", model.truss_turn(probe).imag / STEP, own))
        both = np.concatenate([place + turned, turn], axis=1)
        np.add.at(relative, s.link, s.sign[:, None, None] * both)
        pull = -2.0 * s.sign[:, None, None] * _cross(push[s.link], turn)
        by_span = np.stack([np.sum(moment * d, axis=1) for d in changes], axis=1)
        by_span = 2.0 * s.sign[:, None, None] * by_span
        share = s.share[:, None, None]
        for vertex, slope in (
            (first, (1.0 - share) * pull - by_span),
            (last, share * pull + by_span),
        ):
            _add(slopes.vertices, vertex, np.moveaxis(slope, 2, 0))
    for link, sign, number, _, own_slice in model.still_sides:
        motion = model.maps[number] @ full[own_slice]
        arm = at[link] - model.origins[number]
        relative[link, 3:] += sign * motion[3:]
        relative[link, :3] += sign * (motion[:3] + np.cross(motion[3:].T, arm).T)
        for k in range(modes):
            slopes.points[k, link] += 2.0 * sign * np.cross(push[link, :, k], motion[3:, k])
    for joint, (a, b) in model.geometry.lines.items():
        span = positions[b] - positions[a]
        for c in range(3):
            probe = span.astype(complex)
            probe[c] += 1j * STEP
            change = model.followed(joint, probe).imag / STEP
            both = np.einsum("ak,ai,ik->k", six[joint, :3], change, relative[joint, :3])
            both = both + np.einsum("ak,ai,ik->k", six[joint, 3:], change, relative[joint, 3:])
            slopes.vertices[:, b, c] += 2.0 * both
            slopes.vertices[:, a, c] -= 2.0 * both


def _cross(a: Array, b: Array) -> Array:
    """Return the cross product along the second axis."""
    return np.moveaxis(cross(np.moveaxis(a, 1, -1), np.moveaxis(b, 1, -1)), -1, 1)


def _add_arms(slopes: _Slopes, link: Any, sign: Array, push: Array, turn: Array) -> None:
    """Add the derivative by the links' points: ``2 F . (theta x d arm) = 2 (F x theta) . d arm``."""
    slope = 2.0 * sign[:, None, None] * _cross(push[link], turn)
    _add(slopes.points, link, np.moveaxis(slope, 2, 0))


def length_gradient(positions: Array, stretches: NDArray[np.int64]) -> tuple[Array, Array]:
    """Return lengths of stretches (e,) and the unit vectors from their first to their second end."""
    spans = positions[stretches[:, 1]] - positions[stretches[:, 0]]
    lengths = np.linalg.norm(spans, axis=1)
    return lengths, spans / np.maximum(lengths, 1e-300)[:, None]
