"""From the uncertainty of joint stiffnesses to that of a displacement.

With ``K x = f`` and ``K g = p`` the displacement ``p^T x`` changes by ``-s_r (A_r g)(A_r x)`` per logarithm
of the stiffness of row r; the variance follows by the delta method.
"""

from __future__ import annotations

import numpy as np

from technic.assembly.stiffness import StiffnessTable
from technic.rigidity.uncertainty import NORMAL_95
from technic.statics.solve import Deflection, Load, deflect
from technic.system.assemble import ElementFactory, Probe, solid_element_of
from technic.system.parameters import Parameter, parameter_shares

__all__ = ["displacement_interval"]


def displacement_interval(
    answer: Deflection,
    points: tuple[Load | Probe, ...],
    k: int,
    table: StiffnessTable,
    element: ElementFactory = solid_element_of,
) -> tuple[float, float] | None:
    """Return the 95 % interval of how far a point goes (m), along the way it goes.

    Parameters
    ----------
    answer : Deflection
    points : tuple of Load or Probe
        All points of the answer, in its order: the system then has the same unknowns.
    k : int
        Which of them.
    table : StiffnessTable
        Where the joints' stiffnesses came from. Those without a covariance, and the parts, are taken
        as exact.
    element : callable
        What parts were made of.

    Returns
    -------
    (float, float) or None
        None when nothing that matters was measured, or the point stands still.
    """
    move = answer.probe_twists[k, :3]
    size = float(np.linalg.norm(move))
    if not table.measured or size == 0.0:
        return None
    system = answer.system
    rows, owner, share = parameter_shares(
        system, tuple(Parameter(*name) for name in table.measured)
    )
    if not len(rows):
        return None
    still = np.zeros(3)
    unit = [
        Load(p.part, p.point, move / size if i == k else still, still, p.port)
        for i, p in enumerate(points)
    ]
    g = deflect(system.assembly, tuple(unit), element=element).unknowns
    a = system.A[rows]
    slope = np.zeros(len(table.measured))
    pull = share * system.rows.stiffness[rows] * (a @ answer.unknowns)
    np.add.at(slope, owner, -(a @ g) * pull)
    # in the logarithm, so that the interval never reaches below zero
    deviation = float(np.sqrt(slope @ table.log_covariance @ slope)) / size
    half = float(np.exp(NORMAL_95 * deviation))
    return size / half, size * half
