"""Solid bars against beam theory, at the shipped setting (1 %) and the draft setting (2 %)."""

from __future__ import annotations

from functools import lru_cache

import numpy as np
import pytest

from technic.fem.solid.condense import Solid, element_stiffness, free_modes, solid_of
from technic.fem.solid.grid import MeshSettings
from technic.fem.solid.solver import factorize
from tests.fem.solid.bars import box_triangles, plane_loads, timoshenko_frequencies
from tests.fem.solid.liftarm import ABS

LENGTH, WIDTH, HEIGHT = 48e-3, 4.3e-3, 3.5e-3
"""x is a multiple of both cell sizes, so that sections at the ends have nodes; y and z are not."""

SETTINGS = [
    pytest.param(MeshSettings(cell=0.8e-3), 0.01, id="shipped"),
    pytest.param(MeshSettings(cell=1.2e-3), 0.02, id="draft"),
]
E, G = ABS.young_pa, ABS.shear_pa
AREA = WIDTH * HEIGHT
INERTIA = {1: HEIGHT * WIDTH**3 / 12.0, 2: WIDTH * HEIGHT**3 / 12.0}
"""Second moment that resists displacement along axis 1 (y) and 2 (z)."""
KAPPA = 10.0 * (1.0 + ABS.poisson) / (12.0 + 11.0 * ABS.poisson)
"""Cowper 1966: shear coefficient of a rectangle."""


def torsion_constant(a: float, b: float) -> float:
    """Timoshenko, Goodier, section 109, eq. 170: a >= b."""
    odd = np.arange(1, 40, 2)
    series = (np.tanh(odd * np.pi * a / (2.0 * b)) / odd**5).sum()
    return a * b**3 / 3.0 * (1.0 - 192.0 / np.pi**5 * b / a * series)


@lru_cache(maxsize=2)
def bar(settings: MeshSettings) -> Solid:
    return solid_of(box_triangles(np.zeros(3), [LENGTH, WIDTH, HEIGHT]), ABS, settings)


@pytest.mark.parametrize(("settings", "rel"), SETTINGS)
@pytest.mark.parametrize("axis", [1, 2])
def test_cantilever(settings: MeshSettings, rel: float, axis: int) -> None:
    solid = bar(settings)
    mesh = solid.mesh
    clamp = np.repeat(np.abs(mesh.points[:, 0]) < 1e-6, 3) * 1e4 * E * settings.cell
    factor = factorize(
        mesh.cells, mesh.nodes, lambda chosen: element_stiffness(mesh, ABS, chosen), clamp
    )
    load = plane_loads(solid, LENGTH)[:, axis]
    deflection = load @ factor.solve(load[:, None])[:, 0]
    expected = LENGTH**3 / (3.0 * E * INERTIA[axis]) + LENGTH / (KAPPA * G * AREA)
    assert deflection == pytest.approx(expected, rel=rel)


@pytest.mark.parametrize(("settings", "rel"), SETTINGS)
@pytest.mark.parametrize("axis", [1, 2])
def test_three_point_bending(settings: MeshSettings, rel: float, axis: int) -> None:
    solid = bar(settings)
    left, middle, right = (plane_loads(solid, x)[:, axis] for x in (0.0, LENGTH / 2, LENGTH))
    load = middle - (left + right) / 2.0
    deflection = load @ solid.factor.solve(load[:, None])[:, 0]
    expected = LENGTH**3 / (48.0 * E * INERTIA[axis]) + LENGTH / (4.0 * KAPPA * G * AREA)
    assert deflection == pytest.approx(expected, rel=rel)


@pytest.mark.parametrize(("settings", "rel"), SETTINGS)
def test_torsion_and_tension(settings: MeshSettings, rel: float) -> None:
    solid = bar(settings)
    ends = plane_loads(solid, LENGTH) - plane_loads(solid, 0.0)
    u = solid.factor.solve(ends[:, [0, 3]])
    # Measured a quarter of the length away from the ends, where Saint-Venant's field holds.
    inner = (plane_loads(solid, 0.75 * LENGTH) - plane_loads(solid, 0.25 * LENGTH)).T @ u
    assert inner[0, 0] == pytest.approx(LENGTH / 2.0 / (E * AREA), rel=rel)
    twist = LENGTH / 2.0 / (G * torsion_constant(WIDTH, HEIGHT))
    assert inner[3, 1] == pytest.approx(twist, rel=rel)


@pytest.mark.parametrize(("settings", "rel"), SETTINGS)
def test_free_frequencies(settings: MeshSettings, rel: float) -> None:
    solid = bar(settings)
    x = solid.mesh.points[:, 0] / LENGTH
    start = np.zeros((len(x), 3, 12))
    for k in range(4):
        wave = np.cos((k + 1) * np.pi * x)
        start[:, 1, 2 * k] = wave
        start[:, 2, 2 * k + 1] = wave
    centred = solid.mesh.points - solid.mesh.points.mean(axis=0)
    for k in range(2):
        wave = np.cos((k + 1) * np.pi * x)
        start[:, 0, 8 + k] = wave
        start[:, 1, 10 + k] = -centred[:, 2] * wave * 1e3
        start[:, 2, 10 + k] = centred[:, 1] * wave * 1e3
    values, modes = free_modes(solid, start.reshape(-1, 12), rounds=8)
    found = np.sqrt(values) / (2.0 * np.pi)
    rho = ABS.density
    for axis in (1, 2):
        expected = timoshenko_frequencies(
            LENGTH, E * INERTIA[axis], KAPPA * G * AREA, rho * AREA, rho * INERTIA[axis], 2
        )
        for frequency in expected:
            assert found[np.argmin(np.abs(found - frequency))] == pytest.approx(frequency, rel=rel)
    polar = rho * (INERTIA[1] + INERTIA[2])
    twisting = np.sqrt(G * torsion_constant(WIDTH, HEIGHT) / polar) / (2.0 * LENGTH)
    assert found[np.argmin(np.abs(found - twisting))] == pytest.approx(twisting, rel=rel)
    assert len(modes) == 3 * len(x)


def test_mass_and_centroid_of_a_bar() -> None:
    solid = bar(MeshSettings(cell=1.2e-3))
    per_node = np.asarray(solid.mass.sum(axis=0)).ravel()
    assert per_node.sum() == pytest.approx(ABS.density * AREA * LENGTH, rel=1e-3)
    centroid = per_node @ solid.mesh.points / per_node.sum()
    assert centroid == pytest.approx(np.array([LENGTH, WIDTH, HEIGHT]) / 2.0, abs=1e-5)
