"""Verdicts on real models, counted independently by others (README of the shared models)."""

from __future__ import annotations

import pytest

from technic.ldraw.reader import load_ldraw
from technic.rigidity.analyze import analyze
from technic.rigidity.result import MotionKind

SMALL = {
    "hinged_L.ldr": (2, 1),
    "triangle.ldr": (3, 0),
    "square.ldr": (5, 1),
    "trapezoid.ldr": (7, 1),
    "cube7.ldr": (23, 7),
    "cube9_simple.ldr": (23, 7),
}


@pytest.mark.parametrize("name", SMALL)
def test_small_models_have_exactly_the_stated_motions(model, name):
    report = analyze(load_ldraw(model(name)))
    assert (report.mobility.total, report.mobility.structural) == SMALL[name]
    assert report.verdict == ("rigid" if SMALL[name][1] == 0 else "flexible")
    assert not report.assembly.unknown
    listed = sum(m.kind is MotionKind.STRUCTURAL for m in report.motions)
    assert listed == report.mobility.structural


def test_the_square_says_which_beams_turn_about_which_pins(model):
    report = analyze(load_ldraw(model("square.ldr")))
    (motion,) = (m for m in report.motions if m.kind is MotionKind.STRUCTURAL)
    numbers = {report.assembly.parts[p].number for p in motion.parts}
    assert numbers == {"32316"}
    assert len(motion.parts) == 3
    # every beam turns against its neighbours at both of its pins
    freed = {p for k in motion.freed_by for p in report.assembly.joints[k].parts}
    assert {report.assembly.parts[p].number for p in freed} == {"32316", "2780"}
    assert motion.sentence.count("turns about Pin") == 2
    assert "shifts along" in motion.sentence


def test_the_hinge_turns_about_its_pin(model):
    report = analyze(load_ldraw(model("hinged_L.ldr")))
    motion = report.motions[0]
    assert motion.type == "rotation"
    pin = next(p for p in report.assembly.parts if p.number == "2780")
    arm = pin.centroid - motion.axis_point
    along = motion.axis_direction
    assert abs(arm - (arm @ along) * along).max() < 1e-6
    assert [abs(x) for x in along] == pytest.approx([0, 1, 0], abs=1e-9)
