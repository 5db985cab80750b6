"""Files for other programs: heat map, glTF, CSV tables, film, strip."""

from __future__ import annotations

import csv
import io
import json
import struct
from collections.abc import Callable
from dataclasses import replace
from itertools import pairwise
from pathlib import Path
from typing import Any

import numpy as np
import pytest

import technic
from technic.errors import UsageError
from technic.ldraw.sections import read
from technic.report.comparison import comparison_scene
from technic.report.drawing import drawing_of
from technic.report.energy import energy_shares
from technic.report.film import film
from technic.report.gltf import gltf, write_gltf
from technic.report.heat import RAMP, heat_color
from technic.report.heat_map import direct_color, heat_map, write_heat_map
from technic.report.spreadsheet import tables, write_tables
from technic.rigidity.result import RigidityReport
from technic.rigidity.serialize import unit_load
from tests.conftest import REPO

CHASSIS = REPO / "technic" / "data" / "rolling_chassis.mpd"


@pytest.fixture(scope="module")
def chassis() -> RigidityReport:
    return technic.analyze(technic.load(CHASSIS))


# --- heat map --------------------------------------------------------------------------------------


def test_heat_colors_darken() -> None:
    light = [sum(heat_color(share)) for share in np.linspace(0.0, 1.0, 50)]
    assert all(a > b for a, b in pairwise(light))
    assert heat_color(1.0) == RAMP[-1]


def test_heat_map_changes_colours_only(chassis: RigidityReport, tmp_path: Path) -> None:
    target = tmp_path / "heat.mpd"
    found = write_heat_map(chassis, CHASSIS, target)
    before = CHASSIS.read_bytes().splitlines(keepends=True)
    after = target.read_bytes().splitlines(keepends=True)
    assert len(before) == len(after)
    lines = {part.source.line for part in chassis.assembly.parts if part.source is not None}
    for number, (old, new) in enumerate(zip(before, after, strict=True), 1):
        if number not in lines:
            assert old == new
            continue
        assert new.split()[1].startswith(b"0x2")
        assert old.split()[2:] == new.split()[2:]
    assert found.elsewhere == 0
    assert found.most == pytest.approx(energy_shares(chassis).max())


def test_heat_map_is_the_same_model(chassis: RigidityReport, tmp_path: Path) -> None:
    target = tmp_path / "heat.mpd"
    write_heat_map(chassis, CHASSIS, target)
    again = technic.load(target)
    shares = energy_shares(chassis)
    assert len(again.parts) == len(chassis.assembly.parts)
    for old, new, share in zip(chassis.assembly.parts, again.parts, shares, strict=True):
        assert np.array_equal(old.pose.rotation, new.pose.rotation)
        assert np.array_equal(old.pose.translation, new.pose.translation)
        assert new.color == int(direct_color(heat_color(share / shares.max())), 16)


def test_heat_map_keeps_windows_line_ends(models: dict[str, list[str]], tmp_path: Path) -> None:
    path = tmp_path / "windows.ldr"
    path.write_bytes("\r\n".join(["0 Größe", *models["pair"], ""]).encode("latin-1"))
    report = technic.analyze(technic.load(path))
    raw = heat_map(report, read(path)).text.to_bytes()
    assert raw.count(b"\r\n") == path.read_bytes().count(b"\r\n") == raw.count(b"\n")
    assert raw.startswith("0 Größe\r\n".encode("latin-1"))


def test_heat_map_of_a_submodel_used_twice(models: dict[str, list[str]], tmp_path: Path) -> None:
    use = "1 16 0 0 {} 1 0 0 0 1 0 0 0 1 arm.ldr"
    bridge = "1 4 0 20 40 0 0 1 0 1 0 -1 0 0 32316.dat"
    lines = ["0 FILE main.ldr", use.format(0), use.format(400), bridge, "0 FILE arm.ldr"]
    path = tmp_path / "twice.mpd"
    path.write_text("\n".join(lines + models["pair"]) + "\n", encoding="utf-8")
    report = technic.analyze(technic.load(path))
    found = heat_map(report, read(path))
    assert found.shared == len([line for line in models["pair"] if line.startswith("1 ")])


def test_heat_map_refuses_another_file(pair: RigidityReport) -> None:
    with pytest.raises(UsageError, match="not the file that was analyzed"):
        heat_map(pair, read(CHASSIS))


# --- glTF ------------------------------------------------------------------------------------------


def parsed(raw: bytes) -> tuple[dict, Callable[[int], np.ndarray]]:
    """The JSON of a binary glTF, and its accessors by number."""
    magic, version, length = struct.unpack_from("<4sII", raw)
    assert (magic, version, length) == (b"glTF", 2, len(raw))
    size, kind = struct.unpack_from("<I4s", raw, 12)
    assert kind == b"JSON"
    content = json.loads(raw[20 : 20 + size])
    data = raw[20 + size + 8 :]

    def array(number: int) -> np.ndarray:
        accessor = content["accessors"][number]
        view = content["bufferViews"][accessor["bufferView"]]
        kind = {5126: "<f4", 5125: "<u4"}[accessor["componentType"]]
        width = {"SCALAR": 1, "VEC3": 3}[accessor["type"]]
        values = np.frombuffer(data, kind, accessor["count"] * width, view["byteOffset"])
        return values.reshape(-1, width)

    return content, array


