"""Does the answer hold under the uncertainty of the measured stiffnesses?

The verdict and the motions follow from what joints hold, not from how stiff they are, so they always do. What
can change is an order: which spot is the weakest. (Which of two reinforced models is the more rigid:
`technic.design.confidence`.)

Stiffnesses are drawn from their joint distribution (normal in the logarithms) and the analysis is repeated
for each draw on a few shapes instead of all unknowns (Rayleigh and Ritz): the lowest modes, and how the
worst one changes with each measured stiffness, ``G A_p^T S_p A_p x`` with ``G`` the inverse of ``K + J``. On
these the change of the mode is exact to first order and its energy to third.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Final

import numpy as np
from numpy.typing import NDArray
from scipy import linalg, sparse

from technic.assembly.stiffness import StiffnessTable
from technic.geometry import Array
from technic.rigidity.result import Mode, SpotRange, Stability, WeakSpot
from technic.system.assemble import System
from technic.system.inverse import shifted_inverse, single_thread
from technic.system.parameters import Parameter, parameter_shares

__all__ = ["DRAWS", "Pencil", "draw", "stability"]

DRAWS: Final = 400
"""Draws: the ends of a 95 % range are then known to one in a hundred of the draws."""

_BLOCK: Final = 50
"""Draws that are looked at together: large models do not fill the memory."""

SHOWN: Final = 10
"""Weak spots whose ranks are examined: nobody reinforces the eleventh first."""

_SEED: Final = 20220411
"""Any number; the same one always, so that a report does not change from run to run."""

_SAME: Final = 1e-10
"""Shapes closer than this to those before them bring nothing but rounding."""


_Rows = tuple[NDArray[np.int64], NDArray[np.int64], Array]
"""Joint motions whose stiffness was measured; see `technic.system.parameters.parameter_shares`."""


@dataclass(frozen=True, slots=True, eq=False)
class Pencil:
    """The eigenproblem of one component; see `technic.rigidity.eigen.elastic_modes`.

    Parameters
    ----------
    own : (n,) ndarray of int
        Its unknowns in the system.
    stiffness, measure : (n, n) sparse
    constraints : (c, n) sparse
    motions : (n, k) sparse
    mass : float
        (kg)
    """

    own: NDArray[np.int64]
    stiffness: sparse.csr_array
    measure: sparse.csr_array
    constraints: sparse.csr_array
    motions: sparse.csc_array
    mass: float


def draw(table: StiffnessTable, draws: int = DRAWS) -> Array:
    """Return draws of the changes of the logarithms of the measured stiffnesses, (draws, k).

    They are the same in every run, and each has its mirror image, so that their mean is exact.
    """
    values, vectors = linalg.eigh(np.asarray(table.log_covariance))
    root = vectors * np.sqrt(np.clip(values, 0.0, None))
    half = np.random.default_rng(_SEED).standard_normal((draws // 2, len(values))) @ root.T
    return np.vstack([half, -half])


def stability(
    system: System,
    pencil: Pencil,
    modes: Sequence[Mode],
    spots: Sequence[WeakSpot],
    table: StiffnessTable | None,
) -> Stability | None:
    """Return how far ranks of weak spots range; None when nothing that matters was measured.

    Parameters
    ----------
    system : System
    pencil : Pencil
        Of the component that the modes are of.
    modes : sequence of Mode
        Lowest first.
    spots : sequence of WeakSpot
        Of the first mode, all of them.
    table : StiffnessTable or None
        With the covariance of the measured stiffnesses.
    """
    if table is None or not table.measured or not modes:
        return None
    known = parameter_shares(system, tuple(Parameter(*name) for name in table.measured))
    rows, owner, share = known
    if not len(rows):
        return None
    with single_thread():
        shapes = _shapes(system, pencil, modes, known)
        changes = draw(table)
        mixed = _worst_of_each(system, pencil, shapes, known, changes)
    factors = np.ones((system.A.shape[0], len(changes)))
    np.add.at(factors, rows, share[:, None] * np.expm1(changes[:, owner]).T)
    blocks = [slice(k, k + _BLOCK) for k in range(0, len(changes), _BLOCK)]
    shares = np.hstack(
        [
            _shares(system, pencil.own, shapes @ mixed[:, block], spots, factors[:, block])
            for block in blocks
        ]
    )
    ranks = _ranks(-shares)
    return Stability(
        draws=len(changes),
        spots=tuple(
            SpotRange(
                ranks=_range(ranks[k]),
                energy_shares=(
                    float(np.quantile(shares[k], 0.025)),
                    float(np.quantile(shares[k], 0.975)),
                ),
            )
            for k in range(min(SHOWN, len(spots)))
        ),
    )


def _range(ranks: NDArray[np.int64]) -> tuple[int, int]:
    """Return the ranks between which 95 % of the draws lie."""
    low, high = np.quantile(ranks, [0.025, 0.975], method="inverted_cdf")
    return int(low), int(high)


def _shapes(
    system: System,
    pencil: Pencil,
    modes: Sequence[Mode],
    measured: _Rows,
) -> Array:
    """Return the shapes over the component's unknowns, M-orthonormal, (n, d)."""
    rows, owner, share = measured
    known = np.column_stack([mode.unknowns[pencil.own] for mode in modes])
    a = sparse.csr_array(system.A[rows][:, pencil.own])
    pull = share * system.rows.stiffness[rows] * (a @ known[:, 0])
    # small beside the lowest eigenvalue: the answer is a shape to try, not a result
    inverse = shifted_inverse(
        pencil.stiffness,
        pencil.measure,
        pencil.constraints,
        pencil.motions,
        max(1e-3 * modes[0].value, 1e-12 * float(abs(pencil.stiffness.diagonal()).max())),
    )
    found = [known]
    for p in np.unique(owner):
        load = a.T @ np.where(owner == p, pull, 0.0)
        answer = inverse.solve(load)
        # the part along the worst mode is there already, and far larger than the rest
        answer = answer - known @ (known.T @ (pencil.measure @ answer))
        found.append(answer[:, None])
    every = np.column_stack(found)
    size = np.sqrt(np.einsum("nd,nd->d", every, pencil.measure @ every))
    every = every[:, size > 0.0] / size[size > 0.0]
    gram = every.T @ (pencil.measure @ every)
    values, vectors = linalg.eigh((gram + gram.T) / 2.0)
    kept = values > _SAME
    return np.asarray(every @ (vectors[:, kept] / np.sqrt(values[kept])))


