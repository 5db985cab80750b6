"""The mechanics against formulas that stand in textbooks."""

from __future__ import annotations

import numpy as np
import pytest

from technic.assembly.joint_types import JointType
from technic.rigidity.analyze import analyze
from technic.system.assemble import assemble
from tests.mechanics import STEEL, assembly, beam, block, clamp, joint


def frequencies(report, count):
    return np.sqrt([m.value / report.mass for m in report.modes[:count]]) / (2 * np.pi)


def test_free_beam_has_the_textbook_frequencies():
    # Blevins, Formulas for Natural Frequency and Mode Shape (1979), table 8-1: free-free beam
    length, side = 1.0, 0.01
    report = analyze(assembly([beam("b", [0, 0, 0], [length, 0, 0], side, stretch=length / 32)]))
    wave = np.sqrt(STEEL.young_pa * side**4 / 12 / (STEEL.density * side**2)) / (2 * np.pi)
    expected = [4.73004074**2, 4.73004074**2, 7.85320462**2, 7.85320462**2]
    assert frequencies(report, 4) == pytest.approx(np.array(expected) * wave, rel=3e-3)
    assert report.mobility.total == 0


def test_clamped_beam_has_the_textbook_frequency():
    # Blevins (1979), table 8-1: clamped-free beam, 1.87510407
    length, side = 1.0, 0.01
    model = assembly(
        [beam("b", [0, 0, 0], [length, 0, 0], side, stretch=length / 16)],
        supports=[clamp(0, [0, 0, 0])],
    )
    report = analyze(model)
    wave = np.sqrt(STEEL.young_pa * side**4 / 12 / (STEEL.density * side**2)) / (2 * np.pi)
    assert frequencies(report, 1)[0] == pytest.approx(1.87510407**2 * wave, rel=1e-3)


def two_masses(m1, m2, spring):
    return assembly(
        [block("a", [0, 0, 0], m1), block("b", [0.1, 0, 0], m2)],
        [joint(0, 1, [0.05, 0, 0], axis=(1, 0, 0), stiffness=[spring, *[np.inf] * 5])],
    )


def test_two_masses_on_a_spring():
    m1, m2, spring = 0.3, 0.7, 1234.0
    report = analyze(two_masses(m1, m2, spring))
    omega2 = spring * (m1 + m2) / (m1 * m2)
    assert report.rigidity.value == pytest.approx((m1 + m2) * omega2, rel=1e-9)
    assert report.rigidity.frequency_hz == pytest.approx(np.sqrt(omega2) / (2 * np.pi), rel=1e-9)


def test_springs_in_parallel_add():
    single = two_masses(1.0, 1.0, 500.0)
    both = assembly(single.parts, [single.joints[0], single.joints[0]])
    ratio = analyze(both).rigidity.value / analyze(single).rigidity.value
    assert ratio == pytest.approx(2.0, rel=1e-9)


def test_springs_in_series_add_their_compliances():
    # two masses with a body of almost no mass between two springs
    stiff = [np.inf] * 5
    model = assembly(
        [block("a", [0, 0, 0]), block("m", [0.05, 0, 0], 1e-9), block("b", [0.1, 0, 0])],
        [
            joint(0, 1, [0.02, 0, 0], axis=(1, 0, 0), stiffness=[300.0, *stiff]),
            joint(1, 2, [0.08, 0, 0], axis=(1, 0, 0), stiffness=[600.0, *stiff]),
        ],
    )
    series = 1 / (1 / 300 + 1 / 600)
    assert analyze(model).rigidity.value == pytest.approx(2.0 * series * 2.0, rel=1e-6)


@pytest.mark.parametrize("ratio", [1e-6, 0.25, 1.0, 1e3])
def test_portal_frame_sways_as_the_textbook_says(ratio):
    # Chopra, Dynamics of Structures, eq. 1.3.5: k = 24 E Ic / h^3 (12 r + 1) / (12 r + 4),
    # r = Ib / (4 Ic) with the beam twice as long as the columns are high; no axial or shear strain
    h, side = 1.0, 0.02
    inertia = side**4 / 12
    columns = [
        beam("c1", [0, 0, 0], [0, h, 0], side, shear=False),
        beam("c2", [2 * h, 0, 0], [2 * h, h, 0], side, shear=False),
    ]
    girder = beam("g", [0, h, 0], [2 * h, h, 0], side * (4 * ratio) ** 0.25, shear=False)
    model = assembly(
        [*columns, girder],
        [joint(0, 2, [0, h, 0]), joint(1, 2, [2 * h, h, 0])],
        [clamp(0, [0, 0, 0]), clamp(1, [2 * h, 0, 0])],
    )
    system = assemble(model)
    n, c = system.size, system.A.shape[0]
    k = np.zeros((n + c, n + c))
    k[:n, :n] = system.K.toarray()
    k[n:, :n] = system.A.toarray()
    k[:n, n:] = k[n:, :n].T
    # half of the sway force at either end, so that the girder's stretch plays no part
    load = np.zeros(n + c)
    nodes = system.elements[2].nodes
    load[system.part_slice(2)] = nodes[0, 0] / 2 + nodes[1, 0] / 2
    answer = np.linalg.lstsq(k, load, rcond=1e-14)[0]
    sway = nodes[0, 0] @ answer[:n][system.part_slice(2)]
    expected = 24 * STEEL.young_pa * inertia / h**3 * (12 * ratio + 1) / (12 * ratio + 4)
    assert 1 / sway == pytest.approx(expected, rel=5e-3)


def test_two_beams_on_one_pin_fold_and_on_two_pins_do_not():
    def model(pins):
        parts = [
            beam("a", [0, 0, 0], [0.1, 0, 0]),
            beam("b", [0, 0, 0.01], [0.1, 0, 0.01]),
        ]
        joints = [
            joint(0, 1, [x, 0, 0.005], JointType.HINGE, stiffness=1e5) for x in (0.0, 0.05)[:pins]
        ]
        return assembly(parts, joints)

    one, two = analyze(model(1)), analyze(model(2))
    assert (one.verdict, one.mobility.structural) == ("flexible", 1)
    assert (two.verdict, two.mobility.structural) == ("rigid", 0)
    axis = one.motions[0]
    assert axis.type == "rotation"
    assert np.abs(axis.axis_direction) == pytest.approx([0, 0, 1], abs=1e-9)
    assert axis.axis_point[:2] == pytest.approx([0, 0], abs=1e-9)
