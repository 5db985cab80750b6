"""From real model files to assemblies: nothing lost, everything joined, whatever the noise."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from scipy.sparse import coo_array
from scipy.sparse.csgraph import connected_components

from technic.assembly.joint_types import JointType
from technic.assembly.model import FindingKind
from technic.assembly.stiffness import default_table
from technic.errors import InputError, UsageError
from technic.geometry import Pose
from technic.ldraw.connect import connect
from technic.ldraw.document import read
from technic.ldraw.matching import Limits
from technic.ldraw.reader import load_ldraw, lookup, read_parts
from technic.units import LDU
from tests.ldraw.bricks import rotation

SMALL = ("hinged_L.ldr", "triangle.ldr", "square.ldr", "trapezoid.ldr", "cube7.ldr")
OFFICIAL = ("omr_42020_twin_rotor.mpd", "omr_42004_mini_backhoe.mpd")
BIG = (
    *OFFICIAL,
    "fll_robot.mpd",
    "omr_31066_rover.mpd",
    "omr_8002_destroyer_droid.mpd",
    "omr_10212_imperial_shuttle.mpd",
)


def line(file: str, position="0 0 0", matrix="1 0 0 0 1 0 0 0 1") -> str:
    return f"1 71 {position} {matrix} {file}\n"


@pytest.fixture
def write(tmp_path):
    def to_file(text: str):
        path = tmp_path / "model.ldr"
        path.write_text(text, encoding="utf-8")
        return path

    return to_file


def main_share(assembly) -> float:
    """Share of the known parts in the biggest component."""
    number = len(assembly.parts)
    ends = np.array([joint.parts for joint in assembly.joints]).reshape(-1, 2)
    graph = coo_array((np.ones(len(ends)), (ends[:, 0], ends[:, 1])), shape=(number, number))
    _, label = connected_components(graph, directed=False)
    return float(np.bincount(label).max() / number)


@pytest.mark.parametrize("name", [*SMALL, *BIG])
def test_every_placement_is_accounted_for(model, name):
    reading = read_parts(read(model(name)), lookup())
    unknown = sum(part.count for part in reading.unknown)
    flexible = sum(len(pieces) for pieces in reading.flexible.values())
    assert len(reading.parts) + unknown + flexible == len(reading.placements)
    assert not any(p.scaled and p.flexible is None for p in reading.placements)
    ids = [part.id for part in reading.parts]
    assert len(set(ids)) == len(ids)


@pytest.mark.parametrize(
    ("name", "parts", "joints"),
    [
        ("hinged_L.ldr", 3, 2),
        ("triangle.ldr", 6, 6),
        ("square.ldr", 8, 8),
        ("trapezoid.ldr", 11, 12),
        ("cube7.ldr", 36, 40),
        ("cube9_simple.ldr", 36, 40),
    ],
)
def test_small_models(model, name, parts, joints):
    assembly = load_ldraw(model(name))
    assert (len(assembly.parts), len(assembly.joints)) == (parts, joints)
    assert {joint.connection for joint in assembly.joints} == {"pin/pin_hole"}
    assert main_share(assembly) == 1.0
    assert not assembly.unknown


@pytest.mark.parametrize("name", [*OFFICIAL, "fll_robot.mpd"])
def test_big_models_hang_together(model, name):
    assert main_share(load_ldraw(model(name))) >= 0.95


def keys(parts, limits=None):
    joints, _ = connect(parts, default_table(), limits=limits)
    return {(joint.id, joint.type, joint.connection) for joint in joints}


@pytest.mark.parametrize("name", OFFICIAL)
def test_clean_files_do_not_depend_on_the_radial_limit(model, name):
    parts = load_ldraw(model(name)).parts
    reference = keys(parts)
    for offset in (0.5, 1.0, 2.0, 7.0):
        assert keys(parts, Limits(offset=offset * LDU)) == reference


@pytest.mark.parametrize("name", [*SMALL, *OFFICIAL])
def test_joints_do_not_depend_on_placement_noise(model, name):
    parts = load_ldraw(model(name)).parts
    rng = np.random.default_rng(42)
    shaken = [
        replace(
            part,
            pose=Pose(
                rotation(rng.normal(size=3), 0.05) @ part.pose.rotation,
                part.pose.translation + rng.uniform(-0.03, 0.03, 3) * LDU,
            ),
        )
        for part in parts
    ]
    assert keys(shaken) == keys(parts)


def test_where_a_part_stands(model):
    path = model("square.ldr")
    assembly = load_ldraw(path)
    part = assembly.parts[0]
    assert part.id == "square.ldr/1:32316"
    assert part.name == "Beam 5"
    assert part.color == 71
    assert part.source is not None
    assert (part.source.submodel, part.source.line, part.source.lines) == ("square.ldr", 1, (1,))
    np.testing.assert_allclose(part.pose.translation, [-40 * LDU, 0, 0])
    assert assembly.name == "square"
    assert assembly.source["format"] == "ldraw"
    assert assembly.source["path"] == str(path)
    assert len(assembly.source["sha256"]) == 64


def test_unknown_parts_are_listed_with_their_lines(write):
    text = line("32316.dat") + line("nosuch.dat") + line("other.dat") + line("nosuch.dat")
    assembly = load_ldraw(write(text))
    assert [(u.number, u.count, u.lines) for u in assembly.unknown] == [
        ("nosuch", 2, (2, 4)),
        ("other", 1, (3,)),
    ]


def test_a_stretched_part_is_one_flexible_thing(write):
    text = line("32316.dat") + line("3705.dat", matrix="3 0 0 0 1 0 0 0 1")
    assembly = load_ldraw(write(text))
    assert len(assembly.parts) == 1
    (found,) = assembly.findings
    assert found.kind is FindingKind.FLEXIBLE
    assert "not modelled" in found.message


def test_an_askew_matrix_is_warned_about(write):
    text = line("32316.dat", matrix="1 0.05 0 0 1 0 0 0 1")
    (found,) = load_ldraw(write(text)).findings
    assert found.kind is FindingKind.WARNING
    assert "line 1" in found.message


def test_a_moved_number_lies_as_its_file_says(write):
    """The file of 32531 holds 32531a turned: one line of each, turned alike, lie alike."""
    old, new = load_ldraw(
        write(line("32531.dat") + line("32531a.dat", matrix="0 0 -1 0 1 0 1 0 0"))
    ).parts
    assert old.definition is new.definition
    np.testing.assert_allclose(old.pose.rotation, new.pose.rotation, atol=1e-12)


def test_mirrored_parts_are_accepted(write):
    (part,) = load_ldraw(write(line("32316.dat", matrix="-1 0 0 0 1 0 0 0 1"))).parts
    assert np.linalg.det(part.pose.rotation) == pytest.approx(-1.0)


def test_one_part_and_no_connection_are_results(write):
    one = load_ldraw(write(line("32316.dat")))
    assert (len(one.parts), one.joints, one.findings) == (1, (), ())
    two = load_ldraw(write(line("32316.dat") + line("32316.dat", "500 0 0")))
    assert len(two.parts) == 2
    assert [finding.kind for finding in two.findings] == [FindingKind.LOOSE] * 2


def test_no_known_part_is_an_error(write):
    with pytest.raises(
        InputError, match=r"none of the model's parts is known: nosuch \(1x\)"
    ) as error:
        load_ldraw(write("0 title\n" + line("nosuch.dat")))
    assert error.value.line == 2
    assert error.value.remedy


def test_no_part_at_all_is_an_error(write):
    with pytest.raises(InputError, match="no parts"):
        load_ldraw(write("0 title\n"))


def test_a_library_supplies_what_the_catalogue_lacks(write, ldraw_library):
    from technic.ldraw.library import Library
    from technic.parts.catalogue import catalogue

    library = Library.open(ldraw_library)
    number = next(n for n in sorted(library.part_numbers()) if n not in catalogue())
    path = write(line("32316.dat") + line(f"{number}.dat"))
    alone = load_ldraw(path)
    assert [part.number for part in alone.unknown] == [number]
    helped = load_ldraw(path, library=library)
    assert not helped.unknown
    assert [part.number for part in helped.parts] == ["32316", number]


def test_a_shadow_library_alone_is_a_mistake(model):
    with pytest.raises(UsageError, match="shadow"):
        load_ldraw(model("square.ldr"), shadow=object())


def test_axles_may_slide(model):
    path = model("omr_42004_mini_backhoe.mpd")
    types = {joint.type for joint in load_ldraw(path, axle_slide="free").joints}
    assert JointType.SLIDER in types
    assert JointType.SLIDER not in {joint.type for joint in load_ldraw(path).joints}
