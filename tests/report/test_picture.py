"""Pictures: geometry of what is drawn, layout, and the drawn pixels."""

from __future__ import annotations

import dataclasses
import subprocess
import sys

import numpy as np
import pytest
import trimesh
from hypothesis import given
from hypothesis import strategies as st
from PIL import Image

from technic.errors import MissingDependency
from technic.parts.catalogue import catalogue
from technic.report import render
from technic.report.arrows import arc_arrow, arrow
from technic.report.camera import fit, view_direction
from technic.report.deform import bend_field, move_rigidly, rotation_matrix
from technic.report.layout import Sheet
from technic.report.picture import part_scene, report_scene
from technic.report.render import Painter
from technic.report.scene import LegendItem
from technic.report.solids import sharp_edges, solid_of
from technic.report.worst_field import worst_field

VECTORS = st.lists(st.floats(-1.0, 1.0), min_size=3, max_size=3).map(np.array)


def closed(surface):
    mesh = trimesh.Trimesh(surface.points, surface.faces, process=False)
    return mesh.volume, [piece.is_watertight for piece in mesh.split(only_watertight=False)]


@given(VECTORS.filter(lambda v: np.linalg.norm(v) > 1e-2), VECTORS)
def test_arrow_is_closed_and_ends_where_it_points(vector, start):
    shape = arrow(start, vector, 0.01, (1.0, 0.5, 0.0))
    volume, tight = closed(shape)
    assert all(tight)
    assert volume > 0.0
    reach = (shape.points - start) @ vector / (vector @ vector)
    assert reach.min() == pytest.approx(0.0, abs=1e-6)
    assert reach.max() == pytest.approx(1.0, abs=1e-6)


def test_turning_arrow_keeps_its_distance_to_the_axis():
    shape = arc_arrow(
        np.zeros(3), np.array([0, 0, 1.0]), np.array([1.0, 0, 0.5]), 0.8, 0.01, (0, 1, 0)
    )
    distance = np.linalg.norm(shape.points[:, :2], axis=1)
    assert distance.min() > 0.95
    assert distance.max() < 1.05
    assert all(closed(shape)[1])
    turn = np.arctan2(shape.points[:, 1], shape.points[:, 0])
    assert turn.max() == pytest.approx(0.8, abs=1e-3)


def test_sharp_edges_of_a_box_and_of_a_cylinder():
    box = trimesh.creation.box()
    assert len(sharp_edges(box.vertices, box.faces)) == 12
    bar = trimesh.creation.cylinder(1.0, 2.0, sections=20)
    assert len(sharp_edges(bar.vertices, bar.faces)) == 40  # both rims, not the sides


@given(VECTORS)
def test_rotation_is_a_rotation(theta):
    q = rotation_matrix(theta)
    np.testing.assert_allclose(q @ q.T, np.eye(3), atol=1e-12)
    np.testing.assert_allclose(q @ theta, theta, atol=1e-12)
    assert np.trace(q) == pytest.approx(1.0 + 2.0 * np.cos(np.linalg.norm(theta)), abs=1e-12)


@given(st.lists(st.floats(-1.0, 1.0), min_size=6, max_size=6).map(np.array))
def test_parts_do_not_swell(twist):
    points = np.random.default_rng(0).normal(size=(9, 3))
    moved = move_rigidly(points, points.mean(axis=0), twist)
    before = np.linalg.norm(points[:, None] - points, axis=2)
    np.testing.assert_allclose(np.linalg.norm(moved[:, None] - moved, axis=2), before, atol=1e-9)


@pytest.mark.parametrize("bent", [False, True])
def test_bending_is_that_of_the_nodes_and_rigid_motion_bends_nothing(bent):
    rng = np.random.default_rng(1)
    nodes = np.column_stack([np.linspace(0, 1, 8), np.zeros(8), np.zeros(8)])
    if bent:
        nodes[4:, 1] = nodes[4:, 0] - nodes[4, 0]
    twist = rng.normal(size=6)
    center = np.array([0.3, 0.1, -0.2])
    rigid = twist[:3] + np.cross(twist[3:], nodes - center)
    bend = rng.normal(size=(8, 3))
    np.testing.assert_allclose(bend_field(nodes, center, twist, nodes, rigid), 0.0, atol=1e-12)
    found = bend_field(nodes, center, twist, nodes, rigid + bend)
    np.testing.assert_allclose(found, bend, atol=1e-6)


