"""Parts that belong to each other without a connector: tyres and turntables."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from technic.assembly.joint_types import JointType
from technic.assembly.stiffness import default_table
from technic.ldraw.connect import connect
from technic.parts.definition import MassProperties
from technic.units import LDU
from tests.ldraw.bricks import Z, beam, define, place, port, rotation, turn


def tyre():
    """Return a tyre about z: its inertia says so."""
    ring = MassProperties(5e-3, np.zeros(3), np.diag([1.0, 1.0, 1.8]) * 1e-6)
    plain = define("61481", "Tyre 26/ 24 x 30", [])
    return replace(plain, family="tyre", mass_properties=ring)


def rim():
    """Return a rim about z, its axle hole off the middle."""
    return define("56145", "Wheel Rim 20 x 30", [port("hole", "axle_hole", [0, 0, -10], Z, 20)])


def half(number):
    """Return half a turntable about y."""
    side = [port("hole", "pin_hole", [20, 20 if number == "99009" else -20, 0], Z, 20)]
    return define(number, "Technic Turntable 28 Tooth", side)


def joints_of(parts):
    return connect(parts, default_table())[0]


def test_a_tyre_is_fixed_to_its_rim():
    turned = turn("z", "x")
    parts = [place(tyre(), [100, 0, 0], turned), place(rim(), [100, 0, 0], turned)]
    (joint,) = joints_of(parts)
    assert joint.type is JointType.FIXED
    assert joint.connection == "tyre/rim"
    assert joint.parts == (0, 1)
    np.testing.assert_allclose(joint.point / LDU, [100, 0, 0], atol=1e-9)
    np.testing.assert_allclose(np.abs(joint.axes[0]), [1, 0, 0], atol=1e-9)


def test_a_tyre_takes_the_rim_it_sits_on():
    parts = [place(tyre(), [0, 0, 2]), place(rim(), [0, 0, 18]), place(rim(), [0, 0, 0])]
    assert [joint.parts for joint in joints_of(parts)] == [(0, 2)]


def test_two_tyres_take_two_rims():
    parts = [place(kind(), [0, 0, z], rotation(Z, 31)) for kind in (tyre, rim) for z in (0, 40)]
    assert [joint.parts for joint in joints_of(parts)] == [(0, 2), (1, 3)]


@pytest.mark.parametrize("position", [[0, 0, 25], [10, 0, 0]], ids=["further along", "beside"])
def test_a_tyre_elsewhere_is_loose(position):
    assert not joints_of([place(tyre(), position), place(rim(), [0, 0, 0])])


def test_a_tyre_across_is_loose():
    assert not joints_of([place(tyre(), [0, 0, 0], turn("z", "x")), place(rim(), [0, 0, 0])])


def test_the_halves_of_a_turntable_turn():
    parts = [
        place(half("99009"), [20, -20, -80]),
        place(half("99010"), [20, -20, -80], turn("z", "x")),
        place(beam(3), [0, 500, 0]),
    ]
    (joint,) = joints_of(parts)
    assert joint.type is JointType.HINGE
    assert joint.connection == "turntable/turntable"
    np.testing.assert_allclose(np.abs(joint.axes[0]), [0, 1, 0], atol=1e-9)


def test_two_equal_halves_are_no_turntable():
    assert not joints_of([place(half("99009"), [0, 0, 0]), place(half("99009"), [0, 0, 0])])


# --- differentials ------------------------------------------------------------------------------
def casing():
    """Return a differential's casing about z, with bores at its ends."""
    ends = [port(f"end{k}", "pin_hole", [0, 0, z], Z, 10) for k, z in enumerate((-25, 25))]
    return replace(define("62821", "Differential", ends), family="differential")


def planet():
    """Return a gear about z."""
    return define("6589", "Gear 12 Tooth Bevel", [port("hole", "axle_hole", [0, 0, 0], Z, 10)])


@pytest.mark.parametrize("side", [-12, 12])
def test_planet_gears_turn_on_the_stubs_of_their_casing(side):
    parts = [place(casing(), (0, 0, 0)), place(planet(), (side, 0, 0), turn("z", "x"))]
    (joint,) = joints_of(parts)
    assert joint.connection == "planet/differential"
    assert joint.type is JointType.HINGE
    assert abs(joint.axes[0] @ [1, 0, 0]) == pytest.approx(1.0)


