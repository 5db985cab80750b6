"""How a beam can lie in a layer: by any two of its holes on any two sites, each place once.

Works on arrays: places in the plane of the layer (m), a beam's own plane having z along and x across.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from technic.geometry import Array
from technic.units import LDU

__all__ = ["Placed", "across_arms", "along_line", "place"]

_QUARTER = LDU / 4
"""Beams whose middles differ by less than this lie in the same place."""


@dataclass(frozen=True, slots=True, eq=False)
class Placed:
    """Places of one beam.

    Parameters
    ----------
    turns : (n, 2) ndarray
        Cosine and sine of the angle by which each is turned in the plane.
    origins : (n, 2) ndarray
        Where the beam's own origin lies (m).
    turned_over : (n,) ndarray of bool
    holes : (n, h, 2) ndarray
        Where its holes lie (m).
    """

    turns: Array
    origins: Array
    turned_over: NDArray[np.bool_]
    holes: Array


def along_line(count: int, shorter: int) -> list[tuple[int, int]]:
    """Return the pairs of holes by which a straight beam with `count` holes is laid.

    Only pairs that a beam with `shorter` holes does not reach: the shortest beam that reaches is
    offered, in every position along the line that covers both.
    """
    return [(i, i + k) for k in range(max(1, shorter), count) for i in range(count - k)]


def across_arms(plane: Array) -> list[tuple[int, int]]:
    """Return the pairs of holes of a bent beam that do not lie on one arm."""
    step = np.diff(plane, axis=0)
    step = step / np.linalg.norm(step, axis=1, keepdims=True)
    turn = np.abs(step[1:, 0] * step[:-1, 1] - step[1:, 1] * step[:-1, 0]) > 0.1
    arm = np.concatenate([[0, 0], np.cumsum(turn)])
    corners = {int(k) + 1 for k in np.flatnonzero(turn)}
    ends = [k for k in range(len(plane)) if k not in corners]
    return [(i, j) for i in ends for j in ends if i < j and arm[i] != arm[j]]


def place(
    plane: Array,
    wanted: Sequence[tuple[int, int]],
    sites: Array,
    pairs: NDArray[np.intp],
    tolerance: float,
    *,
    straight: bool,
) -> Placed:
    """Return the places where two holes of a beam meet two sites.

    Parameters
    ----------
    plane : (h, 2) ndarray
        The beam's holes in its own plane (m).
    wanted : sequence of (int, int)
        Pairs of holes to lay it by.
    sites : (s, 2) ndarray
        (m)
    pairs : (m, 2) ndarray of int
        Pairs of sites.
    tolerance : float
        Largest distance of a hole from its site (m).
    straight : bool
        A straight beam is the same when turned over or round.
    """
    start, end = sites[pairs[:, 0]], sites[pairs[:, 1]]
    distance = np.linalg.norm(end - start, axis=1)
    turns, origins, over = [], [], []
    for turned in (False,) if straight else (False, True):
        flat = plane * np.array([1.0, -1.0]) if turned else plane
        for i, j in wanted:
            span = flat[j] - flat[i]
            length = float(np.linalg.norm(span))
            fits = np.flatnonzero(np.abs(distance - length) < 2.0 * tolerance)
            if not len(fits):
                continue
            middle = (start[fits] + end[fits]) / 2.0
            step = (end[fits] - start[fits]) / distance[fits, None]
            for sign in (1.0, -1.0):
                # half of the mismatch at either end
                turn = _turn(span / length, sign * step)
                turns.append(turn)
                origins.append(middle - _apply(turn, (flat[i] + flat[j])[None] / 2.0)[:, 0])
                over.append(np.full(len(fits), turned))
    if not turns:
        nothing = np.zeros((0, 2))
        return Placed(nothing, nothing, np.zeros(0, dtype=bool), np.zeros((0, len(plane), 2)))
    turn, origin, flip = np.concatenate(turns), np.concatenate(origins), np.concatenate(over)
    first = _distinct(turn, origin, flip, straight=straight)
    turn, origin, flip = turn[first], origin[first], flip[first]
    holes = np.where(flip[:, None, None], plane * np.array([1.0, -1.0]), plane)
    return Placed(turn, origin, flip, _apply(turn, holes) + origin[:, None])


def _turn(a: Array, b: Array) -> Array:
    """Return (cos, sin) of the rotations that take direction a to each direction b, (n, 2)."""
    return np.column_stack([b @ a, a[0] * b[:, 1] - a[1] * b[:, 0]])


def _apply(turns: Array, points: Array) -> Array:
    """Return points, (n or 1, h, 2), turned by each rotation, (n, h, 2)."""
    c, s = turns[:, 0, None], turns[:, 1, None]
    x, y = points[..., 0], points[..., 1]
    return np.stack([c * x - s * y, s * x + c * y], axis=-1)


def _distinct(
    turn: Array, origin: Array, flip: NDArray[np.bool_], *, straight: bool
) -> NDArray[np.intp]:
    """Return the first of each group of equal places, in order."""
    angle = np.round(turn * 1e4).astype(np.int64)
    if straight:
        back = (angle[:, 0] < 0) | ((angle[:, 0] == 0) & (angle[:, 1] < 0))
        angle[back] *= -1
    where = np.round(origin / _QUARTER).astype(np.int64)
    keys = np.column_stack([angle, where, flip.astype(np.int64)])
    _, first = np.unique(keys, axis=0, return_index=True)
    return np.sort(first)
