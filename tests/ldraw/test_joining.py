"""Joints, a user's corrections and gears together: what comes first, and what the report says of it."""

from __future__ import annotations

from dataclasses import replace

import pytest

from technic.assembly.joint_types import JointType
from technic.assembly.model import FindingKind
from technic.assembly.overrides import SCHEMA
from technic.ldraw.joining import rejoin
from technic.ldraw.reader import load_ldraw

BEAM = "1 4 0 {y} 0 1 0 0 0 1 0 0 0 1 32316.dat\n"
PIN = "1 0 0 {y} {z} 0 1 0 1 0 0 0 0 1 2780.dat\n"

TWICE = "0 Two pins in one place\n" + BEAM.format(y=0) + BEAM.format(y=-20)
TWICE += PIN.format(y=-10, z=40) * 2
"""Lines 2 and 3: beams; 4 and 5: pins, of which only the first finds room."""

GAP = TWICE + BEAM.format(y=-40)
"""Line 6: a beam over the others, without a pin."""


@pytest.fixture
def corrected(tmp_path):
    def read(model: str, text: str = "", **options):
        path, file = tmp_path / "m.ldr", tmp_path / "o.toml"
        path.write_text(model)
        file.write_text(f'schema = "{SCHEMA}"\n{text}')
        return load_ldraw(path, overrides=file, **options)

    return read


def said(assembly, kind):
    return [finding for finding in assembly.findings if finding.kind is kind]


def ends(assembly):
    return {frozenset(assembly.parts[k].id for k in joint.parts) for joint in assembly.joints}


FIRST_PIN = {
    frozenset({"m.ldr/2:32316", "m.ldr/4:2780"}),
    frozenset({"m.ldr/3:32316", "m.ldr/4:2780"}),
}
SECOND_PIN = {
    frozenset({"m.ldr/2:32316", "m.ldr/5:2780"}),
    frozenset({"m.ldr/3:32316", "m.ldr/5:2780"}),
}


def test_an_ignored_part_makes_room(corrected):
    assert ends(corrected(TWICE)) == FIRST_PIN
    freed = corrected(TWICE, '[[ignore]]\npart = "4:2780"\n')
    assert ends(freed) == SECOND_PIN
    assert not said(freed, FindingKind.NEAR_MISS)
    assert not said(freed, FindingKind.LOOSE)


def test_a_joint_taken_away_leaves_an_open_end(corrected):
    assert not said(corrected(TWICE, '[[ignore]]\npart = "5:2780"\n'), FindingKind.OPEN_PORT)
    text = '[[ignore]]\npart = "5:2780"\n[[remove]]\nparts = ["3:32316", "4:2780"]\n'
    left = corrected(TWICE, text)
    (open_end,) = said(left, FindingKind.NEAR_MISS) + said(left, FindingKind.OPEN_PORT)
    assert left.parts[open_end.parts[0]].number == "2780"
    (loose,) = said(left, FindingKind.LOOSE)
    assert [left.parts[k].id for k in loose.parts] == ["m.ldr/3:32316"]
    (single,) = said(left, FindingKind.ONE_PART_PIN)
    assert left.parts[single.parts[0]].number == "2780"


def test_one_of_two_joints_taken_away_by_its_id(corrected):
    """Two pins hold two beams; the joint that is named opens its own end, not the other's."""
    model = BEAM.format(y=0) + BEAM.format(y=-20) + PIN.format(y=-10, z=40) + PIN.format(y=-10, z=0)
    whole = corrected(model)
    name = whole.joints[0].id
    less = corrected(model, f'[[remove]]\njoint = "{name}"\n')
    assert len(less.joints) == len(whole.joints) - 1
    found = said(less, FindingKind.OPEN_PORT) + said(less, FindingKind.NEAR_MISS)
    assert [f.parts[0] for f in found] == [whole.joints[0].parts[1]]


