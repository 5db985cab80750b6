"""The assembly file: what it says arrives in the model, what is wrong with it is said with its path."""

from __future__ import annotations

import copy
import json
from typing import Any

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

import technic
from technic.assembly.builder import Linkage
from technic.assembly.file import build_assembly, load_assembly, schema
from technic.errors import InputError, SchemaError
from technic.fem.build import build_element
from technic.parts.definition import FrameBody, RigidBody, TrussBody

SQUARE = {"kind": "rectangle", "width": 0.004, "height": 0.006}
GOOD: dict[str, Any] = {
    "schema": "technic-assembly/1",
    "dimension": 3,
    "materials": {"steel": {"young_pa": 2e11, "poisson": 0.3, "density": 7800}},
    "parts": [
        {
            "id": "a",
            "shape": {"kind": "bar", "points": [[0, 0, 0], [0.1, 0, 0]], "section": SQUARE},
            "material": "steel",
        },
        {"id": "b", "shape": {"kind": "rigid"}},
        {"id": "c", "shape": {"kind": "truss", "points": [[0, 0, 0], [0, 0, 0.1]], "area": 1e-5}},
    ],
    "joints": [
        {"type": "hinge", "parts": ["a", "b"], "point": [0.1, 0, 0], "axis": [0, 0, 2]},
        {"type": "ball", "parts": ["c", "b"], "point": [0, 0, 0.1]},
    ],
    "supports": [
        {"part": "a", "point": [0, 0, 0]},
        {"part": "c", "point": [0, 0, 0], "held": ["x"]},
    ],
}


def changed(path, value):
    """Return the good file with one value replaced; `path` is a list of keys."""
    data = copy.deepcopy(GOOD)
    inner: Any = data
    for key in path[:-1]:
        inner = inner[key]
    if value is None:
        del inner[path[-1]]
    else:
        inner[path[-1]] = value
    return data


def test_a_file_becomes_an_assembly(tmp_path):
    path = tmp_path / "rack.json"
    path.write_text(json.dumps(GOOD), encoding="utf-8")
    model = technic.load(path)
    assert (model.name, model.dimension, len(model.joints)) == ("rack", 3, 2)
    assert model.source["format"] == "assembly"
    assert len(model.source["sha256"]) == 64
    assert [type(p.body) for p in model.parts] == [FrameBody, RigidBody, TrussBody]
    bar = model.parts[0]
    assert bar.mass_properties.mass == pytest.approx(7800 * 0.004 * 0.006 * 0.1)
    assert isinstance(bar.body, FrameBody)
    assert bar.body.material.young_pa == 2e11
    assert isinstance(model.parts[2].body, TrussBody)
    assert model.parts[2].body.material.name == "ABS"
    hinge = model.joints[0]
    np.testing.assert_allclose(hinge.axes[0], [0, 0, 1])
    assert hinge.held.tolist() == [True, True, True, False, True, True]
    assert model.supports[0].held.all()
    assert model.supports[1].held.tolist() == [True, False, False, False, False, False]


def test_a_bar_has_the_section_of_the_textbook():
    body = build_assembly(GOOD).parts[0].body
    assert isinstance(body, FrameBody)
    section = body.sections[0]
    assert section.area == pytest.approx(24e-6)
    assert section.inertia_z == pytest.approx(0.004 * 0.006**3 / 12)  # bends in the plane of height
    assert section.inertia_y == pytest.approx(0.006 * 0.004**3 / 12)
    # Roark, Formulas for Stress and Strain, torsion of a rectangle with sides 1.5 to 1: 0.196 a b^3
    assert section.torsion == pytest.approx(0.196 * 0.006 * 0.004**3, rel=2e-3)


def test_a_bar_weighs_and_turns_as_its_solid():
    shape = {
        "kind": "bar",
        "points": [[0, 0, 0], [0.1, 0, 0], [0.1, 0.05, 0]],
        "section": SQUARE,
    }
    model = build_assembly(changed(["parts", 0, "shape"], shape))
    system = technic.assemble(model)
    element = system.elements[0]
    found = element.rigid.T @ element.mass @ element.rigid
    expected = model.parts[0].mass_properties
    np.testing.assert_allclose(found[:3, :3], expected.mass * np.eye(3), atol=1e-12)
    np.testing.assert_allclose(found[3:, 3:], expected.inertia, rtol=1e-6, atol=1e-12)
    np.testing.assert_allclose(found[:3, 3:], 0.0, atol=1e-12)


