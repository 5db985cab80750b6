"""Places for studs under parts without tubes."""

from __future__ import annotations

import numpy as np
import pytest

from technic.geometry import readonly
from technic.ldraw.library import Library
from technic.ldraw.triangles import Surface, surface_of
from technic.ldraw.undersides import stud_places
from technic.units import LDU
from tests.ldraw.small_library import there


def box(low, high) -> list[np.ndarray]:
    """The twelve triangles of a box (LDU)."""
    low, high = np.array(low, dtype=float), np.array(high, dtype=float)
    out = []
    for axis in range(3):
        u, v = (axis + 1) % 3, (axis + 2) % 3
        for side in (low, high):
            corners = np.tile(side, (4, 1))
            corners[:, u] = [low[u], high[u], high[u], low[u]]
            corners[:, v] = [low[v], low[v], high[v], high[v]]
            out += [corners[[0, 1, 2]], corners[[0, 2, 3]]]
    return out


def surface(*boxes) -> Surface:
    triangles = np.array([t for low, high in boxes for t in box(low, high)]) * LDU
    return Surface(readonly(triangles), readonly(np.ones(len(triangles)), dtype=np.bool_), ())


def tile(length: int, *, closed: bool = False):
    """A tile 1 x length, 8 high: a roof of 4 over walls of 4; the bottom is at y = 8."""
    half = 10 * length
    walls = [
        ((-half, 4, -10), (half, 8, -6)),
        ((-half, 4, 6), (half, 8, 10)),
        ((-half, 4, -10), (-half + 4, 8, 10)),
        ((half - 4, 4, -10), (half, 8, 10)),
    ]
    inside = [((-half, 4, -10), (half, 8, 10))] if closed else walls
    return surface(((-half, 0, -10), (half, 4, 10)), *inside)


@pytest.mark.parametrize("length", [1, 2, 4])
def test_a_tile_has_a_place_for_each_stud(length):
    places = stud_places(tile(length))
    assert len(places) == length
    middles = sorted(port.position[0] / LDU for port in places)
    assert middles == pytest.approx([20 * (k - (length - 1) / 2) for k in range(length)])
    for port in places:
        assert port.position[1] / LDU == pytest.approx(6.0)
        assert port.axis.tolist() == [0, 1, 0]


def test_a_closed_bottom_has_none():
    assert stud_places(tile(2, closed=True)) == ()


def test_a_footprint_off_the_grid_or_a_thin_sheet_has_none():
    assert stud_places(surface(((0, 0, 0), (27, 8, 20)))) == ()
    assert stud_places(surface(((0, 0, 0), (20, 1, 20)))) == ()
    assert stud_places(surface(((0, 0, 0), (4000, 8, 4000)))) == ()


def test_a_roof_on_legs_at_its_corners_only_holds_no_stud():
    legs = [((x, 4, z), (x + 2, 8, z + 2)) for x in (-10, 8) for z in (-10, 8)]
    assert stud_places(surface(((-10, 0, -10), (10, 4, 10)), *legs)) == ()


@pytest.mark.parametrize(
    ("number", "places"), [("3070b", 1), ("3069b", 2), ("2431", 4), ("54200", 1), ("3937", 2)]
)
def test_real_parts(shared, number, places):
    library = Library.open(shared / "ldraw" / "ldraw-technic-2026-02.zip")
    assert len(stud_places(there(surface_of(library, number, fine=False)))) == places


def test_a_beam_has_none(shared):
    library = Library.open(shared / "ldraw" / "ldraw-technic-2026-02.zip")
    assert stud_places(there(surface_of(library, "32316", fine=False))) == ()
