"""Colours of strain energy, the same in the page, in pictures and in the heat-map file."""

from __future__ import annotations

import numpy as np

from technic.report.scene import RGB

__all__ = ["RAMP", "heat_color"]

RAMP: tuple[RGB, ...] = (
    (0.87, 0.89, 0.91),
    (0.99, 0.83, 0.40),
    (0.95, 0.47, 0.16),
    (0.72, 0.07, 0.16),
    (0.30, 0.00, 0.25),
)
"""From none to the most: grey, yellow, orange, red, violet; ever darker, so that it reads in grey too."""


def heat_color(share: float) -> RGB:
    """Return the colour of a share from 0 (none) to 1 (the most), linear between the stops.

    >>> heat_color(0.0), heat_color(0.25)
    ((0.87, 0.89, 0.91), (0.99, 0.83, 0.4))
    """
    stops = np.linspace(0.0, 1.0, len(RAMP))
    ramp = np.array(RAMP)
    red, green, blue = (float(np.interp(share, stops, ramp[:, c])) for c in range(3))
    return red, green, blue
