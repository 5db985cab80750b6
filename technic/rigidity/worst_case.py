"""From eigenpairs to what a person reads: movement and load of every part, and where the energy goes."""

from __future__ import annotations

import numpy as np

from technic.geometry import Array, turn_twist
from technic.rigidity.result import Mode, WeakSpot
from technic.system.assemble import System

__all__ = ["mode_of", "node_fields", "rigid_parts", "weak_spots"]


def rigid_parts(system: System) -> Array:
    """Return what turns momentum into the nearest rigid motion: the inverse inertia of every part.

    Parameters
    ----------
    system : System

    Returns
    -------
    (p, 6, 6) ndarray
        About the centroid, world axes (1/kg and consistent).
    """
    squares = {id(e): e.rigid.T @ e.mass @ e.rigid for e in system.elements}
    inertia = np.array([squares[id(e)] for e in system.elements])
    turn = turn_twist(np.array([p.pose.rotation for p in system.assembly.parts]))
    return turn @ np.linalg.pinv(inertia, rcond=1e-12, hermitian=True) @ np.swapaxes(turn, 1, 2)


def mode_of(
    system: System, inverse_inertia: Array, value: float, unknowns: Array, measure: str
) -> Mode:
    """Return movement and load of every part in an elastic mode.

    A part's twist is that of the rigid motion nearest to its movement in the mean square, so the
    deformation left over has no momentum.

    Parameters
    ----------
    system : System
    inverse_inertia : (p, 6, 6) ndarray
        From `rigid_parts`.
    value : float
        Eigenvalue.
    unknowns : (n,) ndarray
        Eigenvector over all unknowns, unit measure.
    measure : str
        "mean_square": the load is ``value * M x``; "nodal": ``value`` times the unweighted measure.
    """
    momentum = (system.R.T @ (system.mass_matrix @ unknowns)).reshape(-1, 6)
    weight = system.M if measure == "mean_square" else system.nodal()
    load = system.R.T @ (weight @ unknowns) * value
    twists = np.einsum("pij,pj->pi", inverse_inertia, momentum)
    return Mode(value, unknowns, twists, load.reshape(-1, 6), node_fields(system, unknowns)[1])


def weak_spots(system: System, unknowns: Array) -> tuple[WeakSpot, ...]:
    """Return the shares of joints and parts in the strain energy of a mode, largest first.

    The energy splits exactly: ``x_i^T K_i x_i`` of each part and ``s_r (A_r x)^2`` of each held motion
    (design, section 2.5).

    Raises
    ------
    ValueError
        The movement stores no energy.
    """
    assembly = system.assembly
    entries: list[tuple[float, str, int, tuple[int, ...]]] = []
    for k, element in enumerate(system.elements):
        x = unknowns[system.part_slice(k)]
        energy = float(x @ element.stiffness @ x)
        if energy > 0.0:
            entries.append((energy, "part", k, (k,)))
    elastic = system.elastic
    stretch = system.A[elastic] @ unknowns
    per_joint = np.zeros(len(assembly.joints))
    np.add.at(per_joint, system.rows.link[elastic], system.rows.stiffness[elastic] * stretch**2)
    for k, joint in enumerate(assembly.joints):
        if per_joint[k] > 0.0:
            entries.append((float(per_joint[k]), "joint", k, joint.parts))
    total = sum(e[0] for e in entries)
    if total <= 0.0:
        raise ValueError("the movement stores no energy")
    entries.sort(key=lambda e: (-e[0], e[1], e[2]))
    return tuple(
        WeakSpot(rank, kind, index, energy / total, parts)
        for rank, (energy, kind, index, parts) in enumerate(entries, start=1)
    )


def node_fields(system: System, unknowns: Array) -> tuple[dict[int, Array], dict[int, Array]]:
    """Return, per part, its nodes in the world (m) and their displacement (m), each (n, 3)."""
    points: dict[int, Array] = {}
    displacements: dict[int, Array] = {}
    for k, (part, element) in enumerate(zip(system.assembly.parts, system.elements, strict=True)):
        x = unknowns[system.part_slice(k)]
        points[k] = part.pose.points(element.node_points)
        displacements[k] = part.pose.directions(element.nodes @ x)
    return points, displacements
