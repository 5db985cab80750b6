"""The paper's null-space construction and ours hold the same motions."""

from __future__ import annotations

import itertools
from typing import Any

import numpy as np
import pytest

from technic.assembly.builder import Linkage
from technic.assembly.joint_types import JointType
from technic.geometry import shift_twist, turn_twist
from technic.system.assemble import assemble
from technic.system.paper import (
    allowed_motions,
    held_combinations,
    paper_rows,
    rigid_displacements,
    row_space,
    selected_nodes,
)

KINDS = {2: ("bar", "truss", "triangles"), 3: ("bar", "bent bar", "truss", "tetrahedra")}
CASES = [
    (d, kind, a, b)
    for d in (2, 3)
    for kind in JointType
    for a, b in itertools.combinations_with_replacement(KINDS[d], 2)
]


@pytest.fixture(scope="module")
def cube(tmp_path_factory):
    """Mesh file of a cube in five tetrahedra, one edge 40 mm."""
    import meshio

    points = np.array(list(itertools.product((0, 1), repeat=3)), float) * 0.04
    cells = [[0, 1, 2, 4], [3, 1, 2, 7], [5, 1, 4, 7], [6, 2, 4, 7], [1, 2, 4, 7]]
    path = tmp_path_factory.mktemp("mesh") / "cube.vtk"
    meshio.write_points_cells(path, points, [("tetra", np.array(cells))])
    return path


def add(linkage, name, kind, at, cube):
    """Add a part of a kind that has the joint's point on it or near it."""
    shift = 0.03 if name == "a" else -0.05
    p: Any
    q: Any
    if len(at) == 2:
        p, q = at, (at[0] + shift, at[1] + 0.07)
        corners = [p, q, (at[0] + shift, at[1] - 0.04)]
    else:
        p, q = at, (at[0] + shift, at[1] + 0.07, at[2] + 0.02)
        corners = [p, q, (at[0] + shift, at[1] - 0.04, at[2])]
    if kind == "bar":
        linkage.bar(name, p, q, section=0.004)
    elif kind == "bent bar":
        linkage.bar(name, *corners, section=0.004)
    elif kind == "truss":
        linkage.truss(name, p, q, area=1e-5)
    elif kind == "triangles":
        linkage.plate(name, *corners, thickness=0.003)
    else:
        position = np.asarray(at) - (0.0 if name == "a" else 0.04)
        linkage.mesh(name, cube, position=position.tolist())


@pytest.fixture
def pair(cube):
    def make(dimension, type_, a, b):
        linkage = Linkage(dimension)
        at = (0.02, 0.01, -0.03)[:dimension]
        add(linkage, "a", a, at, cube)
        add(linkage, "b", b, at, cube)
        axis: Any = (0.6, 0.0, 0.8)
        second: Any = (0.8, 0.0, -0.6)
        if dimension == 2:
            in_plane = type_ in (JointType.SLIDER, JointType.PLANAR)
            axis, second = ((0.6, 0.8) if in_plane else (0.0, 0.0, 1.0)), (0.6, 0.8)
        two = type_ in (JointType.UNIVERSAL, JointType.SLOT)
        linkage.joint(type_.value, "a", "b", at=at, axis=axis, axis2=second if two else None)
        return linkage.assembly()

    return make


@pytest.mark.parametrize(("dimension", "type_", "a", "b"), CASES)
def test_both_hold_the_same_motions_of_rigid_parts(pair, dimension, type_, a, b):
    system = assemble(pair(dimension, type_, a, b))
    rigid = system.R.toarray()
    length = np.tile([1.0] * 3 + [30.0] * 3, 2)  # rotations at an arm of 33 mm
    ours, theirs = (
        row_space(np.round(matrix @ rigid * length, 12))
        for matrix in (system.A.toarray(), paper_rows(system, 0))
    )
    held = system.assembly.joints[0].held.sum()
    assert len(ours) == len(theirs) == held
    np.testing.assert_allclose(theirs @ ours.T @ ours, theirs, atol=1e-6)


@pytest.mark.parametrize(("dimension", "type_", "a", "b"), CASES)
def test_both_hold_the_same_displacements_of_the_selected_nodes(pair, dimension, type_, a, b):
    # With W the least-squares rigid motion of the selected nodes, deformed parts included.
    system = assemble(pair(dimension, type_, a, b))
    joint = system.assembly.joints[0]
    nodes = [selected_nodes(system, 0, side)[0] for side in (0, 1)]
    theirs = held_combinations(allowed_motions(joint, nodes[0], nodes[1], dimension))
    used = [0, 1, 5] if dimension == 2 else list(range(6))
    size = np.linalg.norm(nodes[0] - joint.point, axis=1).max()
    unit = np.array([1.0] * 3 + [1 / size] * 3)
    fits = []
    for side in nodes:
        fit = np.zeros((6, dimension * len(side)))
        motions = rigid_displacements(side, joint.point, dimension) * unit
        fit[used] = np.linalg.pinv(motions[:, used])
        fits.append(fit)
    turn = turn_twist(np.asarray(joint.axes))
    ours = row_space(turn[joint.held] @ np.hstack([fits[0], -fits[1]]))
    assert len(ours) == len(theirs) == joint.held.sum()
    np.testing.assert_allclose(theirs @ ours.T @ ours, theirs, atol=1e-6)


def test_as_many_nodes_as_the_paper_says(pair):
    for dimension in (2, 3):
        a, b = KINDS[dimension][0], KINDS[dimension][-1]
        system = assemble(pair(dimension, JointType.HINGE, a, b))
        for side in (0, 1):
            points, _ = selected_nodes(system, 0, side)
            assert len(points) == dimension
            span = np.linalg.matrix_rank(points[1:] - points[0], tol=1e-9)
            assert span == dimension - 1


def test_rows_hold_nothing_when_both_parts_move_together(pair):
    system = assemble(pair(3, JointType.FIXED, "bar", "tetrahedra"))
    together = system.R @ np.vstack([shift_twist(part.centroid) for part in system.assembly.parts])
    np.testing.assert_allclose(paper_rows(system, 0) @ together, 0.0, atol=1e-12)
