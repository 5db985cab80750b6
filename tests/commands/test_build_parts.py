"""`technic parts build`: what it writes, where, and what it refuses."""

from __future__ import annotations

import json
import sys
from pathlib import Path

import pytest

from technic import cli
from technic.fem.solid.settings import MeshSettings
from technic.fem.solid.store import read, read_shape, shape_key, write
from technic.parts.catalogue import catalogue


def run(monkeypatch: pytest.MonkeyPatch, *arguments: object) -> int:
    monkeypatch.setattr(sys, "argv", ["technic", "parts", "build", *map(str, arguments)])
    try:
        cli.main()
    except SystemExit as end:
        return int(end.code or 0)
    return 0


def test_draft_goes_to_a_file_of_its_own(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    target = tmp_path / "draft.zip"
    assert run(monkeypatch, "43857", "2780", "--draft", "--out", target, "--json", "-") == 0
    out, err = capsys.readouterr()
    said = json.loads(out)
    assert said["built"]["43857"]["cell_mm"] == pytest.approx(1.2)
    assert list(said["failed"]) == ["2780"]  # a pin: its give is in the joints
    assert "1/2" in err
    made = read(target, "43857")
    assert made is not None
    assert made.cell == pytest.approx(1.2e-3)


def test_parts_that_are_kept_keep_the_shape_they_were_made_from(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """Building one part does not make another look up to date."""
    target = tmp_path / "draft.zip"
    assert run(monkeypatch, "43857", "--draft", "--out", target, "-q") == 0
    made = read(target, "43857")
    assert made is not None
    write(target, {"43857": made}, shapes={"43857": "of another shape"})
    assert run(monkeypatch, "32523", "--draft", "--out", target, "-q") == 0
    assert read_shape(target, "43857") == "of another shape"
    definition = catalogue().get("32523")
    assert definition is not None
    assert read_shape(target, "32523") == shape_key(definition)


@pytest.mark.parametrize("option", [("--draft",), ("--cell", "1.0")])
def test_other_cells_never_go_into_the_shipped_file(
    option: tuple[str, ...], monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    assert run(monkeypatch, "43857", *option) == 2
    assert f"{MeshSettings().cell * 1e3:g} mm" in capsys.readouterr().err


def test_contradiction_and_unknown_part(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    assert run(monkeypatch, "43857", "--draft", "--cell", "1.0", "--out", tmp_path / "x.zip") == 2
    assert run(monkeypatch, "nosuchpart") == 2
    assert "no part 'nosuchpart'" in capsys.readouterr().err