def test_what_the_user_joined_is_no_gap_and_not_loose(corrected):
    assert said(corrected(GAP), FindingKind.NO_PIN)
    assert len(said(corrected(GAP), FindingKind.LOOSE)) == 2
    hinge = 'type = "hinge"\npoint = [0, -30, 0]\naxis = [0, 1, 0]\n'
    for table, more in (("weld", ""), ("add", hinge)):
        text = f'[[{table}]]\nparts = ["3:32316", "6:32316"]\n{more}'
        mended = corrected(GAP, text)
        assert not [
            f for f in said(mended, FindingKind.NO_PIN) if len(f.parts) == 2 and 2 in f.parts
        ]
        (loose,) = said(mended, FindingKind.LOOSE)
        assert mended.parts[loose.parts[0]].id == "m.ldr/5:2780"


def test_a_retyped_joint_keeps_its_ends(corrected):
    text = '[[ignore]]\npart = "5:2780"\n'
    text += '[[retype]]\nparts = ["3:32316", "4:2780"]\ntype = "fixed"\n'
    fixed = corrected(TWICE, text)
    assert not said(fixed, FindingKind.OPEN_PORT)
    assert not said(fixed, FindingKind.LOOSE)
    assert len(said(fixed, FindingKind.OVERRIDE)) == 2


GEARS = """0 Two gears on a beam
1 71 0 0 0 1 0 0 0 1 0 0 0 1 32316.dat
1 0 0 -20 0 0 -1 0 1 0 0 0 0 1 3705.dat
1 0 0 -20 40 0 -1 0 1 0 0 0 0 1 3705.dat
1 7 0 -20 0 1 0 0 0 0 1 0 -1 0 10928.dat
1 7 0 -20 40 1 0 0 0 0 1 0 -1 0 3648b.dat
"""


def meshes(assembly):
    return [joint for joint in assembly.joints if joint.type is JointType.MESH]


def test_a_mesh_can_be_taken_away(corrected):
    assert len(meshes(corrected(GEARS, gears="on"))) == 1
    text = '[[remove]]\nparts = ["10928", "3648b"]\n'
    without = corrected(GEARS, text, gears="on")
    assert not meshes(without)
    assert not said(without, FindingKind.GEARS)
    assert not said(corrected(GEARS, text), FindingKind.GEARS)


def test_teeth_hold_what_the_user_joined(corrected):
    loose = GEARS.replace("1 0 0 -20 40 0 -1 0 1 0 0 0 0 1 3705.dat\n", "0 //\n")
    assert not meshes(corrected(loose, gears="on"))
    text = '[[add]]\nparts = ["32316", "3648b"]\ntype = "hinge"\npoint = [0, -20, 40]\n'
    text += "axis = [0, 1, 0]\n"
    assert len(meshes(corrected(loose, text, gears="on"))) == 1


def test_joined_again_it_is_the_same(corrected, model):
    text = '[[weld]]\nparts = ["10928", "32316"]\n'
    whole = corrected(GEARS, text, gears="on")
    again = rejoin(whole, whole.parts)
    assert [j.id for j in again.joints] == [j.id for j in whole.joints]
    assert [j.type for j in again.joints] == [j.type for j in whole.joints]
    robot = load_ldraw(model("fll_robot.mpd"), inner="free")
    assert [j.id for j in rejoin(robot, robot.parts).joints] == [j.id for j in robot.joints]


def test_corrections_name_parts_by_their_ids_when_joined_again(corrected):
    """A number that the model has once means the same part when it has two of them later."""
    text = '[[weld]]\nparts = ["10928", "32316"]\n'
    whole = corrected(GEARS, text)
    twin = replace(whole.parts[0], id="new/1:32316")
    again = rejoin(whole, (*whole.parts, twin))
    (weld,) = [j for j in again.joints if j.connection == "weld"]
    assert weld.parts == (0, 3)


def test_corrections_of_parts_that_are_gone_are_passed_over(corrected):
    text = '[[weld]]\nparts = ["10928", "32316"]\n'
    whole = corrected(GEARS, text)
    again = rejoin(whole, whole.parts[:3])
    assert not [j for j in again.joints if j.connection == "weld"]
