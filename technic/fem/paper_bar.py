"""The paper's own bar: a strip of springs without units, to compare with its printed numbers.

A bar of the paper's two-dimensional examples is a row of stations with a node on either side, a node at
each end, and springs along the sides, across, along both diagonals and to the ends. A spring of rest length
``L`` has the energy ``L (n . du)^2``: it is stiffer the longer it is, so the numbers depend on how finely a
bar is divided and mean nothing in newtons. Everything else in the program uses beams; this is kept for
`technic paper` alone.
"""

from __future__ import annotations

from itertools import pairwise

import numpy as np

from technic.fem.element import Element
from technic.geometry import Array, shift_twist

__all__ = ["paper_bar"]


def paper_bar(p: Array, q: Array, stations: int, thickness: float) -> Element:
    """Return the strip of springs between two points of the plane.

    Parameters
    ----------
    p, q : (3,) ndarray
        Ends, in the paper's units of length.
    stations : int
        Pairs of nodes between the ends, at equal distances; at least 2.
    thickness : float
        Distance between the nodes of a pair.

    Returns
    -------
    Element
        2 unknowns per node. Nodes: one side from p to q, the other side, p, q. The mass is one unit per
        node, as in the paper's measure; there are no frames.
    """
    along = (q - p) / np.linalg.norm(q - p)
    left = np.array([along[1], -along[0], 0.0]) * thickness / 2.0
    shares = np.linspace(1.0 / (stations + 1), 1.0 - 1.0 / (stations + 1), stations)
    middle = p + shares[:, None] * (q - p)
    points = np.vstack([middle + left, middle - left, p, q])
    n = stations
    springs = [(k, k + n) for k in range(n)]
    for a, b in pairwise(range(n)):
        springs += [(a, b), (a + n, b + n), (a, b + n), (a + n, b)]
    springs += [(0, 2 * n), (n, 2 * n), (n - 1, 2 * n + 1), (2 * n - 1, 2 * n + 1)]
    size = 2 * len(points)
    stiffness = np.zeros((size, size))
    for a, b in springs:
        span = (points[b] - points[a])[:2]
        length = float(np.linalg.norm(span))
        row = np.zeros(size)
        row[2 * a : 2 * a + 2], row[2 * b : 2 * b + 2] = -span / length, span / length
        stiffness += length * np.outer(row, row)
    rigid = shift_twist(points - points.mean(axis=0))[:, :2].reshape(size, 6)
    nodes = np.zeros((len(points), 3, size))
    for k in range(len(points)):
        nodes[k, :2, 2 * k : 2 * k + 2] = np.eye(2)
    return Element(
        stiffness=stiffness,
        mass=np.eye(size),
        rigid=rigid,
        frames=np.zeros((0, 6, size)),
        frame_points=np.zeros((0, 3)),
        nodes=nodes,
        node_points=points,
    )
