"""Parts that are not one rigid body: motors, actuators, shock absorbers, universal joints."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from technic.assembly.joint_types import JointType
from technic.assembly.model import FindingKind, Part
from technic.errors import SchemaError, UsageError
from technic.geometry import Pose
from technic.groups import connected_groups
from technic.ldraw.gears import find_meshes
from technic.ldraw.imported import definition_from_library
from technic.ldraw.inner import divide
from technic.ldraw.library import Library
from technic.ldraw.reader import load_ldraw
from technic.ldraw.teeth import gears_of
from technic.parts.catalogue import catalogue
from technic.parts.inner import inner_parts, parse_inner
from technic.rigidity.analyze import analyze
from technic.units import LDU
from tests.ldraw.bricks import rotation

KNOWN = sorted(number for number in inner_parts() if catalogue().get(number) is not None)


def placed(number: str, pose: Pose | None = None) -> Part:
    definition = catalogue().get(number)
    assert definition is not None
    return Part(
        f"m/1:{number}",
        number,
        definition.title,
        pose or Pose.identity(),
        definition.ports,
        definition.body,
        definition.mass_properties,
        definition=definition,
    )


@pytest.mark.parametrize("number", KNOWN)
def test_every_part_of_the_catalogue_divides_and_loses_nothing(number):
    part = placed(number)
    whole = divide([part], "free")
    bodies = inner_parts()[number].bodies
    assert len(whole.parts) == 1 + len(bodies), "a stretch catches no connector, or all of them"
    rest, *pieces = whole.parts
    assert rest.id == part.id
    assert [piece.id for piece in pieces] == [f"{part.id}#{body.name}" for body in bodies]
    names = [port.name for piece in whole.parts for port in piece.ports]
    assert sorted(names) == sorted(port.name for port in part.ports)
    masses = [p.mass_properties for p in whole.parts]
    assert sum(m.mass for m in masses) == pytest.approx(part.mass_properties.mass)
    balance = sum(m.mass * m.centroid for m in masses) / part.mass_properties.mass
    assert balance == pytest.approx(part.mass_properties.centroid)
    hung = [joint for joint in whole.joints if joint.parts[0] == 0]
    assert [joint.parts for joint in hung] == [(0, k + 1) for k in range(len(bodies))]
    for joint in whole.joints:
        assert (joint.stiffness[joint.held] > 0.0).all()


@pytest.mark.slow
def test_every_part_of_the_table_divides_as_the_library_draws_it(ldraw_library):
    library = Library.open(ldraw_library)
    looked = 0
    for number, entry in inner_parts().items():
        definition = definition_from_library(library, number)
        if definition is None:
            continue
        part = Part(
            "p",
            number,
            definition.title,
            Pose.identity(),
            definition.ports,
            definition.body,
            definition.mass_properties,
            definition=definition,
        )
        whole = divide([part], "free")
        assert len(whole.parts) == 1 + len(entry.bodies), (number, definition.title)
        joined = connected_groups(range(len(whole.parts)), (j.parts for j in whole.joints))
        assert len(joined) == 1
        looked += 1
    assert looked > 60


def test_a_motor_holds_unless_it_is_free():
    held, free = divide([placed("95658")]), divide([placed("95658")], "free")
    assert (len(held.parts), len(held.joints)) == (1, 0)
    assert "--inner free" in held.findings[0].message
    assert len(free.parts[1].ports) == 11
    assert free.joints[0].type is JointType.HINGE


def test_the_joint_turns_with_the_part():
    pose = Pose(rotation([1, 2, 3], 0.7), np.array([0.1, 0.2, 0.3]))
    (joint,) = divide([placed("95658", pose)], "free").joints
    assert joint.axes[0] == pytest.approx(pose.directions(np.array([1.0, 0.0, 0.0])))
    assert joint.point == pytest.approx(pose.translation)


def test_a_shock_absorber_is_a_spring_with_a_stated_stiffness():
    whole = divide([placed("41838")])
    (joint,) = whole.joints
    assert joint.stiffness[0] == 500.0
    assert "not measured" in joint.provenance
    assert joint.held.tolist() == [True, True, True, False, True, True]


def test_a_universal_joint_passes_its_turning_on_and_bends():
    (joint,) = divide([placed("61903")]).joints
    assert joint.type is JointType.UNIVERSAL
    assert abs(joint.axes[0] @ [0, 0, 1]) == pytest.approx(1.0)


def test_parts_that_are_rigid_stay_as_they_are():
    part = placed("32316")
    whole = divide([part], "free")
    assert whole.parts == (part,)
    assert not whole.joints
    assert not whole.findings


def test_a_robot_with_motors_free_gains_one_motion_for_each(model):
    held, free = (load_ldraw(model("fll_robot.mpd"), inner=inner) for inner in ("held", "free"))
    motors = [f for f in held.findings if f.kind is FindingKind.INNER]
    assert len(motors) == 4
    assert len(free.parts) == len(held.parts) + 4
    before, after = analyze(held, parts="rigid"), analyze(free, parts="rigid")
    assert before.mobility.total == 97
    assert after.mobility.total == 97 + 4


ARM = """0 Arm
1 71 0 0 0 1 0 0 0 1 0 0 0 1 61927.dat
1 0 {x} 0 190 1 0 0 0 1 0 0 0 1 3673.dat
"""


def test_an_actuator_holds_or_slides(tmp_path):
    path = tmp_path / "arm.ldr"
    path.write_text(ARM.format(x=0))
    held, free = (load_ldraw(path, inner=inner) for inner in ("held", "free"))
    totals = [analyze(assembly, parts="rigid").mobility.total for assembly in (held, free)]
    # The rod turns, and it slides as its input turns.
    assert totals[1] == totals[0] + 2
    assert sum(joint.type is JointType.MESH for joint in free.joints) == 1
    # An input that cannot turn holds the rod: welded to the housing, it only turns about itself.
    file = tmp_path / "o.toml"
    names = [part.id for part in free.parts]
    file.write_text(
        f'schema = "technic-overrides/1"\n[[weld]]\nparts = ["{names[0]}", "{names[1]}"]\n'
    )
    braked = load_ldraw(path, inner="free", overrides=file)
    assert analyze(braked, parts="rigid").mobility.total == totals[0] + 1


@given(
    axis=st.tuples(*[st.floats(-1.0, 1.0)] * 3).filter(lambda v: np.linalg.norm(v) > 0.1),
    angle=st.floats(-180.0, 180.0),
    drift=st.tuples(*[st.floats(-1.0, 1.0)] * 6),
    turning=st.floats(-3.0, 3.0),
    rolling=st.floats(-3.0, 3.0),
)
def test_a_thread_lets_the_rod_move_by_its_lead_and_no_other_way(
    axis, angle, drift, turning, rolling
):
    pose = Pose(rotation(axis, angle), np.array([0.1, 0.2, 0.3]))
    whole = divide([placed("61927", pose)], "free")
    (thread,) = [joint for joint in whole.joints if joint.type is JointType.MESH]
    assert [whole.parts[k].id.split("#")[1] for k in thread.parts] == ["input", "rod"]
    lead = 3.85 * LDU
    along = pose.directions(np.array([0.0, 0.0, 1.0]))
    arm = thread.point - pose.translation
    flank = thread.axes[0]

    def speed(omega, velocity):
        return float((velocity + np.cross(omega, arm)) @ flank)

    swirl, push = np.array(drift[:3]), np.array(drift[3:])
    # the input turns, the rod turns by some other angle, and moves by the difference of the turns
    way = -lead / (2.0 * np.pi) * (turning - rolling)
    slip = speed(swirl + turning * along, push) - speed(swirl + rolling * along, push + way * along)
    assert abs(slip) < 1e-12
    assert abs(speed(0.0 * along, along)) == pytest.approx(1.0, abs=0.01)  # pushed: it holds


def test_a_complete_turntable_turns_and_its_pieces_have_their_teeth(ldraw_library):
    definition = definition_from_library(Library.open(ldraw_library), "50163")
    assert definition is not None
    table = Part(
        "t",
        "50163",
        definition.title,
        Pose.identity(),
        definition.ports,
        definition.body,
        definition.mass_properties,
        definition=definition,
    )
    whole = divide([table])
    assert [part.id for part in whole.parts] == ["t", "t#top"]
    assert [len(part.ports) for part in whole.parts] == [6, 6]
    (joint,) = whole.joints
    assert joint.type is JointType.HINGE
    gears = [gears_of(part, k)[0].teeth for k, part in enumerate(whole.parts)]
    assert [(teeth.teeth, teeth.inner) for teeth in gears] == [(24, True), (56, False)]


def test_a_clutch_gear_slips_when_it_may():
    gear, other = placed("76244"), placed("10928", Pose(np.eye(3), np.array([40.0, 0, 0]) * LDU))
    held, free = divide([gear, other]), divide([gear, other], "free")
    assert (len(held.parts), len(free.parts)) == (2, 3)
    assert "holds its position" in held.findings[0].message
    assert [len(part.ports) for part in free.parts[:2]] == [0, 1]
    assert [mesh.parts for mesh in find_meshes(held.parts)] == [(0, 1)]
    assert [mesh.parts for mesh in find_meshes(free.parts)] == [(0, 2)]  # the ring has the teeth


DRIVE = """0 A motor's output with a wheel
1 71 0 0 0 1 0 0 0 1 0 0 0 1 99499.dat
"""


def test_a_motors_output_turns_what_is_on_it(tmp_path):
    """An axle in the output, a gear on it: fixed to the motor, or one motion that spins."""
    definition = catalogue().get("99499")
    bore = next(p for p in definition.ports if p.kind.value == "axle_hole")
    x, y, z = bore.position / LDU
    assert abs(bore.axis @ [0, 0, 1]) == pytest.approx(1.0)
    text = DRIVE + f"1 0 {x:.3f} {y:.3f} {z - 20:.3f} 0 0 -1 0 1 0 1 0 0 3705.dat\n"
    path = tmp_path / "drive.ldr"
    path.write_text(text)
    held, free = (
        analyze(load_ldraw(path, inner=inner), parts="rigid") for inner in ("held", "free")
    )
    assert held.mobility.total == 0
    assert free.mobility.total == 1


def test_inner_is_held_or_free(model):
    with pytest.raises(UsageError, match="inner"):
        load_ldraw(model("hinged_L.ldr"), inner="loose")  # type: ignore[arg-type]


GOOD = {
    "ids": ["1"],
    "kind": "motor",
    "when": "free",
    "source": "here",
    "body": [
        {
            "name": "output",
            "joint": "hinge",
            "point": [0, 0, 0],
            "axis": [1, 0, 0],
            "along": [0, 1],
            "radius": 1,
            "share": 0.1,
        }
    ],
}


@pytest.mark.parametrize(
    "change",
    [
        {"kind": "wing"},
        {"when": "later"},
        {"source": None, "body": [{}]},
        {"body": [GOOD["body"][0] | {"axis": [0, 0, 0]}]},
        {"body": [GOOD["body"][0] | {"along": [1, 0]}]},
        {"body": [GOOD["body"][0] | {"share": 1.5}]},
        {"body": [GOOD["body"][0] | {"axial": -1.0}]},
        {"body": [GOOD["body"][0] | {"joint": "universal"}]},
        {"body": [GOOD["body"][0] | {"joint": "weld"}]},
        {"body": [GOOD["body"][0] | {"screw": {"with": "input", "lead": 0, "radius": 1}}]},
    ],
)
def test_faults_of_the_file_are_said(change):
    assert parse_inner({"part": [GOOD]})["1"].bodies[0].high == pytest.approx(LDU)
    with pytest.raises(SchemaError, match="part 1"):
        parse_inner({"part": [GOOD | change]})
    with pytest.raises(SchemaError, match="given twice"):
        parse_inner({"part": [GOOD, GOOD]})
