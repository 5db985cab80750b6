"""The second-order test: curvature of every joint, self-stresses, and the search for a definite one."""

from __future__ import annotations

import numpy as np
import pytest

from technic.assembly.builder import Linkage
from technic.assembly.joint_types import JointType
from technic.ldraw.reader import load_ldraw
from technic.rigidity.analyze import analyze
from technic.rigidity.finite import body_links, jacobian, joint_gaps, start, step
from technic.rigidity.kinematics import component_motions, kinematics
from technic.rigidity.result import MotionKind
from technic.rigidity.second_order import row_curvature
from technic.rigidity.semidefinite import positive_combination
from tests.rigidity import special


def structural(report):
    return [m for m in report.motions if m.kind is MotionKind.STRUCTURAL]


def joined(kind, dimension):
    """Two parts with one joint of a kind, and a support of a point."""
    linkage = Linkage(dimension)
    p, q, r = np.eye(3)[:, :dimension] * 0.1 + 0.02
    linkage.bar("a", p, q)
    linkage.bar("b", q, r)
    options = {}
    if dimension == 3 and kind not in (JointType.BALL, JointType.FIXED):
        options["axis"] = [0.3, -0.5, 0.8]
    if kind in (JointType.UNIVERSAL, JointType.SLOT):
        options["axis2"] = [0.8, 0.48, 0.0] if dimension == 3 else [0.6, 0.8]
    elif dimension == 2 and kind in (JointType.SLIDER, JointType.CYLINDRICAL, JointType.PLANAR):
        options["axis"] = [0.6, 0.8]
    linkage.joint(kind.value, "a", "b", at=q, **options)
    linkage.fix("a", at=p, held="xyz"[:dimension])
    return linkage.assembly()


SPATIAL = [k for k in JointType if k not in (JointType.MESH, JointType.FIXED)]


@pytest.mark.parametrize("kind", SPATIAL)
@pytest.mark.parametrize("seed", range(3))
def test_first_and_second_derivatives_are_those_of_the_gaps(kind, seed):
    kin = kinematics(joined(kind, 3))
    bodies, _, links = body_links(kin, kin.components[0], kin.links_of(0))
    begin = start(kin, bodies)
    way = np.random.default_rng(seed).normal(size=(len(bodies), 6))

    def gaps(amount):
        moved = step(begin, amount * way * kin.units)
        return joint_gaps(links, moved, kin.length)[links.held]

    size = 1e-4
    first = (gaps(size) - gaps(-size)) / (2 * size)
    assert jacobian(links, begin, kin.length, kin.dofs) @ way.ravel() == pytest.approx(
        first, abs=1e-6
    )
    second = (gaps(size) + gaps(-size) - 2 * gaps(0.0)) / size**2
    curvature = row_curvature(links, kin, bodies)
    assert curvature == pytest.approx(np.swapaxes(curvature, 1, 2))
    owners = np.repeat(links.parts, links.held.sum(axis=1), axis=0)
    both = np.vstack([way, np.zeros(6)])[owners].reshape(-1, 12)
    predicted = np.einsum("ri,rij,rj->r", both, curvature, both)
    assert predicted == pytest.approx(second, abs=1e-5)


@pytest.mark.parametrize(
    ("forms", "definite"),
    [
        ([[[2.0]]], True),
        ([[[-2.0]]], True),
        ([np.diag([1.0, -1.0])], False),
        ([-np.diag([1.0, 3.0])], True),
        ([np.diag([1.0, -1.0]), np.diag([-1.0, 1.5])], True),
        # definite combinations leave out a positive direction: no off-diagonal helps
        ([np.diag([1.0, -1.0]), np.array([[0.0, 1.0], [1.0, 0.0]])], False),
        ([np.zeros((2, 2))], False),
    ],
)
def test_positive_combinations(forms, definite):
    forms = np.array(forms)
    share = positive_combination(forms)
    assert (share is not None) == definite
    if share is not None:
        assert np.linalg.eigvalsh(np.tensordot(share, forms, 1))[0] > 0


@pytest.mark.parametrize("seed", range(20))
def test_a_hidden_definite_combination_is_found(seed):
    rng = np.random.default_rng(seed)
    size, count = int(rng.integers(2, 7)), int(rng.integers(2, 8))
    count = min(count, size * (size + 1) // 2)
    forms = rng.normal(size=(count, size, size))
    forms = forms + np.swapaxes(forms, 1, 2)
    root = rng.normal(size=(size, size))
    forms[0] = root @ root.T + 0.05 * np.eye(size)
    forms = np.tensordot(rng.normal(size=(count, count)), forms, 1)  # hidden among the others
    share = positive_combination(forms)
    assert share is not None
    assert np.linalg.eigvalsh(np.tensordot(share, forms, 1))[0] > 0


def test_the_stress_test_on_a_stretched_chain_agrees_with_hand_calculation():
    # Two bars in line between two walls: the self-stress is their common force, and moving the middle
    # across lengthens each of them by y^2 / (2 l): resisted.
    points = {"left": (0, 0), "middle": (0.4, 0), "right": (1, 0)}
    model = special.framework(
        points, [("left", "middle"), ("middle", "right")], 2, grounded=("left", "right")
    )
    report = analyze(model)
    assert [(m.order, m.second_order) for m in structural(report)] == [("first-order", "stiffens")]


def test_independent_joints_make_every_motion_finite():
    model = special.framework(
        {"a": (0, 0), "b": (1, 0.2), "c": (1.4, 1)}, [("a", "b"), ("b", "c")], 2
    )
    kin = kinematics(model)
    assert component_motions(kin, 0).internal == 1
    assert [(m.order, m.second_order) for m in structural(analyze(model))] == [("finite", None)]


@pytest.mark.parametrize(
    ("name", "said"),
    [
        ("trapezoid.ldr", {("first-order", "stiffens")}),
        ("square.ldr", {("finite", None)}),
        ("hinged_L.ldr", {("finite", None)}),
    ],
)
def test_real_frames(model, name, said):
    report = analyze(load_ldraw(model(name)))
    assert {(m.order, m.second_order) for m in structural(report)} == said
    rows = report.to_dict()["motions"]
    assert {(r["order"], r["second_order"]) for r in rows if r["kind"] == "structural"} == said


@pytest.mark.parametrize("name", ["cube7.ldr", "cube9_simple.ldr"])
def test_the_cubes_shaking_is_told_motion_by_motion(model, name):
    report = analyze(load_ldraw(model(name)))
    found = structural(report)
    assert len(found) == 7
    shaking = [m for m in found if m.order == "first-order"]
    assert len(shaking) in (2, 3)
    # no one self-stress resists them all, but most are resisted
    assert {m.second_order for m in shaking} <= {"stiffens", "undecided"}
    assert any(m.second_order == "stiffens" for m in shaking)
    assert all(m.freed_by for m in found)
