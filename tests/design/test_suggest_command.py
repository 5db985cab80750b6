"""`technic suggest` from the command line: text, JSON, files, exit codes."""

from __future__ import annotations

import csv
import json
from xml.etree import ElementTree as ET

import pytest

from technic.ldraw.reader import load_ldraw
from technic.rigidity.analyze import analyze
from tests.conftest import REPO
from tests.design.made import ALONG_Z, SQUARE, text_of


@pytest.fixture
def square(tmp_path):
    path = tmp_path / "square.ldr"
    path.write_text("0 Square\n" + text_of(*SQUARE, end="\n"))
    return path


def test_text_says_what_where_and_what_for(run, square):
    code, out, err = run("suggest", square, "--top", 2)
    assert code == 0, err
    assert "Now: flexible, 1 motion" in out
    assert "1. Bent beam" in out
    assert "Then: rigid" in out
    assert "works against motion 1; 1 of 1 gone" in out
    assert "hole at (" in out
    assert "new pin 2780 into Beam 5 (32316" in out
    assert "pins go in from" in out
    assert "would do about as well" in out
    assert "How sure" in out


def test_json_follows_the_contract_and_the_file_keeps_the_promise(run, square, tmp_path):
    target = tmp_path / "new.ldr"
    code, out, err = run(
        "suggest", square, "--json", "-", "--top", 3, "--apply", 2, "--out", target
    )
    assert code == 0, err
    content = json.loads(out)
    assert content["schema"] == "technic-suggestions/1"
    assert content["before"]["verdict"] == "flexible"
    assert [s["rank"] for s in content["suggestions"]] == [1, 2, 3]
    second = content["suggestions"][1]
    for part in second["new_parts"]:
        assert set(part) >= {"part_number", "name", "color", "position_ldu", "rotation"}
        assert len(part["position_ldu"]) == 3
        assert len(part["rotation"]) == 9
    assert set(second) >= {
        "connects", "cures", "predicted_n_per_m", "reanalyzed_n_per_m", "factor", "after",
    }  # fmt: skip
    again = analyze(load_ldraw(target))
    assert again.verdict == second["after"]["verdict"]
    assert again.rigidity.value == pytest.approx(second["reanalyzed_n_per_m"], rel=1e-6)
    ids = {part.id for part in load_ldraw(square).parts}
    assert set(second["connects"]) <= ids


def test_the_pair_is_written_as_promised(run, square, tmp_path):
    target = tmp_path / "pair.ldr"
    arguments = ("--json", "-", "--top", 1, "--apply", 1, "--pair", "--out", target)
    code, out, err = run("suggest", square, *arguments)
    assert code == 0, err
    pair = json.loads(out)["suggestions"][0]["pair"]
    again = analyze(load_ldraw(target))
    promised = pair["after"]["rigidity"]["value_n_per_m"]
    assert again.rigidity.value == pytest.approx(promised, rel=1e-6)


def test_a_sequence_is_applied_up_to_its_rank(run, square, tmp_path):
    target = tmp_path / "two.ldr"
    arguments = ("--count", 2, "--json", "-", "--apply", 2, "--out", target)
    code, out, err = run("suggest", square, *arguments)
    assert code == 0, err
    content = json.loads(out)
    assert content["kind"] == "sequence"
    last = content["suggestions"][-1]
    again = analyze(load_ldraw(target))
    assert again.rigidity.value == pytest.approx(last["reanalyzed_n_per_m"], rel=1e-6)


def test_parts_list_in_both_forms(run, square, tmp_path):
    code, _, err = run("suggest", square, "--top", 1, "-q", "--parts-list", tmp_path / "list")
    assert code == 0, err
    with (tmp_path / "list.csv").open() as stream:
        rows = {row["part"]: int(row["count"]) for row in csv.DictReader(stream)}
    items = {
        item.findtext("ITEMID"): int(item.findtext("MINQTY"))
        for item in ET.parse(tmp_path / "list.xml").getroot().iter("ITEM")
    }
    assert items == rows
    assert sum(rows.values()) >= 3


def test_an_inventory_is_read_from_a_table(run, square, tmp_path):
    stock = tmp_path / "stock.csv"
    stock.write_text("Part,Color,Count\n32526,red,2\n2780,black,4\n6558,blue,0\n")
    code, out, err = run("suggest", square, "--json", "-", "--inventory", stock)
    assert code == 0, err
    for suggestion in json.loads(out)["suggestions"]:
        assert set(suggestion["needs"]) <= {"32526", "2780"}
    stock.write_text("number,amount\n32526,2\n")
    code, _, err = run("suggest", square, "--inventory", stock)
    assert code == 3
    assert "column 'part' is missing" in err


def test_nothing_fits_says_so_and_why(run, tmp_path):
    path = tmp_path / "one.ldr"
    path.write_text(text_of(f"0 0 0 {ALONG_Z} 32316", end="\n"))
    code, out, err = run("suggest", path)
    assert code == 0, err
    assert "Nothing fits: no two free holes" in out