def test_gltf_has_the_parts_and_the_mode(pair: RigidityReport) -> None:
    content, array = parsed(gltf(pair))
    drawing = drawing_of(pair.assembly)
    load = unit_load(pair)
    assert load is not None
    scale = content["asset"]["extras"]["deformation_scale_at_1_n"]
    turn = np.diag([1.0, -1.0, -1.0])
    for k, node in enumerate(content["nodes"]):
        matrix = np.array(node["matrix"]).reshape(4, 4).T
        (primitive,) = content["meshes"][node["mesh"]]["primitives"]
        points = array(primitive["attributes"]["POSITION"])
        world = points @ matrix[:3, :3].T + matrix[:3, 3]
        assert np.allclose(world, drawing.points[k] @ turn, atol=1e-6)
        ways = array(primitive["targets"][0]["POSITION"]) @ matrix[:3, :3].T
        arms = drawing.points[k] - pair.assembly.parts[k].centroid
        rigid = load[1][k, :3] + np.cross(load[1][k, 3:], arms)
        # Small rotations and little bending: the mode to within a few percent of its size.
        assert np.abs(ways - scale * rigid @ turn).max() < 0.15 * np.abs(ways).max()
    (animation,) = content["animations"]
    assert {c["target"]["node"] for c in animation["channels"]} == set(range(len(content["nodes"])))
    weights = array(animation["samplers"][0]["output"])
    assert weights.max() == pytest.approx(1.0)
    assert weights.min() == pytest.approx(-1.0)


def test_gltf_opens_in_another_program(chassis: RigidityReport, tmp_path: Path) -> None:
    import trimesh

    target = tmp_path / "model.glb"
    write_gltf(chassis, target)
    scene: Any = trimesh.load(target)
    points = np.concatenate(drawing_of(chassis.assembly).points)
    assert np.allclose(scene.extents, np.ptp(points, axis=0), atol=1e-5)
    assert len(scene.graph.nodes_geometry) == len(chassis.assembly.parts)


# --- CSV -------------------------------------------------------------------------------------------


def test_tables_can_be_read_back(scissors: RigidityReport, tmp_path: Path) -> None:
    folder = tmp_path / "tables"
    write_tables(scissors, folder)
    assert {path.stem for path in folder.iterdir()} == set(tables(scissors))
    with (folder / "parts.csv").open(encoding="utf-8-sig", newline="") as stream:
        rows = list(csv.DictReader(stream))
    assert [row["id"] for row in rows] == [part.id for part in scissors.assembly.parts]
    assert sum(float(row["energy_share"]) for row in rows) == pytest.approx(1.0)
    # The load holds itself in balance.
    for axis in "xyz":
        total = sum(float(row[f"force_{axis}_n"]) for row in rows)
        assert total == pytest.approx(0.0, abs=1e-9)
    with (folder / "motions.csv").open(encoding="utf-8-sig", newline="") as stream:
        assert len(list(csv.DictReader(stream))) == len(scissors.motions)


def test_names_are_no_formulas(pair: RigidityReport, tmp_path: Path) -> None:
    parts = tuple(replace(part, name="=1+1") for part in pair.assembly.parts)
    write_tables(replace(pair, assembly=replace(pair.assembly, parts=parts)), tmp_path)
    text = (tmp_path / "parts.csv").read_text(encoding="utf-8-sig")
    assert {row["name"] for row in csv.DictReader(io.StringIO(text))} == {"'=1+1"}


def test_tables_say_when_the_place_is_taken(pair: RigidityReport, tmp_path: Path) -> None:
    taken = tmp_path / "file"
    taken.write_text("")
    with pytest.raises(UsageError):
        write_tables(pair, taken)


# --- film and strip --------------------------------------------------------------------------------


def test_film_swings_about_rest_under_a_still_camera(pair: RigidityReport) -> None:
    found = film(pair)
    assert len({id(scene.panels[0].camera) for scene in found.scenes}) == 1
    first, last = (found.scenes[k].panels[0].surfaces[0].points for k in (0, -1))
    middle = found.scenes[len(found.scenes) // 2].panels[0].surfaces[0].points
    rest = np.concatenate(drawing_of(pair.assembly).points)
    assert np.allclose(middle, rest, atol=1e-9)
    assert np.abs(first - rest).max() > 1e-4
    # To and fro: opposite ways, but for the square of the rotations.
    there, back = (first - rest).ravel(), (last - rest).ravel()
    assert there @ back < -0.9 * np.linalg.norm(there) * np.linalg.norm(back)
    assert found.order[0] == 0
    assert max(found.order) == len(found.scenes) - 1
    steps = np.abs(np.diff([*found.order, found.order[0]]))
    assert set(steps) == {1}


@pytest.mark.slow
def test_film_becomes_an_animation(pair: RigidityReport) -> None:
    from PIL import Image

    from technic.report.render import Painter

    short = film(pair)
    image: Any = Image.open(io.BytesIO(Painter().picture(replace(short, order=(0, 3, 6)))))
    assert image.format == "GIF"
    assert image.n_frames == 3


def test_strip_has_one_camera_and_one_scale(pair: RigidityReport, scissors: RigidityReport) -> None:
    scene = comparison_scene([scissors, pair], ["before", "after"])
    one, two = scene.panels
    assert one.camera is two.camera
    assert one.caption.startswith("before: flexible")
    assert two.caption.startswith("after: rigid")
    assert "drawn" in scene.subtitle


@pytest.mark.parametrize("view", ["iso", "front", "side", "top"])
def test_fixed_views_look_from_where_they_say(pair: RigidityReport, view) -> None:
    from technic.report.picture import report_scene

    toward = report_scene(pair, view=view).panels[0].camera.toward
    wanted = {"front": (0, 0, -1), "side": (1, 0, 0), "top": (0, -1, 0), "iso": (1, -1, -1)}[view]
    assert toward @ np.array(wanted) / np.linalg.norm(wanted) > 0.999
