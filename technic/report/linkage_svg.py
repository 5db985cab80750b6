"""A linkage before and after, drawn with plain lines: same scale, same frame, the vertices' path between."""

from __future__ import annotations

from dataclasses import dataclass
from xml.sax.saxutils import escape

import numpy as np

from technic.design.optimize.solve import Optimization
from technic.geometry import Array
from technic.report.wording import number

__all__ = ["AFTER", "BEFORE", "INK", "PATH", "Sheet", "comparison_svg", "sheet_of"]

WIDTH = 900.0
"""Of the picture, or its height where the linkage is tall (px)."""

NARROWEST = 560.0
"""Width that the words below need (px)."""

MARGIN = 40.0

BEFORE, AFTER, PATH, INK = "#9aa5b1", "#0b6e99", "#c2571a", "#1f2933"


@dataclass(frozen=True, slots=True, eq=False)
class Sheet:
    """The vertices' path on a sheet: one scale and one frame for all steps.

    Parameters
    ----------
    places : (s, v, 2) ndarray
        Pixels, the second coordinate downward; one row per step of the history.
    width, height : float
        px.
    thick : float
        Width of a bar's line (px).
    """

    places: Array
    width: float
    height: float
    thick: float


def sheet_of(found: Optimization) -> Sheet:
    """Return the path of the vertices on a sheet."""
    steps = np.array([step.positions for step in found.history])
    flat = steps @ _eye(found.geometry.positions, found.before.dimension).T
    low, high = flat.reshape(-1, 2).min(axis=0), flat.reshape(-1, 2).max(axis=0)
    scale = (WIDTH - 2 * MARGIN) / max(float((high - low).max()), 1e-12)
    across, height = scale * (high - low)
    width = max(NARROWEST, across + 2 * MARGIN)
    height += 2 * MARGIN + 30.0
    x = (width - across) / 2.0 + scale * (flat[..., 0] - low[0])
    y = MARGIN + scale * (high[1] - flat[..., 1])
    return Sheet(
        np.stack([x, y], axis=-1), float(width), float(height), max(2.0, 0.6 * scale * 0.003)
    )


def comparison_svg(found: Optimization) -> str:
    """Return an SVG picture.

    Linkages in space are seen along the direction in which they are thinnest.
    """
    sheet = sheet_of(found)
    places, width, height, thick = sheet.places, sheet.width, sheet.height, sheet.thick
    out = [
        (
            f'<svg xmlns="http://www.w3.org/2000/svg" width="{width:.0f}" height="{height:.0f}" '
            f'viewBox="0 0 {width:.0f} {height:.0f}" font-family="sans-serif" font-size="14">'
        ),
        f"<title>{escape(found.before.name)}: before and after</title>",
        f'<rect width="{width:.0f}" height="{height:.0f}" fill="white"/>',
    ]
    for which, color, dash in (
        (0, BEFORE, ' stroke-dasharray="12 8" stroke-opacity="0.8"'),
        (-1, AFTER, ""),
    ):
        for own in found.geometry.corners.values():
            line = " ".join(f"{x:.2f},{y:.2f}" for x, y in places[which][list(own)])
            out.append(
                f'<polyline points="{line}" fill="none" stroke="{color}" '
                f'stroke-width="{thick:.1f}" stroke-linejoin="round"{dash}/>'
            )
    used = sorted({v for own in found.geometry.corners.values() for v in own})
    for v in used:
        line = " ".join(f"{x:.2f},{y:.2f}" for x, y in places[:, v])
        out.append(
            f'<polyline points="{line}" fill="none" stroke="{PATH}" stroke-width="1.2" opacity="0.8"/>'
        )
        x, y = places[-1, v]
        fill = INK if v in found.geometry.pinned else "white"
        out.append(f'<circle cx="{x:.2f}" cy="{y:.2f}" r="4" fill="{fill}" stroke="{INK}"/>')
        name = escape(found.geometry.names[v])
        out.append(
            f'<text x="{x + 6:.1f}" y="{y - 6:.1f}" fill="{INK}" font-size="11">{name}</text>'
        )
    said = (
        f"dashed: before, {number(found.start.rigidity)} N/m; solid: after, "
        f"{number(found.end.rigidity)} N/m ({number(found.factor)} times)"
    )
    out += [f'<text x="{MARGIN}" y="{height - 14:.1f}" fill="{INK}">{said}</text>', "</svg>"]
    return "\n".join(out) + "\n"


def _eye(positions: Array, dimension: int) -> Array:
    """Return the two directions of the picture, (2, 3)."""
    if dimension == 2:
        return np.eye(3)[:2]
    _, _, axes = np.linalg.svd(positions - positions.mean(axis=0), full_matrices=False)
    axes = axes[:2] * np.where(
        np.take_along_axis(axes[:2], np.argmax(np.abs(axes[:2]), axis=1)[:, None], axis=1) < 0,
        -1.0,
        1.0,
    )
    return np.asarray(axes)
