"""Static displacement under loads: (K + J) x = f, the motions of the model standing still."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from scipy import sparse
from scipy.sparse import linalg as sparse_linalg

from technic.assembly.model import Assembly
from technic.errors import NumericalError, UsageError
from technic.geometry import Array, readonly
from technic.rigidity.kinematics import component_motions, kinematics
from technic.system.assemble import ElementFactory, Probe, System, assemble, solid_element_of
from technic.system.inverse import SHIFT, shifted_inverse, single_thread
from technic.tolerances import DRIVEN_MOTION, STATIC_RESIDUAL

__all__ = ["Deflection", "Load", "deflect", "free_motions", "refuse_driven"]

REFINEMENTS = 60
"""Steps of iterative refinement: each takes away a share of the shift's error."""


@dataclass(frozen=True, slots=True, eq=False)
class Load:
    """A force and a moment at a point of a part.

    Parameters
    ----------
    part : int
    point : (3,) array_like
        World coordinates (m).
    force : (3,) array_like
        (N), world axes.
    moment : (3,) array_like
        (N m), world axes.
    port : str or None
    """

    part: int
    point: Array
    force: Array
    moment: Array
    port: str | None = None

    def __post_init__(self) -> None:
        for name in ("point", "force", "moment"):
            object.__setattr__(self, name, readonly(getattr(self, name)))


@dataclass(frozen=True, slots=True, eq=False)
class Deflection:
    """Where everything goes under the loads.

    Parameters
    ----------
    system : System
    unknowns : (n,) ndarray
    part_twists : (p, 6) ndarray
        Translation of the centroid (m) and rotation (rad), world axes: the nearest rigid motion.
    probe_twists : (q, 6) ndarray
        Twist of each loaded or probed point.
    joint_forces : (j, 6) ndarray
        Force (N) and moment (N m) that each joint's first part exerts on the second, world axes at
        the joint's point; held motions only.
    reactions : (s, 6) ndarray
        Force and moment of each support on its part, world axes at its point.
    work : float
        Work of the loads, ``f^T x`` (J): twice the stored energy.
    """

    system: System
    unknowns: Array
    part_twists: Array
    probe_twists: Array
    joint_forces: Array
    reactions: Array
    work: float


def deflect(
    assembly: Assembly,
    loads: tuple[Load, ...],
    *,
    gravity: Array | None = None,
    probes: tuple[Probe, ...] = (),
    element: ElementFactory = solid_element_of,
) -> Deflection:
    """Return the static displacement of an assembly.

    Parameters
    ----------
    assembly : Assembly
    loads : tuple of Load
    gravity : (3,) array_like, optional
        Acceleration (m/s2) that acts on all material.
    probes : tuple of Probe
        Further points whose twist is wanted; those of the loads come first in `probe_twists`.
    element : callable
        See `technic.system.assemble.assemble`.

    Raises
    ------
    UsageError
        The loads drive a motion that nothing resists: there is no static answer.
    NumericalError
        The factorisation failed or its answer does not balance the loads.
    """
    points = tuple(Probe(load.part, load.point, load.port) for load in loads) + probes
    system = assemble(assembly, element=element, probes=points)
    wrenches = np.zeros(6 * len(points))
    for k, load in enumerate(loads):
        wrenches[6 * k : 6 * k + 6] = np.concatenate([load.force, load.moment])
    force = system.probes.T @ wrenches
    if gravity is not None:
        falling = np.tile([*np.asarray(gravity, dtype=float), 0.0, 0.0, 0.0], len(assembly.parts))
        force = force + system.mass_matrix @ (system.R @ falling)
    motions = free_motions(system)
    refuse_driven(motions, force)
    x = _solve(system, motions, force)
    stretch = system.A @ x
    finite = np.where(system.elastic, system.rows.stiffness, 0.0) * stretch
    finite[~system.elastic] = _multipliers(system, force, x)
    forces = _link_forces(system, finite)
    count = len(assembly.joints)
    momentum = system.R.T @ (system.mass_matrix @ x)
    inertia = sparse.csc_array(system.R.T @ system.mass_matrix @ system.R)
    # in two dimensions a part has no motions out of the plane, and no momentum there
    absent = (inertia.diagonal() == 0.0).astype(float)
    inertia = sparse.csc_array(inertia + sparse.diags_array(absent))
    return Deflection(
        system=system,
        unknowns=readonly(x),
        part_twists=readonly(sparse_linalg.spsolve(inertia, momentum).reshape(-1, 6)),
        probe_twists=readonly((system.probes @ x).reshape(-1, 6)),
        joint_forces=readonly(forces[:count]),
        reactions=readonly(-forces[count:]),
        work=float(force @ x),
    )


