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

_SEEN: Final = 8
"""Modes among which the tapped one is looked for: a weight at a place has three ways to swing."""

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

    def response(self, stiffness: Array, mass: float, down: Array) -> tuple[Array, Array]:
        """Return the frequencies (Hz), (n,), and their derivatives per log stiffness, (n, k).

        The mode that counts is the one that gives most of the sag under the weight: what swings when
        the place is pushed that way and let go.

        Parameters
        ----------
        stiffness : (k,) ndarray
            One per parameter.
        mass : float
            Of the weight (kg).
        down : (n, 3) array_like
            Unit vectors along which the place is tapped.
        """
        stiffness = np.asarray(stiffness, dtype=float)
        own = stiffness[self.owner]
        change = own - self.start[self.owner]
        stiff = np.eye(len(self.inertia)) + (self.rows.T * change) @ self.rows
        inertia = self.inertia + mass * self.place.T @ self.place
        size = len(stiff)
        # the softest modes are the largest of the inverse problem, which rounding spares
        inverse, shapes = linalg.eigh(
            inertia, stiff, subset_by_index=(max(0, size - _SEEN), size - 1)
        )
        values, shapes = 1.0 / inverse, shapes / np.sqrt(inverse)
        sag = (np.asarray(down) @ self.place @ shapes) ** 2 / values
        chosen = sag.argmax(axis=1)
        stretch = self.rows @ shapes[:, chosen]
        energy = np.zeros((len(self.parameters), len(chosen)))
        np.add.at(energy, self.owner, own[:, None] * stretch**2)
        frequency = np.sqrt(values[chosen]) / (2.0 * np.pi)
        # in logarithms a frequency changes half as much as its square
        return frequency, (0.5 * frequency * energy / values[chosen]).T


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
