"""Landscapes of Fig. 7: the energy that it takes to move a point, over directions and over the plane."""

from __future__ import annotations

from typing import Final

import numpy as np
from numpy.typing import NDArray

from technic.assembly.model import Assembly
from technic.system.assemble import assemble

__all__ = ["landscape", "tip_stiffness"]

Array = NDArray[np.float64]

SIDE: Final = 320
LEVELS: Final = 8
SOFT, HARD, LINE = "#e07b00", "#2b6cb0", "#4a5568"


def tip_stiffness(assembly: Assembly, tip: Array) -> Array:
    """Return the stiffness of a point of a plane assembly, (2, 2) in N/m: ``E = u^T k u``.

    Everything else goes where it costs least; supports and rigid joints hold.
    """
    system = assemble(assembly)
    energy = (system.K + system.J).toarray()
    held = system.A.toarray()[~system.elastic]
    rows = None
    for k, (part, element) in enumerate(zip(assembly.parts, system.elements, strict=True)):
        gaps = np.linalg.norm(part.pose.points(element.node_points) - tip, axis=1)
        if rows is None and gaps.min() < 1e-9:
            rows = np.zeros((2, system.size))
            rows[:, system.part_slice(k)] = element.nodes[int(np.argmin(gaps)), :2]
    if rows is None:
        raise ValueError("no node at the tip")
    bound = np.vstack([held, rows])
    scale = float(np.abs(energy).max())
    n, m = len(energy), len(bound)
    saddle = np.block([[energy / scale, bound.T], [bound, np.zeros((m, m))]])
    loads = np.zeros((n + m, 2))
    loads[n + m - 2 :] = np.eye(2)
    x = np.linalg.lstsq(saddle, loads, rcond=1e-12)[0][:n]
    found = x.T @ energy @ x
    return np.asarray((found + found.T) / 2.0)


def _path(points: Array, color: str, *, closed: bool = True, width: float = 1.2) -> str:
    said = " ".join(f"{x:.1f},{y:.1f}" for x, y in points)
    kind = "polygon" if closed else "polyline"
    return f'<{kind} points="{said}" fill="none" stroke="{color}" stroke-width="{width}"/>'


def _place(points: Array, column: int, scale: float) -> Array:
    center = np.array([SIDE * (column + 0.5), SIDE * 0.5 + 30])
    return np.asarray(center + points * [scale, -scale])


def landscape(title: str, k: Array) -> str:
    """Return an SVG picture: E over the circle of directions, and its level lines over the plane."""
    values, ways = np.linalg.eigh(k)
    turns = np.linspace(0.0, 2.0 * np.pi, 181)
    circle = np.column_stack([np.cos(turns), np.sin(turns)])
    energy = np.einsum("ni,ij,nj->n", circle, k, circle)
    reach = 0.42 * SIDE
    parts = [
        _path(_place(circle, 0, reach), "#cbd5e0"),
        _path(_place(circle * (energy / values[-1])[:, None], 0, reach), HARD, width=2.0),
    ]
    for value, way, color in zip(values, ways.T, (SOFT, HARD), strict=True):
        for column in (0, 1):
            parts.append(_path(_place(np.array([-way, way]), column, reach), color, closed=False))
        x, y = _place(way[None] * 1.06, 0, reach)[0]
        text = f"{value:.3g} N/m" if value > 1e-9 * values[-1] else "0"
        parts.append(f'<text x="{x:.0f}" y="{y:.0f}" font-size="11" fill="{color}">{text}</text>')
    inside = f'<clipPath id="plane"><circle cx="{1.5 * SIDE}" cy="{SIDE * 0.5 + 30}" r="{reach}"/>'
    rings = []
    for level in np.arange(1, LEVELS + 1) / LEVELS:
        # E = level * its largest value on the circle
        size = np.sqrt(level * values[-1] / np.maximum(values, 1e-6 * values[-1]))
        ring = (circle * size) @ ways.T
        rings.append(_path(_place(ring, 1, reach), LINE))
    parts += [inside + "</clipPath>", '<g clip-path="url(#plane)">', *rings, "</g>"]
    parts.append(_path(_place(circle, 1, reach), "#cbd5e0"))
    words = [
        (SIDE * 0.5, f"{title}: E over directions"),
        (SIDE * 1.5, "level lines of E over the plane"),
    ]
    for x, text in words:
        parts.append(f'<text x="{x}" y="20" font-size="13" text-anchor="middle">{text}</text>')
    head = (
        f'<svg xmlns="http://www.w3.org/2000/svg" width="{2 * SIDE}" height="{SIDE + 40}" '
        'font-family="sans-serif">'
    )
    return (
        "\n".join([head, '<rect width="100%" height="100%" fill="white"/>', *parts, "</svg>"])
        + "\n"
    )
