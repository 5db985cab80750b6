"""Places for beams, on arrangements of two or three parts that one can check by hand."""

from __future__ import annotations

import numpy as np
import pytest

from technic.design.candidates import EXACT, candidates
from technic.errors import UsageError
from technic.units import LDU, MM
from tests.design.made import ALONG_X, ALONG_Z, PIN_Y, build, from_text


def ends(candidate):
    """Places of the pinned holes (LDU), sorted."""
    return sorted(tuple(round(v / LDU, 3) + 0.0 for v in a.point) for a in candidate.attachments)


def test_two_parallel_beams_are_bridged_by_every_beam_that_reaches():
    # two 5L beams side by side, 4L apart: a 5L beam across lies on any of five rows, above or below
    assembly = build(f"0 0 0 {ALONG_Z} 32316", f"80 0 0 {ALONG_Z} 32316")
    found = candidates(assembly, lengths=[5], bent=False)
    across = {tuple(ends(c)) for c in found if len({p[2] for p in ends(c)}) == 1}
    assert across == {
        ((0.0, y, z), (80.0, y, z)) for y in (-20.0, 20.0) for z in (-40.0, -20.0, 0.0, 20.0, 40.0)
    }


def test_three_four_five():
    # 3 across and 4 along make 5: a beam with six holes would do, the shortest there is has seven
    assembly = build(f"0 0 0 {ALONG_Z} 32316", f"60 0 0 {ALONG_Z} 32316")
    found = candidates(assembly, lengths=[7], bent=False)
    slanted = [c for c in found if len({p[2] for p in ends(c)}) == 2]
    assert slanted
    for candidate in slanted:
        (x0, _, z0), (x1, _, z1) = ends(candidate)
        assert {abs(x1 - x0), abs(z1 - z0)} == {60.0, 80.0}
        assert candidate.mismatch < 1e-9
    # each diagonal in two positions (one hole to spare), above and below
    assert len(slanted) == 8


def test_a_pin_ends_flush_so_a_longer_one_takes_its_place():
    assembly = build(
        f"0 0 0 {ALONG_Z} 32316", f"0 -20 0 {ALONG_X} 32316", f"0 -10 0 {PIN_Y} 2780",
        f"80 0 0 {ALONG_Z} 32316",
    )  # fmt: skip
    kinds = {
        (a.fastening.kind, a.fastening.pin)
        for c in candidates(assembly, lengths=[5], bent=False)
        for a in c.attachments
    }
    assert ("exchange", "6558") in kinds
    for candidate in candidates(assembly, lengths=[5], bent=False):
        for a in candidate.attachments:
            if a.fastening.kind == "exchange":
                assert a.fastening.old_pin == 2
                assert a.fastening.parts == (0, 1)
                assert a.point[1] / LDU == pytest.approx(-40.0, abs=1e-6) or a.point[
                    1
                ] / LDU == pytest.approx(20.0, abs=1e-6)


def test_the_open_end_of_a_pin_is_used_as_it_is():
    assembly = build(
        f"0 0 0 {ALONG_Z} 32316", f"0 -10 0 {PIN_Y} 2780", f"80 0 0 {ALONG_Z} 32316",
        f"80 -10 0 {PIN_Y} 2780",
    )  # fmt: skip
    found = [
        c
        for c in candidates(assembly, lengths=[5], bent=False)
        if all(a.fastening.kind == "present" for a in c.attachments)
    ]
    assert [ends(c) for c in found] == [[(0.0, -20.0, 0.0), (80.0, -20.0, 0.0)]]
    assert found[0].fasteners == 0


def test_snug_is_a_class_of_its_own():
    # 0.3 LDU off the grid: each end misses by half of it, 0.06 mm
    assembly = build(f"0 0 0 {ALONG_Z} 32316", f"80.3 0 0 {ALONG_Z} 32316")
    assert candidates(assembly, lengths=[5], bent=False) == []
    snug = candidates(assembly, lengths=[5], bent=False, snug=0.1 * MM)
    assert snug
    for candidate in snug:
        assert candidate.snug
        assert EXACT < candidate.mismatch <= 0.1 * MM
        assert candidate.mismatch == pytest.approx(0.15 * LDU, rel=1e-6)


def test_excluded_parts_are_left_alone():
    assembly = build(
        f"0 0 0 {ALONG_Z} 32316", f"80 0 0 {ALONG_Z} 32316", f"-80 0 0 {ALONG_Z} 32316"
    )
    assert any(1 in c.parts for c in candidates(assembly))
    assert not any(1 in c.parts for c in candidates(assembly, exclude=frozenset({1})))


def test_every_hole_of_a_bent_beam_meets_its_site():
    assembly = build(f"0 0 0 {ALONG_Z} 40490", f"40 0 -100 {ALONG_X} 40490")
    found = candidates(assembly, lengths=[15], bent=True)
    assert {c.number for c in found} >= {"32526", "32140"}
    for candidate in found:
        holes = [p for p in candidate.definition.ports if p.kind == "pin_hole"]
        assert np.linalg.det(candidate.pose.rotation) == pytest.approx(1.0)
        for a in candidate.attachments:
            world = candidate.pose.points(holes[a.hole].position)
            assert np.allclose(world, a.point, atol=1e-9)
            assert np.linalg.norm(np.subtract(a.point, a.line_point)) <= EXACT
            axis = candidate.pose.directions(holes[a.hole].axis)
            assert abs(axis @ candidate.axis) == pytest.approx(1.0)


def test_no_beam_is_offered_twice():
    assembly = build(
        f"0 0 0 {ALONG_Z} 32316", f"80 0 0 {ALONG_Z} 32316", f"40 0 60 {ALONG_X} 40490"
    )
    found = candidates(assembly)
    places = set()
    for c in found:
        holes = [p.position for p in c.definition.ports if p.kind == "pin_hole"]
        world = (c.pose.points(np.array(holes)) / LDU).round(3) + 0.0
        places.add((c.number, frozenset(map(tuple, world))))
    assert len(places) == len(found)


def test_lengths_that_do_not_exist_are_refused():
    with pytest.raises(UsageError, match="no straight beam with 6 holes"):
        candidates(build(f"0 0 0 {ALONG_Z} 32316"), lengths=[6])


def test_a_pin_line_that_other_places_share_is_not_exchanged():
    """A submodel used twice has one line for two pins: exchanging one would exchange both."""
    text = (
        "0 FILE main.ldr\n1 7 0 0 0 1 0 0 0 1 0 0 0 1 corner.ldr\n"
        "1 7 200 0 0 1 0 0 0 1 0 0 0 1 corner.ldr\n"
        f"1 7 80 0 0 {ALONG_Z} 32316.dat\n"
        "0 NOFILE\n0 FILE corner.ldr\n"
        f"1 7 0 0 0 {ALONG_Z} 32316.dat\n1 7 0 -20 0 {ALONG_X} 32316.dat\n"
        f"1 7 0 -10 0 {PIN_Y} 2780.dat\n0 NOFILE\n"
    )
    assembly = from_text(text)
    found = candidates(assembly)
    assert found
    assert all(a.fastening.kind != "exchange" for c in found for a in c.attachments)
