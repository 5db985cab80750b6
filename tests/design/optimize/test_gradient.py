"""Derivatives of eigenvalues against central differences; matrices against those of `assemble`."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from technic.assembly.builder import Linkage
from technic.assembly.model import Assembly
from technic.design.optimize.freedom import freedom, rules_of
from technic.design.optimize.moving import Model, moved
from technic.design.optimize.objective import Motions, spectrum
from technic.design.optimize.vertices import find_geometry
from technic.loading import load
from technic.system.assemble import assemble
from tests.conftest import REPO

GALLERY = REPO / "examples" / "gallery"

SPRING = {"shear": 5e4, "axial": 2e5}


def random_linkage(seed: int, nodes: int, dimension: int, kind: str) -> Assembly:
    """Return a triangulated strip with random corners."""
    random = np.random.default_rng(seed)
    places = np.zeros((nodes, dimension))
    places[:, 0] = 0.1 * np.arange(nodes) / 2.0
    places[:, 1] = 0.08 * (np.arange(nodes) % 2)
    places += 0.012 * random.standard_normal(places.shape)
    linkage = Linkage(dimension)
    pairs = [(k, k + d) for d in (1, 2) for k in range(nodes - d)]
    if dimension == 3:
        pairs += [(k, k + 3) for k in range(nodes - 3)]
    for a, b in pairs:
        if kind == "truss":
            linkage.truss(f"{a}-{b}", places[a], places[b], area=9e-6)
        else:
            section = {"kind": "rectangle", "width": 0.004, "height": 0.003}
            linkage.bar(f"{a}-{b}", places[a], places[b], section=section)
    for k in range(nodes):
        own = [f"{a}-{b}" for a, b in pairs if k in (a, b)]
        if dimension == 2:
            linkage.hinge(*own, at=places[k], stiffness=SPRING if kind != "rigid pins" else "rigid")
        else:
            linkage.ball(*own, at=places[k])
    return linkage.assembly()


def check_derivative(assembly: Assembly, seed: int, count: int = 1) -> None:
    """Compare the derivative of the lowest eigenvalues along a random direction."""
    geometry = find_geometry(assembly)
    freed = freedom(geometry, rules_of(geometry), assembly.dimension)
    model = Model(assembly, geometry)
    motions = Motions(model)
    values, slopes = spectrum(model, motions, freed.start)
    if values[1] < 1.02 * values[0]:
        return  # a repeated eigenvalue has no derivative of its own
    way = np.random.default_rng(seed).standard_normal(freed.size)
    way /= np.linalg.norm(way)
    exact = freed.pull(slopes[:count]) @ way

    def central(step: float) -> np.ndarray:
        up = spectrum(model, motions, freed.positions(step * way))[0][:count]
        down = spectrum(model, motions, freed.positions(-step * way))[0][:count]
        return (up - down) / (2.0 * step)

    step = 2e-4 * float(np.ptp(freed.start))
    # two steps: the error of fourth order is what remains (Richardson)
    found = (4.0 * central(step / 2.0) - central(step)) / 3.0
    scale = np.linalg.norm(freed.pull(slopes[:count]), axis=1)
    assert np.abs(found - exact).max() <= 1e-6 * scale.max()


@given(
    seed=st.integers(0, 10**6),
    nodes=st.integers(3, 5),
    kind=st.sampled_from(["bar", "truss", "rigid pins"]),
)
@settings(max_examples=15, deadline=None)
def test_gradient_in_the_plane_is_that_of_central_differences(
    seed: int, nodes: int, kind: str
) -> None:
    check_derivative(random_linkage(seed, nodes, 2, kind), seed)


@given(seed=st.integers(0, 10**6), kind=st.sampled_from(["bar", "truss"]))
@settings(max_examples=5, deadline=None)
def test_gradient_in_space_is_that_of_central_differences(seed: int, kind: str) -> None:
    check_derivative(random_linkage(seed, 4, 3, kind), seed)


@pytest.mark.parametrize(
    "name", ["fig08b_excavator", "fig13e_five_bar", "fig12a4_square", "fig10e_universal"]
)
def test_gradient_with_supports_sliders_and_motions(name: str) -> None:
    """Sliding lines turn, supports hold rigidly, motions stay motions."""
    check_derivative(load(GALLERY / f"{name}.json"), 1)


@pytest.mark.parametrize("name", ["fig08a_bridge", "fig08b_excavator", "fig13e_five_bar"])
def test_matrices_are_those_of_the_moved_assembly(name: str) -> None:
    assembly = load(GALLERY / f"{name}.json")
    geometry = find_geometry(assembly)
    freed = freedom(geometry, rules_of(geometry), assembly.dimension)
    model = Model(assembly, geometry)
    q = 2e-3 * np.random.default_rng(0).standard_normal(freed.size)
    positions = freed.positions(q)
    matrices = model.matrices(positions)
    system = assemble(moved(model, positions))
    for own, other in (
        (matrices.stiffness, system.K + system.J),
        (matrices.measure, system.M),
        (matrices.rows, system.A),
    ):
        assert abs(own - other).max() <= 1e-12 * abs(other).max()
    assert matrices.mass == pytest.approx(system.mass, rel=1e-12)
