"""Any LDraw model with a clamped part, a loaded hole and a measured point can be a rig."""

from __future__ import annotations

import numpy as np
import pytest

from calibration.dataset import COLUMNS, GRAVITY
from calibration.rigs import Condition, read_rigs
from technic.assembly.stiffness import default_table
from technic.errors import TechnicError
from technic.statics.calibration import calibrate
from technic.statics.forward import forward_model
from technic.system.parameters import Parameter

MODEL = """0 A shelf on two frictionless pins, screwed to the table by its end holes
1 71 0 0 0 1 0 0 0 1 0 0 0 1 32524.dat
1 7 0 -10 0 0 -1 0 1 0 0 0 0 1 3673.dat
1 7 0 -10 20 0 -1 0 1 0 0 0 0 1 3673.dat
1 4 80 -20 40 0 0 -1 0 -1 0 -1 0 0 32526.dat
"""
RIGS = """schema = "technic-rigs/1"
[rig.shelf]
model = "shelf.ldr"
clamped = ["32524:hole1", "32524:hole7"]
loads = [{ place = "32526:hole1", span_mm = 32 }]
joints = { "pin/pin_hole" = ["shear", "tilt"] }
[rig.shelf.pose.level]
down = [0, 1, 0]
turn = [1, 0, 0]
[rig.shelf.pose.upright]
down = [0, 0, 1]
turn = [1, 0, 0]
angle_deg = 90
"""
PINS = (Parameter("pin/pin_hole", "shear"), Parameter("pin/pin_hole", "tilt"))
TRUTH = np.array([41000.0, 0.35])


@pytest.fixture
def folder(tmp_path):
    (tmp_path / "shelf.ldr").write_text(MODEL)
    (tmp_path / "rigs.toml").write_text(RIGS)
    return tmp_path


def readings(folder):
    """Exact readings of both poses, weights hung and tapped."""
    rigs = read_rigs(folder / "rigs.toml")
    place = rigs["shelf"].loads[0].place
    forward = forward_model(rigs, [("shelf", place)], PINS, default_table())
    lines = [",".join(COLUMNS)]
    for pose, angle in (("level", 0.0), ("upright", 90.0)):
        for load in (20, 60):
            sag = Condition("shelf", pose, angle, place)
            tap = Condition("shelf", pose, angle, place, tap=True, mass=load * 1e-3)
            answer = forward([sag, tap], np.log(TRUTH))
            down = 1e3 * float(answer.per_newton[0]) * load * 1e-3 * GRAVITY
            lines.append(f"t,pin/pin_hole,shelf,{pose},,1,1,,{load},{down!r},0,0.1,,,,")
            hertz = float(answer.frequency[1])
            lines.append(f"t,pin/pin_hole,shelf,{pose},,1,1,,{load},,,,{hertz!r},0.1,,")
    path = folder / "r.csv"
    path.write_text("\n".join(lines))
    return path


def test_a_rig_of_ones_own_returns_the_truth(folder):
    result = calibrate(readings(folder), rigs=folder / "rigs.toml")
    assert [m.value for m in result.measured] == pytest.approx(TRUTH, rel=1e-6)
    assert all(m.identifiable for m in result.measured)


@pytest.mark.parametrize(
    ("old", "new", "said"),
    [
        ("32524:hole7", "32524:hole70", "hole70"),
        ("32526:hole1", "3001:hole1", "3001"),
        ('"pin/pin_hole" =', '"stud/tube" =', "stud/tube"),
        ('clamped = ["32524:hole1", "32524:hole7"]', 'clamped = ["7:3673"]', "7:3673"),
    ],
)
def test_what_is_wrong_with_it_is_said(folder, old, new, said):
    path = readings(folder)
    rigs = folder / "rigs.toml"
    assert old in rigs.read_text()
    rigs.write_text(rigs.read_text().replace(old, new))
    with pytest.raises(TechnicError, match=said):
        calibrate(path, rigs=rigs)


def test_a_rig_that_nothing_holds_is_refused(folder):
    path = readings(folder)
    rigs = folder / "rigs.toml"
    # a frictionless pin turns in its hole, and all the rest with it
    rigs.write_text(rigs.read_text().replace('"32524:hole1", "32524:hole7"', '"2:32524:hole1"'))
    (folder / "shelf.ldr").write_text("\n".join([*MODEL.splitlines()[:3], MODEL.splitlines()[4]]))
    with pytest.raises(TechnicError, match="nothing resists"):
        calibrate(path, rigs=rigs)