@pytest.mark.parametrize(
    ("arguments", "said"),
    [
        (["--apply", 1], "go together"),
        (["--lengths", "5,x"], "list of numbers"),
        (["--lengths", "6"], "no straight beam with 6 holes"),
        (["--between", "32316", "2780"], "32316"),
        (["--longest", 50], "--longest is for assembly files"),
        (["--apply", 99, "--out", "new.ldr"], "there is no suggestion 99"),
    ],
)
def test_wrong_use_is_explained(run, square, arguments, said, tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    code, _, err = run("suggest", square, *arguments)
    assert code == 2
    assert said in err


def test_suggestions_that_stop_nothing_say_so(run, square):
    """The shipped square of 7s has no room for a diagonal; a frame ties its sides."""
    said = "None of them stops the motion"
    code, out, err = run("suggest", REPO / "examples" / "square.ldr", "--top", 1, "--shortlist", 5)
    assert code == 0, err
    assert said in out
    code, out, err = run("suggest", square, "--top", 1, "--shortlist", 5)
    assert code == 0, err
    assert said not in out


def test_filters_that_leave_nothing_say_so(run, square, tmp_path):
    code, out, err = run("suggest", square, "--box", 900, 900, 900, 999, 999, 999)
    assert code == 0, err
    assert "no place is left: 180 x ruled out by what was asked for" in out
    stock = tmp_path / "stock.csv"
    stock.write_text("part,count\n3001,2\n")
    code, out, err = run("suggest", square, "--inventory", stock)
    assert code == 0, err
    assert "ruled out by what was asked for" in out


def test_thin_beams_and_frames_on_demand(run, square):
    code, out, err = run(
        "suggest",
        square,
        "--also",
        "frames",
        "--max-parts",
        3,
        "--shortlist",
        4,
        "--json",
        "-",
        "--top",
        2,
    )
    assert code == 0, err
    assert len(json.loads(out)["suggestions"]) == 2
    code, _, err = run("suggest", square, "--also", "bricks")
    assert code == 2
    assert "--also takes thin and frames" in err


def test_suggestions_say_how_sure_they_are(run, square):
    code, out, err = run("suggest", square, "--json", "-", "--top", 2)
    assert code == 0, err
    first, second = json.loads(out)["suggestions"]
    sure = first["confidence"]
    assert sure["basis"] in ("assumed", "calibration")
    low, high = sure["interval_95"]
    assert low < first["reanalyzed_n_per_m"] < high
    assert 0.0 <= sure["probability_it_beats_the_next"] <= 1.0
    assert second["confidence"]["probability_it_beats_the_next"] is None


LINKAGE = """{"schema": "technic-assembly/1", "dimension": 2, "parts": [%s], "joints": [%s]}"""


@pytest.fixture
def linkage(tmp_path):
    corners = [(0, 0), (0.1, 0), (0.1, 0.1), (0, 0.1)]
    parts, joints = [], []
    for k, corner in enumerate(corners):
        ends = [corner, corners[(k + 1) % 4]]
        section = {"kind": "rectangle", "width": 0.004, "height": 0.004}
        shape = {"kind": "bar", "points": ends, "section": section}
        parts.append(json.dumps({"id": f"b{k}", "shape": shape}))
        pair = [f"b{k - 1}" if k else "b3", f"b{k}"]
        joints.append(json.dumps({"type": "hinge", "parts": pair, "point": corner}))
    path = tmp_path / "frame.json"
    path.write_text(LINKAGE % (",".join(parts), ",".join(joints)))
    return path


def test_a_linkage_gets_a_bar_and_the_file_keeps_the_promise(run, linkage, tmp_path):
    from technic.assembly.file import load_assembly

    target = tmp_path / "braced.json"
    options = ("--between", "b0", "b1", "--longest", 60)
    code, out, err = run("suggest", linkage, *options, "--json", "-", "--apply", 1, "--out", target)
    assert code == 0, err
    content = json.loads(out)
    assert content["schema"] == "technic-suggestions/1"
    best = content["suggestions"][0]
    assert set(best["connects"]) >= {"b0", "b1"}
    assert best["length_mm"] <= 60.0 * (1 + 1e-6)
    again = analyze(load_assembly(target))
    assert again.verdict == best["after"]["verdict"] == "rigid"
    assert again.rigidity.value == pytest.approx(best["reanalyzed_n_per_m"], rel=1e-6)
    written = json.loads(target.read_text())
    assert written["parts"][-1] == best["new_parts"][0]
    assert written["joints"][-len(best["new_joints"]) :] == best["new_joints"]


def test_a_linkage_is_answered_in_words(run, linkage):
    code, out, err = run("suggest", linkage, "--between", "b0", "b2", "--count", 1)
    assert code == 0, err
    assert "Now: flexible, 1 motion" in out
    assert "1. Bar of" in out
    assert "mm on b0" in out
    assert "works against motion 1; 1 of 1 gone" in out
    assert "In the end: rigid" in out
    code, out, err = run("suggest", linkage, "--longest", 1)
    assert code == 0, err
    assert "Nothing fits: no two parts have places" in out


@pytest.mark.parametrize(
    ("arguments", "said"),
    [
        (["--lengths", "5"], "--lengths is for LDraw models"),
        (["--also", "thin"], "--also is for LDraw models"),
        (["--between", "b0", "b0"], "two different parts"),
        (
            ["--longest", 60, "--between", "b0", "b1", "--apply", 9, "--out", "x.json"],
            "there is no",
        ),
    ],
)
def test_wrong_use_on_a_linkage_is_explained(run, linkage, arguments, said, tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    code, _, err = run("suggest", linkage, *arguments)
    assert code == 2
    assert said in err
