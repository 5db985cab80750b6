"""Which joints the search finds, and of which type."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from technic.assembly.joint_types import JointType
from technic.assembly.model import FindingKind, Part
from technic.assembly.stiffness import default_table, read_table
from technic.errors import UsageError
from technic.geometry import Pose
from technic.ldraw.connect import connect
from technic.ldraw.matching import Limits
from technic.units import LDU
from tests.ldraw.bricks import (
    X,
    Y,
    Z,
    axle,
    axle_pin,
    beam,
    bush,
    define,
    pin,
    place,
    port,
    rotation,
    thin_beam,
    turn,
)

TABLE = default_table()


def joints_of(parts, **options):
    return connect(parts, TABLE, **options)[0]


def found_kinds(parts):
    return [finding.kind for finding in connect(parts, TABLE)[1]]


def keys(parts, **options):
    """What is joined to what, by which ports and how: everything but the numbers."""
    return sorted(
        (joint.parts, joint.ports, joint.type, joint.connection)
        for joint in joints_of(parts, **options)
    )


def square():
    """Four beams and four pins: the four-bar square."""
    upright = turn("x", "y")
    across = turn("z", "x")
    return [
        place(beam(5), [-40, 0, 0]),
        place(beam(5), [40, 0, 0]),
        place(beam(5), [0, -20, 40], across),
        place(beam(5), [0, -20, -40], across),
        *(place(pin(), [x, -10, z], upright) for x in (-40, 40) for z in (-40, 40)),
    ]


def test_two_beams_on_one_pin_are_two_hinges():
    parts = [
        place(beam(7), [0, 0, 0]),
        place(beam(7), [0, -20, 0]),
        place(pin(), [0, -10, 60], turn("x", "y")),
    ]
    joints = joints_of(parts)
    assert [joint.parts for joint in joints] == [(0, 2), (1, 2)]
    for joint, level in zip(joints, (0, -20), strict=True):
        assert joint.type is JointType.HINGE
        assert joint.connection == "pin/pin_hole"
        np.testing.assert_allclose(joint.point / LDU, [0, level, 60], atol=1e-9)
        np.testing.assert_allclose(np.abs(joint.axes[0]), Y, atol=1e-12)
        np.testing.assert_allclose(joint.axes @ joint.axes.T, np.eye(3), atol=1e-12)
        np.testing.assert_array_equal(joint.stiffness, [1e8, 65625, 65625, 0, 0.24, 0.24])
        np.testing.assert_array_equal(joint.held, [1, 1, 1, 0, 1, 1])
        assert joint.provenance == "paper"
        assert joint.ports[0] == "hole7"
        assert joint.id == f"{parts[joint.parts[0]].id}~{parts[2].id}@1"


def test_a_square_has_eight_hinges():
    assert len(joints_of(square())) == 8
    assert not found_kinds(square())


def test_a_long_pin_and_a_deep_hole_are_one_joint_at_their_common_middle():
    block = define(
        "block",
        "Block",
        [port("a", "pin_hole", [0, -10, 0], Y, 20), port("b", "pin_hole", [0, 10, 0], Y, 20)],
    )
    parts = [place(block, [0, 0, 0]), place(pin(3), [0, 10, 0], turn("x", "y"))]
    (joint,) = joints_of(parts)
    np.testing.assert_allclose(joint.point, 0.0, atol=1e-12)


def test_two_pins_from_two_sides_share_a_hole_but_two_in_one_place_do_not():
    half = define("half", "Half pin", [port("end", "pin", [5, 0, 0], X, 10)], fastener=True)
    upright = turn("x", "y")
    both = [
        place(beam(1), [0, 0, 0]),
        place(half, [0, -10, 0], upright),
        place(half, [0, 10, 0], -upright),
    ]
    assert len(joints_of(both)) == 2
    doubled = [place(beam(1), [0, 0, 0]), *(place(half, [0, -10, 0], upright) for _ in range(2))]
    joints, findings = connect(doubled, TABLE)
    assert [joint.parts for joint in joints] == [(0, 1)]
    assert any("already taken" in finding.message for finding in findings)


def test_thin_beams_share_one_pin_section():
    parts = [
        place(thin_beam(3), [0, 0, 0]),
        place(thin_beam(3), [0, 10, 0]),
        place(pin(), [0, 20, 0], turn("x", "y")),
    ]
    assert len(joints_of(parts)) == 2


def test_parallel_lines_between_two_parts_are_two_joints():
    double = define(
        "double",
        "Double pin",
        [port("a", "pin", [0, 0, 0], Y, 20), port("b", "pin", [0, 0, 20], Y, 20)],
        fastener=True,
    )
    joints = joints_of([place(beam(5), [0, 0, 0]), place(double, [0, 0, 0])])
    assert [joint.id[-2:] for joint in joints] == ["@1", "@2"]


@pytest.mark.parametrize(
    ("shift", "joined"), [(0.0, True), (4.4, True), (4.6, False), (10.0, False)]
)
def test_radial_limit(shift, joined):
    parts = [place(beam(3), [0, 0, 0]), place(pin(), [shift, 10, 0], turn("x", "y"))]
    joints, findings = connect(parts, TABLE)
    assert bool(joints) == joined
    if joined and shift:
        assert joints[0].offset == pytest.approx(shift * LDU)
        assert findings[0].kind is FindingKind.OFF_GRID
        assert findings[0].distance == pytest.approx(shift * LDU)


@pytest.mark.parametrize(("degrees", "joined"), [(4.9, True), (5.1, False)])
def test_angle_limit(degrees, joined):
    turned = rotation(Z, degrees) @ turn("x", "y")
    centre = np.array([0, 0, 0]) + turned @ [10, 0, 0]
    parts = [place(beam(3), [0, 0, 0]), place(pin(), centre, turned)]
    assert bool(joints_of(parts)) == joined


@pytest.mark.parametrize(("overlap", "joined"), [(3.9, False), (4.1, True)])
def test_axial_overlap(overlap, joined):
    parts = [place(beam(1), [0, 0, 0]), place(pin(), [0, 30 - overlap, 0], turn("x", "y"))]
    assert bool(joints_of(parts)) == joined


def test_a_short_feature_needs_three_quarters_of_its_length():
    stud = define("stud", "Stud", [port("stud", "stud", [0, 0, 0], Y, 4)])
    for enters, joined in ((2.9, False), (3.1, True)):
        parts = [place(beam(1), [0, 0, 0]), place(stud, [0, 12 - enters, 0])]
        assert bool(joints_of(parts)) == joined


def test_axle_in_axle_hole_is_fixed_or_slides():
    parts = [place(axle(4), [0, 0, 0]), place(bush(), [10, 0, 0], turn("z", "x"))]
    (joint,) = joints_of(parts)
    assert joint.type is JointType.FIXED
    assert joint.provenance == "assumed"
    (joint,) = joints_of(parts, axle_slide="free")
    assert joint.type is JointType.SLIDER
    np.testing.assert_array_equal(joint.held, [0, 1, 1, 1, 1, 1])
    assert joint.stiffness[0] == 0.0


def test_friction_in_the_table_holds_ridged_pins_only(tmp_path):
    path = tmp_path / "friction.toml"
    path.write_text(
        """
