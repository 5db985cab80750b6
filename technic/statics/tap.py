"""A calibration rig that is tapped: its natural frequency with a weight fixed to it.

The mass is a point fixed to the measured place, so with ``M`` the rig's mass matrix and ``P`` the motion of
that place the frequency follows from ``(K + A^T D A) x = omega^2 (M + m P^T P) x``, and its derivative from
``d omega^2 / d s_r = (A_r x)^2`` for an x of unit mass. The rigidity of a free model is its mass times
omega squared (DESIGN, section 2.4): a tap measures the same number from the other side.

The rig is reduced once to a few shapes: its lowest modes, its answers to a force on the place and in every
joint motion whose stiffness varies, and the answers to the inertia of these. They hold the first two static
steps for any stiffness and any mass (Woodbury's identity), so the frequency is that of the whole model to
far better than any reading.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Final

import numpy as np
from numpy.polynomial import chebyshev
from numpy.typing import NDArray
from scipy import linalg

from technic.assembly.model import Assembly
from technic.assembly.stiffness import StiffnessTable
from technic.geometry import Array
from technic.statics.rig import rig_system
from technic.system.assemble import ElementFactory, Probe, solid_element_of
from technic.system.parameters import Parameter

__all__ = ["TapModel", "tap_model"]

_MODES: Final = 24
"""Lowest modes of the rig without the weight that the reduction keeps."""

_SEEN: Final = 6
"""Modes without a weight that stay in sight while one is added."""

_STEPS: Final = 2
"""Steps of the power method that a weight is followed for."""

_NODES: Final = 16
"""With more than twice as many weights, the answer is interpolated between this many."""

_EXACT: Final = 1e-8
"""Largest error of the interpolation, relative for periods, far below that of any reading."""

_SAME: Final = 1e-9
"""Shapes closer than this to those before them (in energy) bring nothing but rounding."""


@dataclass(frozen=True, slots=True, eq=False)
class TapModel:
    """A rig, ready to be asked for its frequency at any stiffnesses and with any weight.

    Parameters
    ----------
    parameters : tuple of Parameter
    start : (k,) ndarray
        Stiffness of each in the table (N/m, N m/rad).
    owner : (r,) ndarray of int
        Parameter of each variable row.
    inertia : (d, d) ndarray
        Reduced mass matrix without the weight; the shapes are orthonormal in the stiffness that the
        table gives, so that its size (a blocked motion has 1e8 N/m) brings no rounding.
    rows : (r, d) ndarray
    place : (3, d) ndarray
        Motion of the place that carries the weight.
    """

    parameters: tuple[Parameter, ...]
    start: Array
    owner: NDArray[np.int64]
    inertia: Array
    rows: Array
    place: Array

    def response(self, stiffness: Array, mass: Array, down: Array) -> tuple[Array, Array]:
        """Return the frequencies (Hz), (n,), and their derivatives per log stiffness, (n, k).

        The mode that counts is the one that gives most of the sag under the weight: what swings when
        the place is pushed that way and let go.

        Parameters
        ----------
        stiffness : (k,) ndarray
            One per parameter.
        mass : (n,) array_like
            Of the weights (kg).
        down : (n, 3) array_like
            Unit vectors along which the place is tapped.
        """
        mass, down = np.asarray(mass, dtype=float), np.asarray(down, dtype=float)
        if len(np.unique(mass)) > 2 * _NODES:
            found = self._between(stiffness, mass, down)
            if found is not None:
                return found
        return self._exact(stiffness, mass, down)

    def _between(self, stiffness: Array, mass: Array, down: Array) -> tuple[Array, Array] | None:
        """Interpolate over the weights; None when that is not good enough (two modes change places)."""
        low, high = float(mass.min()), float(mass.max())
        points = np.cos(np.pi * (np.arange(_NODES) + 0.5) / _NODES)
        tried = np.cos(np.pi * np.arange(1, _NODES, 3) / _NODES)
        ways, which = np.unique(down.round(12), axis=0, return_inverse=True)
        at = low + 0.5 * (high - low) * (1.0 + np.concatenate([points, tried]))
        frequency, slope = self._exact(
            stiffness, np.tile(at, len(ways)), np.repeat(ways, len(at), axis=0)
        )
        # what is smooth: the square of the period, nearly a line, and the relative slopes
        known = np.column_stack([frequency**-2.0, slope / frequency[:, None]])
        known = known.reshape(len(ways), len(at), -1)
        fitted = chebyshev.chebfit(
            points, known[:, :_NODES].swapaxes(0, 1).reshape(_NODES, -1), _NODES - 1
        )
        again = chebyshev.chebval(tried, fitted).T.reshape(len(tried), len(ways), -1)
        off = np.abs(again - known[:, _NODES:].swapaxes(0, 1))
        scale = np.maximum(np.abs(known).max(axis=1), np.arange(known.shape[2]) > 0)
        if np.any(off > _EXACT * scale):
            return None
        place = 2.0 * (mass - low) / (high - low) - 1.0
        values = chebyshev.chebval(place, fitted).reshape(len(ways), -1, len(mass))
        values = values[which.ravel(), :, np.arange(len(mass))]
        found = np.asarray(values[:, 0] ** -0.5, dtype=np.float64)
        return found, np.asarray(values[:, 1:] * found[:, None], dtype=np.float64)

    def _exact(self, stiffness: Array, mass: Array, down: Array) -> tuple[Array, Array]:
        stiffness = np.asarray(stiffness, dtype=float)
        own = stiffness[self.owner]
        change = own - self.start[self.owner]
        stiff = np.eye(len(self.inertia)) + (self.rows.T * change) @ self.rows
        # in coordinates in which the stiffness is one, the softest modes are the largest eigenvalues of
        # the inertia, which rounding spares
        lower = np.linalg.cholesky(stiff)
        half = linalg.solve_triangular(lower, self.inertia, lower=True)
        inertia = linalg.solve_triangular(lower, half.T, lower=True)
        place = linalg.solve_triangular(lower, self.place.T, lower=True).T
        shapes = _followed(inertia, place)
        small, seen = shapes.T @ inertia @ shapes, place @ shapes
        masses, which = np.unique(mass, return_inverse=True)
        inverse, modes = np.linalg.eigh(small + masses[:, None, None] * (seen.T @ seen))
        inverse, modes = inverse[which], modes[which]
        # a mode's part in the sag along a direction is the square of how far the place goes in it
        chosen = (np.einsum("ni,ij,njk->nk", down, seen, modes) ** 2).argmax(axis=1)
        each = np.arange(len(which))
        value, mode = 1.0 / inverse[each, chosen], modes[each, :, chosen] @ shapes.T
        stretch = self.rows @ linalg.solve_triangular(lower, mode.T, lower=True, trans="T")
        energy = np.zeros((len(self.parameters), len(which)))
        np.add.at(energy, self.owner, own[:, None] * stretch**2)
        frequency = np.sqrt(value) / (2.0 * np.pi)
        # these are shares of the mode's energy; a frequency changes half as much as its square
        return frequency, (0.5 * frequency * energy).T


def _followed(inertia: Array, place: Array) -> Array:
    """Return an orthonormal basis that holds the lowest modes with any weight at the place.

    A weight m adds ``m P^T P`` to the inertia, which leads back into the span of ``P^T``: so the steps of
    the power method from there, ``D^j P^T``, are the same for all weights.
    """
    size = len(inertia)
    _, lowest = linalg.eigh(inertia, subset_by_index=(max(0, size - _SEEN), size - 1))
    steps = [place.T]
    for _ in range(_STEPS):
        step = inertia @ steps[-1]
        steps.append(step / np.linalg.norm(step, axis=0))
    every = np.column_stack([lowest, *steps])
    left, sizes, _ = linalg.svd(every / np.linalg.norm(every, axis=0), full_matrices=False)
    return np.asarray(left[:, sizes > 1e-12 * sizes[0]])


def tap_model(
    assembly: Assembly,
    probe: Probe,
    parameters: Sequence[Parameter],
    table: StiffnessTable,
    *,
    element: ElementFactory = solid_element_of,
) -> TapModel:
    """Return the model of a rig that is tapped; see `technic.statics.rig.rig_model`.

    Raises
    ------
    UsageError
        The rig has no joint of some parameter, or a force on the place drives a motion that nothing
        resists.
    """
    rig = rig_system(assembly, probe, parameters, table, element)
    free, system = rig.free, rig.system
    k = free.T @ (system.K + system.J) @ free
    m = free.T @ system.mass_matrix @ free
    if rig.motions.shape[1]:
        # what nothing resists stands still: a swing has no share in it
        space = linalg.null_space((m @ (free.T @ rig.motions)).T)
        k, m, free = space.T @ k @ space, space.T @ m @ space, free @ space
    a, place = rig.rows @ free, rig.point @ free
    scale = 1.0 / np.sqrt(np.diag(k))
    factor = linalg.cho_factor(scale[:, None] * k * scale)

    def solved(loads: Array) -> Array:
        return np.asarray(scale[:, None] * linalg.cho_solve(factor, scale[:, None] * loads))

    static = solved(np.column_stack([a.T, place.T]))
    _, modes = linalg.eigh(k, m, subset_by_index=(0, min(_MODES, len(k)) - 1))
    shapes = _independent(np.column_stack([modes, static, solved(m @ static)]), k)
    return TapModel(
        parameters=tuple(parameters),
        start=rig.start,
        owner=rig.owner,
        inertia=shapes.T @ m @ shapes,
        rows=a @ shapes,
        place=place @ shapes,
    )


def _independent(shapes: Array, stiffness: Array) -> Array:
    """Return an orthonormal basis, in energy, of what the shapes span."""
    shapes = shapes / np.sqrt(np.einsum("ij,ik,kj->j", shapes, stiffness, shapes))
    gram = shapes.T @ stiffness @ shapes
    values, vectors = linalg.eigh((gram + gram.T) / 2.0)
    kept = values > _SAME * values[-1]
    return np.asarray(shapes @ (vectors[:, kept] / np.sqrt(values[kept])))
