"""Drawn pixels mean what they should: both renderers, glass, depth, see-through paper, films, labels."""

from __future__ import annotations

import io
import json
import subprocess
import sys
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from PIL import Image

import technic
from technic.errors import MissingDependency, UsageError
from technic.report import render, video
from technic.report.camera import sight
from technic.report.canvas import depth_shades, depth_span, far_first, see_through
from technic.report.comparison import comparison_scene
from technic.report.drawing import drawing_of
from technic.report.film import film
from technic.report.labels import place_labels
from technic.report.load_arrows import LOAD_COLOR
from technic.report.picture import report_scene, styled
from technic.report.render import Painter
from technic.report.scene import Camera, Lines, Panel, Scene, Surface
from technic.report.video import find_ffmpeg, mp4
from tests.conftest import IN_CI, REPO
from tests.report.conftest import SCISSORS
from tests.report.golden_cases import GLASS
from tests.report.perception import likeness, small

GALLERY = REPO / "technic" / "data" / "gallery"


def needs(module: str) -> None:
    """Skip without an extra; in continuous integration fail."""
    try:
        __import__(module)
    except ImportError:
        if IN_CI:
            pytest.fail(f"no {module}; the extra dev has it")
        pytest.skip(f"no {module}")


def drawn(scene: Scene, renderer="pyvista") -> Image.Image:
    return Image.open(io.BytesIO(Painter(renderer).picture(scene)))


def square(at: float, color: tuple[float, float, float], half: float = 0.01, **how) -> Surface:
    """A square across the direction of sight, `at` before the origin."""
    corners = half * np.array([[-1, -1, 0], [1, -1, 0], [1, 1, 0], [-1, 1, 0.0]])
    points = corners + np.array([0.0, 0.0, at])
    faces = np.array([[0, 1, 2], [0, 2, 3]])
    return Surface(points, faces, np.tile(color, (4, 1)), **how)


def scene_of(*surfaces: Surface, **how) -> Scene:
    up, toward = np.array([0.0, 1.0, 0.0]), np.array([0.0, 0.0, 1.0])
    camera = Camera(toward, up, np.zeros(3), 0.012, 0.012)
    empty = Lines(np.zeros((0, 3)), np.zeros((0, 2), dtype=np.int64), np.zeros((0, 3)))
    return Scene("t", "", (Panel("", surfaces, (empty,), camera),), (), (500, 500), **how)


RENDERERS = pytest.mark.parametrize("renderer", ["pyvista", "pyrender"])


@RENDERERS
@pytest.mark.slow
def test_glass_shows_what_is_behind(renderer: str) -> None:
    if renderer == "pyrender":
        needs("pyrender")
    behind, before = (
        square(0.0, (1.0, 0.0, 0.0), 0.004),
        square(0.005, (0.0, 0.0, 1.0), opacity=0.5),
    )
    picture = np.asarray(drawn(scene_of(behind, before), renderer)).astype(int)
    middle, beside = picture[260, 250], picture[260, 360]
    assert middle[0] > 60  # the red square shines through the blue one
    assert middle[2] > 60
    assert middle[0] < 220
    assert beside[2] > beside[0] + 40  # white paper through blue glass
    assert beside[0] > 60


@RENDERERS
@pytest.mark.slow
def test_arrows_are_over_what_is_before_them(renderer: str) -> None:
    if renderer == "pyrender":
        needs("pyrender")
    wall, arrow = square(0.009, (0.2, 0.2, 0.2)), square(-0.009, LOAD_COLOR, 0.004, on_top=True)
    picture = np.asarray(drawn(scene_of(wall, arrow), renderer)).astype(int)
    assert picture[260, 250, 0] > picture[260, 250, 2] + 80
    assert abs(picture[260, 360, 0] - picture[260, 360, 2]) < 20


