"""Gears in mesh: found from teeth and distances, and what they hold."""

from __future__ import annotations

import numpy as np
import pytest

from technic.assembly.joint_types import JointType
from technic.assembly.model import FindingKind, Part
from technic.errors import UsageError
from technic.geometry import Pose
from technic.ldraw.gears import find_meshes
from technic.ldraw.reader import load_ldraw
from technic.ldraw.teeth import gears_of
from technic.parts.catalogue import catalogue
from technic.rigidity.analyze import analyze
from technic.system.assemble import assemble
from technic.units import LDU
from tests.ldraw.bricks import turn

G8, G16, G24, G40 = "10928", "94925", "3648b", "3649"
BEVEL12, DOUBLE12, DOUBLE20 = "6589", "32270", "32269"
WORM, KNOB, RACK = "4716", "32072", "3743"


def put(number: str, at=(0, 0, 0), *, along: str = "z") -> Part:
    """A part of the catalogue with its bore along a direction."""
    definition = catalogue().get(number)
    assert definition is not None, number
    bore = next(p for p in definition.ports if p.kind.value.endswith("hole"))
    own = "xyz"[int(np.argmax(np.abs(bore.axis)))]
    pose = Pose(turn(own, along), np.array(at) * LDU)
    return Part(
        f"{number}@{at}",
        number,
        definition.title,
        pose,
        definition.ports,
        definition.body,
        definition.mass_properties,
        definition.fastener,
        definition=definition,
    )


def kinds(*parts: Part) -> list[str]:
    return [mesh.kind for mesh in find_meshes(parts)]


@pytest.mark.parametrize(
    ("first", "second", "distance"),
    [
        (G8, G8, 20),
        (G8, G24, 40),
        (G16, G24, 50),
        (G16, G16, 40),
        (G24, G40, 80),
        (G8, G40, 60),
        (DOUBLE12, DOUBLE20, 40),
        (G24, "3650c", 60),
        (KNOB, KNOB, 40),
    ],
)
def test_parallel_gears_mesh_at_the_sum_of_their_radii(first, second, distance):
    if catalogue().get(second) is None:
        second = "3650b"
    assert kinds(put(first), put(second, (distance, 0, 0))) == ["spur"]
    slanted = (0.6 * distance, 0.8 * distance, 0)
    assert kinds(put(first), put(second, slanted)) == ["spur"]
    assert kinds(put(first), put(second, (distance + 2, 0, 0))) == []
    assert kinds(put(first), put(second, (distance - 2, 0, 0))) == []
    assert kinds(put(first), put(second, (distance, 0, 20))) == []


def test_gears_on_a_diagonal_of_the_grid_mesh():
    # 36 and 24 teeth would be at 75; 40 and 60 make 72.1: too close. 16 and 20 are at 45; 20 and 40
    # make 44.7.
    assert kinds(put(G16), put(DOUBLE20, (20, 40, 0))) == ["spur"]


@pytest.mark.parametrize(
    ("first", "second", "s1", "s2", "meshes"),
    [
        (DOUBLE12, DOUBLE12, 20, 20, True),
        (DOUBLE12, DOUBLE20, 30, 20, True),
        (DOUBLE12, DOUBLE12, 40, 20, False),
        (DOUBLE12, DOUBLE12, 10, 20, False),
        (G8, G24, 30, 10, False),
        (KNOB, KNOB, 20, 20, True),
    ],
)
def test_bevel_gears_mesh_where_their_shafts_meet(first, second, s1, s2, meshes):
    # shafts along z and x that meet at the origin; the first gear at -s1 z, the second at -s2 x
    middle = [p.mass_properties.centroid / LDU for p in (put(first), put(second))]
    pair = (put(first, (0, 0, -s1)), put(second, (-s2, 0, 0), along="x"))
    assert all(np.linalg.norm(m) < 3.0 for m in middle)
    assert kinds(*pair) == (["bevel"] if meshes else [])


def test_bevel_gears_with_teeth_on_one_side_do_not_mesh_in_parallel():
    assert kinds(put(BEVEL12), put(BEVEL12, (30, 0, 0))) == []


