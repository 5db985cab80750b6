"""`technic calibrate` from the command line, and its table in `technic analyze`."""

from __future__ import annotations

import json
import re
import tomllib
from html.parser import HTMLParser

import pytest

import calibration
from calibration.rigs import shipped_rigs

PAIR = """0 Pair
1 4 0 0 0 1 0 0 0 1 0 0 0 1 32316.dat
1 4 0 -20 60 1 0 0 0 1 0 0 0 1 32316.dat
1 0 0 -10 40 0 1 0 1 0 0 0 0 1 2780.dat
1 0 0 -10 20 0 1 0 1 0 0 0 0 1 2780.dat
"""


@pytest.fixture
def sample(tmp_path):
    """Copy of a shipped sample file."""

    def copy(name):
        path = tmp_path / name
        path.write_bytes(calibration.files().joinpath("samples", name).read_bytes())
        return path

    return copy


def test_samples_say_that_they_are_synthetic_and_give_the_truth_back(run, sample):
    truth = {
        "pins_synthetic.csv": {"shear": 65625.0, "tilt": 0.240},
        "axles_synthetic.csv": {"spin": 0.16, "tilt": 0.16, "shear": 1e4},
        "studs_synthetic.csv": {"tilt": 0.16, "shear": 1e4},
        "half_pins_synthetic.csv": {"tilt": 0.16, "shear": 1e4},
        "taps_synthetic.csv": {"shear": 65625.0, "tilt": 0.240},
    }
    for name, values in truth.items():
        path = sample(name)
        assert path.read_text().startswith("# SYNTHETIC")
        code, out, _ = run("calibrate", path, "--json", "-")
        content = json.loads(out)
        assert code == 0
        assert content["schema"] == "technic-calibration/1"
        found = {p["motion"]: p for p in content["parameters"]}
        for motion, value in values.items():
            low, high = found[motion]["interval_95"]
            assert found[motion]["identifiable"]
            # a dozen intervals of 95 %: one may miss by a little
            assert 0.97 * low < value < 1.03 * high
        count = sum(p["identifiable"] for p in content["parameters"])
        assert len(content["correlation"]["matrix"]) == count
        rows = [x for x in path.read_text().splitlines() if x[:1] not in ("#", "") and "," in x]
        assert len(content["residuals"]) == content["readings"] == len(rows) - 1
        assert content["grid_search"]["agrees"]


def test_one_pose_fits_the_shear_and_warns(run, sample):
    code, out, err = run("calibrate", sample("one_pose_synthetic.csv"), "--json", "-")
    content = json.loads(out)
    assert code == 0
    shear, tilt = content["parameters"]
    assert (shear["motion"], shear["identifiable"]) == ("shear", True)
    assert (tilt["motion"], tilt["identifiable"], tilt["interval_95"]) == ("tilt", False, None)
    assert any("one pose only" in said for said in content["warnings"])
    assert any("Measure also pose flat" in said for said in content["warnings"])
    assert "one pose only" in err
    code, out, err = run("calibrate", sample("one_pose_synthetic.csv"))
    assert (code, err) == (0, "")
    assert "not identifiable" in out


def test_the_table_gives_the_analysis_an_interval(run, sample, tmp_path):
    target, model = tmp_path / "pins.toml", tmp_path / "pair.ldr"
    model.write_text(PAIR)
    assert run("calibrate", sample("pins_synthetic.csv"), "--out", target, "-q") == (0, "", "")
    table = tomllib.loads(target.read_text())
    assert table["schema"] == "technic-stiffness/1"
    assert table["calibration"]["readings"] == 81
    assert len(table["calibration"]["sha256"]) == 64
    shear = table["connection"]["pin/pin_hole"]["shear"]
    assert shear["provenance"] == "calibrated"
    assert shear["interval_95"][0] < shear["value"] < shear["interval_95"][1]
    _, plain, _ = run("analyze", model, "--json", "-")
    _, out, _ = run("analyze", model, "--json", "-", "--calibration", target)
    rigidity = json.loads(out)["rigidity"]
    low, high = rigidity["interval_95"]
    assert low < rigidity["value_n_per_m"] < high
    assert json.loads(plain)["rigidity"]["interval_95"] is None
    assert "calibrated" in json.loads(out)["joint_stiffness"][0]["provenance"]
    _, out, _ = run("analyze", model, "--calibration", target)
    assert "with 95 % confidence" in out
    loaded = ("deflect", model, "--fix", "2:32316", "--hang", "3:32316:hole5:50g")
    _, out, _ = run(*loaded, "--calibration", target, "--json", "-")
    (port,) = json.loads(out)["ports"]
    low, high = port["distance_interval_95_mm"]
    assert low < port["distance_mm"] < high
    assert json.loads(run(*loaded, "--json", "-")[1])["ports"][0]["distance_interval_95_mm"] is None
    assert "with 95 % confidence" in run(*loaded, "--calibration", target)[1]


def test_page_shows_every_reading_and_asks_for_nothing_from_outside(run, sample, tmp_path):
    page = tmp_path / "fit.html"
    assert run("calibrate", sample("one_pose_synthetic.csv"), "--report", page, "-q")[0] == 0
    text = page.read_text(encoding="utf-8")
    assert text.count("<svg") == 3
    assert text.count("<circle") == 3 * 27
    assert "not identifiable" in text
    assert "one pose only" in text
    assert "SYNTHETIC" in text
    assert "http" not in text
    assert "nan" not in text
    HTMLParser().feed(text)


