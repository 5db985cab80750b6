"""What counts as in the way: shrunk solids, full containment, pins on their way in."""

from __future__ import annotations

import numpy as np
import pytest

from technic.design.collide import (
    PLAY,
    Surroundings,
    overlap,
    pin_length,
    push_side,
    solid_overlaps,
    surface_within,
)
from technic.geometry import Pose
from technic.parts.catalogue import catalogue
from technic.parts.shapes import mesh
from technic.units import LDU, PITCH
from tests.design.made import ALONG_Z, SQUARE, build

BEAM = catalogue().get("32316")


def at(x, y, z):
    """A pose along z (LDU)."""
    return Pose(np.eye(3), np.array([x, y, z]) * LDU)


@pytest.mark.parametrize("number", ["32316", "32526", "32348", "2780", "6558"])
def test_a_shrunk_part_is_smaller_by_the_play_on_every_face(number):
    definition = catalogue().get(number)
    whole, small = mesh(definition), surface_within(definition, PLAY)
    assert small.is_watertight
    # a corner of a slotted barrel goes back along both of its faces: a little further
    for lost in (small.bounds[0] - whole.bounds[0], whole.bounds[1] - small.bounds[1]):
        assert (lost > 0.9 * PLAY).all()
        assert (lost < 1.5 * PLAY).all()
    # what is lost is about the surface times the play
    share = (whole.volume - small.volume) / (whole.area * PLAY)
    assert 0.7 < share < 1.1


def test_faces_that_touch_do_not_collide_and_overlaps_do():
    surroundings = Surroundings(build(f"0 0 0 {ALONG_Z} 32316").parts)
    assert surroundings.hits(BEAM, at(0, -20, 0), ()) == []  # flush on top
    assert surroundings.hits(BEAM, at(20, 0, 0), ()) == []  # side by side
    assert surroundings.hits(BEAM, at(0, -19, 0), ()) == [0]
    assert surroundings.hits(BEAM, at(10, 0, 0), ()) == [0]
    assert surroundings.hits(BEAM, at(10, 0, 0), {0}) == []


def test_a_part_inside_another_is_found_although_no_surfaces_cross():
    assembly = build(f"0 0 0 {ALONG_Z} 32316", f"0 0 0 {ALONG_Z} 32316")
    first, second = assembly.parts
    volume = mesh(BEAM).volume
    assert overlap(first, second) == pytest.approx(surface_within(BEAM, PLAY).volume, rel=1e-3)
    assert 0.5 * volume < overlap(first, second) < volume
    assert [found[:2] for found in solid_overlaps(assembly, [1])] == [(second.id, first.id)]


def test_joined_parts_do_not_count_and_each_pair_counts_once():
    assert solid_overlaps(build(*SQUARE), range(8)) == []
    twice = build(*SQUARE, SQUARE[0])
    assert len(solid_overlaps(twice, range(9))) >= 1
    pairs = [frozenset(found[:2]) for found in solid_overlaps(twice, range(9))]
    assert len(set(pairs)) == len(pairs)


def test_a_pin_goes_in_from_the_free_side():
    axis = np.array([0.0, 1.0, 0.0])
    middle = np.array([0.0, -10.0, 0.0]) * LDU
    free = Surroundings(build(f"0 0 0 {ALONG_Z} 32316", f"0 -20 0 {ALONG_Z} 32316").parts)
    assert push_side(free, middle, axis, 2 * PITCH, ()) == 1
    blocked = Surroundings(
        build(
            f"0 0 0 {ALONG_Z} 32316", f"0 -20 0 {ALONG_Z} 32316", f"10 40 0 {ALONG_Z} 40490"
        ).parts
    )
    assert push_side(blocked, middle, axis, 2 * PITCH, ()) == -1
    both = Surroundings(
        build(
            f"0 0 0 {ALONG_Z} 32316",
            f"0 -20 0 {ALONG_Z} 32316",
            f"10 40 0 {ALONG_Z} 40490",
            f"10 -60 0 {ALONG_Z} 40490",
        ).parts
    )
    assert push_side(both, middle, axis, 2 * PITCH, ()) == 0


def test_length_of_pins():
    assert pin_length("2780") == pytest.approx(2 * PITCH)
    assert pin_length("6558") == pytest.approx(3 * PITCH)
