"""What must not depend on how the model is written down, and what must balance."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from scipy.spatial.transform import Rotation

from technic.assembly.joint_types import JointType
from technic.geometry import Pose
from technic.rigidity.analyze import analyze
from technic.system.assemble import assemble
from tests.mechanics import PLASTIC, assembly, beam, block, joint, moved


def random_assembly(seed, parts):
    """Beams and blocks joined in a tree with a few loops."""
    rng = np.random.default_rng(seed)
    where = rng.uniform(-0.1, 0.1, (parts, 3))
    made = []
    for k, at in enumerate(where):
        if rng.random() < 0.5:
            made.append(block(f"p{k}", at, rng.uniform(0.01, 0.1)))
        else:
            end = at + rng.uniform(0.02, 0.1, 3)
            made.append(beam(f"p{k}", at, end, 0.004, material=PLASTIC, stretch=0.03))
    joints = []
    pairs = [(int(rng.integers(k)), k) for k in range(1, parts)]
    pairs += [
        tuple(sorted(map(int, rng.choice(parts, 2, replace=False)))) for _ in range(parts // 2)
    ]
    for n, (a, b) in enumerate(pairs):
        kind = list(JointType)[rng.integers(len(JointType))]
        point = (where[a] + where[b]) / 2 + rng.uniform(-0.01, 0.01, 3)
        stiffness = np.concatenate([10 ** rng.uniform(3, 6, 3), 10 ** rng.uniform(-2, 1, 3)])
        made_joint = joint(a, b, point, kind, rng.normal(size=3), stiffness)
        joints.append(replace(made_joint, id=f"j{n}"))
    return assembly(made, joints)


@settings(max_examples=15)
@given(seed=st.integers(0, 10**6), parts=st.integers(2, 9))
def test_moving_and_renumbering_change_nothing(seed, parts):
    model = random_assembly(seed, parts)
    rng = np.random.default_rng(seed + 1)
    turn = Rotation.from_rotvec(rng.normal(size=3)).as_matrix()
    elsewhere = moved(model, Pose(turn, rng.uniform(-1, 1, 3)))
    order = rng.permutation(parts)
    place = np.argsort(order)
    renumbered = replace(
        model,
        parts=tuple(model.parts[k] for k in order),
        joints=tuple(
            replace(j, parts=(int(place[j.parts[0]]), int(place[j.parts[1]])))
            for j in reversed(model.joints)
        ),
    )
    reference = analyze(model)
    for other in (analyze(elsewhere), analyze(renumbered)):
        assert other.mobility.total == reference.mobility.total
        assert other.mobility.structural == reference.mobility.structural
        assert (other.rigidity is None) == (reference.rigidity is None)
        if reference.rigidity is not None:
            assert other.rigidity.value == pytest.approx(
                reference.rigidity.value, rel=1e-4
            )  # springs a billion times stiffer than the softest mode leave six digits of it


@settings(max_examples=15)
@given(seed=st.integers(0, 10**6), parts=st.integers(2, 9))
def test_energy_and_load_balance(seed, parts):
    report = analyze(random_assembly(seed, parts))
    if report.rigidity is None:
        return
    assert sum(s.energy_share for s in report.weak_spots) == pytest.approx(1.0)
    worst = report.modes[0]
    assert worst.value == pytest.approx(report.rigidity.value)
    points = np.array([p.centroid for p in report.assembly.parts])
    force, moment = worst.forces[:, :3], worst.forces[:, 3:]
    scale = np.abs(worst.forces).max()
    assert np.abs(force.sum(axis=0)).max() < 1e-6 * scale
    assert np.abs((moment + np.cross(points, force)).sum(axis=0)).max() < 1e-6 * scale


@settings(max_examples=15)
@given(seed=st.integers(0, 10**6), parts=st.integers(2, 9))
def test_matrices_are_what_they_should_be(seed, parts):
    system = assemble(random_assembly(seed, parts))
    k, m = system.K.toarray(), system.M.toarray()
    assert np.abs(k - k.T).max() <= 1e-9 * max(np.abs(k).max(), 1e-300)
    assert np.abs(system.K @ system.R.toarray()).max(initial=0.0) <= 1e-9 * max(
        np.abs(k).max(), 1.0
    )
    assert np.linalg.eigvalsh(m).min() > 0.0
    # a rigid translation of everything by 1 m has a mean square of 1 m2
    ones = np.tile([1.0, 0, 0, 0, 0, 0], parts)
    x = system.R @ ones
    assert x @ (system.M @ x) == pytest.approx(1.0)


@settings(max_examples=15)
@given(seed=st.integers(0, 10**6), parts=st.integers(3, 9))
def test_another_joint_never_adds_mobility(seed, parts):
    model = random_assembly(seed, parts)
    fewer = replace(model, joints=model.joints[:-1])
    # a joint that ties two components together also takes away six rigid motions
    more_motions = analyze(model).mobility.total + 6 * len(analyze(model).components)
    assert more_motions <= analyze(fewer).mobility.total + 6 * len(analyze(fewer).components)


def test_a_mirrored_part_is_as_stiff_as_its_twin():
    plain = beam("b", [0, 0, 0], [0.1, 0.02, 0.01], 0.004, stretch=0.03)
    other = block("c", [0.2, 0.03, 0.0], 0.05)
    tie = joint(0, 1, [0.1, 0.02, 0.01], JointType.FIXED, (1, 2, 3), [1e4] * 3 + [0.1] * 3)
    model = assembly([plain, other], [tie])
    mirror = Pose(np.diag([1.0, 1.0, -1.0]), np.zeros(3))
    a, b = analyze(model), analyze(moved(model, mirror))
    assert [x.value for x in b.modes] == pytest.approx([x.value for x in a.modes], rel=1e-9)
