"""Settings: which stiffness table is found where, and that the report says so."""

from __future__ import annotations

import json

import pytest

PAIR = """0 Pair
1 4 0 0 0 1 0 0 0 1 0 0 0 1 32316.dat
1 4 0 -20 60 1 0 0 0 1 0 0 0 1 32316.dat
1 0 0 -10 40 0 1 0 1 0 0 0 0 1 2780.dat
1 0 0 -10 20 0 1 0 1 0 0 0 0 1 2780.dat
"""
TABLE = """schema = "technic-stiffness/1"
name = "{name}"
[sources]
calibrated = "made up for a test"
[calibration]
date = "2026-01-02"
readings = 12
rigs = ["pin-pair"]
parts = "{parts}"
[connection."pin/pin_hole"]
type = "hinge"
axial = {{ value = 1e8, provenance = "paper" }}
shear = {{ value = {shear}, provenance = "calibrated", interval_95 = [{low}, {high}] }}
tilt = {{ value = 0.24, provenance = "paper" }}
"""


def table(path, name, shear=50000.0, parts="solid"):
    path.parent.mkdir(exist_ok=True, parents=True)
    path.write_text(
        TABLE.format(name=name, shear=shear, low=0.8 * shear, high=1.25 * shear, parts=parts)
    )


@pytest.fixture
def run(run, monkeypatch, tmp_path):
    """Run the program with its own folder of settings: exit code, output, errors."""
    monkeypatch.setenv("TECHNIC_CONFIG", str(tmp_path / "settings"))
    (tmp_path / "models").mkdir()
    (tmp_path / "models" / "pair.ldr").write_text(PAIR)
    return run


def in_force(run, model, *more):
    code, out, err = run("analyze", model, "--json", "-", *more)
    assert code == 0, err
    content = json.loads(out)
    shear = content["joint_stiffness"][0]["values"]["shear_n_per_m"]
    return content["stiffness_table"], shear


def test_what_is_nearest_wins(run, tmp_path):
    model = tmp_path / "models" / "pair.ldr"
    shipped, shear = in_force(run, model)
    assert (shipped["name"], shipped["found"], shipped["path"]) == ("default", "shipped", None)
    assert (shipped["measured"], shipped["calibration"]) == ([], None)
    assert shear == 65625.0

    table(tmp_path / "settings" / "mine.toml", "mine", 40000.0)
    (tmp_path / "settings" / "technic.toml").write_text('calibration = "mine.toml"\n')
    found, shear = in_force(run, model)
    assert (found["name"], found["found"], shear) == ("mine", "the user's settings", 40000.0)
    assert found["path"] == str(tmp_path / "settings" / "mine.toml")
    assert found["measured"] == [{"joint_type": "pin/pin_hole", "motion": "shear"}]
    assert found["calibration"]["date"] == "2026-01-02"

    table(tmp_path / "models" / "tables" / "here.toml", "here", 30000.0)
    (tmp_path / "models" / "technic.toml").write_text('calibration = "tables/here.toml"\n')
    found, shear = in_force(run, model)
    assert (found["name"], shear) == ("here", 30000.0)
    assert found["found"] == "technic.toml beside the model"

    table(tmp_path / "given.toml", "given", 20000.0)
    found, shear = in_force(run, model, "--calibration", tmp_path / "given.toml")
    assert (found["name"], found["found"], shear) == ("given", "given", 20000.0)

    found, shear = in_force(run, model, "--calibration", "shipped")
    assert (found["name"], shear) == ("default", 65625.0)
    (tmp_path / "models" / "technic.toml").write_text('calibration = "shipped"\n')
    assert in_force(run, model)[1] == 65625.0


def test_the_text_names_the_table_and_where_it_was_found(run, tmp_path):
    model = tmp_path / "models" / "pair.ldr"
    assert "table: the shipped one" in run("analyze", model)[1]
    table(tmp_path / "models" / "here.toml", "here", parts="frame")
    (tmp_path / "models" / "technic.toml").write_text('calibration = "here.toml"\n')
    out = " ".join(run("analyze", model)[1].split())
    assert "table: here (technic.toml beside the model:" in out
    assert "measured: 12 readings on pin-pair, 2026-01-02" in out
    assert "with 95 % confidence" in out
    assert "does not depend on the calibration" in out
    assert "measured with parts taken as frame" in out
    assert run("analyze", model, "-q", "--report", tmp_path / "page.html")[0] == 0
    page = (tmp_path / "page.html").read_text(encoding="utf-8")
    assert "Table: here (technic.toml beside the model:" in page
    assert "within their uncertainty" in page or "order is not sure" in page
    loaded = ("deflect", model, "--fix", "2:32316", "--hang", "3:32316:hole5:50g")
    _, out, _ = run(*loaded)
    assert "with 95 % confidence" in out
    assert "table: here (technic.toml beside the model:" in " ".join(out.split())
    _, out, _ = run(*loaded, "--json", "-")
    assert json.loads(out)["stiffness_table"]["name"] == "here"


