"""What every renderer shares: light, glass-like edges of a see-through picture, shades of depth."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from technic.geometry import Array
from technic.report.scene import RGB, Panel

__all__ = [
    "FAR_SHADE",
    "LIGHTS",
    "NEAR_SHADE",
    "Pixels",
    "depth_shades",
    "depth_span",
    "far_first",
    "half_height",
    "nearest",
    "see_through",
    "with_mask",
]

Pixels = NDArray[np.uint8]

LIGHTS: tuple[tuple[tuple[float, float, float], float], ...] = (
    ((0.0, 0.0, 1.0), 0.6),
    ((-0.8, 1.2, 0.4), 0.6),
)
"""Where light comes from (right, up, toward the eye) and how much: from the eye, and from above on the
left; white, so that colours stay what they are."""

NEAR_SHADE: RGB = (0.07, 0.09, 0.13)
FAR_SHADE: RGB = (0.86, 0.90, 0.93)
"""Dark in front, light behind: on white paper the outline of what is near is the clearest."""


def half_height(panel: Panel, size: tuple[int, int]) -> float:
    """Return half the height (m) that a picture of (width, height) pixels shows of a panel."""
    view = panel.camera
    return max(view.half_height, view.half_width * size[1] / size[0])


def far_first(panel: Panel) -> Panel:
    """Return a panel whose glass-like surfaces have their triangles from far to near.

    Blended in this order they look right, on every machine; peeling layers off by depth is a matter of
    drivers (with the off-screen Mesa we tried, nothing was drawn).
    """
    surfaces = []
    for surface in panel.surfaces:
        if surface.opacity < 1.0:
            depth = (surface.points @ panel.camera.toward)[surface.faces].sum(axis=1)
            surface = replace(surface, faces=surface.faces[np.argsort(depth, kind="stable")])
        surfaces.append(surface)
    return replace(panel, surfaces=tuple(surfaces))


def see_through(on_white: Pixels, on_black: Pixels) -> Pixels:
    """Return a picture (height, width, 4) from the same one drawn on white and on black.

    What the background shines through is what differs; that holds for smoothed edges and for
    glass-like parts, whatever the renderer does with its own alpha.
    """
    white, black = on_white.astype(float), on_black.astype(float)
    alpha = np.clip(1.0 - (white - black).max(axis=2) / 255.0, 0.0, 1.0)
    color = np.where(alpha[..., None] > 0.0, black / np.maximum(alpha, 1e-3)[..., None], 255.0)
    pixels = np.dstack([np.clip(color, 0.0, 255.0), 255.0 * alpha])
    return np.asarray(np.round(pixels), dtype=np.uint8)


def with_mask(pixels: Pixels, drawn: NDArray[np.bool_]) -> Pixels:
    """Return a picture (height, width, 4) that is there where something is drawn."""
    return np.dstack([pixels, np.where(drawn, 255, 0).astype(np.uint8)])


def _ahead(panel: Panel) -> Array:
    """Return how far each point of the model lies toward the eye (m)."""
    points = [surface.points for surface in panel.surfaces if not surface.on_top]
    return np.asarray(np.concatenate(points) @ panel.camera.toward)


def depth_span(panels: Sequence[Panel]) -> float:
    """Return from how far to how near the points of a panel lie (m), the largest of all panels."""
    return max(float(np.ptp(_ahead(panel))) for panel in panels)


def depth_shades(behind: Array, span: float) -> Pixels:
    """Return the shades, (height, width, 3), of distances behind the nearest point.

    Parameters
    ----------
    behind : (height, width) ndarray
        In m; not a number where there is nothing: white.
    span : float
        The distance that has the lightest shade (m).
    """
    share = np.clip(behind / max(span, 1e-12), 0.0, 1.0)[..., None]
    shades = np.array(NEAR_SHADE) + share * (np.array(FAR_SHADE) - np.array(NEAR_SHADE))
    shades[np.isnan(behind)] = 1.0
    return np.asarray(np.round(255.0 * shades), dtype=np.uint8)


def nearest(panel: Panel) -> float:
    """Return the coordinate toward the eye (m) of the point of the model nearest to it."""
    return float(_ahead(panel).max())
