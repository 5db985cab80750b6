"""Static answers in the plane, through the assembly file, against statics written down by hand."""

from __future__ import annotations

import numpy as np
import pytest

from technic.assembly.builder import Linkage
from technic.statics.solve import Load, deflect


def pull(model, part, at, force):
    load = Load(model.index(part), np.array([*at, 0.0]), np.array([*force, 0.0]), np.zeros(3))
    return deflect(model, (load,))


def test_truss_of_two_bars():
    # two bars at 45 degrees, pushed down at the top: each carries P / sqrt 2
    area, young, size, push = 1e-5, 2.2e9, 0.1, 10.0
    frame = Linkage(2)
    frame.truss("left", (-size, 0), (0, size), area=area)
    frame.truss("right", (size, 0), (0, size), area=area)
    frame.hinge("left", "right", at=(0, size), stiffness="rigid")
    frame.fix("left", at=(-size, 0), held="xy")
    frame.fix("right", at=(size, 0), held="xy")
    answer = pull(frame.assembly(), "left", (0, size), (0, -push))
    length = size * np.sqrt(2)
    expected = push * length / (young * area)  # P L / (2 E A cos^2 45)
    assert answer.probe_twists[0, :2] == pytest.approx([0, -expected], rel=1e-6, abs=1e-9)
    np.testing.assert_allclose(answer.reactions[:, :2], [[5, 5], [-5, 5]], rtol=1e-6)
    assert answer.part_twists[0, 2:5] == pytest.approx([0, 0, 0])


def test_cantilever_in_the_plane():
    # Timoshenko, with Cowper's shear coefficient of a rectangle
    length, width, height, young, nu, push = 0.1, 0.004, 0.01, 2.2e9, 0.35, 2.0
    arm = Linkage(2)
    section = {"kind": "rectangle", "width": width, "height": height}
    arm.bar("arm", (0, 0), (length, 0), section=section)
    arm.fix("arm", at=(0, 0))
    answer = pull(arm.assembly(), "arm", (length, 0), (0, push))
    inertia, area = width * height**3 / 12, width * height
    shear = 10 * (1 + nu) / (12 + 11 * nu) * young / (2 * (1 + nu)) * area
    expected = push * length**3 / (3 * young * inertia) + push * length / shear
    assert answer.probe_twists[0, 1] == pytest.approx(expected, rel=1e-8)
    assert answer.reactions[0] == pytest.approx([0, -push, 0, 0, 0, -push * length], abs=1e-7)


def test_plate_pulled_along():
    # a strip in tension, gripped at its ends: P L / E A between the grips, which are a patch long
    strip = Linkage(2)
    corners = [(0, 0), (0.2, 0), (0.2, 0.01), (0, 0.01)]
    strip.plate("strip", *corners, thickness=0.002, size=0.004)
    strip.fix("strip", at=(0, 0.005))
    answer = pull(strip.assembly(), "strip", (0.2, 0.005), (20.0, 0))
    whole = 20.0 * 0.2 / (2.2e9 * 0.002 * 0.01)
    assert answer.probe_twists[0, 0] == pytest.approx(whole, rel=0.03)
