"""The surface of library parts, and definitions made from it."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from technic.errors import InputError
from technic.ldraw import triangles
from technic.ldraw.imported import definition_from_library
from technic.ldraw.library import Library
from technic.ldraw.triangles import Surface, surface_of
from technic.ldraw.weight import mass_of
from technic.parts.definition import RigidBody
from technic.parts.materials import material
from technic.units import LDU
from tests.ldraw.small_library import files_with, line, part, there, write_folder

CORNERS = [(x, y, z) for x in (-1, 1) for y in (-1, 1) for z in (-1, 1)]
FACES = [(0, 1, 3, 2), (4, 6, 7, 5), (0, 4, 5, 1), (2, 3, 7, 6), (0, 2, 6, 4), (1, 5, 7, 3)]
"""A cube of edge 2, counter-clockwise from outside."""


def polygons(clockwise: bool = False) -> str:
    """The cube as type 4 lines, one face as two triangles."""
    out = []
    for number, face in enumerate(FACES):
        corners = [CORNERS[k] for k in (reversed(face) if clockwise else face)]
        rows = [corners] if number else [corners[:3], [corners[0], *corners[2:]]]
        for row in rows:
            numbers = " ".join(str(value) for corner in row for value in corner)
            out.append(f"{len(row)} 16 {numbers}\r\n")
    return "".join(out)


CUBE = part(polygons())


@pytest.fixture
def library(tmp_path, monkeypatch):
    """Library with the given files."""
    monkeypatch.setenv("TECHNIC_CACHE", str(tmp_path / "cache"))

    def make(**parts: str) -> Library:
        files = {f"parts/{name}.dat": body for name, body in parts.items()}
        return Library.open(write_folder(tmp_path / "l", files_with(files)))

    return make


@pytest.fixture(scope="module")
def shared_library(ldraw_library, tmp_path_factory):
    """Technic subset of the official library."""
    with pytest.MonkeyPatch.context() as patch:
        patch.setenv("TECHNIC_CACHE", str(tmp_path_factory.mktemp("cache")))
        return Library.open(ldraw_library)


def volume_ldu(surface: Surface) -> float:
    """Enclosed volume in LDU^3."""
    return surface.integrals().volume / LDU**3


# --- windings ---------------------------------------------------------------------------------
MIRROR = (-1, 0, 0, 0, 1, 0, 0, 0, 1)
INVERT = "0 BFC INVERTNEXT\r\n"


@pytest.mark.parametrize(
    ("body", "volume"),
    [
        (CUBE, 8),
        (CUBE.replace("CERTIFY CCW", "CERTIFY CW"), -8),
        (part("0 BFC CW\r\n", polygons(clockwise=True)), 8),
        (part(line("cube.dat", matrix=(2, 0, 0, 0, 3, 0, 0, 0, 4))), 192),
        (part(line("cube.dat", (50, 0, 0), MIRROR)), 8),
        (part(INVERT, line("cube.dat")), -8),
        (part(INVERT, line("cube.dat", matrix=MIRROR)), -8),
        # INVERTNEXT holds for one line only
        (part(INVERT, line("cube.dat"), line("cube.dat", (9, 0, 0))), 0),
        (part(INVERT, line("hollow.dat")), 8),
    ],
)
def test_normals_point_outward(library, body, volume):
    known = library(x=body, cube=CUBE, hollow=part(INVERT, line("cube.dat")))
    assert volume_ldu(there(surface_of(known, "x"))) == pytest.approx(volume)


def test_uncertified_polygons_are_marked(library):
    known = library(x=part(line("cube.dat"), line("old.dat")), cube=CUBE, old=polygons())
    surface = there(surface_of(known, "x"))
    assert surface.triangles.shape == (24, 3, 3)
    assert surface.certified.sum() == 12
    assert not surface.triangles.flags.writeable


def test_a_moved_number_is_turned(library):
    stub = part(line("slab.dat", (0, 0, 5), (0, 0, -1, 0, 1, 0, 1, 0, 0)), title="~Moved to slab")
    slab = part(line("cube.dat", matrix=(5, 0, 0, 0, 1, 0, 0, 0, 1)))
    known = library(x=stub, slab=slab, cube=CUBE)
    surface = there(surface_of(known, "x"))
    np.testing.assert_allclose(surface.bounds / LDU, [[-1, -1, 0], [1, 1, 10]], atol=1e-9)
    assert volume_ldu(surface) == pytest.approx(40)


def test_missing_subfiles_are_named(library):
    known = library(x=part(line("gone.dat")))
    empty = there(surface_of(known, "x"))
    assert empty.missing == ("gone.dat",)
    np.testing.assert_array_equal(empty.bounds, np.zeros((2, 3)))
    assert surface_of(known, "y") is None


# --- limits -----------------------------------------------------------------------------------
def test_too_many_triangles_are_refused(library, monkeypatch):
    monkeypatch.setattr(triangles, "MAX_TRIANGLES", 50)
    many = part(*[line("cube.dat")] * 5)
    with pytest.raises(InputError, match="more than 50 triangles"):
        there(surface_of(library(x=many, cube=CUBE), "x"))
    with pytest.raises(InputError, match="more than 50 triangles"):
        there(surface_of(library(x=part(polygons() * 5)), "x"))


def test_a_file_that_includes_itself_is_refused(library):
    known = library(x=part(line("y.dat")), y=part(line("x.dat")))
    with pytest.raises(InputError, match="includes itself"):
        there(surface_of(known, "x"))


@pytest.mark.parametrize("text", ["3 16 0 0 0 1 1 1 2 2\r\n", "4 16 0 0 0 1 1 1 2 2 2 a b c\r\n"])
def test_broken_polygons_are_named(library, text):
    with pytest.raises(InputError, match=r"parts/x\.dat:5: a type . line needs"):
        there(surface_of(library(x=part(text)), "x"))


# --- integrals --------------------------------------------------------------------------------
@given(
    st.tuples(*[st.floats(0.5, 20)] * 3),
    st.tuples(*[st.floats(-50, 50)] * 3),
    st.floats(0, 6.3),
)
def test_integrals_of_a_turned_box(half, middle, angle):
    """Volume, centroid and second moments of a box, in closed form."""
    turn = np.array(
        [[np.cos(angle), -np.sin(angle), 0], [np.sin(angle), np.cos(angle), 0], [0, 0, 1]]
    )
    corners = np.array(CORNERS) * half @ turn.T + middle
    faces = np.array([[f[k] for k in pick] for f in FACES for pick in ((0, 1, 2), (0, 2, 3))])
    found = Surface(corners[faces], np.ones(12, dtype=bool)).integrals()
    volume = 8 * np.prod(half)
    moments = volume * (turn @ np.diag(np.square(half)) @ turn.T / 3 + np.outer(middle, middle))
    assert found.volume == pytest.approx(volume)
    assert found.gap < 1e-12
    np.testing.assert_allclose(found.centroid, middle, atol=1e-9)
    np.testing.assert_allclose(found.second_moments, moments, rtol=1e-9, atol=1e-7 * volume)


def test_volume_of_a_beam(shared_library):
    """The 48-sided primitives give a closed surface, and bores nearer to round ones."""
    coarse, fine = (there(surface_of(shared_library, "32523", fine=flag)) for flag in (False, True))
    assert fine.integrals().gap < 1e-5
    assert fine.certified.all()
    assert len(fine.triangles) > len(coarse.triangles)
    assert fine.integrals().volume == pytest.approx(coarse.integrals().volume, rel=0.02)
    np.testing.assert_allclose(fine.bounds / LDU, [[-9, -10, -29], [9, 10, 29]], atol=1e-3)


# --- definitions ------------------------------------------------------------------------------
def test_definition_of_a_beam(shared_library):
    beam = there(definition_from_library(shared_library, "32523"))
    assert (beam.id, beam.title, beam.family) == ("32523", "Technic Beam 3", "library")
    assert isinstance(beam.body, RigidBody)
    assert [port.name for port in beam.ports] == ["hole1", "hole2", "hole3"]
    assert not beam.fastener
    assert "mass from the surface" in beam.source
    mass = beam.mass_properties
    assert mass.mass == pytest.approx(0.7e-3, rel=0.03)  # 0.66 cm3 of ABS
    np.testing.assert_allclose(mass.centroid, 0, atol=1e-6)
    assert np.linalg.eigvalsh(mass.inertia)[0] > 0


@pytest.mark.parametrize(
    ("number", "fastener"),
    [
        *((n, True) for n in ("2780", "6558", "43093", "3705", "87083", "32054", "3713", "6577")),
        *((n, False) for n in ("32524", "6536", "48989", "15100", "3647", "59443", "3700")),
    ],
)
def test_fasteners_are_told_from_structure(shared_library, number, fastener):
    assert there(definition_from_library(shared_library, number)).fastener is fastener


def test_mass_of_a_cube(library):
    mass, how = mass_of(there(surface_of(library(cube=CUBE), "cube")))
    expected = material().density * (2 * LDU) ** 3
    assert how == "mass from the surface"
    assert mass.mass == pytest.approx(expected)
    np.testing.assert_allclose(mass.inertia, expected * (2 * LDU) ** 2 / 6 * np.eye(3), atol=1e-20)


def test_what_draws_nothing_has_no_mass(library):
    nothing, how = mass_of(there(surface_of(library(y=part()), "y")))
    assert (nothing.mass, how) == (0.0, "no surface, no mass")


def test_titles_lose_the_marks_of_the_library(library):
    known = library(a=part(CUBE, title="=Technic  Beam   3"))
    assert there(definition_from_library(known, "a.DAT")).title == "Technic Beam 3"
    assert definition_from_library(known, "b") is None
