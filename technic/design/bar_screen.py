"""A fast forecast of what a new bar does: Rayleigh-Ritz, the bar as a spring with a mass.

The bar stretches and its two pins give way; all three are springs in a row. It moves with what it is
pinned to. Its own bending is left to the exact analysis.
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import Final

import numpy as np
from scipy import linalg, sparse

from technic.assembly.model import Assembly
from technic.assembly.typed_joints import DEFAULT_STIFFNESS
from technic.design.bars import Bar, Pattern
from technic.design.free_motions import all_motions
from technic.design.screen import Forecast
from technic.geometry import Array
from technic.rigidity.eigen import elastic_modes
from technic.rigidity.kinematics import kinematics
from technic.system.assemble import Probe, assemble
from technic.system.inverse import orthonormal, single_thread

__all__ = ["BarScreen"]

MODES: Final = 20
"""Elastic modes of the combination."""

BLOCK: Final = 2000
"""Bars whose eigenvalues are found at once."""

_RESISTED: Final = 1e-6
"""A motion is stopped when the bar stretches by more than this share of the greatest movement in it."""

Spot = tuple[int, tuple[float, float, float]]
"""A part and a place on it (m)."""


class BarScreen:
    """The lowest movements of a linkage at the places where bars may end.

    Parameters
    ----------
    assembly : Assembly
    pattern : Pattern
        What new bars are made of.
    spots : sequence of Spot
        Every end that will be asked about.
    """

    def __init__(self, assembly: Assembly, pattern: Pattern, spots: Sequence[Spot]) -> None:
        self._pattern = pattern
        self._place = {spot: k for k, spot in enumerate(dict.fromkeys(spots))}
        probes = tuple(Probe(part, np.array(point)) for part, point in self._place)
        system = assemble(assembly, probes=probes)
        self._mass = system.mass
        kin = kinematics(assembly)
        scale = sparse.diags_array(np.tile(kin.units, len(assembly.parts)))
        moving = sparse.csc_array(system.R @ (scale @ all_motions(kin)))
        moving = sparse.csc_array(moving[:, np.diff(moving.indptr) > 0])
        constraints = sparse.csr_array(system.A[~system.elastic])
        with single_thread():
            pairs = elastic_modes(
                sparse.csr_array(system.K + system.J), system.M, constraints, moving, MODES
            )
            free = orthonormal(system.M, moving.toarray())
        basis = np.column_stack([free, pairs.vectors])
        self._motions = free.shape[1]
        self._values = np.concatenate([np.zeros(self._motions), pairs.values])
        grounded = any(len(owner) == 1 for owner in kin.owners)
        whole = 3 if assembly.dimension == 2 else 6
        self._whole = 0 if grounded or len(kin.components) > 1 else whole
        twists = np.asarray(system.probes @ basis).reshape(len(probes), 6, -1)
        self._moves = twists[:, :3]

    def forecasts(self, bars: Sequence[Bar]) -> list[Forecast]:
        """Return what each bar would do."""
        out: list[Forecast] = []
        with single_thread():
            for first in range(0, len(bars), BLOCK):
                out += self._block(bars[first : first + BLOCK])
        return out

    def _ends(self, bars: Sequence[Bar]) -> tuple[Array, Array]:
        rows = [
            [self._place[end.parts[0], end.point] for end in (bar.first, bar.second)]
            for bar in bars
        ]
        ends = self._moves[np.array(rows)]
        return ends[:, 0], ends[:, 1]

    def _stretch(self, bars: Sequence[Bar]) -> Array:
        """Return by how much each bar stretches in each movement, (bars, movements)."""
        first, second = self._ends(bars)
        along = np.array([bar.span / bar.length for bar in bars])
        return np.asarray(np.einsum("bi,bim->bm", along, second - first))

    def _block(self, bars: Sequence[Bar]) -> list[Forecast]:
        pattern = self._pattern
        first, second = self._ends(bars)
        stretch = self._stretch(bars)
        lengths = np.array([bar.length for bar in bars])
        pins = np.array([[len(bar.first.parts), len(bar.second.parts)] for bar in bars])
        soft = lengths / (pattern.material.young_pa * pattern.area)
        soft = soft + (1.0 / (DEFAULT_STIFFNESS * pins)).sum(axis=1)
        stiffness = np.einsum("bm,bn->bmn", stretch, stretch) / soft[:, None, None]
        index = np.arange(stiffness.shape[1])
        stiffness[:, index, index] += self._values
        weights = pattern.material.density * pattern.area * lengths
        share = weights / self._mass / 6.0
        together = first + second
        inertia = np.einsum("bim,bin->bmn", first, first)
        inertia += np.einsum("bim,bin->bmn", second, second)
        inertia += np.einsum("bim,bin->bmn", together, together)
        inertia *= share[:, None, None]
        inertia[:, index, index] += 1.0
        lower = np.linalg.cholesky(inertia)
        half = np.linalg.solve(lower, stiffness)
        values = np.linalg.eigvalsh(np.linalg.solve(lower, half.transpose(0, 2, 1)))
        greatest = np.abs(self._moves[:, :, : self._motions]).max(initial=1e-300)
        resisted = np.abs(stretch[:, : self._motions]).max(axis=1, initial=0.0)
        removed = (resisted > _RESISTED * greatest).astype(int)
        if self._motions <= self._whole:
            removed[:] = 0
        lowest = self._motions - removed
        out = []
        for k, at in enumerate(lowest):
            value = values[k, at] if at < values.shape[1] else np.inf
            out.append(Forecast(int(removed[k]), float(value) * (1.0 + weights[k] / self._mass)))
        return out

    def projections(self, bars: Sequence[Bar]) -> list[float]:
        """Return the paper's heuristic: how fast the ends of each bar approach each other in the model's
        internal motions, or in its worst mode when it has none.
        """
        stretch = self._stretch(bars)
        if self._motions > self._whole:
            return [float(v) for v in linalg.norm(stretch[:, : self._motions], axis=1)]
        return [float(v) for v in np.abs(stretch[:, self._motions])]
