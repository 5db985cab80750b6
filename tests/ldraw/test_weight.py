"""Mass of library parts: closed, open, overlapping and empty surfaces."""

from __future__ import annotations

import numpy as np
import pytest

from technic.ldraw.triangles import Surface, surface_of
from technic.ldraw.weight import MOST_CUBES, mass_of
from technic.parts.catalogue import catalogue
from technic.parts.materials import material
from technic.units import MM
from tests.ldraw.small_library import there

BOX = np.array([40.0, 8.0, 16.0]) * MM
DENSITY = material().density


def box(low=(0, 0, 0), size=BOX, faces=range(12)) -> np.ndarray:
    """Triangles of a box, outward; `faces` leaves some out."""
    corners = (
        np.array(low) + np.array([[i, j, k] for i in (0, 1) for j in (0, 1) for k in (0, 1)]) * size
    )
    quads = [(0, 1, 3, 2), (4, 6, 7, 5), (0, 4, 5, 1), (2, 3, 7, 6), (0, 2, 6, 4), (1, 5, 7, 3)]
    triangles = [t for a, b, c, d in quads for t in ((a, b, c), (a, c, d))]
    return corners[[triangles[k] for k in faces]]


def surface(*triangles: np.ndarray) -> Surface:
    every = np.concatenate(triangles)
    return Surface(every, np.ones(len(every), dtype=bool))


def inertia(size) -> np.ndarray:
    size = np.asarray(size)
    return DENSITY * np.prod(size) / 12 * np.diag(size @ size - size**2)


def test_a_closed_surface_is_exact():
    mass, how = mass_of(surface(box()))
    assert how == "mass from the surface"
    assert mass.mass == pytest.approx(DENSITY * np.prod(BOX))
    np.testing.assert_allclose(mass.centroid, BOX / 2)
    np.testing.assert_allclose(mass.inertia, inertia(BOX), rtol=1e-9, atol=1e-15)


def test_a_missing_face_hardly_matters():
    mass, how = mass_of(surface(box(faces=range(10))))
    assert how == "mass from the surface, filled with cubes"
    assert mass.mass == pytest.approx(DENSITY * np.prod(BOX), rel=0.02)
    np.testing.assert_allclose(mass.centroid, BOX / 2, atol=0.3 * MM)
    np.testing.assert_allclose(np.diag(mass.inertia), np.diag(inertia(BOX)), rtol=0.05)


def test_bodies_that_overlap_count_once():
    """Two boxes of which half is common: the theorem alone would count that twice."""
    mass, how = mass_of(surface(box(), box(low=(0.5 * BOX[0], 0, 0))))
    assert how == "mass from the surface, filled with cubes"
    assert mass.mass == pytest.approx(1.5 * DENSITY * np.prod(BOX), rel=0.02)
    np.testing.assert_allclose(mass.centroid, BOX * [0.75, 0.5, 0.5], atol=0.2 * MM)


def test_a_sheet_encloses_nothing_and_gets_an_estimate():
    mass, how = mass_of(surface(box(faces=(0, 1, 4, 5))))
    assert how == "mass estimated from the box"
    assert 0.0 < mass.mass < DENSITY * np.prod(BOX)
    assert np.linalg.eigvalsh(mass.inertia)[0] > 0.0


def test_big_parts_are_filled_with_larger_cubes():
    size = np.array([1.0, 1.0, 0.5])
    assert np.prod(size) / (0.8 * MM) ** 3 > 100 * MOST_CUBES
    mass, how = mass_of(surface(box(size=size, faces=range(10))))
    assert how.endswith("cubes")
    assert mass.mass == pytest.approx(DENSITY * np.prod(size), rel=0.03)


@pytest.mark.parametrize("number", ["32524", "3023b", "3701", "32184", "32013", "10197", "64179"])
def test_masses_of_known_parts(ldraw_library, number):
    """Plates, bricks and connectors, whose drawings overlap: the theorem alone is off by half."""
    from technic.ldraw.library import Library

    drawn = there(surface_of(Library.open(ldraw_library), number, fine=False))
    mass, _ = mass_of(drawn)
    known = there(catalogue().get(number)).mass_properties
    assert mass.mass == pytest.approx(known.mass, rel=0.1)
    np.testing.assert_allclose(mass.centroid, known.centroid, atol=0.5 * MM)
    np.testing.assert_allclose(
        np.linalg.eigvalsh(mass.inertia), np.linalg.eigvalsh(known.inertia), rtol=0.15
    )