def free_motions(system: System) -> sparse.csc_array:
    """Return every motion of the assembly over all unknowns."""
    assembly = system.assembly
    kin = kinematics(assembly)
    columns = []
    for c, parts in enumerate(kin.components):
        found = component_motions(kin, c)
        own = np.concatenate([np.arange(6 * p, 6 * p + 6) for p in parts])
        scale = sparse.diags_array(np.tile(kin.units, len(parts)))
        columns.append(system.R[:, own] @ (scale @ found.twists))
    return (
        sparse.csc_array(sparse.hstack(columns)) if columns else sparse.csc_array((system.size, 0))
    )


def refuse_driven(motions: sparse.csc_array, force: Array) -> None:
    """Refuse a load that drives a motion which nothing resists.

    Parameters
    ----------
    motions : (n, k) sparse
        From `free_motions`.
    force : (n,) ndarray

    Raises
    ------
    UsageError
    """
    if motions.shape[1] == 0:
        return
    furthest = np.asarray(abs(motions).max(axis=0).toarray()).ravel()
    work = np.abs(motions.T @ force)
    if np.any(work > DRIVEN_MOTION * furthest * float(np.abs(force).sum())):
        raise UsageError(
            "the loads drive a motion that nothing resists, so there is no static answer; "
            "hold the model (--fix PART) or look at what moves with `technic analyze`"
        )


def _solve(system: System, motions: sparse.csc_array, force: Array) -> Array:
    """Solve by refinement with the shifted inverse."""
    stiffness = sparse.csr_array(system.K + system.J)
    constraints = sparse.csr_array(system.A[~system.elastic])
    biggest = float(abs(stiffness.diagonal()).max(initial=0.0)) or 1.0
    with single_thread():
        inverse = shifted_inverse(
            stiffness, system.M, constraints, motions, SHIFT * SHIFT**0.5 * biggest
        )
        x = np.zeros(system.size)
        rest = force
        first = None
        for _ in range(REFINEMENTS):
            step = inverse.solve(rest)
            x = x + step
            size = float(np.sqrt(max(step @ (system.M @ step), 0.0)))
            first = size if first is None else first
            total = float(np.sqrt(max(x @ (system.M @ x), 0.0)))
            if size <= STATIC_RESIDUAL * total or total == 0.0:
                return x
            # what the shift took away comes back as a load
            rest = inverse.shift * (system.M @ step)
    raise NumericalError(
        f"the static solution did not converge: the last step was {size / total:.1e} of the whole"
    )


def _multipliers(system: System, force: Array, x: Array) -> Array:
    """Return the forces in rows held rigidly: what balances the rest."""
    c = sparse.csc_array(system.A[~system.elastic].T)
    if c.shape[1] == 0:
        return np.zeros(0)
    rest = system.K @ x + system.J @ x - force
    return np.asarray(-sparse_linalg.lsqr(c, rest, atol=1e-14, btol=1e-14)[0])


def _link_forces(system: System, rows: Array) -> Array:
    """Return force and moment of every joint and support in world axes, (links, 6)."""
    assembly = system.assembly
    out = np.zeros((len(assembly.joints) + len(assembly.supports), 6))
    np.add.at(out, (system.rows.link, system.rows.motion), rows)
    axes = np.array([j.axes for j in assembly.joints] + [np.eye(3)] * len(assembly.supports))
    if len(axes):
        out[:, :3] = np.einsum("kij,ki->kj", axes, out[:, :3])
        out[:, 3:] = np.einsum("kij,ki->kj", axes, out[:, 3:])
    return out