def test_defaults_of_stiffness_depend_on_the_section():
    ball, hinge = (build_assembly(GOOD).joints[k] for k in (1, 0))
    assert ball.stiffness[:3].tolist() == [1e4] * 3
    assert ball.provenance == "assumed"
    # the bar's section has the root area 4.9 mm, less than the 1 cm of a part that has none
    np.testing.assert_allclose(hinge.stiffness[4:], 1e4 * 24e-6)


def test_stiffness_that_is_given_is_taken():
    given = {"axial": 5.0, "shear": "rigid", "tilt": 2.0}
    joint = build_assembly(changed(["joints", 0, "stiffness"], given)).joints[0]
    np.testing.assert_array_equal(joint.stiffness, [5.0, np.inf, np.inf, 0.0, 2.0, 2.0])
    assert joint.provenance == "file"
    joint = build_assembly(changed(["joints", 0, "stiffness"], "rigid")).joints[0]
    assert np.isinf(joint.stiffness[joint.held]).all()
    joint = build_assembly(changed(["joints", 0, "stiffness"], {"axial": 5.0})).joints[0]
    assert joint.provenance == "file (axial); assumed (shear, tilt)"


def test_play_adds_compliance():
    data = changed(["joints", 1, "stiffness"], {"axial": 1e4, "shear": "rigid"})
    data["joints"][1]["jitter"] = {"axial": 1e-4, "shear": 2e-4, "force": 2.0}
    joint = build_assembly(data).joints[1]
    assert joint.stiffness[0] == pytest.approx(1 / (1e-4 + 5e-5))
    assert joint.stiffness[1] == pytest.approx(2.0 / 2e-4)
    assert "play" in joint.provenance


def test_what_is_given_for_a_freed_motion_is_reported():
    model = build_assembly(changed(["joints", 0, "stiffness"], {"spin": 1.0}))
    assert not model.joints[0].held[3]
    assert "spin" in model.findings[0].message


def test_three_parts_at_one_place_are_joined_pairwise():
    data = changed(["joints", 1, "parts"], ["a", "b", "c"])
    model = build_assembly(data)
    assert [j.parts for j in model.joints] == [(0, 1), (0, 1), (0, 2), (1, 2)]
    assert len({j.id for j in model.joints}) == 4


def test_a_rigid_part_without_geometry_weighs_at_its_joints():
    part = build_assembly(GOOD).parts[1]
    np.testing.assert_allclose(part.mass_properties.centroid, [0.05, 0, 0.05])


FAULTS = [
    (["schema"], "technic-assembly/2", r"\$\.schema"),
    (["dimension"], 4, r"\$\.dimension: 4 is not one of: 2, 3"),
    (["dimension"], None, r"\$: 'dimension' is missing"),
    (["parts"], [], r"\$\.parts"),
    (["parts", 0, "shape", "kind"], "blob", r"\$\.parts\[0\]\.shape\.kind: 'blob' is not one of"),
    (["parts", 0, "shape", "section"], None, r"\$\.parts\[0\]\.shape: 'section' is missing"),
    (["parts", 0, "shape", "sektion"], 1, r"\$\.parts\[0\]\.shape: unknown key 'sektion'"),
    (["parts", 0, "shape", "section", "width"], -1, r"\$\.parts\[0\]\.shape\.section\.width"),
    (["parts", 0, "shape", "section", "width"], "4 mm", r"\.section\.width: '4 mm' is not"),
    (["parts", 0, "shape", "points", 1], [0, 0, 0], r"\$\.parts\[0\]\.shape\.points\[1\]: is the"),
    (["parts", 0, "shape", "points", 1], [0, 1], r"\.points\[1\]: a point in three dimensions"),
    (["parts", 0, "shape", "normal"], [1, 0, 0], r"\$\.parts\[0\]\.shape\.normal: is parallel"),
    (["parts", 0, "material"], "wood", r"\$\.parts\[0\]\.material: 'wood'"),
    (["parts", 1, "id"], "a", r"\$\.parts\[1\]\.id: 'a' is also"),
    (["parts", 2, "shape", "area"], 0, r"\$\.parts\[2\]\.shape\.area"),
    (["parts", 2, "shape"], {"kind": "mesh", "file": "x.vtk"}, r"\.shape\.file: .*no such mesh"),
    (
        ["parts", 2, "shape"],
        {"kind": "polygon", "points": [[0, 0], [1, 0], [0, 1]], "thickness": 1},
        r"\$\.parts\[2\]\.shape\.points\[0\]: a point in three dim",
    ),
    (["materials", "steel", "poisson"], 0.5, r"\$\.materials\.steel\.poisson"),
    (["joints", 0, "type"], "weld", r"\$\.joints\[0\]\.type: 'weld' is not one of: fixed, hinge"),
    (["joints", 0, "parts"], ["a", "z"], r"\$\.joints\[0\]\.parts\[1\]: there is no part 'z'"),
    (["joints", 0, "parts"], ["a", "a"], r"\$\.joints\[0\]\.parts"),
    (["joints", 0, "axis"], None, r"\$\.joints\[0\]\.axis: is missing"),
    (["joints", 0, "axis"], [0, 0, 0], r"\$\.joints\[0\]\.axis: is zero"),
    (["joints", 0, "type"], "universal", r"\$\.joints\[0\]\.axis2: is missing"),
    (["joints", 0, "point"], [0, 0], r"\$\.joints\[0\]\.point: a point in three"),
    (["joints", 0, "stiffness"], "soft", r"\$\.joints\[0\]\.stiffness"),
    (["supports", 0, "part"], "q", r"\$\.supports\[0\]\.part: there is no part 'q'"),
    (["supports", 1, "held"], ["w"], r"\$\.supports\[1\]\.held\[0\]: 'w' is not one of"),
    (["supports", 1, "held"], [], r"\$\.supports\[1\]\.held"),
]


