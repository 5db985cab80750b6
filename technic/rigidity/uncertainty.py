"""From the uncertainty of joint stiffnesses to that of the rigidity.

The derivative of an eigenvalue with respect to a stiffness is ``d lambda / d s_r = (A_r x)^2`` for
``x^T M x = 1`` (DESIGN, section 2.5). In logarithms it is a share of energy,

    d log lambda / d log s_p = sum over the rows r of p of s_r (A_r x)^2 / lambda

so that ``var(log lambda) = e^T C e`` with these shares e and the covariance C of the logarithms.
"""

from __future__ import annotations

import numpy as np

from technic.assembly.stiffness import StiffnessTable
from technic.geometry import Array
from technic.system.assemble import System
from technic.system.parameters import Parameter, parameter_shares

__all__ = ["NORMAL_95", "energy_shares", "rigidity_interval"]

NORMAL_95 = 1.959964
"""Half width of a 95 % interval in standard deviations."""


def energy_shares(system: System, x: Array, parameters: tuple[Parameter, ...]) -> Array:
    """Return the share of the strain energy of `x` in the rows of each parameter, (k,).

    It is the derivative of the logarithm of the eigenvalue per logarithm of the stiffness.
    """
    rows, owner, share = parameter_shares(system, parameters)
    stretch = system.A[rows] @ x
    shares = np.zeros(len(parameters))
    np.add.at(shares, owner, share * system.rows.stiffness[rows] * stretch**2)
    return shares / float(x @ (system.K @ x) + x @ (system.J @ x))


def rigidity_interval(
    system: System, x: Array, value: float, table: StiffnessTable
) -> tuple[tuple[float, float], tuple[float, ...]] | None:
    """Return the 95 % interval of an eigenvalue and its slopes; None when nothing in it was measured.

    The slopes are ``d log lambda / d log s`` of every measured stiffness.

    Parameters
    ----------
    system : System
    x : (n,) ndarray
        The eigenvector.
    value : float
        The eigenvalue.
    table : StiffnessTable
        With the covariance of the stiffnesses that were measured; the others, and the parts, are
        taken as exact.
    """
    if not table.measured:
        return None
    shares = energy_shares(system, x, tuple(Parameter(*name) for name in table.measured))
    if not np.any(shares > 0.0):
        return None
    deviation = float(np.sqrt(shares @ table.log_covariance @ shares))
    half = float(np.exp(NORMAL_95 * deviation))
    return (value / half, value * half), tuple(float(share) for share in shares)