@pytest.mark.parametrize(
    ("at", "along"),
    [((0, 0, 12), "z"), ((12, 6, 0), "x"), ((60, 0, 0), "x"), ((12, 0, 40), "x")],
)
def test_gears_elsewhere_are_no_planets(at, along):
    assert joints_of([place(casing(), (0, 0, 0)), place(planet(), at, turn("z", along))]) == ()


# --- gearboxes ------------------------------------------------------------------------------------
def ring():
    """Return a driving ring about z, which has no connector."""
    return define("18947", "Technic Transmission Driving Ring 3L", [])


def joiner():
    """Return the ridged joiner that a driving ring sits on, about z."""
    ends = [port(f"end{k}", "axle_hole", [0, 0, z], Z, 28) for k, z in enumerate((-16, 16))]
    return define("18948", "Technic Axle Joiner 3L with Ridges for Driving Ring", ends)


def clutch():
    """Return a gear with a clutch: it turns on its shaft."""
    bore = port("hole", "pin_hole", [0, 0, 0], Z, 20)
    return define("18946", "Technic Gear 16 Tooth with Clutch on Both Sides", [bore])


@pytest.mark.parametrize(("shift", "driven"), [(-10, (1, 2)), (0, None), (10, (1, 3))])
def test_a_driving_ring_is_on_its_joiner_and_in_the_gear_that_it_drives(shift, driven):
    parts = [
        place(joiner(), (0, 0, 0)),
        place(ring(), (0, 0, shift)),
        place(clutch(), (0, 0, -40)),
        place(clutch(), (0, 0, 40)),
    ]
    joints = {joint.connection: joint for joint in joints_of(parts)}
    assert joints["driving ring/joiner"].type is JointType.FIXED
    assert joints["driving ring/joiner"].parts == (0, 1)
    dogs = joints.get("driving ring/clutch")
    assert (None if dogs is None else dogs.parts) == driven
    if dogs is not None:
        assert dogs.type is JointType.SLIDER
        assert abs(dogs.axes[0] @ [0, 0, 1]) == pytest.approx(1.0)


def test_a_ring_elsewhere_drives_nothing():
    beside = [place(joiner(), (0, 0, 0)), place(ring(), (20, 0, 0)), place(clutch(), (0, 0, 30))]
    assert joints_of(beside) == ()
    across = [place(joiner(), (0, 0, 0)), place(ring(), (0, 0, 0), turn("z", "x"))]
    assert joints_of(across) == ()
    slipping = define(
        "76244", "Gear 24 Tooth Clutch", [port("hole", "axle_hole", [0, 0, 0], Z, 20)]
    )
    assert joints_of([place(ring(), (0, 0, 0)), place(slipping, (0, 0, 20))]) == ()


# --- hinges ---------------------------------------------------------------------------------------
def half_hinge(number, title="Hinge"):
    """Return a half without connectors."""
    return define(number, title, [])


@pytest.mark.parametrize("top", ["3938", "6134"])
@pytest.mark.parametrize("angle", [0, 35, 90])
def test_a_hinge_brick_turns_about_its_knuckles(top, angle):
    knuckle = np.array([0, 10, 0])
    turned = rotation([1, 0, 0], angle)
    base = place(half_hinge("3937"), (0, 0, 0))
    parts = [base, place(half_hinge(top), knuckle - turned @ knuckle, turned)]
    (joint,) = joints_of(parts)
    assert joint.type is JointType.HINGE
    assert joint.connection == "hinge/hinge"
    np.testing.assert_allclose(joint.point / LDU, knuckle, atol=1e-9)
    np.testing.assert_allclose(np.abs(joint.axes[0]), [1, 0, 0], atol=1e-9)
    shifted = [base, place(half_hinge(top), knuckle - turned @ knuckle + [20, 0, 0], turned)]
    assert not joints_of(shifted)


def test_click_hinges_take_a_finger_between_two():
    bucket, arm = half_hinge("30394"), half_hinge("30552")
    (joint,) = joints_of([place(arm, (0, 0, 0)), place(bucket, (0, 0, -10))])
    assert joint.connection == "hinge/hinge"
    assert not joints_of([place(arm, (0, 0, 0)), place(arm, (0, 0, 0))])
    assert not joints_of([place(arm, (0, 0, 0)), place(half_hinge("3937"), (0, -10, -10))])


def test_each_half_is_in_one_hinge():
    bases = [place(half_hinge("3937"), (x, 0, 0)) for x in (0, 1)]
    tops = [place(half_hinge("3938"), (x, 0, 0)) for x in (0, 1)]
    assert sorted(j.parts for j in joints_of([*bases, *tops])) == [(0, 2), (1, 3)]
