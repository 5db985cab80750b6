"""The ports of all placed parts in world coordinates, as arrays, and which of them lie on one line.

Everything the connection search does to thousands of ports it does here, on whole arrays; the
modules that use it (`matching`, `stops`, `findings`) then loop over the few pairs that are left.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from itertools import product
from typing import Any, Final

import numpy as np
from numpy.typing import NDArray

from technic.assembly.model import Part
from technic.errors import InputError
from technic.geometry import Array
from technic.parts.definition import Port, PortKind
from technic.units import PITCH

__all__ = ["Indices", "Overlap", "PlacedPorts", "collect", "near_pairs", "on_line", "overlap"]

Indices = NDArray[np.intp]

_SAMPLE: Final = PITCH
"""Spacing of the points by which a port is found in the index."""

_MOST_PAIRS: Final = 20_000_000
"""Most pairs of points in neighbouring cubes; 2,526 parts of a real model have 40 thousand. Far above
it (thousands of copies in one place) the memory would not do."""


@dataclass(frozen=True, slots=True, eq=False)
class PlacedPorts:
    """All ports of an assembly in world coordinates; ``n`` of them, in the order of the parts.

    Parameters
    ----------
    parts : sequence of Part
    start : (number of parts + 1,) ndarray of int
        Ports of part k are ``start[k]`` up to ``start[k + 1]``.
    part : (n,) ndarray of int
        Which part each port belongs to.
    kind : (n,) ndarray of str
    position : (n, 3) ndarray
        Middle of the port (m).
    axis : (n, 3) ndarray
        Unit vectors.
    half : (n,) ndarray
        Half its length (m).
    """

    parts: Sequence[Part]
    start: Indices
    part: Indices
    kind: NDArray[Any]
    position: Array
    axis: Array
    half: Array

    def port(self, index: int) -> Port:
        """Return a port as the part has it."""
        part = int(self.part[index])
        return self.parts[part].ports[index - int(self.start[part])]

    def name(self, index: int) -> str:
        """Return the name of a port."""
        return self.port(index).name

    def of_part(self, part: int) -> range:
        """Return the ports of a part."""
        return range(int(self.start[part]), int(self.start[part + 1]))

    def of_kind(self, *kinds: PortKind) -> Indices:
        """Return the ports of some kinds, ascending."""
        return np.flatnonzero(np.isin(self.kind, [str(kind) for kind in kinds]))


@dataclass(frozen=True, slots=True, eq=False)
class Overlap:
    """How pairs of ports lie to each other; coordinates along the second one's axis, from its middle.

    Parameters
    ----------
    low, high : (m,) ndarray
        The stretch they share (m); empty when ``low > high``.
    offset : (m,) ndarray
        Distance of their lines in the middle of that stretch (m).
    angle : (m,) ndarray
        Angle between their lines (rad), 0 to pi/2.
    """

    low: Array
    high: Array
    offset: Array
    angle: Array

    @property
    def length(self) -> Array:
        """Length of the stretch they share (m); negative: the gap between them."""
        return self.high - self.low


def collect(parts: Sequence[Part]) -> PlacedPorts:
    """Return the ports of all parts in world coordinates."""
    cache: dict[int, tuple[NDArray[Any], Array, Array, Array]] = {}
    kinds, positions, axes, halves = [], [], [], []
    counts = np.zeros(len(parts), dtype=np.intp)
    for k, part in enumerate(parts):
        counts[k] = len(part.ports)
        if not part.ports:
            continue
        key = id(part.ports)
        if key not in cache:
            cache[key] = (
                np.array([str(port.kind) for port in part.ports]),
                np.array([port.position for port in part.ports]),
                np.array([port.axis for port in part.ports]),
                np.array([port.length / 2.0 for port in part.ports]),
            )
        kind, position, axis, half = cache[key]
        kinds.append(kind)
        positions.append(part.pose.points(position))
        axes.append(part.pose.directions(axis))
        halves.append(half)
    start = np.concatenate([[0], np.cumsum(counts)]).astype(np.intp)
    return PlacedPorts(
        parts,
        start,
        np.repeat(np.arange(len(parts), dtype=np.intp), counts),
        np.concatenate([np.empty(0, dtype="U9"), *kinds]),
        np.concatenate([np.empty((0, 3)), *positions]),
        np.concatenate([np.empty((0, 3)), *axes]),
        np.concatenate([np.empty(0), *halves]),
    )


def near_pairs(placed: PlacedPorts, first: Indices, second: Indices, reach: float) -> Indices:
    """Return the pairs of ports of different parts that come within `reach` (m) of each other.

    A few more pairs may be returned, never fewer.

    Returns
    -------
    (m, 2) ndarray of int
        Each pair once, in ascending order.
    """
    if not len(first) or not len(second):
        return np.empty((0, 2), dtype=np.intp)
    points_a, owner_a = _samples(placed, first)
    points_b, owner_b = _samples(placed, second)
    # Every point of a port is within _SAMPLE / 2 of a sample, so two ports within reach have samples
    # within reach + _SAMPLE.
    near_a, near_b = _close(points_a, points_b, reach + _SAMPLE)
    i, j = owner_a[near_a], owner_b[near_b]
    total = len(placed.part)
    codes = np.unique((i * total + j)[placed.part[i] != placed.part[j]])
    return np.column_stack([codes // total, codes % total])


def _samples(placed: PlacedPorts, chosen: Indices) -> tuple[Array, Indices]:
    half = placed.half[chosen]
    count = np.maximum(1, np.ceil(2.0 * half / _SAMPLE - 1e-9).astype(np.intp))
    owner = np.repeat(chosen, count)
    rank = np.arange(len(owner)) - np.repeat(np.cumsum(count) - count, count)
    along = ((rank + 0.5) / np.repeat(count, count) * 2.0 - 1.0) * np.repeat(half, count)
    return placed.position[owner] + along[:, None] * placed.axis[owner], owner


def _close(first: Array, second: Array, reach: float) -> tuple[Indices, Indices]:
    """Return all pairs of points at most `reach` (m) apart: indices into `first` and `second`.

    A grid of cubes with side `reach` is the index: neighbours lie in the same cube or one of the 26
    around it. (SciPy's tree does the same, but importing it costs more than the search.)
    """
    keys = _cells(second, reach)
    code = _codes(keys)
    order = np.argsort(code, kind="stable")
    code = code[order]
    own = _cells(first, reach)
    pairs_a, pairs_b = [], []
    for step in product((-1, 0, 1), repeat=3):
        wanted = _codes(own + np.array(step))
        start = np.searchsorted(code, wanted, side="left")
        count = np.searchsorted(code, wanted, side="right") - start
        if count.sum() > _MOST_PAIRS:
            raise InputError(
                "too many parts in one place: their connections cannot be told apart",
                remedy="Remove the copies that lie in each other.",
            )
        a = np.repeat(np.arange(len(first)), count)
        rank = np.arange(len(a)) - np.repeat(np.cumsum(count) - count, count)
        b = order[np.repeat(start, count) + rank]
        between = first[a] - second[b]
        close = np.einsum("ij,ij->i", between, between) <= reach * reach
        pairs_a.append(a[close])
        pairs_b.append(b[close])
    return np.concatenate(pairs_a), np.concatenate(pairs_b)


def _cells(points: Array, side: float) -> NDArray[np.int64]:
    return np.floor(points / side).astype(np.int64)


def _codes(cells: NDArray[np.int64]) -> NDArray[np.int64]:
    """Return one number for each cube. Far cubes may share one: distances sort that out, and pairs
    that are found twice are dropped.
    """
    return np.asarray(cells @ np.array([1, 1 << 21, 1 << 42], dtype=np.int64))


def overlap(placed: PlacedPorts, pairs: Indices) -> Overlap:
    """Return how pairs of ports, (m, 2), lie to each other."""
    i, j = pairs[:, 0], pairs[:, 1]
    axis_i, axis_j = placed.axis[i], placed.axis[j]
    cosine = np.einsum("ij,ij->i", axis_i, axis_j)
    sine = np.linalg.norm(np.cross(axis_i, axis_j), axis=1)
    between = placed.position[i] - placed.position[j]
    along = np.einsum("ij,ij->i", between, axis_j)
    reach = placed.half[i] * np.abs(cosine)
    low = np.maximum(-placed.half[j], along - reach)
    high = np.minimum(placed.half[j], along + reach)
    middle = ((low + high) / 2.0)[:, None] * axis_j - between
    offset = np.linalg.norm(
        middle - np.einsum("ij,ij->i", middle, axis_i)[:, None] * axis_i, axis=1
    )
    return Overlap(low, high, offset, np.arctan2(sine, np.abs(cosine)))


def on_line(
    placed: PlacedPorts,
    chosen: Sequence[int],
    point: Array,
    axis: Array,
    offset: float,
    angle: float,
) -> Indices:
    """Return those of the chosen ports that lie on a line within `offset` (m) and `angle` (rad)."""
    index = np.asarray(chosen, dtype=np.intp)
    if not len(index):
        return index
    between = placed.position[index] - point
    across = between - (between @ axis)[:, None] * axis
    sine = np.linalg.norm(np.cross(placed.axis[index], axis), axis=1)
    close = (np.linalg.norm(across, axis=1) <= offset) & (sine <= np.sin(angle))
    return np.asarray(index[close])
