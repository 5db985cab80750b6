"""Derivatives of eigenvalues against central differences; matrices against those of `assemble`."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from scipy import linalg

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
    free, stiffness = motions.at(freed.start), model.matrices(freed.start).stiffness
    if free.shape[1] and abs(stiffness @ free).max() > 1e-9 * abs(stiffness).max():
        return  # so nearly flat that it counts as flexible: what is held as a motion costs a little
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


@given(seed=st.integers(0, 10**6), nodes=st.integers(3, 6))
@settings(max_examples=10, deadline=None)
def test_gradient_is_that_of_automatic_differentiation(seed: int, nodes: int) -> None:
    """Forward differentiation by a complex step through a dense model that shares no code with ours."""
    assembly = random_linkage(seed, nodes, 2, "truss")
    geometry = find_geometry(assembly)
    freed = freedom(geometry, rules_of(geometry), 2)
    model = Model(assembly, geometry)
    values, slopes = spectrum(model, Motions(model), freed.start)
    if values[1] < 1.02 * values[0]:
        return
    way = np.random.default_rng(seed).standard_normal(freed.size)
    way /= np.linalg.norm(way)
    step = 1e-20j
    moving = freed.start + step * (freed.basis @ way).reshape(-1, 3)
    value = dense_truss_value(assembly, geometry.corners, moving[:, :2])
    assert value.real == pytest.approx(values[0], rel=1e-8)
    exact = freed.pull(slopes[:1])[0]
    assert abs(value.imag / step.imag - exact @ way) <= 1e-7 * np.linalg.norm(exact)


def dense_truss_value(assembly: Assembly, corners: dict, places: np.ndarray) -> complex:
    """Return the lowest elastic eigenvalue of truss bars on shear springs, as a function of places.

    The derivative of a simple eigenvalue of a complex symmetric pencil is found with the pencil itself:
    at the real eigenpair, one step of Rayleigh's quotient is exact to the first order in the step.
    """
    bars = list(corners.values())
    size = 4 * len(bars)
    stiffness = np.zeros((size, size), complex)
    mass = np.zeros((size, size), complex)
    total = 0.0 + 0.0j
    for b, (i, j) in enumerate(bars):
        body = assembly.parts[b].body
        span = places[j] - places[i]
        length = np.sqrt(span @ span)
        axial = body.material.young_pa * body.area / length**3 * np.outer(span, span)
        own = slice(4 * b, 4 * b + 4)
        stiffness[own, own] += np.block([[axial, -axial], [-axial, axial]])
        kg = body.material.density * body.area * length
        mass[own, own] += kg / 6.0 * np.kron([[2.0, 1.0], [1.0, 2.0]], np.eye(2))
        total += kg
    for joint in assembly.joints:
        ends = []
        for part in joint.parts:
            near = [np.abs(places[v].real - joint.point[:2]).max() for v in bars[part]]
            ends.append(4 * part + 2 * int(np.argmin(near)))
        for c in range(2):
            row = np.zeros(size)
            row[ends[0] + c], row[ends[1] + c] = 1.0, -1.0
            stiffness += SPRING["shear"] * np.outer(row, row)
    values, modes = linalg.eigh(stiffness.real, mass.real / total.real)
    mode = modes[:, 3]
    assert values[2] < 1e-6 * values[3]
    return complex(mode @ stiffness @ mode / (mode @ (mass / total) @ mode))