@given(st.lists(VECTORS, min_size=2, max_size=8).map(np.array), st.floats(0.3, 3.0))
def test_camera_sees_every_point(points, aspect):
    camera = fit(points, view_direction(points, points[:1], aspect))
    seen = (points - camera.center) @ camera.axes().T
    assert np.all(np.abs(seen[:, 0]) <= camera.half_width + 1e-9)
    assert np.all(np.abs(seen[:, 1]) <= camera.half_height + 1e-9)
    np.testing.assert_allclose(camera.axes() @ camera.axes().T, np.eye(3), atol=1e-12)


def test_camera_does_not_look_along_the_movement():
    points = np.array([[0, 0, 0], [1, 1, 1], [1, 0, 1], [0, 1, 0.0]])
    usual = view_direction(points)
    found = view_direction(points, np.array([usual]))
    assert abs(found @ usual) < 0.9


def test_field_has_the_rms_displacement_that_the_report_says(pair):
    field = worst_field(pair)
    assert field is not None
    square = (field.displacements**2).sum(axis=1)
    rms = np.sqrt(field.weights @ square / field.weights.sum())
    # Samples at nodes instead of an integral over the material: near, not equal.
    assert rms == pytest.approx(1.0 / pair.rigidity.value, rel=0.35)


def test_part_without_shape_is_drawn_and_said_to_be_a_stand_in(pair):
    parts = [dataclasses.replace(p, definition=None) for p in pair.assembly.parts]
    report = dataclasses.replace(
        pair, assembly=dataclasses.replace(pair.assembly, parts=tuple(parts))
    )
    assert solid_of()(parts[0]).stand_in
    scene = report_scene(report)
    assert any("4 parts without a shape drawn as tubes" in item.text for item in scene.legend)


def test_legend_and_panels_share_nothing(scissors):
    scene = report_scene(scissors)
    assert len(scene.panels) == 2
    many = tuple(LegendItem("arrow", (1, 0, 0), "a long line of words " * n) for n in range(1, 9))
    sheet = Sheet(dataclasses.replace(scene, legend=many, title="A very long title " * 12))
    page = np.asarray(sheet.image)
    for left, top, right, bottom in sheet.boxes:
        assert right > left
        assert bottom > top
        assert np.all(page[top:bottom, left:right] == 255)  # nothing is written where panels go
    assert sheet.boxes[0][2] <= sheet.boxes[1][0]


def near(image, color, tolerance=60):
    return np.all(np.abs(image.astype(int) - color) < tolerance, axis=2)


def test_picture_of_a_flexible_model(scissors, tmp_path):
    target = tmp_path / "scissors.png"
    painter = Painter()
    painter.draw(report_scene(scissors), target)
    with Image.open(target) as file:
        image = np.asarray(file.convert("RGB"))
    assert image.shape == (1200, 1600, 3)
    panels = image[180:900]
    assert near(panels, (245, 125, 0)).sum() > 300  # load
    assert near(panels, (13, 148, 56)).sum() > 300  # motion
    assert near(panels, (180, 0, 0)).sum() > 3000  # the beams are red
    assert near(image, (255, 255, 255), 3).mean() > 0.4
    assert [p.name for p in tmp_path.iterdir()] == ["scissors.png"]


def test_picture_of_a_part(tmp_path):
    definition = catalogue().get("32316")
    assert definition is not None
    scene = part_scene(definition)
    painter = Painter()
    painter.draw(scene, tmp_path / "beam.png")
    with Image.open(tmp_path / "beam.png") as image:
        assert image.size == (1200, 900)


def test_machine_that_cannot_draw_is_told_what_to_install(pair, tmp_path, monkeypatch):
    def crash(*_how):
        return subprocess.Popen(
            [sys.executable, "-c", "import os; os.abort()"],
            stdin=subprocess.PIPE,
            stdout=subprocess.PIPE,
            stderr=subprocess.PIPE,
        )

    monkeypatch.setattr(render, "_start", crash)
    painter = Painter()
    with pytest.raises(MissingDependency, match="apt install libegl1"):
        painter.draw(report_scene(pair), tmp_path / "p.png")
    assert not list(tmp_path.iterdir())


def test_painter_that_draws_nothing_leaves_no_process():
    painter = Painter()
    process = painter._process
    assert process is not None
    painter.close()
    assert process.returncode is not None