@pytest.mark.parametrize(("gear", "height"), [(G8, 20), (G24, 40), (G40, 60), (G16, 30)])
def test_a_worm_is_in_the_teeth_of_a_gear_on_a_crossing_shaft(gear, height):
    (mesh,) = find_meshes([put(WORM, along="x"), put(gear, (10, height, 0))])
    assert mesh.kind == "worm"
    assert abs(mesh.direction @ [1, 0, 0]) == pytest.approx(1.0)
    assert kinds(put(WORM, along="x"), put(gear, (40, height, 0))) == []
    assert kinds(put(WORM, along="z"), put(gear, (0, height, 0))) == []
    assert kinds(put(WORM, along="x"), put(gear, (10, height + 3, 0))) == []


@pytest.mark.parametrize("number", ["32316", "32062", "18939", "99009", "56145"])
def test_parts_without_teeth_of_a_known_place_are_no_gears(number):
    definition = catalogue().get(number)
    if definition is not None and any(p.kind.value.endswith("hole") for p in definition.ports):
        assert gears_of(put(number), 0) == ()


def test_teeth_touch_without_relative_speed_when_gears_roll():
    first, second = put(G8), put(G24, (40, 0, 0))
    (mesh,) = find_meshes([first, second])
    axis = np.array([0.0, 0.0, 1.0])
    speeds = [
        np.cross(turns * axis, mesh.point - part.centroid) @ mesh.direction
        for turns, part in ((24.0, first), (-8.0, second))
    ]
    assert speeds[0] == pytest.approx(speeds[1])
    assert abs(speeds[0]) > 0.0


# --- whole models -----------------------------------------------------------------------------
BEAM = "1 71 0 {y} 0 1 0 0 0 1 0 0 0 1 32316.dat\n"
AXLE = "1 0 0 {y} {z} 0 -1 0 1 0 0 0 0 1 3706.dat\n"
GEAR = "1 7 0 {y} {z} 1 0 0 0 0 1 0 -1 0 {number}.dat\n"
BUSH = "1 7 0 {y} {z} 1 0 0 0 0 1 0 -1 0 3713.dat\n"


@pytest.fixture
def train(tmp_path):
    """Three shafts with gears of 8, 24 and 8 teeth in a row, between two beams."""
    text = BEAM.format(y=0) + BEAM.format(y=-60)
    for z, number in ((-40, G8), (0, G24), (40, G8)):
        text += AXLE.format(y=-30, z=z) + GEAR.format(y=-20, z=z, number=number)
        text += BUSH.format(y=-40, z=z)
    path = tmp_path / "train.ldr"
    path.write_text("0 Train\n" + text)
    return path


def test_a_train_of_three_wheels_turns_as_one(train):
    free, tied = (analyze(load_ldraw(train, gears=gears)) for gears in ("off", "on"))
    assert free.mobility.total - tied.mobility.total == 2
    assert (free.mobility.spinning, tied.mobility.spinning) == (3, 1)
    (motion,) = [m for m in tied.motions if m.kind.value == "spinning"]
    turned = {
        tied.assembly.parts[k].number: twist[3:]
        for k, twist in zip(motion.parts, motion.twists, strict=True)
    }
    assert turned[G24] == pytest.approx(-turned[G8] * 8 / 24)
    assert any("each gear turns by itself (2 in mesh" in said for said in free.not_modelled)
    assert not any("gear" in said for said in tied.not_modelled)


def test_the_energy_of_a_mesh_is_in_the_joint_matrix(train):
    system = assemble(load_ldraw(train, gears="on"))
    joints = system.assembly.joints
    mesh = [row for row, k in enumerate(system.rows.link) if joints[k].type is JointType.MESH]
    assert len(mesh) == 2
    assert set(system.rows.motion[mesh]) == {0}
    rigid = system.A[mesh] @ system.R @ np.tile(np.eye(6), (len(joints and system.elements), 1))
    assert np.abs(rigid[:, :3]).max() < 1e-9  # moved as a whole, nothing slips


def test_gears_of_separate_pieces_are_listed_and_not_coupled(tmp_path):
    path = tmp_path / "loose.ldr"
    text = GEAR.format(y=0, z=0, number=G8) + GEAR.format(y=0, z=40, number=G24)
    path.write_text("0 Loose\n" + text)
    assembly = load_ldraw(path, gears="on")
    assert not assembly.joints
    (finding,) = [f for f in assembly.findings if f.kind is FindingKind.GEARS]
    assert "not coupled" in finding.message