@pytest.mark.parametrize(("path", "value", "message"), FAULTS)
def test_every_fault_is_said_with_its_path(path, value, message):
    with pytest.raises(SchemaError, match=message) as caught:
        build_assembly(changed(path, value))
    assert caught.value.exit_code == 3


def test_two_axes_of_a_slot_are_at_right_angles():
    data = changed(["joints", 0, "type"], "slot")
    data["joints"][0]["axis2"] = [1, 0, 1]
    with pytest.raises(SchemaError, match="right angles"):
        build_assembly(data)
    data["joints"][0]["axis2"] = [0, 0, -1]
    with pytest.raises(SchemaError, match=r"\.axis2: is parallel"):
        build_assembly(data)


def test_all_faults_are_said_at_once():
    data = changed(["joints", 0, "parts"], ["a", "z"])
    data["parts"][0]["material"] = "wood"
    data["supports"][0]["part"] = "q"
    with pytest.raises(SchemaError) as caught:
        build_assembly(data)
    assert len(caught.value.faults) == 3


@pytest.mark.parametrize(
    ("text", "message"),
    [
        ("{", r"not JSON"),
        ("[1, 2]", r"expected|\$"),
        ("null", r"\$"),
        ('{"schema": "technic-assembly/1", "schema": "x"}', "stands twice"),
        ("\ufeff{}", r"\$\.schema"),
        ("[" * 100000, "nested|not JSON"),
    ],
)
def test_text_that_is_no_assembly_is_refused(tmp_path, text, message):
    path = tmp_path / "bad.json"
    path.write_text(text, encoding="utf-8")
    with pytest.raises(InputError, match=message):
        load_assembly(path)


def test_numbers_are_finite(tmp_path):
    text = json.dumps(GOOD).replace("0.006", "1e999").replace("0.004", "NaN")
    path = tmp_path / "bad.json"
    path.write_text(text, encoding="utf-8")
    with pytest.raises(SchemaError, match=r"section\.height: inf is not a finite"):
        load_assembly(path)


def test_not_text(tmp_path):
    path = tmp_path / "bad.json"
    path.write_bytes(b"\xff\xfe\x00{")
    with pytest.raises(InputError, match="UTF-8"):
        load_assembly(path)


def test_the_published_schema_is_a_schema_and_lists_every_joint_type():
    from jsonschema import Draft202012Validator

    from technic.assembly.joint_types import JointType
    from technic.assembly.shapes import MAKERS

    Draft202012Validator.check_schema(schema())
    definitions = schema()["$defs"]
    assert definitions["joint"]["properties"]["type"]["enum"] == [t.value for t in JointType]
    assert definitions["shape"]["properties"]["kind"]["enum"] == list(MAKERS)


