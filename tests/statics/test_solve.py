"""Static displacement against textbook formulas."""

from __future__ import annotations

import numpy as np
import pytest

from technic.assembly.joint_types import JointType
from technic.errors import UsageError
from technic.statics.solve import Load, deflect
from technic.system.assemble import Probe
from tests.mechanics import STEEL, assembly, beam, block, clamp, joint

L, SIDE = 0.5, 0.01
AREA, INERTIA = SIDE**2, SIDE**4 / 12
G = STEEL.young_pa / 2.6


def load(part, at, force=(0, 0, 0), moment=(0, 0, 0)):
    return Load(part, np.array(at, float), np.array(force, float), np.array(moment, float))


def cantilever():
    return assembly([beam("b", [0, 0, 0], [L, 0, 0], SIDE)], supports=[clamp(0, [0, 0, 0])])


def test_cantilever_under_a_tip_force():
    # Timoshenko: P L^3 / 3 E I + P L / (5/6 G A)
    answer = deflect(cantilever(), (load(0, [L, 0, 0], [0, -3.0, 0]),))
    expected = 3 * L**3 / (3 * STEEL.young_pa * INERTIA) + 3 * L / (5 / 6 * G * AREA)
    assert answer.probe_twists[0, 1] == pytest.approx(-expected, rel=1e-8)
    slope = 3 * L**2 / (2 * STEEL.young_pa * INERTIA)
    assert answer.probe_twists[0, 5] == pytest.approx(-slope, rel=1e-8)
    assert answer.reactions[0] == pytest.approx([0, 3, 0, 0, 0, 3 * L], abs=1e-6)
    assert answer.work == pytest.approx(3 * expected, rel=1e-8)


def test_bar_stretches_and_twists():
    answer = deflect(cantilever(), (load(0, [L, 0, 0], [100, 0, 0], [2, 0, 0]),))
    assert answer.probe_twists[0, 0] == pytest.approx(100 * L / (STEEL.young_pa * AREA), rel=1e-8)
    assert answer.probe_twists[0, 3] == pytest.approx(2 * L / (G * 0.1406 * SIDE**4), rel=1e-8)


def test_cantilever_under_its_own_weight():
    # w L^4 / 8 E I with twenty elements; shear adds w L^2 / 2 k G A
    model = assembly(
        [beam("b", [0, 0, 0], [L, 0, 0], SIDE, stretch=L / 20)], supports=[clamp(0, [0, 0, 0])]
    )
    answer = deflect(model, (), gravity=[0, -9.81, 0], probes=(Probe(0, np.array([L, 0, 0])),))
    w = STEEL.density * AREA * 9.81
    expected = w * L**4 / (8 * STEEL.young_pa * INERTIA) + w * L**2 / (2 * 5 / 6 * G * AREA)
    assert answer.probe_twists[0, 1] == pytest.approx(-expected, rel=1e-3)
    assert answer.reactions[0, 1] == pytest.approx(w * L, rel=1e-8)


def test_a_spring_joint_carries_the_load():
    model = assembly(
        [block("a", [0, 0, 0]), block("b", [0.1, 0, 0])],
        [joint(0, 1, [0.05, 0, 0], axis=(1, 0, 0), stiffness=[500.0, *[1e6] * 5])],
        [clamp(0, [0, 0, 0])],
    )
    answer = deflect(model, (load(1, [0.1, 0, 0], [2.0, 0, 0]),))
    assert answer.part_twists[1, 0] == pytest.approx(2 / 500, rel=1e-8)
    assert answer.joint_forces[0] == pytest.approx([-2, 0, 0, 0, 0, 0], abs=1e-6)


def test_a_free_model_takes_balanced_loads_only():
    model = assembly([beam("b", [0, 0, 0], [L, 0, 0], SIDE)])
    pull = (load(0, [0, 0, 0], [-9, 0, 0]), load(0, [L, 0, 0], [9, 0, 0]))
    answer = deflect(model, pull)
    stretch = answer.probe_twists[1, 0] - answer.probe_twists[0, 0]
    assert stretch == pytest.approx(9 * L / (STEEL.young_pa * AREA), rel=1e-8)
    with pytest.raises(UsageError, match="nothing resists"):
        deflect(model, pull[:1])


def test_a_load_that_drives_a_hinge_is_refused():
    model = assembly(
        [block("a", [0, 0, 0]), block("b", [0.1, 0, 0])],
        [joint(0, 1, [0, 0, 0], JointType.HINGE, stiffness=1e5)],
        [clamp(0, [0, 0, 0])],
    )
    with pytest.raises(UsageError, match="nothing resists"):
        deflect(model, (load(1, [0.1, 0, 0], [0, 1, 0]),))
    answer = deflect(model, (load(1, [0.1, 0, 0], [1, 0, 0]),))
    assert answer.part_twists[1, 0] == pytest.approx(1e-5, rel=1e-6)
