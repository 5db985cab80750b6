"""Arrows and turning arrows as triangles."""

from __future__ import annotations

import numpy as np

from technic.geometry import Array, axes_from
from technic.report.scene import RGB, Surface, merge

__all__ = ["arc_arrow", "arrow", "tube"]

_SIDES = 14
_HEAD_WIDTH = 2.6
"""Radius of an arrow's head over that of its shaft."""

_HEAD_LENGTH = 5.5
"""Length of the head over the shaft's radius."""


def _sweep(path: Array, radii: Array, color: RGB) -> Surface:
    """Return the surface of circles of given radii around a polyline, closed at both ends."""
    tangents = np.gradient(path, axis=0) if len(path) > 2 else np.tile(path[-1] - path[0], (2, 1))
    # Where two circles sit at one point (the foot of a head) the neighbours give the direction.
    lengths = np.linalg.norm(tangents, axis=1)
    tangents[lengths == 0.0] = path[-1] - path[0]
    tangents /= np.linalg.norm(tangents, axis=1)[:, None]
    side = axes_from(tangents[0])[1]
    angle = np.linspace(0.0, 2.0 * np.pi, _SIDES, endpoint=False)
    rings = []
    for point, tangent, radius in zip(path, tangents, radii, strict=True):
        side = side - (side @ tangent) * tangent
        side /= np.linalg.norm(side)
        other = np.cross(tangent, side)
        rings.append(
            point + radius * (np.cos(angle)[:, None] * side + np.sin(angle)[:, None] * other)
        )
    points = np.concatenate([*rings, path[:1], path[-1:]])
    here = np.arange(_SIDES)
    after = (here + 1) % _SIDES
    faces = []
    for k in range(len(path) - 1):
        a, b = k * _SIDES, (k + 1) * _SIDES
        faces.append(np.column_stack([a + here, a + after, b + after]))
        faces.append(np.column_stack([a + here, b + after, b + here]))
    first, last, end = len(points) - 2, len(points) - 1, (len(path) - 1) * _SIDES
    faces.append(np.column_stack([np.full(_SIDES, first), after, here]))
    faces.append(np.column_stack([np.full(_SIDES, last), end + here, end + after]))
    return Surface(points, np.concatenate(faces), np.tile(color, (len(points), 1)))


def tube(start: Array, end: Array, radius: float, color: RGB, rings: int = 2) -> Surface:
    """Return a round bar from `start` to `end`; with more than two rings it can be bent."""
    path = np.linspace(np.asarray(start, dtype=float), np.asarray(end, dtype=float), rings)
    return _sweep(path, np.full(rings, radius), color)


def arrow(start: Array, vector: Array, radius: float, color: RGB) -> Surface:
    """Return an arrow; a short one shrinks as a whole, so that it stays an arrow."""
    start, vector = np.asarray(start, dtype=float), np.asarray(vector, dtype=float)
    length = float(np.linalg.norm(vector))
    unit = vector / length
    radius = min(radius, length / (1.6 * _HEAD_LENGTH))
    neck = start + (length - _HEAD_LENGTH * radius) * unit
    head = _sweep(
        np.array([neck, start + vector]), np.array([_HEAD_WIDTH * radius, 1e-3 * radius]), color
    )
    return merge([tube(start, neck, radius, color), head])


def arc_arrow(
    center: Array, axis: Array, start: Array, angle: float, radius: float, color: RGB
) -> Surface:
    """Return an arrow along an arc.

    Parameters
    ----------
    center, axis : (3,) array_like
        The arc turns about `axis` (right-hand rule) through `center`.
    start : (3,) array_like
        Where it begins; its distance to the axis is the arc's radius.
    angle : float
        How far it goes (rad).
    radius : float
        Of the shaft (m).
    color : RGB
    """
    axis = np.asarray(axis, dtype=float) / np.linalg.norm(axis)
    arm = np.asarray(start, dtype=float) - center
    along = (arm @ axis) * axis
    arm = arm - along
    other = np.cross(axis, arm)
    size = float(np.linalg.norm(arm))
    head_angle = min(_HEAD_LENGTH * radius / size, 0.6 * abs(angle)) * np.sign(angle)
    base = np.asarray(center, dtype=float) + along

    def at(turn: Array) -> Array:
        return base + np.cos(turn)[:, None] * arm + np.sin(turn)[:, None] * other

    shaft = at(np.linspace(0.0, angle - head_angle, 24))
    tip = at(np.array([angle - head_angle, angle]))
    return merge(
        [
            _sweep(shaft, np.full(24, radius), color),
            _sweep(tip, np.array([_HEAD_WIDTH * radius, 1e-3 * radius]), color),
        ]
    )
