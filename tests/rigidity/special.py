"""Linkages and frameworks in special positions, whose mobility is in the literature."""

from __future__ import annotations

from itertools import combinations, product

import numpy as np

from technic.assembly.builder import Linkage
from technic.geometry import rotation_matrix

__all__ = [
    "PLATE",
    "bennett",
    "bricard_loop",
    "convex_octahedron",
    "double_banana",
    "flat_tripod",
    "framework",
    "hinge_loop",
    "jessen",
    "line_symmetric_octahedron",
    "sarrus",
]

PLATE = 0.1
"""Size of the models (m): what of, does not matter for what moves."""


def framework(points, edges, dimension=3, grounded=()):
    """Bars between points, ball joints (in the plane: pins) where they meet.

    Parameters
    ----------
    points : dict of name to coordinates
    edges : iterable of (name, name)
    grounded : iterable of names
        Points held to the ground.
    """
    linkage = Linkage(dimension)
    at = {name: PLATE * np.asarray(p, dtype=float) for name, p in points.items()}
    ends = {name: [] for name in points}
    for a, b in edges:
        bar = f"{a}-{b}"
        linkage.truss(bar, at[a], at[b], area=1e-5)
        ends[a].append(bar)
        ends[b].append(bar)
    for name, bars in ends.items():
        if len(bars) > 1:
            linkage.joint("ball" if dimension == 3 else "hinge", *bars, at=at[name])
        if name in grounded:
            linkage.fix(bars[0], at=at[name], held="xyz"[:dimension])
    return linkage.assembly()


def jessen():
    """Return Jessen's orthogonal icosahedron: 12 corners, 30 bars of two lengths."""
    corners = [
        np.roll([2.0 * a, 1.0 * b, 0.0], k) for k in range(3) for a, b in product((1, -1), (1, -1))
    ]
    points = {str(k): p for k, p in enumerate(corners)}
    squares = {4.0**2, 6.0}
    edges = [
        (a, b)
        for a, b in combinations(points, 2)
        if any(abs(np.sum((points[a] - points[b]) ** 2) - s) < 1e-9 for s in squares)
    ]
    assert len(edges) == 30
    return framework(points, edges)


def double_banana():
    """Return two bananas of nine bars each that share both tips."""
    points = {"top": (0, 0, 1), "bottom": (0, 0, -1)}
    edges = []
    for banana, angle in enumerate((0.0, 2.4)):
        ring = [f"{banana}{k}" for k in range(3)]
        for name, turn in zip(ring, (-0.6, 0.1, 0.7), strict=True):
            reach = 1.0 + 0.2 * np.cos(5 * turn)
            points[name] = (
                reach * np.cos(angle + turn),
                reach * np.sin(angle + turn),
                0.1 * np.sin(9 * turn),
            )
        edges += [*combinations(ring, 2), *product(ring, ("top", "bottom"))]
    assert len(edges) == 3 * len(points) - 6
    return framework(points, edges)


def _octahedron(a, b, c, mirror):
    points = {}
    for name, p in zip("abc", (a, b, c), strict=True):
        points[name], points[name + "'"] = np.array(p), np.array(mirror(p))
    edges = [(x, y) for x, y in combinations(points, 2) if x[0] != y[0]]
    return framework(points, edges)


def line_symmetric_octahedron():
    """Return Bricard's octahedron of the first kind: opposite corners change places in a half turn."""
    return _octahedron(
        (1.0, 0.2, 0.3), (-0.3, 0.9, -0.4), (0.5, 0.6, 0.8), lambda p: (-p[0], -p[1], p[2])
    )


def convex_octahedron():
    """Return the same graph as a convex body, which is rigid (Cauchy)."""
    return _octahedron(
        (1.0, 0.2, 0.1), (-0.2, 0.9, 0.1), (0.1, 0.1, 1.2), lambda p: (-p[0], -p[1], -0.9 * p[2])
    )