@RENDERERS
@pytest.mark.slow
def test_depth_is_linear_in_the_distance(renderer: str) -> None:
    if renderer == "pyrender":
        needs("pyrender")
    near, far = square(0.01, (1, 0, 0), 0.004), square(-0.01, (1, 0, 0))
    middle = replace(square(0.0, (1, 0, 0), 0.007))
    scene = scene_of(near, middle, far, depth=True)
    picture = np.asarray(drawn(scene, renderer)).astype(int)[:, :, :3]
    row = picture[260]
    shades = [row[250], row[250 + 70], row[250 + 105]]  # on the near, the middle and the far square
    said = depth_shades(np.array([[0.0, 0.01, 0.02, np.nan]]), 0.02)[0].astype(int)
    assert depth_span(scene.panels) == pytest.approx(0.02)
    for found, wanted in zip(shades, said, strict=False):
        np.testing.assert_allclose(found, wanted, atol=3)
    assert tuple(said[3]) == (255, 255, 255)


def test_legend_says_the_range_of_depth(pair) -> None:
    scene = styled(report_scene(pair), depth=True)
    ahead = [
        np.concatenate([s.points for s in panel.surfaces if not s.on_top]) @ panel.camera.toward
        for panel in scene.panels
    ]
    far = 1e3 * max(float(np.ptp(values)) for values in ahead)
    words = next(item.text for item in scene.legend if "behind" in item.text)
    assert float(words.split()[0]) == pytest.approx(far, rel=0.01)
    assert not any("outline" in item.text and item.swatch == "line" for item in scene.legend)


@RENDERERS
@pytest.mark.slow
def test_see_through_picture_is_the_same_on_white(pair, renderer: str) -> None:
    if renderer == "pyrender":
        needs("pyrender")
    scene = report_scene(pair)
    solid, clear = drawn(scene, renderer), drawn(styled(scene, transparent=True), renderer)
    assert clear.mode == "RGBA"
    alpha = np.asarray(clear)[:, :, 3]
    assert (alpha == 0).mean() > 0.3
    assert (alpha == 255).mean() > 0.1
    white = Image.alpha_composite(Image.new("RGBA", clear.size, "white"), clear).convert("RGB")
    gap = np.abs(np.asarray(white).astype(int) - np.asarray(solid.convert("RGB")).astype(int))
    assert np.percentile(gap, 99.9) <= 24  # letters are blended once more


def test_see_through_gives_back_colour_and_alpha() -> None:
    alpha = np.array([[0.0, 0.25, 1.0]])[..., None]
    color = np.array([[[9.0, 9, 9], [200, 40, 90], [10, 220, 30]]])
    white, black = (alpha * color + (1 - alpha) * paper for paper in (255.0, 0.0))
    found = see_through(np.round(white).astype(np.uint8), np.round(black).astype(np.uint8))
    np.testing.assert_allclose(found[0, :, 3], [0, 64, 255], atol=1)
    np.testing.assert_allclose(found[0, 1:, :3], color[0, 1:], atol=4)


def test_triangles_of_glass_come_from_far_to_near() -> None:
    glass = square(0.0, (0, 0, 1), opacity=0.5)
    both = replace(
        glass,
        points=np.concatenate([glass.points + np.array([0, 0, 0.01]), glass.points]),
        faces=np.concatenate([glass.faces, glass.faces + 4]),
        colors=np.tile((0.0, 0.0, 1.0), (8, 1)),
    )
    faces = far_first(scene_of(both).panels[0]).surfaces[0].faces
    assert faces[:2].min() == 4


@pytest.mark.slow
def test_both_renderers_draw_the_same(pair) -> None:
    needs("pyrender")
    scene = report_scene(pair)
    assert likeness(small(drawn(scene)), small(drawn(scene, "pyrender"))).same


