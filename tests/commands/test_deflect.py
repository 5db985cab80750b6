"""`technic deflect` from the command line: what it prints, refuses, and how it balances."""

from __future__ import annotations

import json
from functools import partial

import numpy as np
import pytest

PAIR = """0 Pair of 5L beams, two pins
1 4 0 0 0 1 0 0 0 1 0 0 0 1 32316.dat
1 4 0 -20 60 1 0 0 0 1 0 0 0 1 32316.dat
1 0 0 -10 40 0 1 0 1 0 0 0 0 1 2780.dat
1 0 0 -10 20 0 1 0 1 0 0 0 0 1 2780.dat
"""
HELD = ("--fix", "2:32316")
END = "3:32316:hole5"
BAR = {
    "schema": "technic-assembly/1",
    "dimension": 3,
    "parts": [
        {
            "id": "bar",
            "shape": {
                "kind": "bar",
                "points": [[0, 0, 0], [0.2, 0, 0]],
                "section": {"kind": "rectangle", "width": 0.01, "height": 0.01},
            },
        }
    ],
    "joints": [],
    "supports": [{"part": "bar", "point": [0, 0, 0]}],
}


@pytest.fixture
def pair(tmp_path):
    path = tmp_path / "pair.ldr"
    path.write_text(PAIR)
    return path


@pytest.fixture
def run(run):
    """Run `technic deflect` in this process: exit code, standard output, standard error."""
    return partial(run, "deflect")


def answer(run, *arguments):
    code, out, err = run(*arguments, "--json", "-")
    assert (code, err) == (0, "")
    return json.loads(out)


def test_contract(run, pair):
    content = answer(run, pair, *HELD, "--load", f"{END}:1,2,3", "--probe", "3:32316")
    assert content["schema"] == "technic-deflection/1"
    assert [p["id"] for p in content["parts"]] == [
        "pair.ldr/2:32316",
        "pair.ldr/3:32316",
        "pair.ldr/4:2780",
        "pair.ldr/5:2780",
    ]
    for part in content["parts"]:
        assert len(part["displacement_mm"]) == len(part["rotation_rad"]) == 3
    loaded, probed = content["ports"]
    assert (loaded["part"], loaded["port"], loaded["loaded"]) == ("pair.ldr/3:32316", "hole5", True)
    assert (probed["port"], probed["loaded"]) == (None, False)
    assert probed["displacement_mm"] == pytest.approx(
        content["parts"][1]["displacement_mm"], rel=0.2, abs=1e-3
    )
    assert len(content["joints"]) == 4
    assert {"id", "force_n", "moment_nm"} <= content["joints"][0].keys()
    assert content["loads"][0]["force_n"] == [1, 2, 3]
    work = np.dot(loaded["displacement_mm"], [1, 2, 3]) * 1e-3
    assert content["work_j"] == pytest.approx(work, rel=1e-8)


def test_reactions_balance_load_and_weight(run, pair):
    content = answer(run, pair, *HELD, "--hang", f"{END}:200g", "--gravity")
    (reaction,) = content["reactions"]
    weight = (0.2 + content["model"]["mass_kg"]) * 9.80665
    assert reaction["force_n"] == pytest.approx([0, -weight, 0], abs=1e-8)


def test_a_weight_is_its_force_whatever_its_unit(run, pair):
    force = answer(run, pair, *HELD, "--load", f"{END}:0,1.96133,0")
    for amount in ("200g", "0.2kg", "0.2 kg", "1.96133N", "2e2g"):
        hung = answer(run, pair, *HELD, "--hang", f"{END}:{amount}")
        assert hung["parts"] == force["parts"]


def test_loads_add_up(run, pair):
    one = answer(run, pair, *HELD, "--load", f"{END}:0,1,0")
    two = answer(run, pair, *HELD, "--load", f"{END}:0,0,2")
    both = answer(run, pair, *HELD, "--load", f"{END}:0,1,0", "--load", f"{END}:0,0,2")
    for a, b, c in zip(one["parts"], two["parts"], both["parts"], strict=True):
        total = np.add(a["displacement_mm"], b["displacement_mm"])
        assert c["displacement_mm"] == pytest.approx(total, abs=1e-9)


