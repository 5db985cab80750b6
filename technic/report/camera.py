"""Where to look at a model from."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from technic.geometry import Array
from technic.report.scene import Camera

__all__ = ["fit", "view_direction"]

_MARGIN = 1.06

_ELEVATION = 30.0
_FLAT_ELEVATION = 55.0
"""Degrees above the horizon: a model that lies flat is seen from higher up."""

_AZIMUTH = 35.0
"""Degrees from the front towards the right side: not 45, where equal sides of a frame coincide."""


def view_direction(points: Array) -> Array:
    """Return the unit vector from a model, (n, 3) points, towards the eye: in front, right, above."""
    size = np.ptp(points, axis=0)
    flat = size[1] < 0.3 * min(size[0], size[2])
    elevation = np.radians(_FLAT_ELEVATION if flat else _ELEVATION)
    azimuth = np.radians(_AZIMUTH)
    # LDraw: x right, y down, z away from the one who looks.
    return np.array(
        [
            np.sin(azimuth) * np.cos(elevation),
            -np.sin(elevation),
            -np.cos(azimuth) * np.cos(elevation),
        ]
    )


def fit(points: Array, toward: Array) -> Camera:
    """Return the camera, looking from the direction `toward`, that just sees all points (n, 3)."""
    camera = Camera(toward, np.array([0.0, -1.0, 0.0]), points[0], 1.0, 1.0)
    axes = camera.axes()
    seen = points @ axes.T
    low, high = seen.min(axis=0), seen.max(axis=0)
    half = np.maximum(0.5 * _MARGIN * (high - low), 1e-4)
    return replace(
        camera,
        center=0.5 * (low + high) @ axes,
        half_width=float(half[0]),
        half_height=float(half[1]),
    )