@pytest.mark.parametrize(
    ("name", "lost"), [("omr_42020_twin_rotor.mpd", 2), ("omr_42004_mini_backhoe.mpd", 4)]
)
def test_official_models_lose_a_motion_per_mesh(model, name, lost):
    free = load_ldraw(model(name))
    tied = load_ldraw(model(name), gears="on")
    found = [f for f in free.findings if f.kind is FindingKind.GEARS]
    assert len(found) == lost
    assert len(tied.joints) == len(free.joints) + lost
    assert sum(j.type is JointType.MESH for j in tied.joints) == lost
    before, after = analyze(free, parts="rigid"), analyze(tied, parts="rigid")
    assert before.mobility.total - after.mobility.total == lost
    for mobility in (before.mobility, after.mobility):
        kinds_sum = mobility.structural + mobility.spinning + mobility.sliding + mobility.idle
        assert kinds_sum == mobility.total
        assert min(mobility.structural, mobility.spinning, mobility.idle) >= 0
    assert after.mobility.idle == before.mobility.idle


def test_gears_is_off_or_on(model):
    with pytest.raises(UsageError, match="gears"):
        load_ldraw(model("hinged_L.ldr"), gears="maybe")  # type: ignore[arg-type]


DIFFERENTIAL = """0 A differential on two half axles, held by two beams
1 71 0 0 0 1 0 0 0 1 0 0 0 1 62821.dat
1 19 0 0 -17 1 0 0 0 1 0 0 0 1 6589.dat
1 19 0 0 17 1 0 0 0 -1 0 0 0 -1 6589.dat
1 0 0 0 -72 0 0 1 0 1 0 -1 0 0 3706.dat
1 0 0 0 72 0 0 1 0 1 0 -1 0 0 3706.dat
1 4 0 0 -100 1 0 0 0 0 1 0 -1 0 32316.dat
1 4 0 0 100 1 0 0 0 0 1 0 -1 0 32316.dat
1 19 17 0 0 0 0 -1 0 1 0 1 0 0 6589.dat
1 19 -17 0 0 0 0 1 0 1 0 -1 0 0 6589.dat
"""


def test_a_differential_has_two_motions(tmp_path):
    """Its planets turn on the stubs of the casing; with the teeth, casing and half axles are left two
    motions: half axles turn against each other, or all together. The casing turns by the mean.
    """
    path, file = tmp_path / "d.ldr", tmp_path / "o.toml"
    path.write_text(DIFFERENTIAL)
    file.write_text('schema = "technic-overrides/1"\n[[weld]]\nparts = ["7:32316", "8:32316"]\n')
    free, tied = (load_ldraw(path, gears=gears, overrides=file) for gears in ("off", "on"))
    assert not [f for f in free.findings if f.kind is FindingKind.LOOSE]
    planets = [j for j in free.joints if j.connection == "planet/differential"]
    assert len(planets) == 2
    assert sum(j.type is JointType.MESH for j in tied.joints) == 4
    before, after = (analyze(assembly, parts="rigid") for assembly in (free, tied))
    # casing, two half axles, two planets; four rows of teeth, one of which the others imply
    turning = [r.mobility.structural + r.mobility.spinning for r in (before, after)]
    assert turning == [5, 2]
    assert before.mobility.total - after.mobility.total == 3

    def turned(casing: float, low: float, high: float, planet: float) -> float:
        """Largest speed of teeth through each other when the wheels turn by these angles."""
        z, x = np.array([0, 0, 1.0]), np.array([1.0, 0, 0])
        spin = {
            "d.ldr/2:62821": casing * z,
            "d.ldr/3:6589": low * z,
            "d.ldr/4:6589": high * z,
            "d.ldr/9:6589": casing * z + planet * x,
            "d.ldr/10:6589": casing * z - planet * x,
        }
        worst = 0.0
        for joint in tied.joints:
            if joint.type is JointType.MESH:
                speed = [np.cross(spin[tied.parts[k].id], joint.point) for k in joint.parts]
                worst = max(worst, abs(float((speed[0] - speed[1]) @ joint.axes[0])))
        return worst

    assert turned(1.0, 1.0, 1.0, 0.0) < 1e-12
    assert min(turned(0.0, 1.0, -1.0, s) for s in (1.0, -1.0)) < 1e-12
    assert min(turned(0.5, 1.0, 0.0, s) for s in (0.5, -0.5)) < 1e-12
    assert turned(0.0, 1.0, 1.0, 0.0) > 1e-3