def test_missing_pyrender_is_said(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(render.importlib.util, "find_spec", lambda _name: None)
    with pytest.raises(MissingDependency, match=r"pip install \"technic-rigidity\[pyrender\]\""):
        Painter("pyrender")


def test_clear_beam_is_drawn_as_glass(make_report) -> None:
    report = make_report(GLASS, "glass")
    opacities = {s.opacity for s in report_scene(report).panels[0].surfaces}
    assert any(0.3 < value < 0.7 for value in opacities)
    assert 1.0 in opacities


def test_load_arrow_points_where_the_load_pushes(make_report) -> None:
    """In pixels: along each drawn arrow the head is where the load of the analysis goes."""
    from technic.report.worst_field import worst_field

    report = make_report(
        SCISSORS,
        "open",
        parts="frame",
    )
    scene = report_scene(report, view="side")
    panel = scene.panels[-1]
    arrows = next(s for s in panel.surfaces if s.on_top)
    only = replace(panel, surfaces=(replace(arrows),), lines=(), markers=(), caption="")
    image = np.asarray(drawn(replace(scene, panels=(only,), legend=()))).astype(int)[:, :, :3]
    orange = (image[:, :, 0] - image[:, :, 2] > 90) & (np.arange(len(image)) > 110)[:, None]
    rows, columns = np.nonzero(orange)
    axes = panel.camera.axes()
    field = worst_field(report)
    upper = field.points[:, 1] < np.median(field.points[:, 1])  # LDraw: y points down
    ways = [
        np.mean((field.displacements[mine] @ axes.T)[:, :2], axis=0) for mine in (upper, ~upper)
    ]
    seen = [np.mean((field.points[mine] @ axes.T)[:, 1]) for mine in (upper, ~upper)]
    assert seen[0] > seen[1]
    middle = 0.5 * (rows.min() + rows.max())
    # The beams are pushed apart: the upper arrows end at the top, the lower ones at the bottom.
    assert ways[0][1] > 0 > ways[1][1]
    for half, top in ((rows < middle, True), (rows >= middle, False)):
        own = rows[half]
        widths = np.bincount(own - own.min())
        heads = np.flatnonzero(widths == widths.max()).mean() / len(widths)
        assert (heads < 0.5) == top  # the head is the widest place of an arrow
    assert len(columns) > 200


def test_comparison_has_one_scale_for_arrows(scissors, pair) -> None:
    scene = comparison_scene([scissors, pair], ["before", "after"])
    first, second = scene.panels
    assert first.camera is second.camera
    said = next(item.text for item in scene.legend if item.swatch == "arrow")
    strongest = float(said.split("longest arrow ")[1].split()[0])
    from technic.report.worst_field import worst_field

    fields = [worst_field(report) for report in (scissors, pair)]
    assert strongest == pytest.approx(1e-3 * max(f.strongest for f in fields), rel=0.01)
    longest = [
        np.linalg.norm(np.ptp(next(s for s in p.surfaces if s.on_top).points, axis=0))
        for p in scene.panels
    ]
    assert longest[0] != pytest.approx(longest[1], rel=0.05)


@pytest.mark.parametrize(
    ("name", "up"), [("fig08a_bridge", (0, 1, 0)), ("fig14c_drying_rack_3", (0, 0, 1))]
)
def test_assembly_files_stand_upright(name: str, up: tuple[int, int, int]) -> None:
    report = technic.analyze(technic.load(GALLERY / f"{name}.json"))
    cameras = [report_scene(report).panels[0].camera, film(report).scenes[0].panels[0].camera]
    cameras.append(comparison_scene([report, report], ["a", "b"]).panels[0].camera)
    for camera in cameras:
        _, above, toward = camera.axes()
        assert above @ np.array(up) > 0.6
        if report.assembly.dimension == 2:
            np.testing.assert_allclose(toward, [0, 0, 1], atol=1e-12)


@pytest.mark.parametrize("view", ["iso", "front", "side", "top", "mode"])
def test_views_of_an_upright_model(view) -> None:
    assembly = technic.load(GALLERY / "fig14c_drying_rack_3.json")
    points = np.concatenate(drawing_of(assembly).points)
    toward, up = sight(assembly, points, view=view)
    assert np.linalg.norm(toward) == pytest.approx(1.0)
    np.testing.assert_allclose(up, [0, 0, 1], atol=1e-12)
    wanted = {"front": (0, -1, 0), "side": (1, 0, 0), "top": (0, 0, 1)}
    if view in wanted:
        assert toward @ np.array(wanted[view]) > 0.999


# --- films ----------------------------------------------------------------------------------------


def frames_of(data: bytes) -> dict:
    """Return what ffmpeg says of a film."""
    program = find_ffmpeg()
    done = subprocess.run(
        [program, "-v", "error", "-i", "-", "-f", "framehash", "-"],
        input=data,
        capture_output=True,
        check=True,
    )
    lines = done.stdout.decode().splitlines()
    size = next(line.split()[-1] for line in lines if line.startswith("#dimensions"))
    return {"size": size, "frames": [line for line in lines if not line.startswith("#")]}


def test_mp4_has_all_frames() -> None:
    needs("imageio_ffmpeg")
    ramp = np.linspace(0, 255, 64, dtype=np.uint8)
    frames = [np.tile(np.roll(ramp, 8 * k)[None, :, None], (48, 1, 3)) for k in range(6)]
    data = mp4(frames, 1.0, rounds=2)
    assert data[4:8] == b"ftyp"
    said = frames_of(data)
    assert said["size"] == "64x48"
    assert len(said["frames"]) == 12
    assert mp4(frames, 1.0, rounds=2) == data


@pytest.mark.slow
def test_film_of_the_worst_mode_as_mp4(pair) -> None:
    needs("imageio_ffmpeg")
    made = film(pair, kind="mp4")
    said = frames_of(Painter().picture(made))
    assert said["size"] == "960x720"
    assert len(said["frames"]) == 3 * len(made.order)


def test_missing_ffmpeg_is_said_before_the_analysis(
    monkeypatch: pytest.MonkeyPatch, tmp_path: Path
) -> None:
    from technic.commands.options import AnalysisOptions
    from technic.commands.outputs import Outputs

    monkeypatch.setitem(sys.modules, "imageio_ffmpeg", None)
    monkeypatch.setattr(video.shutil, "which", lambda _name: None)
    with pytest.raises(MissingDependency) as error:
        Outputs(AnalysisOptions(animate=tmp_path / "film.mp4"))
    for remedy in ('pip install "technic-rigidity[mp4]"', "apt install ffmpeg", ".gif"):
        assert remedy in str(error.value)


def test_options_for_pictures_need_a_picture() -> None:
    from technic.commands.options import AnalysisOptions
    from technic.commands.outputs import Outputs

    for options in (AnalysisOptions(transparent=True), AnalysisOptions(depth=True)):
        with pytest.raises(UsageError, match="--picture"):
            Outputs(options)


# --- labels ---------------------------------------------------------------------------------------

SPOTS = st.lists(
    st.tuples(st.floats(0, 600), st.floats(0, 400), st.floats(10, 90)), min_size=1, max_size=20
)


@given(SPOTS)
def test_labels_never_overlap_and_stay_inside(spots) -> None:
    sizes = [(width, 26.0) for _, _, width in spots]
    placed = place_labels([(x, y) for x, y, _ in spots], sizes, (0.0, 0.0, 600.0, 400.0))
    boxes = []
    for middle, (width, height) in zip(placed, sizes, strict=True):
        assert middle is not None
        x, y = middle
        boxes.append((x - width / 2, y - height / 2, x + width / 2, y + height / 2))
    for k, a in enumerate(boxes):
        assert a[0] >= 0
        assert a[1] >= 0
        assert a[2] <= 600
        assert a[3] <= 400
        for b in boxes[k + 1 :]:
            assert a[2] <= b[0] or b[2] <= a[0] or a[3] <= b[1] or b[3] <= a[1]


def test_label_with_room_stays_at_its_point() -> None:
    points = [(100.0, 100.0), (200.0, 100.0)]
    assert place_labels(points, [(30.0, 26.0)] * 2, (0, 0, 300, 300)) == points


def test_label_without_room_is_left_out() -> None:
    placed = place_labels([(20.0, 20.0)] * 2, [(38.0, 38.0)] * 2, (0, 0, 40, 40))
    assert placed[0] is not None
    assert placed[1] is None


@pytest.mark.parametrize("name", ["pair", "scissors"])
def test_gltf_of_clear_parts_blends(name: str, make_report) -> None:
    from technic.report.gltf import gltf

    report = make_report(GLASS if name == "pair" else GLASS[:1], name)
    data = gltf(report)
    content = json.loads(data[20 : 20 + int.from_bytes(data[12:16], "little")])
    modes = [material.get("alphaMode", "OPAQUE") for material in content["materials"]]
    assert ("BLEND" in modes) == (name == "pair")
