"""`technic deflect`: rigid bore walls, materials, picture, loads that are too large."""

from __future__ import annotations

import json
import sys
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from technic import cli
from technic.assembly.model import Assembly
from technic.ldraw.reader import load_ldraw
from technic.report.deflection import StaticCase
from technic.report.deflection_picture import deflection_scene
from technic.statics.loads import parse_hang
from technic.statics.solve import deflect

PAIR = """0 Pair of 3L beams, two pins
1 4 0 0 0 1 0 0 0 1 0 0 0 1 32523.dat
1 4 0 -20 20 1 0 0 0 1 0 0 0 1 32523.dat
1 0 0 -10 20 0 1 0 1 0 0 0 0 1 2780.dat
1 0 0 -10 0 0 1 0 1 0 0 0 0 1 2780.dat
"""
HELD = ("--fix", "2:32523:hole1")
END = "3:32523:hole3"


@pytest.fixture
def pair(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    monkeypatch.setenv("TECHNIC_CACHE", str(tmp_path / "cache"))
    path = tmp_path / "pair.ldr"
    path.write_text(PAIR)
    return path


def run(monkeypatch: pytest.MonkeyPatch, *arguments: object) -> int:
    monkeypatch.setattr(sys, "argv", ["technic", *map(str, arguments)])
    try:
        cli.main()
    except SystemExit as end:
        return int(end.code or 0)
    return 0


def answer(
    monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str], *arguments: object
) -> Any:
    code = run(monkeypatch, *arguments, "--json", "-")
    out, err = capsys.readouterr()
    assert (code, err) == (0, "")
    return json.loads(out)


def test_rigid_walls_give_the_least_that_it_can_sag(
    pair: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    load = ("deflect", pair, *HELD, "--hang", f"{END}:100g")
    plain = answer(monkeypatch, capsys, *load)
    both = answer(monkeypatch, capsys, *load, "--port-walls", "rigid")
    assert plain["ports"][0]["distance_rigid_walls_mm"] is None
    mean, stiff = (both["ports"][0][f"distance{k}_mm"] for k in ("", "_rigid_walls"))
    assert mean == plain["ports"][0]["distance_mm"]
    assert 0.5 * mean < stiff < mean
    report = answer(monkeypatch, capsys, "analyze", pair, "--port-walls", "rigid")
    walls = report["rigidity"]["port_walls"]
    assert walls["mean_n_per_m"] == report["rigidity"]["value_n_per_m"] < walls["rigid_n_per_m"]
    assert list((pair.parent / "cache" / "solids").glob("*.zip"))


def test_rigid_walls_need_solid_models(
    pair: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    for command in (("deflect", pair, "--gravity", *HELD), ("analyze", pair)):
        code = run(monkeypatch, *command, "--port-walls", "rigid", "--parts", "frame")
        assert code == 2
        assert "solid models" in capsys.readouterr().err


def test_stiffer_plastic_sags_less(
    pair: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    load = ("deflect", pair, *HELD, "--hang", f"{END}:100g")
    soft, hard = (
        answer(monkeypatch, capsys, *load, "--material", name)["ports"][0]["distance_mm"]
        for name in ("ABS", "32523=PC")
    )
    assert hard < soft
    assert run(monkeypatch, *load, "--material", "Ironn") == 3
    assert "no material 'Ironn'" in capsys.readouterr().err


def test_loads_beyond_small_movements_are_said(
    pair: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    light, heavy = (
        answer(monkeypatch, capsys, "deflect", pair, *HELD, "--hang", f"{END}:{weight}")
        for weight in ("100g", "100kg")
    )
    assert light["warnings"] == []
    assert "degrees" in heavy["warnings"][0]


def case(model: Assembly, weight: str) -> StaticCase:
    from dataclasses import replace

    from technic.assembly.select import parse_fix

    held = replace(model, supports=(parse_fix(model, "2:32523"),))
    loads = (parse_hang(held, f"{END}:{weight}", np.array([0.0, 1.0, 0.0])),)
    return StaticCase(deflect(held, loads), loads)


def test_picture_shows_loads_supports_and_a_round_exaggeration(pair: Path) -> None:
    scene = deflection_scene(case(load_ldraw(pair), "100g"))
    panel = scene.panels[0]
    assert "deformation x" in panel.caption
    assert len(panel.surfaces) == 3  # the model, the load, what the ground gives
    assert any("without loads" in item.text for item in scene.legend)
    still = panel.lines[1].points
    moved = panel.lines[0].points
    size = np.linalg.norm(np.ptp(still, axis=0))
    assert 0.01 * size < np.linalg.norm(moved - still, axis=1).max() < 0.2 * size


def test_picture_does_not_depend_on_the_size_of_the_load(pair: Path) -> None:
    small, large = (deflection_scene(case(load_ldraw(pair), w)) for w in ("10g", "100g"))
    scales = [float(s.panels[0].caption.split("x ")[1].rstrip(")")) for s in (small, large)]
    assert scales[0] == pytest.approx(10 * scales[1], rel=1e-6)
