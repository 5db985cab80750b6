"""What the fit needs to know of the mechanics: a callable, and the readings as arrays."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from calibration.dataset import Reading
from calibration.rigs import Condition

__all__ = ["Array", "Design", "Forward", "Offset", "Response", "design", "weighted_matrix"]

Array = NDArray[np.float64]


@dataclass(frozen=True, slots=True, eq=False)
class Response:
    """How rigs answer, one row per condition; what a condition does not ask for is 0.

    Parameters
    ----------
    per_newton : (c,) ndarray
        How far the point goes down per newton hung on it (m/N).
    own_weight : (c,) ndarray
        How far it goes down by the rig's own weight (m).
    d_per_newton, d_own_weight : (c, k) ndarray
        Derivatives with respect to the logarithms of the k stiffnesses.
    frequency : (c,) ndarray
        Natural frequency of the tapped rig (Hz).
    d_frequency : (c, k) ndarray
    """

    per_newton: Array
    own_weight: Array
    d_per_newton: Array
    d_own_weight: Array
    frequency: Array
    d_frequency: Array


Forward = Callable[[Sequence[Condition], Array], Response]
"""The mechanics: from conditions and the logarithms of the stiffnesses to the response."""


@dataclass(frozen=True, slots=True)
class Offset:
    """A constant beside the elastic answer of one rig in one pose.

    Parameters
    ----------
    kind : str
        ``"free_play"``: how far the point goes before the joints bite; ``"hysteresis"``: how much
        lower it stands while unloading than while loading.
    rig, pose : str
    """

    kind: str
    rig: str
    pose: str


@dataclass(frozen=True, slots=True, eq=False)
class Design:
    """Readings as arrays, n rows.

    Parameters
    ----------
    conditions : tuple of Condition
        Different ones only.
    which : (n,) ndarray of int
        Condition of each reading.
    force, own : (n,) ndarray
        Force (N), and 1.0 where the own weight counts; both 0 in tap tests.
    tapped : (n,) ndarray of bool
        Where a frequency was read.
    read, rounding : (n,) ndarray
        Displacement (m) or frequency (Hz), and the standard deviation of it from rounding.
    offsets : tuple of Offset
        Those that the readings can tell.
    columns : (n, q) ndarray
        What a unit of each offset adds.
    """

    conditions: tuple[Condition, ...]
    which: NDArray[np.int64]
    force: Array
    own: Array
    tapped: NDArray[np.bool_]
    read: Array
    rounding: Array
    offsets: tuple[Offset, ...]
    columns: Array

    def predict(self, forward: Forward, log_stiffness: Array) -> tuple[Array, Array]:
        """Return what should be read, (n,), and its derivatives, (n, k), without offsets."""
        answer = forward(self.conditions, log_stiffness)
        value = (
            self.force * answer.per_newton[self.which]
            + self.own * answer.own_weight[self.which]
            + self.tapped * answer.frequency[self.which]
        )
        slope = (
            self.force[:, None] * answer.d_per_newton[self.which]
            + self.own[:, None] * answer.d_own_weight[self.which]
            + self.tapped[:, None] * answer.d_frequency[self.which]
        )
        return value, slope


def design(readings: Sequence[Reading]) -> Design:
    """Return the readings as arrays."""
    conditions = tuple(sorted({r.condition for r in readings}))
    index = {condition: k for k, condition in enumerate(conditions)}
    tapped = np.array([r.tap for r in readings], dtype=bool)
    force = np.where(tapped, 0.0, [r.force for r in readings])
    offsets: list[Offset] = []
    columns: list[Array] = []
    place = np.array([f"{r.condition.rig}\0{r.condition.pose}" for r in readings])
    way = np.array([r.direction for r in readings], dtype=float)
    for rig, pose in sorted({(c.rig, c.pose) for c in conditions if not c.tap}):
        here = ((place == f"{rig}\0{pose}") & ~tapped).astype(float)
        hung = force[(here > 0.0) & (force > 0.0)]
        # a dead zone shows only as a line through different loads that misses zero
        if len(np.unique(hung)) >= 3:
            offsets.append(Offset("free_play", rig, pose))
            columns.append(here * (force > 0.0))
        if {-1.0, 1.0} <= set(way[here > 0.0]):
            offsets.append(Offset("hysteresis", rig, pose))
            columns.append(-0.5 * here * way)
    return Design(
        conditions=conditions,
        which=np.array([index[r.condition] for r in readings], dtype=np.int64),
        force=force,
        own=np.array([float(r.own_weight) for r in readings]),
        tapped=tapped,
        read=np.array([r.value for r in readings]),
        rounding=np.array([r.rounding for r in readings]),
        offsets=tuple(offsets),
        columns=np.column_stack(columns) if columns else np.zeros((len(readings), 0)),
    )


def weighted_matrix(slope: Array, columns: Array, sigma: Array) -> Array:
    """Return the Jacobian of the weighted residuals: stiffnesses first, then offsets."""
    return np.asarray(np.column_stack([slope, columns]) / sigma[:, None])
