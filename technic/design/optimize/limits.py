"""What the moved geometry must obey: lengths of bars, distances of joints, mass."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from technic.design.optimize.freedom import Freedom
from technic.design.optimize.gradient import length_gradient
from technic.design.optimize.moving import Model
from technic.errors import UsageError
from technic.geometry import Array
from technic.parts.definition import FrameBody, TrussBody

__all__ = ["Limits", "limits_of"]


@dataclass(frozen=True, slots=True, eq=False)
class Limits:
    """Constraints as functions that are not negative where they hold, in units of one length.

    Parameters
    ----------
    stretches : (e, 2) ndarray of int
    shortest, longest : (e,) ndarray
        Of each stretch (m).
    pairs : (p, 2) ndarray of int
        Vertices that keep their distance.
    clearance : float
        m.
    line_masses : (e,) ndarray
        kg/m of each stretch.
    heaviest : float
        kg, of the bars; infinite for no limit.
    unit : float
        m.
    """

    stretches: NDArray[np.int64]
    shortest: Array
    longest: Array
    pairs: NDArray[np.int64]
    clearance: float
    line_masses: Array
    heaviest: float
    unit: float

    def at(self, positions: Array, near: float = np.inf) -> tuple[Array, Array]:
        """Return values (c,) and derivatives (c, v, 3).

        Pairs further apart than clearance + `near` are left out.
        """
        lengths, units = length_gradient(positions, self.stretches)
        slope = _by_ends(self.stretches, units, len(positions))
        capped = np.isfinite(self.longest)
        values = [
            (lengths - self.shortest) / self.unit,
            (self.longest - lengths)[capped] / self.unit,
        ]
        slopes = [slope / self.unit, -slope[capped] / self.unit]
        if len(self.pairs):
            gaps, ways = length_gradient(positions, self.pairs)
            close = gaps < self.clearance + near
            values.append((gaps[close] - self.clearance) / self.unit)
            slopes.append(_by_ends(self.pairs[close], ways[close], len(positions)) / self.unit)
        if np.isfinite(self.heaviest):
            mass = float(lengths @ self.line_masses)
            values.append(np.array([1.0 - mass / self.heaviest]))
            by = np.tensordot(self.line_masses, slope, axes=1)
            slopes.append(-by[None] / self.heaviest)
        return np.concatenate(values), np.concatenate(slopes)

    def broken(self, positions: Array) -> float:
        """Return by how much the worst limit is broken, in units of length; 0 when all hold."""
        values, _ = self.at(positions)
        return float(max(0.0, -values.min(initial=0.0)))


def _by_ends(pairs: NDArray[np.int64], units: Array, count: int) -> Array:
    out = np.zeros((len(pairs), count, 3))
    row = np.arange(len(pairs))
    out[row, pairs[:, 1]] += units
    out[row, pairs[:, 0]] -= units
    return out


def limits_of(
    model: Model,
    freedom: Freedom,
    line_masses: Array,
    *,
    lengths: tuple[float, float],
    clearance: float | None,
    max_mass: float | None,
) -> Limits:
    """Return the limits.

    Parameters
    ----------
    model : Model
    freedom : Freedom
    line_masses : (e,) ndarray
    lengths : (float, float)
        Shortest and longest a bar may become, as shares of its length at the start. Pieces of a straight
        bar between others joined along it are held by the clearance only.
    clearance : float or None
        Least distance of two joints (m); the widest bar's width if None. Joints that are closer at the
        start may stay as close as they are.
    max_mass : float or None
        kg, of the whole assembly.

    Raises
    ------
    UsageError
        The limits leave no room.
    """
    geometry = model.geometry
    if not 0.0 < lengths[0] <= 1.0 <= lengths[1]:
        raise UsageError(
            "bounds of lengths are shares of the length at the start, such as 0.5 and 2"
        )
    start = freedom.start
    stretches = geometry.stretches
    long, _ = length_gradient(start, stretches)
    inner = np.array([a in geometry.slides or b in geometry.slides for a, b in stretches], bool)
    widths = []
    for p in geometry.corners:
        body = model.assembly.parts[p].body
        if isinstance(body, FrameBody):
            widths.append(np.sqrt(max(s.area for s in body.sections)))
        elif isinstance(body, TrussBody):
            widths.append(np.sqrt(body.area))
    count = len(start)
    moving = np.abs(freedom.basis.reshape(count, 3, -1)).max(axis=(1, 2)) > 0.0
    a, b = np.triu_indices(count, 1)
    used = moving[a] | moving[b]
    pairs = np.column_stack([a[used], b[used]])
    gaps, _ = length_gradient(start, pairs)
    least = float(gaps.min(initial=np.inf))
    wanted = float(max(widths, default=0.0)) if clearance is None else clearance
    if clearance is not None and clearance > least * (1.0 + 1e-9):
        raise UsageError(
            f"two joints are {1e3 * least:.3g} mm apart at the start, closer than the clearance"
        )
    room = min(wanted, least)
    shortest = np.where(inner, min(room, float(long.min())), lengths[0] * long)
    heaviest = np.inf
    if max_mass is not None:
        heaviest = max_mass - model.still_kg
        if heaviest < float(long @ line_masses) * (1.0 - 1e-9):
            raise UsageError("the assembly is heavier at the start than the greatest mass allowed")
    return Limits(
        stretches=stretches,
        shortest=shortest,
        longest=np.where(inner, np.inf, lengths[1] * long),
        pairs=pairs,
        clearance=room,
        line_masses=line_masses,
        heaviest=heaviest,
        unit=float(long.mean()),
    )