def test_taps_are_told_beside_sags(run, sample, tmp_path):
    page = tmp_path / "fit.html"
    code, out, _ = run("calibrate", sample("taps_synthetic.csv"), "--report", page)
    assert code == 0
    assert "Frequencies scatter by" in out
    assert "tapped with 50.0 g" in out
    text = page.read_text(encoding="utf-8")
    assert text.count("<svg") == 6
    assert "measured (Hz)" in text
    assert "measured (mm)" in text
    _, out, _ = run("calibrate", sample("taps_synthetic.csv"), "--json", "-")
    content = json.loads(out)
    taps = [row for row in content["residuals"] if row["kind"] == "tap"]
    assert len(taps) == 54
    assert taps[0]["measured_mm"] is None
    assert taps[0]["measured_hz"] == pytest.approx(taps[0]["predicted_hz"], rel=0.1)
    assert 0.005 < content["tap_scatter"] < 0.02 < content["scatter"]


def test_a_table_can_be_installed_for_all_models(run, sample, tmp_path, monkeypatch):
    monkeypatch.setenv("TECHNIC_CONFIG", str(tmp_path / "settings"))
    model = tmp_path / "pair.ldr"
    model.write_text(PAIR)
    code, out, err = run("calibrate", sample("pins_synthetic.csv"), "--install", "-q")
    assert (code, out) == (0, "")
    assert "stiffness.toml" in err
    _, out, _ = run("analyze", model, "--json", "-")
    found = json.loads(out)["stiffness_table"]
    assert (found["name"], found["found"]) == ("pins_synthetic", "the user's settings")
    assert run("calibrate", sample("pins_synthetic.csv"), "--install", "-q")[0] == 0
    (tmp_path / "settings" / "technic.toml").write_text('calibration = "mine.toml"\n')
    code, _, err = run("calibrate", sample("pins_synthetic.csv"), "--install", "-q")
    assert code == 2
    assert "mine.toml" in err


def test_template_can_be_built_filled_and_calibrated(run, tmp_path):
    folder = tmp_path / "new" / "rig"
    code, out, err = run("calibrate", "--template", folder)
    assert (code, err) == (0, "")
    names = {str(path.relative_to(folder)) for path in folder.rglob("*") if path.is_file()}
    assert {
        "readings.csv",
        "readings.schema.json",
        "datapackage.json",
        "protocol.md",
        "rigs.toml",
        "pin-pair.ldr",
        "pictures/pin-pair.png",
    } <= names
    assert set(out.split()) == {str(folder / name) for name in names}
    assert run("calibrate", folder / "readings.csv", "--rigs", folder / "rigs.toml")[0] == 0
    assert run("analyze", folder / "pin-pair.ldr", "-q")[0] == 0
    code, _, err = run("calibrate", "--template", folder)
    assert code == 2
    assert "already has" in err


def test_protocol_in_the_package_is_the_page_of_the_docs(repo):
    shipped = calibration.files().joinpath("template", "protocol.md").read_text("utf-8")
    page = (repo / "docs" / "calibration.md").read_text("utf-8")
    # the pictures lie beside the protocol that is shipped
    assert page.startswith(
        shipped.rstrip().replace("(pictures/", "(../calibration/template/pictures/")
    )
    shown = set(re.findall(r"\(pictures/([a-z-]+)\.png\)", shipped))
    assert shown == set(shipped_rigs())


def test_every_rig_has_a_picture_that_is_small():
    for name in shipped_rigs():
        content = calibration.files().joinpath("template", "pictures", f"{name}.png").read_bytes()
        assert content.startswith(b"\x89PNG")
        assert len(content) < 60_000


@pytest.mark.parametrize(
    "arguments",
    [
        ("calibrate",),
        ("calibrate", "{csv}", "--template", "{dir}"),
        ("calibrate", "{csv}", "--draw", "{dir}"),
        ("calibrate", "--template", "{dir}", "--draw", "{dir}"),
        ("calibrate", "--template", "{dir}", "--install"),
        ("calibrate", "{csv}", "--out", "/no/such/directory/x.toml"),
        ("calibrate", "{csv}", "--json", "/no/such/directory/x.json"),
    ],
)
def test_usage_errors(run, sample, tmp_path, arguments):
    names = {"csv": sample("pins_synthetic.csv"), "dir": tmp_path / "t"}
    code, out, err = run(*(a.format(**names) for a in arguments))
    assert (code, out) == (2, "")
    assert "Traceback" not in err


def test_bad_readings_exit_with_3_by_row_and_column(run, sample, tmp_path):
    path = sample("pins_synthetic.csv")
    path.write_text(path.read_text().replace(",32,50,", ",32,-50,", 1))
    code, out, err = run("calibrate", path, "--out", tmp_path / "x.toml")
    assert (code, out) == (3, "")
    assert "column 'load_g'" in err
    assert "row 7" in err
    assert not (tmp_path / "x.toml").exists()


def test_contradictory_readings_exit_with_3(run, sample):
    path = sample("pins_synthetic.csv")
    lines = path.read_text().splitlines()
    for k in range(3, len(lines)):
        cells = lines[k].split(",")
        cells[9] = str(float(cells[9]) + 9 * (k % 3))
        lines[k] = ",".join(cells)
    path.write_text("\n".join(lines))
    code, out, err = run("calibrate", path)
    assert (code, out) == (3, "")
    assert "contradict each other" in err
    assert "rows" in err


def test_missing_files(run, tmp_path, sample):
    assert run("calibrate", tmp_path / "none.csv")[0] == 3
    assert run("calibrate", sample("pins_synthetic.csv"), "--rigs", tmp_path / "none.toml")[0] == 3
    assert run("calibrate", sample("pins_synthetic.csv"), "--base", tmp_path / "none.toml")[0] == 3
