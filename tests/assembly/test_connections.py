"""Joints of an assembly file that take their stiffness from the table."""

from __future__ import annotations

import numpy as np
import pytest

from technic.assembly.builder import Linkage
from technic.assembly.file import build_assembly
from technic.assembly.stiffness import default_table
from technic.assembly.writing import to_document
from technic.errors import SchemaError


def document(**joint):
    linkage = Linkage()
    linkage.bar("a", (0, 0, 0), (0.1, 0, 0))
    linkage.bar("b", (0, 0, 0), (0, 0.1, 0))
    kind = joint.pop("type", "hinge")
    linkage.joint(kind, "a", "b", at=(0, 0, 0), axis=(0, 0, 1), **joint)
    return linkage.document()


def test_values_and_provenance_come_from_the_table():
    (joint,) = build_assembly(document(connection="pin/pin_hole")).joints
    entry = default_table().get("pin/pin_hole")
    assert joint.connection == "pin/pin_hole"
    assert np.array_equal(joint.stiffness[joint.held], entry.vector()[joint.held])
    assert joint.stiffness[3] == 0.0
    assert joint.provenance == "paper"


def test_written_and_read_again_it_still_names_the_connection():
    assembly = build_assembly(document(connection="pin/pin_hole"))
    written = to_document(assembly)
    assert written["joints"][0]["connection"] == "pin/pin_hole"
    assert "stiffness" not in written["joints"][0]
    (again,) = build_assembly(written).joints
    assert np.array_equal(again.stiffness, assembly.joints[0].stiffness)
    assert again.provenance == assembly.joints[0].provenance


@pytest.mark.parametrize(
    ("joint", "said"),
    [
        ({"connection": "pin/pinhole"}, "has no 'pin/pinhole'; it has axle/axle_hole"),
        ({"connection": "pin/pin_hole", "type": "fixed"}, "has no spin in the stiffness table"),
        ({"connection": "pin/pin_hole", "stiffness": "rigid"}, "'stiffness' says it too"),
        ({"connection": "pin/pin_hole", "jitter": {"shear": 1e-4}}, "'jitter' says it too"),
    ],
)
def test_what_cannot_be_is_refused_with_its_path(joint, said):
    with pytest.raises(SchemaError) as caught:
        build_assembly(document(**joint))
    assert "$.joints[0].connection" in str(caught.value)
    assert said in str(caught.value)
