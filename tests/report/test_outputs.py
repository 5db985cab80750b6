"""The files of `technic analyze`, as the command line writes them."""

from __future__ import annotations

import hashlib
import re
import subprocess
import sys
from pathlib import Path

import pytest

from technic.report import render
from tests.conftest import REPO


@pytest.fixture
def no_drawing(monkeypatch) -> None:
    """A machine on which VTK kills its process."""

    def crash(*_how):
        return subprocess.Popen(
            [sys.executable, "-c", "import os; os.abort()"],
            stdin=subprocess.PIPE,
            stdout=subprocess.PIPE,
            stderr=subprocess.PIPE,
        )

    monkeypatch.setattr(render, "_start", crash)


@pytest.fixture
def model(models, tmp_path) -> Path:
    path = tmp_path / "pair.ldr"
    path.write_text("\n".join(["0 Pair", *models["pair"], ""]), encoding="utf-8")
    return path


def test_report_has_the_picture(run, model, tmp_path):
    target = tmp_path / "report.html"
    code, out, err = run("analyze", model, "--report", target)
    assert code == 0
    assert "RIGID" in out
    assert f"report: {target}" in err
    text = target.read_text(encoding="utf-8")
    assert '<img src="data:image/webp;base64,' in text
    assert text.startswith("<!doctype html>")


@pytest.mark.usefixtures("no_drawing")
def test_report_without_a_way_to_draw(run, model, tmp_path):
    """Everything but the picture, and one clear line."""
    target = tmp_path / "report.html"
    code, _, err = run("analyze", model, "--report", target, "-q")
    assert code == 0
    assert "the page is without a picture" in err
    assert "apt install" in err
    assert 'id="snapshot"' in target.read_text(encoding="utf-8")


@pytest.mark.usefixtures("no_drawing")
def test_files_come_before_the_picture_that_fails(run, model, tmp_path):
    page, heat, tables = tmp_path / "r.html", tmp_path / "h.mpd", tmp_path / "tables"
    picture = tmp_path / "p.png"
    code, _, _ = run(
        *("analyze", model, "--report", page, "--picture", picture),
        *("--heatmap", heat, "--csv", tables),
    )
    assert code == 4
    assert page.exists()
    assert heat.exists()
    assert (tables / "parts.csv").exists()
    assert not picture.exists()


def test_files_for_other_programs(run, model, tmp_path):
    heat, scene, tables = tmp_path / "heat.mpd", tmp_path / "model.glb", tmp_path / "tables"
    code, out, err = run(
        *("analyze", model, "--heatmap", heat, "--gltf", scene, "--csv", tables, "--json", "-")
    )
    assert code == 0
    assert out.startswith("{")
    assert heat.read_text(encoding="utf-8").count("0x2") == 4
    assert scene.read_bytes().startswith(b"glTF")
    for target in (heat, scene, tables):
        assert str(target) in err


@pytest.mark.parametrize("option", ["--report", "--heatmap", "--gltf", "--csv", "--animate"])
def test_bad_target_is_said_before_the_work(run, model, tmp_path, option):
    code, out, err = run("analyze", model, option, tmp_path / "nowhere" / "file")
    assert code == 2
    assert out == ""
    assert "does not exist" in err


def test_heat_map_needs_an_ldraw_model(run, tmp_path):
    from importlib.resources import files

    gallery = next(
        path for path in Path(str(files("technic"))).rglob("*.json") if "gallery" in path.parts
    )
    code, _, err = run("analyze", gallery, "--heatmap", tmp_path / "h.mpd", "-q")
    assert code == 2
    assert "LDraw" in err


def test_viewer_is_the_built_one():
    """The bundle says from which sources it was made: those in web/; and nobody changed it since."""
    content = (REPO / "technic/report/html/assets/viewer.js").read_bytes()
    first, _, bundle = content.partition(b"\n")
    said = re.fullmatch(
        rb"/\* technic viewer; sources ([0-9a-f]{64}); bundle ([0-9a-f]{64}) \*/", first
    )
    assert said is not None, "run scripts/build_viewer"
    web = REPO / "web"
    names = ["package.json", *(f"src/{path.name}" for path in (web / "src").glob("*.js"))]
    # As sha256sum lists them, in the order of their bytes.
    listed = "".join(
        f"{hashlib.sha256((web / name).read_bytes()).hexdigest()}  {name}\n"
        for name in sorted(names)
    )
    assert said[1].decode() == hashlib.sha256(listed.encode()).hexdigest(), (
        "run scripts/build_viewer"
    )
    assert said[2].decode() == hashlib.sha256(bundle).hexdigest()


@pytest.mark.parametrize(
    ("template", "sources"),
    [("page", ("viewer", "list", "marks", "main")), ("suggest", ("compare", "main"))],
)
def test_viewer_finds_what_it_asks_for(template, sources):
    """Every element that the sources look up by name is in the page that they work on."""
    folder = REPO / "technic/report/html/templates"
    html = "".join(
        (folder / f"{name}.html.j2").read_text(encoding="utf-8") for name in ("base", template)
    )
    html += html.replace("{{ side }}", "before") + html.replace("{{ side }}", "after")
    for source in sources:
        script = (REPO / "web" / "src" / f"{source}.js").read_text(encoding="utf-8")
        for name in re.findall(r'(?:byId|getElementById)\("([^"]+)"\)', script):
            assert f'id="{name}"' in html