def _worst_of_each(
    system: System,
    pencil: Pencil,
    shapes: Array,
    measured: _Rows,
    changes: Array,
) -> Array:
    """Return the worst mode of every draw in terms of the shapes, (d, draws)."""
    rows, owner, share = measured
    base = shapes.T @ (pencil.stiffness @ shapes)
    a = np.asarray(system.A[rows][:, pencil.own] @ shapes)
    weighted = (share * system.rows.stiffness[rows])[:, None] * a
    parameters = changes.shape[1]
    joints = np.array([a[owner == p].T @ weighted[owner == p] for p in range(parameters)])
    every = base + np.einsum("mp,pij->mij", np.expm1(changes), joints)
    _, vectors = np.linalg.eigh(every)
    return np.asarray(vectors[:, :, 0].T)


def _shares(
    system: System,
    own: NDArray[np.int64],
    moved: Array,
    spots: Sequence[WeakSpot],
    factors: Array,
) -> Array:
    """Return the share of each spot in the strain energy of each draw, (spots, m).

    Parameters
    ----------
    system : System
    own : (n,) ndarray of int
        Unknowns of the component that the spots are in.
    moved : (n, m) ndarray
        The worst mode of each draw.
    spots : sequence of WeakSpot
    factors : (r, m) ndarray
        What the stiffness of every joint motion was multiplied with.
    """
    x = np.zeros((system.size, moved.shape[1]))
    x[own] = moved
    parts = np.add.reduceat(x * (system.K @ x), system.offsets[:-1], axis=0)
    elastic = np.flatnonzero(system.elastic)
    stretch = system.A[elastic] @ x
    energy = system.rows.stiffness[elastic][:, None] * factors[elastic] * stretch**2
    links = len(system.assembly.joints) + len(system.assembly.supports)
    joints = np.zeros((links, x.shape[1]))
    np.add.at(joints, system.rows.link[elastic], energy)
    found = np.array([(joints if s.kind == "joint" else parts)[s.index] for s in spots])
    return np.asarray(found / found.sum(axis=0))


def _ranks(values: Array) -> NDArray[np.int64]:
    """Return the rank of every row in each column, from 1 for the lowest value."""
    order = np.argsort(values, axis=0, kind="stable")
    ranks = np.empty(order.shape, dtype=np.int64)
    np.put_along_axis(ranks, order, np.arange(1, len(values) + 1)[:, None], axis=0)
    return ranks
