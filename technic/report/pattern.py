"""How a model gives way, in one phrase: twisting, bending, racking or stretching."""

from __future__ import annotations

import numpy as np

from technic.geometry import Array
from technic.report.wording import AXIS_WORDS

__all__ = ["describe_field"]

_CLEAR = 0.6
"""Share of the movement that a simple pattern must explain before it is named."""

_SIDE_WORDS = ("sideways", "up and down", "to and fro")


def _candidates(points: Array) -> list[tuple[str, Array]]:
    """Return named displacement fields, (n, 3) each, at points about their centre."""
    fields: list[tuple[str, Array]] = []
    for e in range(3):
        s = points[:, e]
        axis = np.zeros(3)
        axis[e] = 1.0
        fields.append((f"it twists about {AXIS_WORDS[e]}", s[:, None] * np.cross(axis, points)))
        for d in range(3):
            if d == e:
                continue
            bend = np.zeros_like(points)
            bend[:, d] = 0.5 * s**2
            bend[:, e] = -s * points[:, d]
            fields.append((f"it bends {_SIDE_WORDS[d]} along {AXIS_WORDS[e]}", bend))
        a, b = (k for k in range(3) if k != e)
        rack = np.zeros_like(points)
        rack[:, a], rack[:, b] = points[:, b], points[:, a]
        fields.append((f"it racks (rectangles become diamonds) seen along {AXIS_WORDS[e]}", rack))
        stretch = np.zeros_like(points)
        stretch[:, e] = s
        fields.append((f"it stretches along {AXIS_WORDS[e]}", stretch))
    return fields


def describe_field(points: Array, displacements: Array, weights: Array) -> str | None:
    """Return the simple pattern that explains a displacement field best, as a phrase.

    The field is compared with polynomial fields after the rigid motions are taken out of all of
    them, in the weighted mean-square sense.

    Parameters
    ----------
    points, displacements : (n, 3) array_like
        Where (m) and how far (m).
    weights : (n,) array_like
        Mass that each point stands for.

    Returns
    -------
    str or None
        None when no pattern explains three fifths of the movement.
    """
    points = np.asarray(points, dtype=float)
    weights = np.asarray(weights, dtype=float)
    total = float(weights.sum())
    if len(points) < 3 or total <= 0.0:
        return None
    points = points - weights @ points / total
    root = np.sqrt(weights / total)[:, None]
    size = float(np.abs(points).max())
    if size == 0.0:
        return None
    points = points / size
    rigid = [np.tile(np.eye(3)[k], (len(points), 1)) for k in range(3)]
    rigid += [np.cross(np.eye(3)[k], points) for k in range(3)]
    basis = np.array([(field * root).ravel() for field in rigid]).T
    u, s, _ = np.linalg.svd(basis, full_matrices=False)
    # A model whose parts lie on one line has a rotation that moves nothing.
    q = u[:, s > 1e-9 * s[0]]

    def elastic(field: Array) -> Array:
        vector = (field * root).ravel()
        return np.asarray(vector - q @ (q.T @ vector))

    field = elastic(np.asarray(displacements, dtype=float))
    size_of_field = float(np.linalg.norm(field))
    if size_of_field == 0.0:
        return None
    best, share = "", 0.0
    for phrase, candidate in _candidates(points):
        pattern = elastic(candidate)
        length = float(np.linalg.norm(pattern))
        if length < 1e-6:
            continue
        explained = float(pattern @ field) ** 2 / (length * size_of_field) ** 2
        if explained > share + 1e-9:
            best, share = phrase, explained
    return best if share >= _CLEAR else None
