"""Random linkages: what must not depend on how they are written down, and what can only go one way."""

from __future__ import annotations

from dataclasses import replace
from typing import Any

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from scipy.spatial.transform import Rotation

from technic.assembly.builder import Linkage
from technic.assembly.file import build_assembly
from technic.assembly.joint_types import JointType
from technic.assembly.model import Assembly
from technic.assembly.writing import to_document
from technic.geometry import Pose
from technic.rigidity.analyze import analyze
from technic.system.assemble import assemble
from tests.mechanics import moved

SEEDS = st.integers(0, 10**6)
DIMENSIONS = st.sampled_from([2, 3])


def linkage(seed, dimension, parts=6):
    """Bars and trusses between random places, joined in a tree with a few loops."""
    rng = np.random.default_rng(seed)
    where = rng.uniform(-0.1, 0.1, (parts + 1, dimension))
    out = Linkage(dimension)
    ends = []
    for k in range(parts):
        a, b = int(rng.integers(k + 1)), k + 1
        ends.append((a, b))
        if rng.random() < 0.7:
            out.bar(f"p{k}", where[a], where[b], section=0.004)
        else:
            out.truss(f"p{k}", where[a], where[b], area=1e-5)
    for a in range(parts):
        for b in range(a + 1, parts):
            shared = set(ends[a]) & set(ends[b])
            if shared:
                kind, options = random_joint(rng, dimension)
                out.joint(kind, f"p{a}", f"p{b}", at=where[shared.pop()], **options)
    for _ in range(2):
        a, b = (int(k) for k in rng.choice(parts, 2, replace=False))
        out.hinge(f"p{a}", f"p{b}", at=where[ends[a][1]], axis=(0, 0, 1))
    return out.assembly()


def random_joint(rng, dimension):
    kinds = [JointType.FIXED, JointType.HINGE, JointType.BALL, JointType.SLIDER]
    kind = kinds[int(rng.integers(4))]
    options: dict[str, Any] = {"axis": rng.normal(size=dimension)}
    if dimension == 2 and kind is not JointType.SLIDER:
        options = {}
    options["stiffness"] = {"axial": 2e4, "shear": 3e4, "spin": 2.0, "tilt": 5.0}
    return kind.value, options


def value(report):
    return None if report.rigidity is None else report.rigidity.value


def same(first, second, factor=1.0):
    assert first.mobility.total == second.mobility.total
    if value(first) is not None:
        assert value(second) == pytest.approx(factor * value(first), rel=1e-5)


@settings(max_examples=15)
@given(seed=SEEDS, dimension=DIMENSIONS)
def test_renumbering_and_moving_change_nothing(seed, dimension):
    model = linkage(seed, dimension)
    rng = np.random.default_rng(seed)
    order = rng.permutation(len(model.parts))
    place = np.argsort(order)
    joints = [
        replace(j, parts=(int(place[j.parts[0]]), int(place[j.parts[1]]))) for j in model.joints
    ]
    turn = Rotation.from_rotvec([0, 0, rng.normal()] if dimension == 2 else rng.normal(size=3))
    shift = np.append(rng.normal(size=2), 0.0 if dimension == 2 else 0.3)
    other = replace(
        model,
        parts=tuple(model.parts[k] for k in order),
        joints=tuple(joints[k] for k in rng.permutation(len(joints))),
    )
    other = moved(other, Pose(turn.as_matrix(), shift))
    same(analyze(model, modes=1), analyze(other, modes=1))


@settings(max_examples=10)
@given(seed=SEEDS, dimension=DIMENSIONS)
def test_a_longer_unit_of_length_scales_the_rigidity(seed, dimension):
    # all lengths times s with the same material: every stiffness times s, rotations times s^3
    scale = 7.0
    model = linkage(seed, dimension)
    data = to_document(model)
    for part in data["parts"]:
        shape = part["shape"]
        shape["points"] = (scale * np.array(shape["points"])).tolist()
        if "area" in shape:
            shape["area"] *= scale**2
        else:
            for key in ("width", "height"):
                shape["section"][key] *= scale
    for joint in data["joints"]:
        joint["point"] = (scale * np.array(joint["point"])).tolist()
        for key, power in (("axial", 1), ("shear", 1), ("spin", 3), ("tilt", 3)):
            if key in joint["stiffness"]:
                joint["stiffness"][key] *= scale**power
    same(analyze(model, modes=1), analyze(build_assembly(data), modes=1), scale)


