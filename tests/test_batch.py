"""Many models: order, isolation of what goes wrong, tables, exit codes."""

from __future__ import annotations

import csv
import io
import json
import os
import subprocess
import sys
import time
from pathlib import Path
from typing import Any

import pytest

from technic.batch import analyze_many, find_models
from technic.errors import InputError
from technic.report.batch_table import batch_csv, batch_dict, batch_text
from technic.report.style import Style
from technic.rigidity.analyze import analyze
from tests.conftest import REPO

EXAMPLES = REPO / "examples"
SQUARE, TRIANGLE = EXAMPLES / "square.ldr", EXAMPLES / "triangle.ldr"


def ends_on_squares(path: Path) -> dict[str, Any]:
    """End the process on a square, as a crash or the system's killer would."""
    if path.stem == "square":
        os._exit(9)
    return {}


def sleeps_on_squares(path: Path) -> dict[str, Any]:
    if path.stem == "square":
        time.sleep(600.0)
    return {}


def run(*arguments: str | Path) -> subprocess.CompletedProcess[str]:
    command = [sys.executable, "-m", "technic", "batch", *map(str, arguments), "--no-library"]
    return subprocess.run(command, cwd=REPO, capture_output=True, text=True, check=False)


def test_directories_are_searched_and_files_listed_once(tmp_path: Path) -> None:
    inner = tmp_path / "inner"
    inner.mkdir()
    for name in ("b.ldr", "a.MPD", "part.dat", "notes.txt"):
        (inner / name).write_text("0\n")
    (inner / "other.json").write_text("{}")
    (inner / "linkage.json").write_text(json.dumps({"schema": "technic-assembly/1"}))
    (tmp_path / "again").symlink_to(tmp_path)  # a circle
    found = find_models([inner / "b.ldr", tmp_path])
    assert [path.name for path in found] == ["b.ldr", "a.MPD", "linkage.json"]
    (tmp_path / "linked").mkdir()
    (tmp_path / "linked" / "here").symlink_to(inner)
    assert len(find_models([tmp_path / "linked"])) == 3
    with pytest.raises(InputError, match="no model in it"):
        find_models([_empty(tmp_path)])
    with pytest.raises(InputError, match="no such file"):
        find_models([tmp_path / "nowhere"])


def test_a_folder_that_cannot_be_read_is_said(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    def refuse(_folder: Path) -> list[Path]:
        raise PermissionError(13, "Permission denied")

    monkeypatch.setattr(Path, "iterdir", refuse)
    with pytest.raises(InputError, match="cannot be read: Permission denied"):
        find_models([tmp_path])


def _empty(folder: Path) -> Path:
    out = folder / "empty"
    out.mkdir()
    return out


def test_answers_come_in_order_and_are_those_of_analyze() -> None:
    paths = [SQUARE, TRIANGLE, SQUARE]
    found = list(analyze_many(paths, jobs=2, parts="frame"))
    assert [outcome.path for outcome in found] == paths
    own = analyze(_load(TRIANGLE), parts="frame").to_dict()
    report = found[1].report
    assert report is not None
    assert report["rigidity"]["value_n_per_m"] == own["rigidity"]["value_n_per_m"]
    assert report["mobility"] == own["mobility"]


def _load(path: Path) -> Any:
    from technic.loading import load

    return load(path)


def test_what_goes_wrong_with_one_leaves_the_others(tmp_path: Path) -> None:
    bad = tmp_path / "bad.ldr"
    bad.write_text("1 4 0 0 0 1 0 0 0 1 0 0 0 one 32524.dat\n")
    found = list(analyze_many([bad, SQUARE, TRIANGLE], ends_on_squares, jobs=2))
    assert [outcome.report is None for outcome in found] == [True, True, False]
    assert found[0].exit_code == 3
    assert "bad.ldr:1" in found[0].error
    assert found[1].exit_code == 5
    assert "code 9" in found[1].error


def test_one_that_takes_too_long_is_given_up() -> None:
    (found,) = analyze_many([SQUARE], sleeps_on_squares, max_seconds=0.5)
    assert "given up" in found.error
    assert found.report is None


def test_tables_say_the_same() -> None:
    found = list(analyze_many([SQUARE, TRIANGLE, EXAMPLES / "nothing.ldr"], jobs=2))
    content = batch_dict(found)
    assert content["schema"] == "technic-batch/1"
    assert [row["verdict"] for row in content["models"][:2]] == ["flexible", "rigid"]
    assert content["failed"] == 1
    assert content["models"][2]["error"]["exit_code"] == 3
    rows = list(csv.DictReader(io.StringIO(batch_csv(found))))
    for row, own in zip(rows, content["models"], strict=True):
        assert row["path"] == own["path"]
        if own["error"] is None:
            assert float(row["rigidity_n_per_m"]) == own["rigidity"]["value_n_per_m"]
            assert int(row["structural"]) == own["mobility"]["structural"]
            assert row["weakest"] == own["weakest"]["id"]
    text = batch_text(found, Style())
    assert "1 model of 3 could not be analysed" in text
    assert "nothing.ldr: no such file" in " ".join(text.split())
    assert len({line.index("flexible") for line in text.splitlines() if "flexible" in line}) == 1


def test_command(tmp_path: Path) -> None:
    table, reports = tmp_path / "table.csv", tmp_path / "reports"
    done = run(SQUARE, TRIANGLE, "--csv", table, "--reports", reports, "--json", "-", "--jobs", "2")
    assert done.returncode == 0, done.stderr
    assert json.loads(done.stdout)["failed"] == 0
    assert table.read_text(encoding="utf-8-sig").count("\n") == 3
    assert {path.name for path in reports.iterdir()} == {"square.ldr.json", "triangle.ldr.json"}
    assert run(SQUARE, "--require-rigid", "-q").returncode == 1
    assert run(TRIANGLE, "--require-rigid", "--min-rigidity", "1", "-q").returncode == 0
    wrong = run(tmp_path / "nowhere.ldr")
    assert wrong.returncode == 3
    assert "Traceback" not in wrong.stderr
