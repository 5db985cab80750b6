"""Corrections of a user: joints added, removed, retyped; parts ignored, welded; faults said."""

from __future__ import annotations

import pytest

from technic.assembly.joint_types import JointType
from technic.assembly.model import FindingKind
from technic.assembly.overrides import SCHEMA, apply_overrides, read_overrides
from technic.errors import InputError, SchemaError
from technic.ldraw.reader import load_ldraw
from technic.rigidity.analyze import analyze

MODEL = """0 Scissors
1 4 0 0 0 1 0 0 0 1 0 0 0 1 32316.dat
1 4 0 -20 0 1 0 0 0 1 0 0 0 1 32316.dat
1 0 0 -10 40 0 1 0 1 0 0 0 0 1 2780.dat
"""


@pytest.fixture
def path(tmp_path):
    place = tmp_path / "m.ldr"
    place.write_text(MODEL)
    return place


@pytest.fixture
def scissors(path):
    return load_ldraw(path)


def change(assembly, **tables):
    return apply_overrides(assembly, {"schema": SCHEMA, **tables})


def structural(assembly) -> int:
    return analyze(assembly, parts="rigid").mobility.structural


BEAMS = ["2:32316", "3:32316"]


def test_a_weld_makes_the_scissors_rigid(scissors):
    assert structural(scissors) == 1
    welded = change(scissors, weld=[{"parts": BEAMS}])
    assert structural(welded) == 0
    (finding,) = [f for f in welded.findings if f.kind is FindingKind.OVERRIDE]
    assert "one piece" in finding.message


def test_an_added_joint(scissors):
    row = {"parts": BEAMS, "type": "hinge", "point": [0, -10, -40], "axis": [0, 1, 0]}
    added = change(scissors, add=[row, row | {"stiffness": {"axial": 5.0}}])
    first, second = added.joints[-2:]
    assert first.id != second.id
    assert first.point == pytest.approx([0, -0.004, -0.016])
    assert first.stiffness[0] == 1e4
    assert second.stiffness[0] == 5.0
    assert "overrides file (axial)" in second.provenance
    assert structural(added) == 0


def test_a_joint_made_fixed_and_a_joint_taken_away(scissors):
    pair = {"parts": ["2:32316", "4:2780"]}
    fixed = change(scissors, retype=[pair | {"type": "fixed", "stiffness": "rigid"}])
    assert sum(joint.type is JointType.FIXED for joint in fixed.joints) == 1
    assert len(fixed.joints) == len(scissors.joints)
    name = scissors.joints[0].id
    assert len(change(scissors, remove=[{"joint": name}]).joints) == 1
    assert len(change(scissors, remove=[pair]).joints) == 1


def test_an_ignored_part_takes_its_joints_along(scissors):
    left = change(scissors, ignore=[{"part": "2780"}])
    assert [part.number for part in left.parts] == ["32316", "32316"]
    assert not left.joints
    for finding in left.findings:
        assert all(0 <= p < 2 for p in finding.parts)
    first = change(scissors, ignore=[{"part": "2:32316"}])
    assert [joint.parts for joint in first.joints] == [(0, 1)]


@pytest.mark.parametrize(
    ("tables", "fault"),
    [
        ({"schema": "other"}, "schema: expected"),
        ({"glue": []}, "glue: unknown"),
        ({"weld": {"parts": BEAMS}}, r"weld: expected \[\[weld\]\]"),
        ({"weld": ["x"]}, r"weld\[1\]: expected a table"),
        ({"weld": [{"parts": BEAMS[:1]}]}, "two or more"),
        ({"weld": [{"parts": [BEAMS[0], BEAMS[0]]}]}, "named twice"),
        ({"weld": [{"parts": [BEAMS[0], "3001"]}]}, r"weld\[1\].parts\[2\]: no part is called"),
        ({"weld": [{"parts": [BEAMS[0], "32316"]}]}, "can mean 2 parts"),
        ({"weld": [{"parts": [BEAMS[0], 7]}]}, "expected the name"),
        ({"weld": [{"parts": BEAMS, "color": 4}]}, r"weld\[1\].color: unknown"),
        ({"ignore": [{}]}, r"ignore\[1\].part"),
        ({"remove": [{"parts": BEAMS}]}, "no such joint"),
        ({"remove": [{"joint": "x"}]}, "no such joint"),
        ({"remove": [{"joint": "x", "parts": BEAMS}]}, "either"),
        ({"add": [{"parts": BEAMS, "type": "hinge", "point": [0, 0, 0]}]}, "axis: is missing"),
        ({"add": [{"parts": BEAMS, "type": "glue", "point": [0, 0, 0]}]}, "type: 'glue'"),
        ({"add": [{"parts": BEAMS, "type": "ball", "point": [0, 0]}]}, "three numbers"),
        ({"add": [{"parts": BEAMS, "type": "ball", "point": [0, 0, float("nan")]}]}, "three"),
        (
            {"add": [{"parts": BEAMS, "type": "ball", "point": [0, 0, 0], "stiffness": 3}]},
            "stiffness: expected",
        ),
        (
            {
                "add": [
                    {"parts": BEAMS, "type": "ball", "point": [0, 0, 0], "stiffness": {"axial": 0}}
                ]
            },
            "stiffness.axial",
        ),
        (
            {
                "add": [
                    {"parts": BEAMS, "type": "ball", "point": [0, 0, 0], "stiffness": {"wide": 1}}
                ]
            },
            "stiffness.wide: unknown",
        ),
    ],
)
def test_each_fault_is_said_with_its_place(scissors, tables, fault):
    with pytest.raises(SchemaError, match=fault):
        apply_overrides(scissors, {"schema": SCHEMA} | tables, "o.toml")


def test_from_a_file(path, tmp_path):
    place = tmp_path / "o.toml"
    place.write_text(f'schema = "{SCHEMA}"\n[[weld]]\nparts = {BEAMS}\n')
    assert structural(load_ldraw(path, overrides=place)) == 0


@pytest.mark.parametrize("content", [b"= 3", b"\xff\xfe", b"a = " + b"[" * 5000])
def test_files_that_are_no_toml(tmp_path, content):
    place = tmp_path / "o.toml"
    place.write_bytes(content)
    with pytest.raises(InputError, match="not a TOML"):
        read_overrides(place)


def test_files_that_cannot_be_read(tmp_path):
    with pytest.raises(InputError, match="cannot be read"):
        read_overrides(tmp_path / "none.toml")
    big = tmp_path / "big.toml"
    big.write_bytes(b"#" * (2**20 + 1))
    with pytest.raises(InputError, match="larger"):
        read_overrides(big)
