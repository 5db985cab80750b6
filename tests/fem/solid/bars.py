"""Solid bars and what the theory of beams says about them."""

from __future__ import annotations

import numpy as np
from scipy import linalg

from technic.fem.solid.condense import Solid
from technic.geometry import Array, skew

__all__ = ["box_triangles", "plane_loads", "timoshenko_frequencies"]


def box_triangles(low: Array, high: Array) -> Array:
    """Return the twelve triangles of a box, outward normals."""
    low, high = np.asarray(low, dtype=float), np.asarray(high, dtype=float)
    corner = np.array([[x, y, z] for x in (0, 1) for y in (0, 1) for z in (0, 1)])
    faces = [
        (0, 1, 3), (0, 3, 2), (4, 6, 7), (4, 7, 5), (0, 4, 5), (0, 5, 1),
        (2, 3, 7), (2, 7, 6), (0, 2, 6), (0, 6, 4), (1, 5, 7), (1, 7, 3),
    ]  # fmt: skip
    return (low + corner * (high - low))[np.array(faces)]


def plane_loads(solid: Solid, x: float) -> Array:
    """Return (3 n, 6): unit loads on the section at `x`, spread by area; also its mean twist.

    The columns are the rows of the weighted least-squares twist of the section's nodes about its
    middle, so that ``loads.T @ u`` is the twist and ``loads @ f`` a load with resultant `f`.
    """
    mesh = solid.mesh
    plane = np.abs(mesh.points[:, 0] - x) < 0.01 * mesh.settings.cell
    weight = np.where(plane, np.asarray(solid.mass.sum(axis=0)).ravel(), 0.0)
    # Corner nodes of 20-node cells have negative consistent weights: the diagonal's are positive.
    weight = np.where(plane, solid.mass.diagonal(), weight)
    middle = (mesh.points * weight[:, None]).sum(axis=0) / weight.sum()
    rows = np.zeros((len(weight), 3, 6))
    rows[:, range(3), range(3)] = 1.0
    rows[:, :, 3:] = -skew(mesh.points - middle)
    normal = np.einsum("k,kia,kib->ab", weight, rows, rows)
    return (weight[:, None, None] * rows @ np.linalg.inv(normal)).reshape(-1, 6)


def timoshenko_frequencies(
    length: float, bending: float, shear: float, mass: float, rotary: float, count: int
) -> Array:
    """Return free-free bending frequencies (Hz) of a Timoshenko beam, by 400 linear elements.

    Parameters
    ----------
    length : float
        (m)
    bending, shear : float
        ``E I`` (N m2) and ``kappa G A`` (N).
    mass, rotary : float
        ``rho A`` (kg/m) and ``rho I`` (kg m).
    count : int
    """
    cells = 400
    h = length / cells
    k = np.zeros((2 * cells + 2, 2 * cells + 2))
    m = np.zeros_like(k)
    slope = np.array([-1.0, 0.0, 1.0, 0.0]) / h
    turn = np.array([0.0, -1.0, 0.0, 1.0]) / h
    mean = np.array([0.0, 0.5, 0.0, 0.5])
    local = shear * h * np.outer(slope - mean, slope - mean) + bending * h * np.outer(turn, turn)
    line = np.array([[2.0, 1.0], [1.0, 2.0]]) * h / 6.0
    inertia = np.kron(line, np.diag([mass, rotary]))
    for cell in range(cells):
        at = slice(2 * cell, 2 * cell + 4)
        k[at, at] += local
        m[at, at] += inertia
    values = linalg.eigh(k, m, eigvals_only=True, subset_by_index=(2, 1 + count))
    return np.sqrt(values) / (2.0 * np.pi)
