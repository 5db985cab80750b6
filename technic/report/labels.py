"""Where labels go: at their points when there is room, beside them when not, never over each other."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from math import cos, hypot, pi, sin

__all__ = ["place_labels"]

_GAP = 3.0
"""Pixels between two labels."""

_STEP = 11.0
_DIRECTIONS = 16

Box = tuple[float, float, float, float]


def _around(x: float, y: float, reach: float) -> Iterator[tuple[float, float]]:
    """Give points: the point itself, then circles about it, ever wider."""
    yield x, y
    ring = 1
    while ring * _STEP <= reach:
        for k in range(_DIRECTIONS):
            # Upwards first: there are fewer arrows.
            angle = 2.0 * pi * k / _DIRECTIONS - pi / 2.0
            yield x + ring * _STEP * cos(angle), y + ring * _STEP * sin(angle)
        ring += 1


def place_labels(
    points: Sequence[tuple[float, float]], sizes: Sequence[tuple[float, float]], box: Box
) -> list[tuple[float, float] | None]:
    """Return the middle of each label; None for one that finds no room.

    Parameters
    ----------
    points : sequence of (float, float)
        What the labels belong to, in pixels, the most important first.
    sizes : sequence of (float, float)
        Width and height of each label.
    box : (float, float, float, float)
        Left, top, right, bottom: labels stay inside.

    Examples
    --------
    >>> place_labels([(50, 50), (52, 50)], [(20, 20), (20, 20)], (0, 0, 100, 100))[0]
    (50, 50)
    """
    left, top, right, bottom = box
    taken: list[Box] = []
    placed: list[tuple[float, float] | None] = []
    reach = hypot(right - left, bottom - top)
    for (x, y), (width, height) in zip(points, sizes, strict=True):
        found = None
        for u, v in _around(x, y, reach):
            mine = (u - width / 2, v - height / 2, u + width / 2, v + height / 2)
            inside = mine[0] >= left and mine[1] >= top and mine[2] <= right and mine[3] <= bottom
            if inside and not any(_meet(mine, other) for other in taken):
                taken.append(mine)
                found = (u, v)
                break
        placed.append(found)
    return placed


def _meet(one: Box, other: Box) -> bool:
    return (
        one[0] < other[2] + _GAP
        and other[0] < one[2] + _GAP
        and one[1] < other[3] + _GAP
        and other[1] < one[3] + _GAP
    )