# --- two dimensions -----------------------------------------------------------------------------
def plane(joint, **support):
    return {
        "schema": "technic-assembly/1",
        "dimension": 2,
        "parts": [
            {"id": "a", "shape": {"kind": "bar", "points": [[0, 0], [0.1, 0]], "section": SQUARE}},
            {"id": "b", "shape": {"kind": "rigid", "points": [[0.1, 0, 0], [0.1, 0.1]]}},
        ],
        "joints": [{"parts": ["a", "b"], "point": [0.1, 0], **joint}],
        "supports": [{"part": "a", **support}] if support else [],
    }


@pytest.mark.parametrize(
    ("joint", "mobility"),
    [
        ({"type": "fixed"}, 0),
        ({"type": "hinge"}, 1),
        ({"type": "ball"}, 1),
        ({"type": "slider", "axis": [1, 1]}, 1),
        ({"type": "cylindrical", "axis": [1, 1]}, 1),
        ({"type": "cylindrical", "axis": [0, 0, 1]}, 1),
        ({"type": "planar", "axis": [1, 1]}, 1),
        ({"type": "planar", "axis": [0, 0, 1]}, 3),
        ({"type": "universal", "axis": [1, 0], "axis2": [0, 1]}, 0),
        ({"type": "universal", "axis": [0, 0, 1], "axis2": [0, 1]}, 1),
        ({"type": "slot", "axis2": [0, 1]}, 2),
    ],
)
def test_joints_in_the_plane(joint, mobility):
    from technic.rigidity.analyze import analyze

    report = analyze(build_assembly(plane(joint)))
    assert report.mobility.total == mobility


@pytest.mark.parametrize(
    ("joint", "message"),
    [
        ({"type": "slider"}, r"axis: is missing"),
        ({"type": "slider", "axis": [1, 0, 1]}, r"axis: is askew"),
        ({"type": "hinge", "point": [0, 0, 1]}, r"point\[2\]: must be 0"),
    ],
)
def test_faults_in_the_plane(joint, message):
    with pytest.raises(SchemaError, match=message):
        build_assembly(plane(joint))


def test_a_support_in_the_plane_holds_something():
    assert build_assembly(plane({"type": "hinge"}, held=["x", "z"])).supports[0].held.sum() == 1
    with pytest.raises(SchemaError, match=r"\$\.supports\[0\]\.held: holds nothing"):
        build_assembly(plane({"type": "hinge"}, held=["z"]))


def test_a_plate_in_space_weighs_what_it_is():
    side, thickness = 0.1, 0.004
    turn = Rotation.from_rotvec([0.3, 1.1, -0.4]).as_matrix()
    flat = np.array([(0, 0, 0), (side, 0, 0), (side, side / 2, 0), (0, side / 2, 0)])
    linkage = Linkage(3)
    linkage.plate("plate", *(flat @ turn.T + 0.02), thickness=thickness)
    part = linkage.assembly().parts[0]
    mass = part.mass_properties
    a, b, c = side, side / 2, thickness
    assert mass.mass == pytest.approx(1050 * a * b * c)
    assert mass.centroid == pytest.approx(turn @ [a / 2, b / 2, 0] + 0.02)
    box = mass.mass / 12 * np.diag([b * b + c * c, a * a + c * c, a * a + b * b])
    assert mass.inertia == pytest.approx(turn @ box @ turn.T, abs=1e-12)
    element = build_element(part.body, mass, np.zeros((0, 3)))
    assert element.rigid.T @ element.mass @ element.rigid == pytest.approx(
        np.block([[np.eye(3) * mass.mass, np.zeros((3, 3))], [np.zeros((3, 3)), mass.inertia]]),
        abs=1e-9,
    )
    assert np.abs(element.stiffness @ element.rigid).max() < 1e-9 * np.abs(element.stiffness).max()


@pytest.mark.parametrize(
    ("corners", "fault"),
    [
        ([(0, 0, 0), (1, 0, 0), (1, 1, 0.1), (0, 1, 0)], "leaves the plane of the others"),
        ([(0, 0, 0), (1, 0, 0), (2, 0, 0)], "encloses no area"),
    ],
)
def test_a_plate_in_space_is_flat(corners, fault):
    linkage = Linkage(3)
    linkage.plate("plate", *corners, thickness=0.01)
    with pytest.raises(SchemaError, match=fault) as caught:
        linkage.assembly()
    assert "$.parts[0].shape.points" in str(caught.value)