def flat_tripod(height):
    """Return three bars from the ground to a point at some height over the plane of their feet."""
    feet = {f"foot{k}": (np.cos(2.1 * k), np.sin(2.1 * k), 0.0) for k in range(3)}
    points = {**feet, "tip": (0.1, 0.05, height)}
    return framework(points, [(foot, "tip") for foot in feet], grounded=feet)


def _link(angle, length, twist):
    """Return the step from one hinge's frame to the next (Denavit and Hartenberg)."""
    out = np.eye(4)
    turn = rotation_matrix(np.array([0.0, 0.0, angle]))
    out[:3, :3] = turn @ rotation_matrix(np.array([twist, 0.0, 0.0]))
    out[:3, 3] = turn @ np.array([length, 0.0, 0.0])
    return out


def hinge_loop(angles, lengths, twists):
    """Return a closed chain of rigid links, hinged along the z axes of its frames.

    Raises
    ------
    ValueError
        The chain does not close.
    """
    frame = np.eye(4)
    frames = []
    for angle, length, twist in zip(angles, lengths, twists, strict=True):
        frames.append(frame)
        frame = frame @ _link(angle, length, twist)
    if np.abs(frame - np.eye(4)).max() > 1e-12:
        raise ValueError("the chain does not close")
    linkage = Linkage()
    count = len(frames)
    for k in range(count):
        linkage.rigid(f"link{k}", mass=0.01)
    for k in range(count):
        linkage.hinge(
            f"link{k - 1 if k else count - 1}",
            f"link{k}",
            at=PLATE * frames[k][:3, 3],
            axis=frames[k][:3, 2],
        )
    return linkage.assembly()


def bennett(ratio=1.0):
    """Return Bennett's linkage: four hinges, sides as the sines of their twists.

    With another `ratio` of sides and sines the chain that is closed here could not be built.
    """
    alpha, beta, first = 0.7, 1.3, 0.9
    # tan(t1/2) tan(t2/2) = sin((beta + alpha)/2) / sin((beta - alpha)/2)
    second = 2 * np.arctan(
        np.sin((beta + alpha) / 2) / np.sin((beta - alpha) / 2) / np.tan(first / 2)
    )
    lengths = [np.sin(alpha), ratio * np.sin(beta)] * 2
    return hinge_loop([second, first, -second, -first], lengths, [alpha, beta] * 2)


def bricard_loop(first=np.pi / 2):
    """Return Bricard's orthogonal six-hinge loop of threefold symmetry: sides 1, twists 90 degrees."""
    # cos a + cos b + cos a cos b = 0
    second = np.arccos(-np.cos(first) / (1 + np.cos(first)))
    return hinge_loop([first, -second] * 3, [1.0] * 6, [np.pi / 2, -np.pi / 2] * 3)


def sarrus(skewed=0.0):
    """Return Sarrus' linkage: two plates joined by two pairs of flaps with hinges at right angles.

    `skewed` turns the middle hinge of one pair out of parallel.
    """
    linkage = Linkage()
    for name in ("floor", "roof", "left low", "left high", "back low", "back high"):
        linkage.rigid(name, mass=0.01)
    for side, axis, out in (("left", (0, 1, 0), (1, 0, 0)), ("back", (1, 0, 0), (0, 1, 0))):
        foot, knee, head = 0.5, 1.1, 0.5
        middle = np.asarray(axis, dtype=float)
        if side == "back":
            middle = middle + skewed * np.array([0, 0, 1.0])
        rows = [
            ("floor", f"{side} low", foot, 0.0, axis),
            (f"{side} low", f"{side} high", knee, 0.7, middle),
            (f"{side} high", "roof", head, 1.4, axis),
        ]
        for a, b, reach, height, line in rows:
            at = PLATE * (reach * np.asarray(out, dtype=float) + np.array([0, 0, height]))
            linkage.hinge(a, b, at=at, axis=line)
    return linkage.assembly()