@settings(max_examples=20)
@given(seed=SEEDS, dimension=DIMENSIONS)
def test_a_joint_more_never_softens_and_never_adds_a_motion(seed, dimension):
    model = linkage(seed, dimension)
    fewer: Assembly = replace(model, joints=model.joints[:-1])
    system, less = assemble(model), assemble(fewer)
    # the elements may be divided differently; on rigid parts both have the same unknowns
    rigid = [s.R.T @ (s.K + s.J) @ s.R for s in (system, less)]
    gain = (rigid[0] - rigid[1]).toarray()
    lowest = np.linalg.eigvalsh((gain + gain.T) / 2)[0]
    assert lowest >= -1e-9 * np.abs(gain).max(initial=1.0)
    mobility = [analyze(m, modes=1).mobility for m in (model, fewer)]
    free = 6 if dimension == 3 else 3
    components = [len(analyze(m, modes=1).components) for m in (model, fewer)]
    # a joint that ties two pieces together turns a rigid motion of one piece into one of the whole
    totals = [m.total + free * c for m, c in zip(mobility, components, strict=True)]
    assert totals[0] <= totals[1]


@settings(max_examples=15)
@given(seed=SEEDS, dimension=DIMENSIONS, play=st.floats(1e-6, 1e-3))
def test_play_never_stiffens_and_moves_nothing(seed, dimension, play):
    model = linkage(seed, dimension)
    data = to_document(model)
    for row in data["joints"]:
        row["jitter"] = {"shear": play, "axial": play, "spin": 10 * play, "tilt": 10 * play}
    tight, loose = analyze(model, modes=1), analyze(build_assembly(data), modes=1)
    counts = [
        (m.structural, m.spinning, m.sliding, m.idle) for m in (tight.mobility, loose.mobility)
    ]
    assert counts[0] == counts[1]
    if value(tight) is not None:
        assert value(loose) < value(tight) * (1 + 1e-9)


@settings(max_examples=10)
@given(seed=SEEDS, dimension=DIMENSIONS)
def test_a_part_between_two_others_never_softens_them(seed, dimension):
    model = linkage(seed, dimension)
    rng = np.random.default_rng(seed)
    a, b = (int(k) for k in rng.choice(len(model.parts), 2, replace=False))
    points = [model.parts[k].centroid for k in (a, b)]
    extra = Linkage(dimension)
    extra.bar("a", points[0][:dimension], (points[0] + [0.01, 0, 0])[:dimension])
    extra.bar("b", points[1][:dimension], (points[1] + [0.01, 0, 0])[:dimension])
    extra.bar("new", points[0][:dimension], points[1][:dimension], section=0.004)
    for k, name in enumerate("ab"):
        extra.hinge(name, "new", at=points[k][:dimension], axis=(0, 0, 1))
    built = extra.assembly()
    n = len(model.parts)
    new = [
        replace(j, id=f"new{k}", parts=(index, n))
        for k, (j, index) in enumerate(zip(built.joints, (a, b), strict=True))
    ]
    more = replace(model, parts=(*model.parts, built.parts[2]), joints=(*model.joints, *new))
    # what the others feel when the new part goes where it likes best
    before, after = (energy_matrix(m, n) for m in (model, more))
    lowest = np.linalg.eigvalsh(after - before)[0]
    assert lowest >= -1e-7 * np.abs(after).max()


def energy_matrix(model, keep):
    """Energy of the rigid motions of the first parts, the others (rigid too) relaxed."""
    system = assemble(model)
    whole = (system.R.T @ (system.K + system.J) @ system.R).toarray()
    cut = 6 * keep
    rest = whole[cut:, cut:]
    if not len(rest):
        return whole
    coupling = whole[:cut, cut:]
    return whole[:cut, :cut] - coupling @ np.linalg.pinv(rest, rcond=1e-12) @ coupling.T