@pytest.mark.parametrize(
    ("text", "said"),
    [
        ("calibraton = 'x.toml'", "calibraton: unknown; known: calibration"),
        ("calibration = 3", "expected the name of a file"),
        ("calibration = ", "not a TOML file"),
        ("calibration = 'none.toml'", "none.toml"),
    ],
)
def test_settings_that_cannot_be_used_are_not_passed_over(run, tmp_path, text, said):
    (tmp_path / "models" / "technic.toml").write_text(text)
    code, out, err = run("analyze", tmp_path / "models" / "pair.ldr")
    assert (code, out) == (3, "")
    assert said in err


def test_min_rigidity_within_the_interval_is_warned_about(run, tmp_path):
    model = tmp_path / "models" / "pair.ldr"
    table(tmp_path / "t.toml", "t")
    _, out, _ = run("analyze", model, "--calibration", tmp_path / "t.toml", "--json", "-")
    low, high = json.loads(out)["rigidity"]["interval_95"]
    options = (model, "--calibration", tmp_path / "t.toml", "-q", "--min-rigidity")
    assert "is not sure" in run("analyze", *options, 0.5 * (low + high))[2]
    code, _, err = run("analyze", *options, 0.9 * low)
    assert (code, err) == (0, "")


LINKAGE = {
    "schema": "technic-assembly/1",
    "dimension": 3,
    "parts": [
        {
            "id": name,
            "shape": {
                "kind": "bar",
                "points": points,
                "section": {"kind": "rectangle", "width": 0.007, "height": 0.008},
            },
        }
        for name, points in (
            ("a", [[0, 0, 0], [0.08, 0, 0]]),
            ("b", [[0.016, 0, 0.008], [0.1, 0, 0.008]]),
        )
    ],
    "joints": [
        {
            "type": "hinge",
            "parts": ["a", "b"],
            "point": [x, 0, 0.004],
            "axis": [0, 0, 1],
            "connection": "pin/pin_hole",
        }
        for x in (0.032, 0.064)
    ],
}


def test_joints_of_an_assembly_file_may_name_a_connection(run, tmp_path):
    path = tmp_path / "models" / "linkage.json"
    path.write_text(json.dumps(LINKAGE))
    table(tmp_path / "t.toml", "t", 50000.0)
    code, out, err = run("analyze", path, "--json", "-", "--calibration", tmp_path / "t.toml")
    assert code == 0, err
    content = json.loads(out)
    (entry,) = content["joint_stiffness"]
    assert entry["connection"] == "pin/pin_hole"
    assert entry["values"]["shear_n_per_m"] == 50000.0
    assert "calibrated" in entry["provenance"]
    low, high = content["rigidity"]["interval_95"]
    assert low < content["rigidity"]["value_n_per_m"] < high
    code, out, _ = run("analyze", path, "--json", "-")
    assert json.loads(out)["joint_stiffness"][0]["values"]["shear_n_per_m"] == 65625.0


def test_a_table_that_changes_nothing_is_refused(run, tmp_path):
    plain = json.loads(json.dumps(LINKAGE))
    for joint in plain["joints"]:
        del joint["connection"]
    path = tmp_path / "models" / "linkage.json"
    path.write_text(json.dumps(plain))
    table(tmp_path / "t.toml", "t")
    code, out, err = run("analyze", path, "--calibration", tmp_path / "t.toml")
    assert (code, out) == (2, "")
    assert "names a connection" in err
    # one of the settings is meant for other files too
    (tmp_path / "models" / "technic.toml").write_text('calibration = "../t.toml"\n')
    code, out, err = run("analyze", path)
    assert (code, err) == (0, "")
    assert "table:" not in out