schema = "technic-stiffness/1"
[connection."pin/pin_hole"]
type = "hinge"
axial = { value = 1e8, provenance = "paper" }
shear = { value = 65625, provenance = "paper" }
tilt = { value = 0.24, provenance = "paper" }
spin = { value = 0.01, provenance = "assumed" }
""",
        encoding="utf-8",
    )
    smooth = define("smooth", "Smooth pin", [port("end", "pin", [0, 0, 0], Y, 20)], fastener=True)
    for kind, held in (
        (place(pin(1), [0, 0, 0], turn("x", "y")), True),
        (place(smooth, [0, 0, 0]), False),
    ):
        (joint,), _ = connect([place(beam(1), [0, 0, 0]), kind], read_table(path))
        assert bool(joint.held[3]) == held
        assert joint.stiffness[3] == (0.01 if held else 0.0)


def test_unknown_axle_slide_is_refused():
    with pytest.raises(UsageError, match="axle_slide"):
        connect([], TABLE, axle_slide="maybe")


def test_an_axle_through_both_kinds_of_hole_of_one_part_is_fixed_once():
    block = define(
        "block",
        "Block",
        [port("a", "pin_hole", [-20, 0, 0], X, 20), port("b", "axle_hole", [0, 0, 0], X, 20)],
    )
    (joint,) = joints_of([place(axle(4), [0, 0, 0]), place(block, [0, 0, 0])])
    assert joint.type is JointType.FIXED
    np.testing.assert_allclose(joint.point, 0.0, atol=1e-12)


def test_a_pin_does_not_fit_an_axle_hole():
    assert not joints_of([place(pin(), [0, 0, 0]), place(bush(), [10, 0, 0], turn("z", "x"))])


def test_axle_pin_joins_by_both_ends():
    parts = [
        place(axle_pin(), [0, 0, 0]),
        place(beam(1), [10, 0, 0], turn("y", "x")),
        place(bush(), [-10, 0, 0], turn("z", "x")),
    ]
    assert [joint.type for joint in joints_of(parts)] == [JointType.HINGE, JointType.FIXED]


def test_ball_in_socket():
    ball = define("ball", "Ball", [port("ball", "ball", [0, 0, 0], Y, 10)])
    socket = define("socket", "Link", [port("socket", "socket", [0, 0, 0], Z, 10)])
    (joint,) = joints_of([place(ball, [3, 0, 0]), place(socket, [0, 0, 0])])
    assert joint.type is JointType.BALL
    assert joint.offset == pytest.approx(3 * LDU)
    np.testing.assert_array_equal(joint.held, [1, 1, 1, 0, 0, 0])


def plate(kind, studs, name):
    axis = -Y if kind == "stud" else Y
    return define(
        name, name, [port(f"{kind}{k}", kind, [20 * k, 0, 0], axis, 4) for k in range(studs)]
    )


def test_one_stud_turns_and_several_hold():
    (one,) = joints_of(
        [place(plate("stud", 1, "s"), [0, 0, 0]), place(plate("tube", 1, "t"), [0, 0, 0])]
    )
    assert one.type is JointType.HINGE
    (two,) = joints_of(
        [place(plate("stud", 2, "s"), [0, 0, 0]), place(plate("tube", 2, "t"), [0, 0, 0])]
    )
    assert two.type is JointType.FIXED
    np.testing.assert_allclose(two.point / LDU, [10, 0, 0], atol=1e-9)
    # Two springs of 1e4 N/m, 4 mm to either side of the middle.
    assert two.stiffness[0] == pytest.approx(2e4)
    assert two.stiffness[3] == pytest.approx(2 * 1e4 * 0.004**2)
    tilts = sorted(two.stiffness[4:])
    assert tilts == pytest.approx([0.32, 0.32 + 2 * 1e4 * 0.004**2])
    # The stiff tilt is the one about the axis across the row.
    stiff = two.axes[4 - 3 + int(np.argmax(two.stiffness[4:]))]
    np.testing.assert_allclose(np.abs(stiff), Z, atol=1e-9)


def test_a_stud_does_not_enter_a_tube_from_behind():
    upside_down = np.diag([1.0, -1.0, -1.0])
    parts = [
        place(plate("stud", 2, "s"), [0, 0, 0], upside_down),
        place(plate("tube", 2, "t"), [0, 0, 0]),
    ]
    assert not joints_of(parts)


def test_no_parts_and_no_connections():
    assert connect([], TABLE) == ((), ())
    assert not joints_of([place(beam(3), [0, 0, 0]), place(beam(3), [500, 0, 0])])


def everything():
    """A model with one of each connection."""
    upright = turn("x", "y")
    return [
        *square(),
        place(axle(6), [0, -10, 40], upright),
        place(bush(), [0, -40, 40], turn("z", "y")),
        place(bush(), [0, 10, 40], turn("z", "y")),
        place(thin_beam(3), [-40, -40, 40]),
    ]


def test_radial_limits_from_half_to_seven_ldu_give_the_same_joints():
    reference = keys(everything())
    for offset in (0.5, 1, 2, 7):
        assert keys(everything(), limits=Limits(offset=offset * LDU)) == reference


@settings(max_examples=25, deadline=None)
@given(st.integers(0, 2**32 - 1))
def test_placement_noise_does_not_change_the_joints(seed):
    rng = np.random.default_rng(seed)
    parts = everything()
    assert keys([shaken(part, rng) for part in parts]) == keys(parts)


def shaken(part: Part, rng) -> Part:
    """Move a part by up to 0.03 LDU and turn it by 0.05 degrees."""
    from dataclasses import replace

    turned = rotation(rng.normal(size=3), 0.05) @ part.pose.rotation
    moved = part.pose.translation + rng.uniform(-0.03, 0.03, 3) * LDU
    return replace(part, pose=Pose(turned, moved))


@settings(max_examples=25, deadline=None)
@given(st.integers(0, 2**32 - 1))
def test_joints_move_with_the_model(seed):
    from dataclasses import replace

    rng = np.random.default_rng(seed)
    turned = rotation(rng.normal(size=3), rng.uniform(0, 360))
    if seed % 2:
        turned = turned @ np.diag([1.0, 1.0, -1.0])
    frame = Pose(turned, rng.uniform(-1, 1, 3))
    parts = everything()
    moved = [replace(part, pose=frame @ part.pose) for part in parts]
    assert keys(moved) == keys(parts)
    for before, after in zip(joints_of(parts), joints_of(moved), strict=True):
        np.testing.assert_allclose(frame.points(before.point), after.point, atol=1e-9)
        np.testing.assert_allclose(frame.directions(before.axes[0]), after.axes[0], atol=1e-9)


def test_order_of_the_parts_does_not_matter():
    parts = everything()
    order = np.random.default_rng(3).permutation(len(parts))
    mixed = [parts[k] for k in order]
    ids = {frozenset(parts[k].id for k in joint.parts) for joint in joints_of(parts)}
    assert {frozenset(mixed[k].id for k in joint.parts) for joint in joints_of(mixed)} == ids
