"""Written and read back, an assembly is the same, to the last digit where nothing has been moved."""

from __future__ import annotations

import json
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import Any

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from scipy.spatial.transform import Rotation

import technic
from technic.assembly.builder import Linkage
from technic.assembly.joint_types import JointType
from technic.assembly.model import Part
from technic.assembly.writing import to_document
from technic.errors import UsageError
from technic.geometry import Pose
from tests.mechanics import assembly as bare
from tests.mechanics import block, moved


def random_linkage(seed, dimension):
    """Parts of every shape in a chain with every joint type, two supports."""
    rng = np.random.default_rng(seed)
    linkage = Linkage(dimension, name=f"random {seed}")
    linkage.material("oak", 1.1e10, 0.35, 700.0)
    count = int(rng.integers(2, 7))
    where = rng.uniform(-1, 1, (count + 1, dimension))
    for k in range(count):
        p, q = where[k], where[k + 1]
        which = int(rng.integers(4))
        name = f"part {k}"
        if which == 0:
            bend = rng.uniform(-1, 1, dimension)
            section = {"kind": "circle", "diameter": rng.uniform(0.01, 0.05)}
            linkage.bar(name, p, bend, q, section=section, material="oak")
        elif which == 1:
            linkage.truss(name, p, q, area=rng.uniform(1e-5, 1e-3))
        elif which == 2 and dimension == 2:
            linkage.plate(name, p, q, rng.uniform(-1, 1, 2), thickness=0.01, size=0.3)
        elif which == 2 and rng.random() < 0.5:
            linkage.plate(name, p, q, rng.uniform(-1, 1, 3), thickness=0.02, size=0.5)
        elif rng.random() < 0.5:
            linkage.rigid(name)
        else:
            linkage.rigid(name, p, q, mass=rng.uniform(0.1, 2.0))
    for k in range(1, count):
        kind = list(JointType)[int(rng.integers(len(JointType)))]
        axis, second = rng.normal(size=(2, 3))
        second = np.cross(axis, second)
        if dimension == 2:
            in_plane = rng.random() < 0.5 or kind in (JointType.SLIDER, JointType.PLANAR)
            axis = np.array([*axis[:2], 0.0]) if in_plane else np.array([0.0, 0.0, 1.0])
            second = np.array([-axis[1], axis[0], 0.0]) if in_plane else np.array([1.0, 2.0, 0.0])
        stiffness: Any = [None, "rigid", {"axial": 3e4, "shear": "rigid", "tilt": 1 / 3}][
            rng.integers(3)
        ]
        jitter = {"shear": 1e-4, "force": 3.0} if rng.random() < 0.3 else None
        two = kind in (JointType.UNIVERSAL, JointType.SLOT)
        linkage.joint(
            kind.value,
            f"part {k - 1}",
            f"part {k}",
            at=where[k],
            axis=axis,
            axis2=second if two else None,
            stiffness=stiffness,
            jitter=jitter,
        )
    linkage.fix("part 0", at=where[0], held=["x", "y"])
    if rng.random() < 0.5:
        linkage.fix(f"part {count - 1}")
    return linkage.assembly()


def same(first, second, exact=True):
    compare = np.testing.assert_array_equal if exact else close
    assert (first.name, first.dimension) == (second.name, second.dimension)
    assert [p.id for p in first.parts] == [p.id for p in second.parts]
    for a, b in zip(first.parts, second.parts, strict=True):
        compare(a.mass_properties.mass, b.mass_properties.mass)
        compare(a.centroid, b.centroid)
    assert [(j.id, j.type, j.parts, j.provenance) for j in first.joints] == [
        (j.id, j.type, j.parts, j.provenance) for j in second.joints
    ]
    for a, b in zip(first.joints, second.joints, strict=True):
        np.testing.assert_array_equal(a.held, b.held)
        compare(a.point, b.point)
        compare(np.asarray(a.stiffness)[a.held], np.asarray(b.stiffness)[b.held])
    for a, b in zip(first.supports, second.supports, strict=True):
        np.testing.assert_array_equal(a.held, b.held)
        assert (a.part, a.point is None) == (b.part, b.point is None)


def close(a, b):
    np.testing.assert_allclose(a, b, atol=1e-12)


def through_a_file(model):
    with TemporaryDirectory() as folder:
        path = Path(folder) / "model.json"
        technic.save(model, path)
        return technic.load(path)


@settings(max_examples=40)
@given(seed=st.integers(0, 10**6), dimension=st.sampled_from([2, 3]))
def test_written_and_read_back_it_is_the_same(seed, dimension):
    model = random_linkage(seed, dimension)
    again = through_a_file(model)
    same(model, again)
    first, second = to_document(model), to_document(again)
    assert json.dumps(first["parts"]) == json.dumps(second["parts"])
    k, j = (technic.assemble(m) for m in (model, again))
    assert np.abs((k.K - j.K).toarray()).max() == 0.0
    gap = np.abs((k.A - j.A).toarray()).max(initial=0.0)
    assert gap < 1e-9


@settings(max_examples=15)
@given(seed=st.integers(0, 10**6))
def test_a_moved_assembly_is_written_where_it_is(seed):
    rng = np.random.default_rng(seed)
    turn = Rotation.from_rotvec(rng.normal(size=3)).as_matrix()
    model = random_linkage(seed, 3)
    model = moved(
        type(model)(model.name, model.parts, model.joints), Pose(turn, rng.normal(size=3))
    )
    again = through_a_file(model)
    same(model, again, exact=False)
    first, second = (technic.analyze(m) for m in (model, again))
    assert first.mobility.total == second.mobility.total
    assert (first.rigidity is None) == (second.rigidity is None)
    if first.rigidity is not None and second.rigidity is not None:
        # an eigenvalue is no surer than rounding of the largest entry of K: a bar 1e9 times as stiff as
        # the softest mode shows in its seventh digit (LAPACK's dense solver has the same scatter)
        rounding = 100.0 * np.finfo(float).eps * abs(technic.assemble(model).K).max()
        close = pytest.approx(first.rigidity.value, rel=1e-5, abs=rounding)
        assert second.rigidity.value == close


def test_mesh_files_are_found_again(tmp_path):
    import meshio

    (tmp_path / "meshes").mkdir()
    points = [[0, 0, 0], [1, 0, 0], [0, 1, 0], [0, 0, 1]]
    meshio.write_points_cells(
        tmp_path / "meshes" / "tet.vtk",
        np.array(points, float),
        [("tetra", np.array([[0, 1, 2, 3]]))],
    )
    linkage = Linkage()
    linkage.mesh("t", "meshes/tet.vtk", scale=0.01, position=[1.0, 2.0, 3.0])
    path = tmp_path / "model.json"
    path.write_text(json.dumps(linkage.document()), encoding="utf-8")
    model = technic.load(path)
    assert model.parts[0].mass_properties.mass == pytest.approx(1050 * 1e-6 / 6)
    np.testing.assert_allclose(model.parts[0].centroid, [1.0025, 2.0025, 3.0025])
    (tmp_path / "sub").mkdir()
    technic.save(model, tmp_path / "sub" / "again.json")
    same(model, technic.load(tmp_path / "sub" / "again.json"), exact=False)


def test_lego_parts_are_not_written_as_shapes(tmp_path):
    part: Part = block("b", [0, 0, 0])
    with pytest.raises(UsageError, match="LEGO part"):
        technic.save(bare([part]), tmp_path / "x.json")
    with pytest.raises(UsageError, match=r"not as '\.ldr'"):
        technic.save(bare([part]), tmp_path / "x.ldr")
