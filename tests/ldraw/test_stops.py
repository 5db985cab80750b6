"""When an axle is held along its bores, and on which side a stop is missing."""

from __future__ import annotations

import pytest

from technic.assembly.joint_types import JointType
from technic.assembly.stiffness import default_table
from technic.ldraw.connect import connect
from tests.ldraw.bricks import (
    X,
    axle,
    axle_pin,
    beam,
    bush,
    define,
    gear,
    place,
    port,
    turn,
)

ALONG = turn("z", "x")
"""Turns a bush or gear onto the x axis."""
ACROSS = turn("y", "x")
"""Turns a beam's bores onto the x axis."""


def bores(parts, **options):
    """Type and missing stop of each joint of an axle with a round bore; the axis is +x."""
    joints, _ = connect(parts, default_table(), **options)
    found = []
    for joint in joints:
        if joint.connection == "axle/pin_hole":
            side = joint.missing_stop
            if joint.axes[0] @ X < 0:
                side = {"+": "-", "-": "+"}.get(side, side)
            found.append((joint.type, side))
    return found


HELD = (JointType.HINGE, "")


def loose(side):
    return (JointType.CYLINDRICAL, side)


def frame(*positions):
    """Beams with one bore on the x axis, 20 LDU wide, at these places."""
    return [place(beam(1), [x, 0, 0], ACROSS) for x in positions]


def test_a_bare_axle_slides_both_ways():
    assert bores([place(axle(6), [0, 0, 0]), *frame(0)]) == [loose("both")]


def test_a_bush_on_one_side_leaves_the_other_open():
    parts = [place(axle(6), [0, 0, 0]), *frame(0)]
    assert bores([*parts, place(bush(), [20, 0, 0], ALONG)]) == [loose("-")]
    assert bores([*parts, place(bush(), [-20, 0, 0], ALONG)]) == [loose("+")]


def test_bushes_on_both_sides_of_one_beam():
    parts = [place(axle(6), [0, 0, 0]), *frame(0)]
    parts += [place(bush(), [x, 0, 0], ALONG) for x in (-20, 20)]
    assert bores(parts) == [HELD]


def test_bushes_on_the_far_sides_of_two_beams():
    parts = [place(axle(10), [0, 0, 0]), *frame(-40, 40)]
    parts += [place(bush(), [x, 0, 0], ALONG) for x in (-60, 60)]
    assert bores(parts) == [HELD, HELD]


def test_a_bush_between_two_beams_holds_both_ways():
    parts = [place(axle(10), [0, 0, 0]), *frame(-20, 20), place(gear(), [0, 0, 0], ALONG)]
    assert bores(parts) == [HELD, HELD]


def test_a_stack_of_touching_beams_passes_the_stop_on():
    parts = [place(axle(10), [0, 0, 0]), *frame(0, 20, 40)]
    parts += [place(bush(), [60, 0, 0], ALONG), place(bush(), [-20, 0, 0], ALONG)]
    assert bores(parts) == [HELD] * 3


@pytest.mark.parametrize(("gap", "held"), [(0.0, True), (0.9, True), (1.1, False), (10.0, False)])
def test_touch_ends_at_one_ldu(gap, held):
    parts = [place(axle(10), [0, 0, 0]), *frame(0)]
    parts += [place(bush(), [20 + gap, 0, 0], ALONG), place(bush(), [-20, 0, 0], ALONG)]
    assert bores(parts) == [HELD if held else loose("+")]


@pytest.mark.parametrize(("depth", "held"), [(2.0, True), (2.9, True), (4.0, False)])
def test_a_collar_may_sit_inside_the_counterbore(depth, held):
    collared = define(
        "collared",
        "Axle with a collar",
        [
            port("axle", "axle", [0, 0, 0], X, 120),
            port("collar", "stop", [10 + 2 - depth, 0, 0], X, 4),
        ],
        fastener=True,
    )
    parts = [place(collared, [0, 0, 0]), *frame(0), place(bush(), [-20, 0, 0], ALONG)]
    assert bores(parts) == [HELD if held else loose("+")]


def test_an_axle_with_a_stop_needs_a_bush_only_on_the_other_side():
    stopped = place(axle(4, stop=True), [0, 0, 0])  # from -40 to 40, collar from -40 to -36
    parts = [stopped, *frame(-26)]
    assert bores(parts) == [loose("+")]
    assert bores([*parts, place(bush(), [-6, 0, 0], ALONG)]) == [HELD]


def test_a_collar_flush_with_the_face_of_its_hole_is_a_stop():
    stopped = place(axle(4, stop=True), [0, 0, 0])
    parts = [stopped, *frame(-30)]  # bore from -40 to -20, collar from -40 to -36
    assert bores(parts) == [loose("both")]
    thin = define(
        "thin",
        "Axle with a collar",
        [port("axle", "axle", [0, 0, 0], X, 80), port("collar", "stop", [-39, 0, 0], X, 2)],
        fastener=True,
    )
    assert bores([place(thin, [0, 0, 0]), *frame(-30)]) == [loose("+")]


def test_the_pin_end_of_an_axle_pin_is_a_stop():
    parts = [place(axle_pin(), [0, 0, 0]), *frame(10, -10)]
    assert bores(parts) == [loose("-")]


def test_axles_in_a_joiner_share_their_stops():
    joiner = define(
        "joiner", "Joiner", [port("hole", "axle_hole", [0, 0, 0], X, 40)], fastener=True
    )
    parts = [
        place(axle(4), [-40, 0, 0]),
        place(axle(4), [40, 0, 0]),
        place(joiner, [0, 0, 0]),
        *frame(-50, 50),
        place(bush(), [-70, 0, 0], ALONG),
        place(bush(), [70, 0, 0], ALONG),
    ]
    assert bores(parts) == [HELD, HELD]
    without = [*parts[:2], *parts[3:]]
    assert bores(without) == [loose("+"), loose("-")]


def test_a_gripping_part_on_another_line_is_no_stop():
    parts = [place(axle(6), [0, 0, 0]), *frame(0), place(bush(), [20, 20, 0], ALONG)]
    assert bores(parts) == [loose("both")]


def test_bushes_that_may_slide_are_no_stops():
    parts = [place(axle(4, stop=True), [0, 0, 0]), *frame(-26), place(bush(), [-6, 0, 0], ALONG)]
    assert bores(parts, axle_slide="free") == [loose("+")]


def test_the_side_follows_the_axis_of_the_bore():
    flipped = turn("y", "x") @ turn("x", "y") @ turn("x", "y")  # bore axis along -x
    parts = [
        place(axle(6), [0, 0, 0]),
        place(beam(1), [0, 0, 0], flipped),
        place(bush(), [20, 0, 0], ALONG),
    ]
    (joint,) = (j for j in connect(parts, default_table())[0] if j.connection == "axle/pin_hole")
    assert joint.axes[0] @ X == pytest.approx(-1.0)
    assert joint.missing_stop == "+"
