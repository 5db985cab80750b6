"""Patch test, rigid motions, split cells, surfaces with faults, dependent frames."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from technic.errors import InputError, NumericalError, UsageError
from technic.fem.solid import (
    MeshSettings,
    SuperElement,
    build_super_element,
    super_element_to_element,
)
from technic.fem.solid.cells import elasticity, gauss_weights, shape_functions
from technic.fem.solid.condense import element_stiffness, solid_of
from technic.fem.solid.grid import Mesh, mesh_part
from technic.fem.solid.inside import fill_fractions
from technic.fem.solid.solver import factorize
from technic.fem.solid.superelement import elastic_eigenvalues, rigid_motions
from technic.geometry import Array
from technic.parts.definition import Port, PortKind
from technic.units import PITCH
from tests.fem.solid.bars import box_triangles
from tests.fem.solid.liftarm import ABS, holes, plain_liftarm

DRAFT = MeshSettings(cell=1.2e-3)
offsets = st.tuples(*[st.floats(0.0, 0.99)] * 3)


@pytest.fixture(scope="module")
def part() -> SuperElement:
    return build_super_element("liftarm4", plain_liftarm(4), holes(4), ABS, DRAFT)


def whole_matrix(mesh: Mesh) -> Array:
    out = np.zeros((3 * len(mesh.points),) * 2)
    matrices = element_stiffness(mesh, ABS, np.arange(len(mesh.cells)))
    for nodes, matrix in zip(mesh.nodes, matrices, strict=True):
        at = (3 * nodes[:, None] + np.arange(3)).ravel()
        out[np.ix_(at, at)] += matrix
    return out


def test_shape_functions_are_a_partition_of_unity_and_nodal() -> None:
    from technic.fem.solid.cells import OFFSETS

    values, gradients = shape_functions(OFFSETS - 1.0)
    assert values == pytest.approx(np.eye(20), abs=1e-14)
    points = np.random.default_rng(1).uniform(-1, 1, (9, 3))
    values, gradients = shape_functions(points)
    assert values.sum(axis=1) == pytest.approx(np.ones(9))
    assert gradients.sum(axis=1) == pytest.approx(np.zeros((9, 3)), abs=1e-13)
    step = 1e-6
    for axis in range(3):
        moved = points + step * np.eye(3)[axis]
        assert (shape_functions(moved)[0] - values) / step == pytest.approx(
            gradients[:, :, axis], abs=1e-5
        )


@settings(max_examples=5)
@given(offset=offsets)
def test_patch_test_on_cut_cells(offset: tuple[float, float, float]) -> None:
    # A linear displacement has constant stress: its energy is that of the volume, and nodes whose
    # cells are all full feel no force.
    size = np.array([5.1e-3, 4.3e-3, 3.7e-3])
    mesh = mesh_part(box_triangles(np.zeros(3), size), MeshSettings(1.2e-3, 4, offset))
    gradient = np.array([[1.0, 0.3, -0.2], [0.1, -0.5, 0.4], [0.7, 0.2, 0.6]]) * 1e-3
    u = (mesh.points @ gradient.T).ravel()
    symmetric = (gradient + gradient.T) / 2.0
    voigt = np.array([*np.diag(symmetric), *(2.0 * symmetric[[1, 2, 0], [2, 0, 1]])])
    energy = voigt @ elasticity(ABS) @ voigt * mesh.volume
    force = whole_matrix(mesh) @ u
    assert u @ force == pytest.approx(energy, rel=1e-5)
    full = np.ones(len(mesh.points), dtype=bool)
    full[mesh.nodes[mesh.fill.min(axis=1) < 1.0]] = False
    counts = np.bincount(mesh.nodes[:, :8].ravel(), minlength=len(full))
    inner = full & (counts == 8)
    assert inner.any()
    assert np.abs(force.reshape(-1, 3)[inner]).max() < 1e-9 * np.abs(force).max()


@settings(max_examples=8)
@given(offset=offsets)
def test_volume_and_centroid_do_not_depend_on_the_grid(offset: tuple[float, float, float]) -> None:
    size = np.array([5.1e-3, 4.3e-3, 3.7e-3])
    mesh = mesh_part(box_triangles(np.zeros(3), size), MeshSettings(1.2e-3, 4, offset))
    assert mesh.volume == pytest.approx(np.prod(size), rel=2e-3)


def test_gauss_weights_have_volume_and_centroid() -> None:
    fill = np.array([0.3, 1.0, 0.5])
    moment = np.array([[0.06, 0.0, -0.03], [0.0, 0.0, 0.0], [0.125, 0.0, 0.0]])
    weights = gauss_weights(fill, moment)
    g = np.sqrt(1.0 / 12.0)
    points = np.array([[x, y, z] for x in (-g, g) for y in (-g, g) for z in (-g, g)])
    assert weights.sum(axis=1) == pytest.approx(fill)
    assert weights @ points == pytest.approx(moment, abs=1e-12)
    assert weights.min() >= 0.0


def test_rigid_motions_symmetry_and_six_zero_eigenvalues(part: SuperElement) -> None:
    rigid = rigid_motions(part.points, part.centroid)
    assert (part.stiffness == part.stiffness.T).all()
    assert (part.mass == part.mass.T).all()
    assert np.abs(part.stiffness @ rigid).max() < 1e-12 * np.abs(part.stiffness).max()
    values = np.linalg.eigvalsh(part.stiffness)
    assert np.abs(values[:6]).max() < 1e-7 * values[6]
    assert np.linalg.eigvalsh(part.mass)[0] > 0.0


def test_mass_matches_the_mesh(part: SuperElement) -> None:
    import trimesh

    surface = trimesh.Trimesh(**trimesh.triangles.to_kwargs(plain_liftarm(4)))
    rigid = rigid_motions(part.points, part.centroid)
    inertia = rigid.T @ part.mass @ rigid
    assert inertia[0, 0] == pytest.approx(ABS.density * surface.volume, rel=2e-3)
    assert part.centroid == pytest.approx(surface.center_mass, abs=2e-5)
    expected = surface.moment_inertia * ABS.density
    assert np.diag(inertia)[3:] == pytest.approx(np.diag(expected), rel=0.01)


def test_the_solver_agrees_with_dense_algebra() -> None:
    mesh = mesh_part(box_triangles(np.zeros(3), np.array([6e-3, 3e-3, 2.5e-3])), DRAFT)
    matrix = whole_matrix(mesh)
    springs = np.full(len(matrix), 1e3)
    factor = factorize(
        mesh.cells, mesh.nodes, lambda chosen: element_stiffness(mesh, ABS, chosen), springs
    )
    right = np.random.default_rng(3).normal(size=(len(matrix), 4))
    expected = np.linalg.solve(matrix + np.diag(springs), right)
    assert factor.solve(right) == pytest.approx(expected, rel=1e-8, abs=1e-9)


def test_an_indefinite_matrix_is_refused() -> None:
    mesh = mesh_part(box_triangles(np.zeros(3), np.array([6e-3, 3e-3, 2.5e-3])), DRAFT)
    with pytest.raises(NumericalError):
        factorize(
            mesh.cells,
            mesh.nodes,
            lambda chosen: -element_stiffness(mesh, ABS, chosen),
            np.zeros(3 * len(mesh.points)),
        )


@pytest.mark.parametrize(("shift", "split"), [(0.0, False), (0.5, True)])
def test_walls_across_a_gap_are_not_glued(shift: float, split: bool) -> None:
    # A tuning fork: two prongs 0.5 mm apart, in cells of 1.2 mm; pulling them apart must bend both.
    import trimesh

    length, deep, thick, gap = 24e-3, 4e-3, 2e-3, 0.5e-3
    half = thick + gap / 2.0
    boxes = [
        box_triangles([-4e-3, -half, 0.0], [0.0, half, deep]),
        box_triangles([-1e-3, gap / 2.0, 0.0], [length, half, deep]),
        box_triangles([-1e-3, -half, 0.0], [length, -gap / 2.0, deep]),
    ]
    solids = [trimesh.Trimesh(**trimesh.triangles.to_kwargs(b)) for b in boxes]
    fork = trimesh.boolean.union(solids, engine="manifold")
    settings = MeshSettings(cell=1.2e-3, offset=(0.0, shift, 0.0))
    solid = solid_of(np.asarray(fork.triangles), ABS, settings)
    mesh = solid.mesh
    # The middle of the gap is inside a cell or (nearly) at a face between cells.
    assert (len(np.unique(mesh.cells, axis=0)) < len(mesh.cells)) == split
    load = np.zeros(3 * len(mesh.points))
    tip = np.nonzero(mesh.cells[:, 0] == mesh.cells[:, 0].max())[0]
    for element in tip:
        middle = mesh.origin[1] + (np.nonzero(mesh.owner == element)[1].mean() + 0.5) * settings.sub
        load[3 * mesh.nodes[element] + 1] += np.sign(middle) * mesh.fill[element].sum()
    load /= np.abs(load).sum() / 2.0
    opening = load @ solid.factor.solve(load[:, None])[:, 0]
    cantilever = length**3 / (3.0 * ABS.young_pa * deep * thick**3 / 12.0)
    # The root of a prong turns a little: the fork is softer than two clamped cantilevers.
    assert 1.9 * cantilever < opening < 2.4 * cantilever


def test_overlapping_and_open_surfaces_fill_like_closed_ones() -> None:
    a = box_triangles(np.zeros(3), np.array([4.0, 3.0, 2.0]))
    b = box_triangles(np.array([2.0, 1.0, 0.5]), np.array([6.0, 2.0, 1.5]))
    both = np.concatenate([a, b])
    origin, size, shape = np.full(3, -0.5), 0.1, (75, 45, 35)
    whole = 24.0 + 4.0 - 2.0
    closed = fill_fractions(both, origin, size, shape)
    assert closed.fraction.sum() * size**3 == pytest.approx(whole, rel=1e-3)
    assert closed.open_rays == 0.0
    assert not closed.leaking
    # Without half of the top face the flood fill enters; the other rays still tell.
    opened = fill_fractions(both[np.arange(len(both)) != 9], origin, size, shape)
    assert opened.open_rays > 0.0
    assert opened.leaking
    assert opened.fraction.sum() * size**3 == pytest.approx(whole, rel=0.02)
    # All triangles turned over: the same body.
    turned = fill_fractions(both[:, ::-1], origin, size, shape)
    assert turned.fraction == pytest.approx(closed.fraction)


def test_an_enclosed_void_stays_empty() -> None:
    outer = box_triangles(np.zeros(3), np.full(3, 4.0))
    inner = box_triangles(np.full(3, 1.0), np.full(3, 3.0))[:, ::-1]
    filled = fill_fractions(np.concatenate([outer, inner]), np.full(3, -0.45), 0.2, (26, 26, 26))
    assert filled.fraction.sum() * 0.2**3 == pytest.approx(64.0 - 8.0, rel=1e-3)


def test_surfaces_that_cannot_be_meshed_are_refused() -> None:
    with pytest.raises(InputError, match="triangles"):
        mesh_part(np.zeros((0, 3, 3)), DRAFT)
    flat = box_triangles(np.zeros(3), np.array([5e-3, 5e-3, 0.0]))
    with pytest.raises(InputError, match="no material"):
        mesh_part(flat, DRAFT)
    apart = np.concatenate(
        [
            box_triangles(np.zeros(3), np.full(3, 4e-3)),
            box_triangles(np.array([9e-3, 0, 0]), np.array([13e-3, 4e-3, 4e-3])),
        ]
    )
    with pytest.raises(InputError, match="separate pieces"):
        mesh_part(apart, DRAFT)


def test_a_port_without_material_is_refused() -> None:
    far = Port("away", PortKind.PIN_HOLE, np.array([0.0, 30e-3, 0.0]), [0, 0, 1], PITCH)
    with pytest.raises(InputError, match="away"):
        build_super_element("x", plain_liftarm(2), [*holes(2), far], ABS, DRAFT)


def test_the_same_bore_twice_is_merged_and_half_a_bore_aside_is_refused() -> None:
    twin = Port("twin", PortKind.PIN_HOLE, np.zeros(3), [0, 0, -1], PITCH)
    element = build_super_element("x", plain_liftarm(2), [*holes(2), twin], ABS, DRAFT)
    assert element.merged == (("twin", "hole1"),)
    assert element.index("twin") == element.index("hole1")
    assert len(element.ports) == 2


def test_ports_not_in_use_are_condensed_out(part: SuperElement) -> None:
    element, error = super_element_to_element(part, ["hole1", "hole4", "hole1"])
    assert error <= 1e-2
    assert element.frames.shape == (3, 6, element.size)
    assert (element.frames[0] == element.frames[2]).all()
    assert np.abs(element.stiffness @ element.rigid).max() < 1e-9 * np.abs(element.stiffness).max()
    exact = elastic_eigenvalues(part.stiffness, part.mass, 2)
    assert elastic_eigenvalues(element.stiffness, element.mass, 2) == pytest.approx(exact, rel=1e-2)
    with pytest.raises(UsageError, match="hole9"):
        super_element_to_element(part, ["hole9"])


def test_a_frame_beside_its_port_moves_rigidly_with_it(part: SuperElement) -> None:
    points = np.array([[1e-3, 2e-3, -4e-3]])
    element, _ = super_element_to_element(part, [None], points)
    twist = np.array([0.1, -0.2, 0.3, 0.01, 0.02, -0.03])
    moved = element.frames[0] @ (element.rigid @ twist)
    arm = points[0] - part.centroid
    assert moved == pytest.approx(np.concatenate([twist[:3] + np.cross(twist[3:], arm), twist[3:]]))
    with pytest.raises(UsageError, match="names no port"):
        super_element_to_element(part, [None])


def test_another_material_scales(part: SuperElement) -> None:
    other = part.scaled(2.0, 3.0)
    assert (other.stiffness == 2.0 * part.stiffness).all()
    assert (other.mass == 3.0 * part.mass).all()
