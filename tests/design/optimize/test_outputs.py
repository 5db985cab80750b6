"""What `technic optimize` writes: assembly, picture, cutting files, solids, JSON, text."""

from __future__ import annotations

import json
import re
import subprocess
import sys
from itertools import pairwise
from pathlib import Path
from xml.etree import ElementTree as ET

import numpy as np
import pytest
import trimesh
from PIL import Image, ImageSequence

from technic.errors import UsageError
from technic.loading import load
from technic.report.cutting import blanks, outline, write_cut, write_stl
from technic.rigidity.analyze import analyze
from tests.conftest import REPO

MAST = REPO / "examples" / "gallery" / "fig13e_five_bar.json"

SVG = "{http://www.w3.org/2000/svg}"


def run(*arguments: str | Path) -> subprocess.CompletedProcess[str]:
    command = [sys.executable, "-m", "technic", "optimize", *map(str, arguments)]
    return subprocess.run(command, cwd=REPO, capture_output=True, text=True, check=False)


def test_command_writes_everything_that_was_asked_for(tmp_path: Path) -> None:
    out, svg, cut = tmp_path / "out.json", tmp_path / "out.svg", tmp_path / "bars.dxf"
    done = run(
        MAST, "--out", out, "--svg", svg, "--cut", cut, "--stl", tmp_path / "stl", "--json", "-"
    )
    assert done.returncode == 0, done.stderr
    data = json.loads(done.stdout)
    assert data["schema"] == "technic-optimization/1"
    assert data["factor"] > 2.0
    after = analyze(load(out)).rigidity
    assert after is not None
    assert after.value == pytest.approx(data["after"]["rigidity_n_per_m"], rel=1e-6)
    moved = [v for v in data["vertices"] if not np.allclose(v["from_m"], v["to_m"])]
    assert {p for v in moved for p in v["parts"]} == {"mast", "stay left", "stay right"}
    picture = ET.fromstring(svg.read_text())
    assert len(picture.findall(f"{SVG}circle")) == 6
    assert cut.read_text().count("POLYLINE") == 5
    assert len(list((tmp_path / "stl").glob("*.stl"))) == 5


def test_film_and_picture(tmp_path: Path) -> None:
    """The film starts at the start, ends at the end and has the path between; the picture shows both."""
    gif, png = tmp_path / "path.gif", tmp_path / "both.png"
    done = run(MAST, "--gif", gif, "--picture", png, "--max-evaluations", "12", "-q")
    assert done.returncode == 0, done.stderr
    with Image.open(gif) as film:
        assert 3 <= film.n_frames <= 13
        frames = [
            np.array(frame.convert("RGB")).astype(int) for frame in ImageSequence.Iterator(film)
        ]
        assert film.info["loop"] == 0
    changed = [np.abs(b - a).max(axis=2) > 100 for a, b in pairwise(frames)]
    assert any(c.sum() > 200 for c in changed)
    assert np.abs(frames[-1] - frames[0]).max(axis=2).sum() > changed[0].sum()
    # the path is drawn in its own colour, and only after the start
    orange = [((f[..., 0] > 150) & (f[..., 1] < 120) & (f[..., 2] < 90)).sum() for f in frames]
    assert orange[0] == 0
    assert orange[-1] > 20
    with Image.open(png) as both:
        assert both.size[0] > 1.5 * both.size[1]


def test_list_and_mistakes() -> None:
    listed = run(MAST, "--list")
    assert listed.returncode == 0
    assert "slides along its bar" in listed.stdout
    assert run(MAST, "--fix", "nowhere").returncode == 2
    wrong = run(MAST, "--cut", "bars.txt", "--keep", "1")
    assert wrong.returncode == 2
    assert "Traceback" not in wrong.stderr


def test_bars_have_their_length_and_holes(tmp_path: Path) -> None:
    assembly = load(MAST)
    found = {blank.id: blank for blank in blanks(assembly, 0.001)}
    mast = found["mast"]
    assert np.ptp(mast.axis[:, 0]) == pytest.approx(200.0)
    assert mast.width == pytest.approx(3.0)
    assert sorted(mast.holes[:, 0]) == pytest.approx([0.0, 40.0, 60.0])
    edge = outline(mast)
    assert np.ptp(edge[:, 0]) == pytest.approx(203.0, abs=0.05)
    # a wide pin makes the bar wider
    assert {b.id: b for b in blanks(assembly, 0.004)}["mast"].width == pytest.approx(6.0)
    sheet = tmp_path / "bars.svg"
    write_cut(assembly, sheet, 0.001)
    root = ET.fromstring(sheet.read_text())
    groups = root.findall(f"{SVG}g")
    assert len(groups) == 5
    assert sum(len(g.findall(f"{SVG}circle")) for g in groups) == sum(
        len(b.holes) for b in found.values()
    )
    # all of it lies on the sheet
    wide, high = (float(v) for v in re.findall(r"[\d.]+", root.attrib["viewBox"])[2:])
    for polygon in root.iter(f"{SVG}polygon"):
        points = np.array(
            [[float(v) for v in p.split(",")] for p in polygon.attrib["points"].split()]
        )
        assert points.min() >= 0.0
        assert points[:, 0].max() <= wide
        assert points[:, 1].max() <= high
    with pytest.raises(UsageError, match=r"\.svg or \.dxf"):
        write_cut(assembly, tmp_path / "bars.txt", 0.001)


def test_solids_are_watertight_and_have_their_volume(tmp_path: Path) -> None:
    assembly = load(MAST)
    for path, blank in zip(
        write_stl(assembly, tmp_path, 0.001), blanks(assembly, 0.001), strict=True
    ):
        solid = trimesh.load(path)
        assert solid.is_watertight
        length = np.linalg.norm(np.diff(blank.axis, axis=0), axis=1).sum()
        area = length * blank.width + np.pi * (blank.width / 2) ** 2
        area -= len(blank.holes) * np.pi * 0.5**2
        assert solid.volume == pytest.approx(area * blank.thickness, rel=0.01)
