"""Rigid bore walls: an upper bound, with exact rigid motions, and frames for the mass that change nothing."""

from __future__ import annotations

import numpy as np
import pytest

from technic.fem.solid.settings import MeshSettings
from technic.fem.solid.store import build, solid_ports
from technic.fem.solid.superelement import SuperElement, rigid_motions
from technic.fem.solid.walls import build_with_rigid_walls
from technic.parts.catalogue import catalogue
from technic.parts.materials import material_of
from technic.parts.shapes import mesh

PART = "32523"
COARSE = MeshSettings(cell=1.6e-3)


def walled(used: tuple[int, ...], free: tuple[int, ...] = ()) -> SuperElement:
    definition = catalogue().get(PART)
    assert definition is not None
    ports = solid_ports(definition)
    return build_with_rigid_walls(
        PART,
        np.asarray(mesh(definition, "solid").triangles),
        [ports[k] for k in used],
        material_of(definition),
        COARSE,
        free=[ports[k] for k in free],
    )


def condensed(element: SuperElement, kept: int) -> np.ndarray:
    """Return the stiffness of the first ports, the others free."""
    k, n = element.stiffness, 6 * kept
    return np.asarray(k[:n, :n] - k[:n, n:] @ np.linalg.solve(k[n:, n:], k[n:, :n]))


@pytest.fixture(scope="module")
def mixed() -> SuperElement:
    return walled((0, 2), (1,))


def test_free_frames_do_not_stiffen(mixed: SuperElement) -> None:
    two = walled((0, 2))
    scale = np.abs(two.stiffness).max()
    np.testing.assert_allclose(condensed(mixed, 2), two.stiffness, atol=1e-7 * scale)


def test_six_rigid_motions_with_the_whole_mass(mixed: SuperElement) -> None:
    rigid = rigid_motions(mixed.points, mixed.centroid)
    values = np.linalg.eigvalsh(mixed.stiffness)
    assert np.all(np.abs(values[:6]) < 1e-12 * values[-1])
    assert values[6] > 1e-9 * values[-1]
    inertia = rigid.T @ mixed.mass @ rigid
    np.testing.assert_allclose(
        inertia[:3, :3], inertia[0, 0] * np.eye(3), atol=1e-9 * inertia[0, 0]
    )
    np.testing.assert_allclose(inertia[:3, 3:], 0.0, atol=1e-9 * inertia[0, 0])
    assert np.linalg.eigvalsh(mixed.mass)[0] > 0.0


def test_stiffer_than_bores_that_give_and_softer_than_every_wall_rigid(mixed: SuperElement) -> None:
    definition = catalogue().get(PART)
    assert definition is not None
    mean = build([definition], COARSE)[0][PART]
    order = np.concatenate([6 * k + np.arange(6) for k in (0, 2, 1)])
    soft = np.asarray(mean.stiffness)[np.ix_(order, order)]
    soft = soft[:12, :12] - soft[:12, 12:] @ np.linalg.solve(soft[12:, 12:], soft[12:, :12])
    hard = condensed(walled((0, 2, 1)), 2)
    middle = condensed(mixed, 2)
    size = np.abs(hard).max()
    for lower, upper in ((soft, middle), (middle, hard)):
        # every load does at least as much work on the softer one
        assert np.linalg.eigvalsh(upper - lower)[0] > -1e-6 * size
