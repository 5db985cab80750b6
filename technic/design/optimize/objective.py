"""What is made small: weighted rigidity and change of length; and what must hold on the way."""

from __future__ import annotations

from dataclasses import dataclass, field

import numpy as np
from scipy import sparse

from technic.design.optimize.gradient import eigenvalue_gradients, length_gradient
from technic.design.optimize.modes import Tracker
from technic.design.optimize.moving import Model, moved
from technic.errors import NumericalError, UsageError
from technic.geometry import Array, shift_twist
from technic.rigidity.kinematics import component_motions, kinematics

__all__ = ["Objective", "Point", "spectrum"]

CLUSTER = 6
"""Modes in the bundle: more than ever meet at one rigidity on the models at hand."""


@dataclass(frozen=True, slots=True, eq=False)
class Point:
    """The objective at one set of positions.

    Parameters
    ----------
    value : float
    gradient : (v, 3) ndarray
    rigidity : float
        Worst-case rigidity (N/m).
    spectrum : (k,) ndarray
        Lowest eigenvalues (N/m).
    edges : float
        Total length of the bars (m).
    mass : float
        kg.
    """

    value: float
    gradient: Array
    rigidity: float
    spectrum: Array
    edges: float
    mass: float


class Motions:
    """The motions that cost nothing: of the whole, and of its mechanisms if it has any.

    Raises
    ------
    UsageError
        The assembly falls apart into pieces.
    """

    def __init__(self, model: Model) -> None:
        kin = kinematics(model.assembly)
        if len(kin.components) != 1:
            raise UsageError(
                f"the assembly falls into {len(kin.components)} pieces: join them first"
            )
        found = component_motions(kin, 0)
        self.model = model
        self.internal = found.internal
        self.grounded = found.rigid == 0
        self.order = np.array(found.parts)

    def at(self, positions: Array) -> sparse.csc_array | None:
        """Return the basis of the motions (n, k), None when there are more than at the start."""
        whole = self.model.rigid_motions(positions)
        if self.internal == 0:
            if self.grounded:
                return sparse.csc_array((len(whole), 0))
            plane = [0, 1, 5] if self.model.assembly.dimension == 2 else list(range(6))
            return sparse.csc_array(whole[:, plane])
        assembly = moved(self.model, positions)
        kin = kinematics(assembly)
        found = component_motions(kin, 0)
        if found.internal > self.internal:
            return None
        twists = (sparse.diags_array(np.tile(kin.units, len(found.parts))) @ found.twists).toarray()
        out = np.zeros((len(whole), twists.shape[1]))
        for k, p in enumerate(found.parts):
            own = self.model.system.part_slice(p)
            back = shift_twist(-assembly.parts[p].centroid)
            out[own] = whole[own] @ back @ twists[6 * k : 6 * k + 6]
        return sparse.csc_array(out)


def spectrum(
    model: Model, motions: Motions, positions: Array, tracker: Tracker | None = None
) -> tuple[Array, Array]:
    """Return the lowest eigenvalues (N/m) and their derivatives (k, v, 3).

    Both are empty where the geometry gives way: more motions than at the start.
    """
    free = motions.at(positions)
    matrices = model.matrices(positions)
    if free is None:
        return np.zeros(0), np.zeros((0, *positions.shape))
    try:
        values, vectors = (tracker or Tracker(CLUSTER)).modes(matrices, free)
    except NumericalError:
        return np.zeros(0), np.zeros((0, *positions.shape))
    if not len(values):
        raise UsageError("nothing in the assembly can give way: it has no elastic mode")
    return values, eigenvalue_gradients(model, positions, matrices, values, vectors)


@dataclass(slots=True, eq=False)
class Objective:
    """``w_rigid E_rigid + w_geom E_geom``.

    ``E_rigid`` is the worst-case rigidity over that at the start, as a smooth minimum over the lowest
    modes: ``-(1 / sharpness) log sum exp(-sharpness lambda_i / lambda_start)``. Where two modes meet it
    rises as long as both can rise, while lambda_1 itself has an edge there. ``E_geom`` is the square of
    the change of the total edge length, in percent of the length at the start: the paper's, made
    independent of units.

    Parameters
    ----------
    model : Model
    motions : Motions
    rigid_weight, geometry_weight : float
    start_rigidity, start_edges : float
        Scales: N/m and m.
    sharpness : float
    tracker : Tracker
    lines : (e,) ndarray or None
        kg per metre of every stretch, kept once computed.
    """

    model: Model
    motions: Motions
    rigid_weight: float
    geometry_weight: float
    start_rigidity: float
    start_edges: float
    sharpness: float = 20.0
    tracker: Tracker = field(default_factory=lambda: Tracker(CLUSTER))
    lines: Array | None = None

    def at(self, positions: Array) -> Point:
        """Return value and derivative at some positions."""
        stretches = self.model.geometry.stretches
        lengths, units = length_gradient(positions, stretches)
        edges = float(lengths.sum())
        if lengths.min() <= 1e-6 * self.start_edges / len(lengths):
            return self._hopeless(positions, edges)
        values, slopes = spectrum(self.model, self.motions, positions, self.tracker)
        if not len(values):
            return self._hopeless(positions, edges)
        scaled = values / self.start_rigidity
        low = float(scaled[0])
        weights = np.exp(-self.sharpness * (scaled - low))
        total = float(weights.sum())
        smooth = low - float(np.log(total)) / self.sharpness
        by_rigidity = np.tensordot(weights / total, slopes, axes=1) / self.start_rigidity
        percent = 100.0 * (edges - self.start_edges) / self.start_edges
        by_edges = np.zeros_like(positions)
        np.add.at(by_edges, stretches[:, 1], units)
        np.add.at(by_edges, stretches[:, 0], -units)
        scale = 2.0 * percent * 100.0 / self.start_edges
        return Point(
            value=self.rigid_weight * smooth + self.geometry_weight * percent**2,
            gradient=self.rigid_weight * by_rigidity + self.geometry_weight * scale * by_edges,
            rigidity=float(values[0]),
            spectrum=values,
            edges=edges,
            mass=self.mass(positions),
        )

    def merit(self, point: Point) -> float:
        """Return the objective with the true minimum in place of the smooth one."""
        percent = 100.0 * (point.edges - self.start_edges) / self.start_edges
        rigid = self.rigid_weight * point.rigidity / self.start_rigidity
        return rigid + self.geometry_weight * percent**2

    def mass(self, positions: Array) -> float:
        """Return the mass (kg)."""
        lengths, _ = length_gradient(positions, self.model.geometry.stretches)
        if self.lines is None:
            self.lines = self.line_masses()
        return float(self.model.still_kg + lengths @ self.lines)

    def line_masses(self) -> Array:
        """Return kg per metre of every stretch."""
        out = []
        for p, own in self.model.geometry.corners.items():
            body = self.model.assembly.parts[p].body
            kg = self.model.assembly.parts[p].mass_properties.mass
            total = float(np.linalg.norm(np.diff(body.points, axis=0), axis=1).sum())  # type: ignore[union-attr]
            out += [kg / total] * (len(own) - 1)
        return np.array(out)

    def _hopeless(self, positions: Array, edges: float) -> Point:
        """Return a point without rigidity: a bar without length, or one more motion."""
        worst = -2.0 * self.rigid_weight if self.rigid_weight < 0 else 2.0
        flat = np.zeros_like(positions)
        return Point(worst + 1.0, flat, 0.0, np.zeros(1), edges, self.mass(positions))
