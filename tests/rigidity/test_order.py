"""Mechanism or shaking: the finite step on cases whose answer is known."""

from __future__ import annotations

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from technic.assembly.joint_types import JointType
from technic.geometry import rotation_matrix, rotation_vector
from technic.ldraw.reader import load_ldraw
from technic.rigidity.analyze import analyze
from technic.rigidity.result import MotionKind
from tests.mechanics import assembly, block, clamp, joint


def orders(report):
    return sorted(m.order for m in report.motions if m.kind is MotionKind.STRUCTURAL)


@pytest.mark.parametrize(
    ("name", "finite"),
    [
        ("hinged_L.ldr", {1}),
        ("square.ldr", {1}),
        ("trapezoid.ldr", {0}),
        ("cube7.ldr", {4, 5}),
        ("cube9_simple.ldr", {4, 5}),
    ],
)
def test_motions_of_real_frames(model, name, finite):
    report = analyze(load_ldraw(model(name)))
    found = orders(report)
    assert len(found) == report.mobility.structural
    assert found.count("finite") in finite


def four_bar(lengths):
    """Planar four-bar, hinges along z, ground link clamped; collinear when the lengths say so."""
    a, b, c, d = lengths
    parts = [block("ground", [0, 0, 0]), block("crank", [a / 2, 0, 0.01])]
    if a + b + c == d:  # flat: all pivots on the x axis
        pivots = [[0, 0, 0], [a, 0, 0], [a + b, 0, 0], [d, 0, 0]]
    else:  # a parallelogram standing upright
        pivots = [[0, 0, 0], [0, a, 0], [d, c, 0], [d, 0, 0]]
    middle = np.array(pivots, float)
    parts = [
        block("ground", (middle[0] + middle[3]) / 2),
        block("crank", (middle[0] + middle[1]) / 2),
        block("coupler", (middle[1] + middle[2]) / 2),
        block("rocker", (middle[2] + middle[3]) / 2),
    ]
    joints = [
        joint(a, b, p, JointType.HINGE, stiffness=1e4)
        for (a, b), p in zip([(0, 1), (1, 2), (2, 3), (3, 0)], pivots, strict=True)
    ]
    return assembly(parts, joints, [clamp(0, middle[0])])


def test_a_parallelogram_is_a_mechanism():
    report = analyze(four_bar((0.05, 0.1, 0.05, 0.1)))
    assert orders(report) == ["finite"]


def test_a_flat_four_bar_only_shakes():
    # stretched to its full length it has a first-order motion and no path
    report = analyze(four_bar((0.03, 0.04, 0.03, 0.1)))
    assert report.mobility.structural >= 1
    assert set(orders(report)) == {"first-order"}


def test_rotations_match_scipy():
    rng = np.random.default_rng(0)
    for size in (0.0, 1e-9, 1e-4, 1.0, 3.0, np.pi - 1e-6):
        v = rng.normal(size=(50, 3))
        v *= size / np.linalg.norm(v, axis=1)[:, None]
        matrices = rotation_matrix(v)
        assert np.abs(matrices - Rotation.from_rotvec(v).as_matrix()).max() < 1e-14
        assert rotation_vector(matrices) == pytest.approx(v, abs=1e-9)