def test_down_may_be_another_way(run, pair):
    there = answer(run, pair, *HELD, "--hang", f"{END}:100g", "--down=-z")
    assert there["loads"][0]["force_n"] == pytest.approx([0, 0, -0.980665])
    skew = answer(run, pair, *HELD, "--hang", f"{END}:1N", "--down", "3,0,4")
    assert skew["loads"][0]["force_n"] == pytest.approx([0.6, 0, 0.8])


def test_rigid_parts_sag_less(run, pair):
    sag = {
        kind: answer(run, pair, *HELD, "--hang", f"{END}:200g", "--parts", kind)["work_j"]
        for kind in ("frame", "rigid")
    }
    assert 0 < sag["rigid"] < sag["frame"]


def test_text_names_the_part_that_goes_furthest_first(run, pair):
    code, out, err = run(pair, *HELD, "--hang", f"{END}:200g", "--gravity")
    assert (code, err) == (0, "")
    table = out.split("How far each part goes")[1].splitlines()
    assert "line 3" in table[1]
    assert "down (+y)" in out
    assert "What the joints carry" in out
    assert "What the ground gives" in out
    assert "the model's own weight" in out.lower()


def test_assembly_file_needs_to_be_told_where_down_is(run, tmp_path):
    path = tmp_path / "bar.json"
    path.write_text(json.dumps(BAR))
    code, out, err = run(path, "--hang", "bar:1kg")
    assert (code, out) == (2, "")
    assert "--down" in err
    content = answer(run, path, "--hang", "bar:1kg", "--down=-y")
    assert content["reactions"][0]["force_n"] == pytest.approx([0, 9.80665, 0], abs=1e-8)
    content = answer(run, path, "--load", "bar:0,5,0")
    assert content["reactions"][0]["moment_nm"] == pytest.approx([0, 0, -0.5], abs=1e-8)


@pytest.mark.parametrize(
    ("arguments", "words"),
    [
        ((), "nothing acts"),
        (("--load", "3:32316"), "cannot read the force"),
        (("--load", "3:32316:hole5:1,2"), "three|in newtons"),
        (("--load", "3:32316:hole5:1,2,x"), "in newtons"),
        (("--load", "3:32316:hole5:1,2,nan"), "in newtons"),
        (("--load", "1,2,3"), "cannot read the load"),
        (("--load", "3:32316:hole9:1,2,3"), "no port called 'hole9'"),
        (("--load", "32316:1,2,3"), "can mean 2 parts"),
        (("--hang", "3:32316:hole5:200"), "g, kg or N"),
        (("--hang", "3:32316:hole5:-200g"), "g, kg or N"),
        (("--hang", "3:32316:hole5:200lb"), "g, kg or N"),
        (("--hang", "3:32316:hole5:9e999g"), "g, kg or N"),
        (("--hang", "nobody:200g"), "no part is called"),
        (("--gravity", "--down", "0,0,0"), "nowhere"),
        (("--gravity", "--down", "sideways"), "no direction"),
        (
            ("--load", "3:32316:hole5:0,1,0", "--json", "/no/such/directory/x.json"),
            "does not exist",
        ),
        (("--load", "3:32316:hole5:0,1,0", "--probe", "99:1"), "no part is called"),
    ],
)
def test_usage_errors(run, pair, arguments, words):
    code, out, err = run(pair, *HELD, *arguments)
    assert (code, out) == (2, "")
    assert "Traceback" not in err
    assert any(word in err for word in words.split("|"))


def test_a_model_that_nothing_holds_is_refused(run, pair):
    code, out, err = run(pair, "--load", f"{END}:0,1,0")
    assert (code, out) == (2, "")
    assert "--fix PART" in err


def test_missing_file(run, tmp_path):
    code, _, err = run(tmp_path / "none.ldr", "--gravity")
    assert code == 3
    assert "no such file" in err
