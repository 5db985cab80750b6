"""The stiffness table: its values, its format, its faults."""

from __future__ import annotations

import math

import numpy as np
import pytest

from technic.assembly.joint_types import JointType
from technic.assembly.stiffness import MOTIONS, default_table, read_table
from technic.errors import InputError, SchemaError, UsageError
from technic.ldraw.gears import CONNECTION as GEARS
from technic.ldraw.matching import MATES
from technic.ldraw.seats import DOGS, HINGE, PLANET, RING, TURNTABLE, TYRE


def test_every_connection_has_an_entry():
    known = {*MATES.values(), TYRE, TURNTABLE, PLANET, RING, DOGS, HINGE, GEARS}
    assert known == set(default_table().connections)


def test_pin_has_the_papers_values():
    entry = default_table().get("pin/pin_hole")
    assert entry.type is JointType.HINGE
    np.testing.assert_allclose(entry.vector(), [1e8, 65625, 65625, 0, 0.24, 0.24])
    assert entry.values["tilt"].value == pytest.approx(14992 * 0.004**2, rel=1e-3)
    assert entry.provenance(entry.held()) == "paper"


def test_other_connections_have_the_papers_default_and_say_it_is_assumed():
    for key, entry in default_table().connections.items():
        if key in ("pin/pin_hole", GEARS):
            continue
        assert {v.provenance for v in entry.values.values()} == {"assumed"}
        for motion, value in entry.values.items():
            arm = 0.02 if key == "turntable/turntable" else 0.004
            expected = 1e4 if motion in ("axial", "shear") else 1e4 * arm**2
            assert math.isclose(value.value, expected)


def test_every_provenance_has_a_source():
    table = default_table()
    used = {v.provenance for entry in table.connections.values() for v in entry.values.values()}
    assert used == set(table.sources)


def test_unknown_connection():
    with pytest.raises(UsageError, match="no connection 'glue'"):
        default_table().get("glue")


GOOD = """
schema = "technic-stiffness/1"
[connection."pin/pin_hole"]
type = "hinge"
axial = { value = 2e7, provenance = "paper" }
shear = { value = 5e4, provenance = "calibrated", interval_95 = [4e4, 6e4] }
tilt = { value = 0.3, provenance = "calibrated", interval_95 = [0.2, 0.4] }
spin = { value = 0.01, provenance = "assumed" }
"""


def test_a_table_of_ones_own(tmp_path):
    path = tmp_path / "mine.toml"
    path.write_text(GOOD, encoding="utf-8")
    table = read_table(path)
    assert table.name == "mine"
    entry = table.get("pin/pin_hole")
    assert entry.values["shear"].interval_95 == (4e4, 6e4)
    # A spin stiffness holds the spin.
    assert entry.held().all()
    assert (
        entry.provenance(entry.held()) == "paper (axial), calibrated (shear, tilt), assumed (spin)"
    )
    # What it leaves out is the shipped table's.
    assert table.get("ball/socket") == default_table().get("ball/socket")


@pytest.mark.parametrize(
    ("old", "new", "fault"),
    [
        ("technic-stiffness/1", "other/1", "schema"),
        ('type = "hinge"', 'type = "glue"', "'glue' is not a joint type"),
        ("value = 2e7", "value = -1", "positive"),
        ("value = 2e7", "value = nan", "positive"),
        ("value = 2e7", 'value = "x"', "positive"),
        ("value = 2e7", "value = true", "positive"),
        (', provenance = "paper"', "", "provenance: missing"),
        ("[4e4, 6e4]", "[6e4, 4e4]", "interval_95"),
        ("[4e4, 6e4]", "[4e4]", "interval_95"),
        ("axial = ", "sideways = ", "axial: missing"),
        ("axial = ", "sideways = ", "sideways: unknown key"),
    ],
)
def test_faults_are_named(tmp_path, old, new, fault):
    assert old in GOOD
    path = tmp_path / "bad.toml"
    path.write_text(GOOD.replace(old, new), encoding="utf-8")
    with pytest.raises(SchemaError, match="fault") as error:
        read_table(path)
    assert fault in str(error.value)
    assert str(path) in str(error.value)


def test_no_table(tmp_path):
    with pytest.raises(InputError, match="cannot read"):
        read_table(tmp_path / "none.toml")
    (tmp_path / "broken.toml").write_text("schema = ", encoding="utf-8")
    with pytest.raises(InputError, match="not a TOML file"):
        read_table(tmp_path / "broken.toml")


def test_motions_cover_the_six_slots():
    assert MOTIONS == ("axial", "shear", "spin", "tilt")
