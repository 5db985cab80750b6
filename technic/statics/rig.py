"""A calibration rig: how far it gives way per newton, and how that depends on each joint stiffness.

The rig is solved once, with the stiffnesses of a table. Other stiffnesses change few rows of the joint
matrix, so their answer follows exactly from the motions in these rows (Woodbury's identity):

    (K0 + A^T D A)^-1 = K0^-1 - K0^-1 A^T D (1 + V D)^-1 A K0^-1,    V = A K0^-1 A^T,  D = S - S0

and the derivative of a displacement ``p^T x`` from ``dx/ds_r = -K^-1 A_r^T A_r x``.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from scipy import linalg

from technic.assembly.model import Assembly
from technic.assembly.stiffness import StiffnessTable
from technic.errors import UsageError
from technic.geometry import Array
from technic.statics.solve import free_motions, refuse_driven
from technic.system.assemble import ElementFactory, Probe, System, assemble, solid_element_of
from technic.system.parameters import Parameter, parameter_rows

__all__ = ["RigModel", "RigSystem", "rig_model", "rig_system"]


@dataclass(frozen=True, slots=True, eq=False)
class RigModel:
    """A rig, ready to be asked for any stiffnesses.

    Parameters
    ----------
    parameters : tuple of Parameter
    start : (k,) ndarray
        Stiffness of each in the table (N/m, N m/rad).
    owner : (r,) ndarray of int
        Parameter of each variable row.
    base : (3, 6) ndarray
        Displacement of the point along the axes under a unit force and under unit gravity along each,
        with the table's stiffnesses (m/N, m per m/s2).
    rows : (r, r) ndarray
        ``V``.
    loaded : (r, 6) ndarray
        ``A x`` of the same six load cases.
    """

    parameters: tuple[Parameter, ...]
    start: Array
    owner: NDArray[np.int64]
    base: Array
    rows: Array
    loaded: Array

    def response(self, stiffness: Array) -> tuple[Array, Array]:
        """Return the displacements, (3, 6), and their derivatives, (k, 3, 6), per log stiffness.

        Parameters
        ----------
        stiffness : (k,) ndarray
            One per parameter.
        """
        stiffness = np.asarray(stiffness, dtype=float)
        own = stiffness[self.owner]
        change = own - self.start[self.owner]
        moved = linalg.solve(np.eye(len(own)) + self.rows * change, self.loaded)
        # the point is loaded and measured in the same place: its probes are the first three cases
        value = self.base - (self.loaded[:, :3] * change[:, None]).T @ moved
        energy = np.einsum("ri,rj,r->rij", moved[:, :3], moved, own)
        slope = np.zeros((len(self.parameters), 3, 6))
        np.add.at(slope, self.owner, -energy)
        return value, slope


def rig_model(
    assembly: Assembly,
    probe: Probe,
    parameters: Sequence[Parameter],
    table: StiffnessTable,
    *,
    element: ElementFactory = solid_element_of,
) -> RigModel:
    """Return the model of a rig.

    Parameters
    ----------
    assembly : Assembly
        With its clamps as supports and the stiffnesses of `table`.
    probe : Probe
        The point that is loaded and measured.
    parameters : sequence of Parameter
    table : StiffnessTable
    element : callable
        What parts are made of.

    Raises
    ------
    UsageError
        The rig has no joint of some parameter, or the load drives a motion that nothing resists.
    """
    rig = rig_system(assembly, probe, parameters, table, element)
    x = _solved(rig, np.column_stack([rig.loads, rig.rows.T]))
    return RigModel(
        parameters=tuple(parameters),
        start=rig.start,
        owner=rig.owner,
        base=rig.point @ x[:, :6],
        rows=rig.rows @ x[:, 6:],
        loaded=rig.rows @ x[:, :6],
    )


@dataclass(frozen=True, slots=True, eq=False)
class RigSystem:
    """The matrices of a rig, n unknowns.

    Parameters
    ----------
    system : System
    start : (k,) ndarray
        Stiffness of each parameter in the table (N/m, N m/rad).
    rows : (r, n) ndarray
        Joint motions whose stiffness is a parameter.
    owner : (r,) ndarray of int
        Parameter of each of these rows.
    point : (3, n) ndarray
        Motion of the loaded and measured place.
    loads : (n, 6) ndarray
        Unit forces on the place and unit gravity, along each axis.
    motions : (n, m) ndarray
        Motions that nothing resists; no load drives them.
    free : (n, f) ndarray
        Basis of what obeys the clamps.
    """

    system: System
    start: Array
    rows: Array
    owner: NDArray[np.int64]
    point: Array
    loads: Array
    motions: Array
    free: Array


def rig_system(
    assembly: Assembly,
    probe: Probe,
    parameters: Sequence[Parameter],
    table: StiffnessTable,
    element: ElementFactory = solid_element_of,
) -> RigSystem:
    """Return the matrices of a rig; see `rig_model`.

    Raises
    ------
    UsageError
        The rig has no joint of some parameter, or the load drives a motion that nothing resists.
    """
    system = assemble(assembly, element=element, probes=(probe,))
    rows, owner = parameter_rows(system, parameters)
    for k, parameter in enumerate(parameters):
        if not np.any(owner == k):
            raise UsageError(f"the rig {assembly.name!r} has no joint that holds {parameter}")
    if not np.all(system.elastic[rows]):
        raise UsageError(f"the rig {assembly.name!r} has joints that are held rigidly")
    start = np.array([table.get(p.connection).values[p.motion].value for p in parameters])
    point = system.probes[:3].toarray()
    falling = np.tile(np.vstack([np.eye(3), np.zeros((3, 3))]), (len(assembly.parts), 1))
    loads = np.column_stack([point.T, system.mass_matrix @ (system.R @ falling)])
    factor = system.rows.stiffness[rows] / start[owner]
    if not np.allclose(factor, 1.0, rtol=1e-9):
        raise UsageError(
            f"the rig {assembly.name!r} has joints whose stiffness is not the table's own (several "
            "studs together): their lever arms mix the motions; use single ones"
        )
    motions = free_motions(system)
    for load in loads.T:
        refuse_driven(motions, load)
    held = system.A[~system.elastic].toarray()
    return RigSystem(
        system=system,
        start=start,
        rows=system.A[rows].toarray(),
        owner=owner,
        point=point,
        loads=loads,
        motions=motions.toarray(),
        free=linalg.null_space(held) if len(held) else np.eye(system.size),
    )


def _solved(rig: RigSystem, loads: Array) -> Array:
    """Return ``K^-1 loads`` on what obeys the supports, the free motions standing still."""
    free = rig.free
    stiffness = free.T @ (rig.system.K + rig.system.J) @ free
    idle = free.T @ rig.motions
    if idle.shape[1]:
        # what nothing resists and nothing drives may have any stiffness: it does not move
        idle = linalg.orth(idle)
        stiffness = stiffness + float(np.median(np.diag(stiffness))) * idle @ idle.T
    scale = 1.0 / np.sqrt(np.diag(stiffness))
    factor = linalg.cho_factor(scale[:, None] * stiffness * scale)
    out = free @ (scale[:, None] * linalg.cho_solve(factor, scale[:, None] * (free.T @ loads)))
    return np.asarray(out)
