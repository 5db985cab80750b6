"""Readings as people write them: what is understood, and what is refused with row and column."""

from __future__ import annotations

import hashlib
import json

import pytest

import calibration
from calibration.dataset import COLUMNS, GRAVITY, parse_csv, read_csv
from calibration.errors import DataError
from calibration.rigs import read_rigs, shipped_rigs
from tests.calibration.synthetic import HEADER

ROW = "t1,pin/pin_hole,pin-pair,edge,90,1,1,32,50,12.7,10.0,0.1,,,loading,fine"


def parse(*rows, header=HEADER):
    return parse_csv("\n".join([header, *rows, ""]), shipped_rigs())


def faults(*rows, header=HEADER):
    with pytest.raises(DataError) as caught:
        parse(*rows, header=header)
    return caught.value.faults


def with_cell(column, value):
    cells = ROW.split(",")
    cells[list(COLUMNS).index(column)] = value
    return ",".join(cells)


def test_a_row_in_si_units():
    (reading,) = parse(ROW).readings
    assert reading.force == pytest.approx(0.050 * GRAVITY)
    assert reading.displacement == pytest.approx(2.7e-3)
    assert reading.resolution == pytest.approx(1e-4)
    assert reading.rounding == pytest.approx(1e-4 * (2 / 12) ** 0.5)
    assert (reading.row, reading.direction, reading.own_weight) == (2, 1, False)
    assert (reading.condition.rig, reading.condition.pose) == ("pin-pair", "edge")
    assert reading.condition.place == "9:32526:hole1"


def test_blank_cells_have_defaults():
    (reading,) = parse(",pin/pin_hole,pin-pair,edge,NA,,,n/a,50,2.7,,0.1,,,,").readings
    assert reading.own_weight
    assert reading.rounding == pytest.approx(1e-4 / 12**0.5)
    assert (reading.specimen, reading.repeat, reading.direction) == ("1", 1, 0)
    assert reading.condition.angle_deg == 90.0
    assert reading.condition.place == "9:32526:hole1"


@pytest.mark.parametrize("mark", [";", "\t"])
def test_decimal_commas_with_another_separator(mark):
    header = HEADER.replace(",", mark)
    (reading,) = parse(ROW.replace(",", mark).replace(".", ","), header=header).readings
    assert reading == parse(ROW).readings[0]


def test_decimal_commas_in_quotes():
    (reading,) = parse(ROW.replace("12.7", '"12,7"')).readings
    assert reading == parse(ROW).readings[0]


def test_byte_order_mark_windows_lines_comments_and_capitals(tmp_path):
    content = ("\ufeff# made up\r\n" + HEADER.upper() + "\r\n" + ROW + "\r\n\r\n").encode()
    path = tmp_path / "r.csv"
    path.write_bytes(content)
    data = read_csv(path, shipped_rigs())
    assert len(data.readings) == 1
    assert data.readings[0].row == 3
    assert data.sha256 == hashlib.sha256(content).hexdigest()
    assert data.name == "r.csv"


def test_the_span_names_the_hole():
    (reading,) = parse(with_cell("span_mm", "16.4")).readings
    assert reading.condition.place == "9:32526:hole3"


@pytest.mark.parametrize(
    ("column", "value", "said"),
    [
        ("load_g", "-50", "negative"),
        ("load_g", "50 g", "unit stands in the header"),
        ("load_g", "", "blank"),
        ("load_g", "NA", "blank"),
        ("load_g", "1e9", "grams"),
        ("load_g", "inf", "finite"),
        ("load_g", "1.234.5", "two ways"),
        ("reading_mm", "a lot", "not a number"),
        ("reading_mm", "4.0", "downward"),
        ("resolution_mm", "0", "more than 0"),
        ("rig", "crane", "no rig; known are pin-pair"),
        ("pose", "upside-down", "has no pose 'upside-down'; it has edge, flat"),
        ("pose_angle_deg", "20", "is at 90, not at 20"),
        ("span_mm", "24", "32 and 16 mm, not at 24"),
        ("joint_type", "axle/axle_hole", "measures pin/pin_hole"),
        ("direction", "sideways", "neither"),
        ("repeat", "1.5", "whole number"),
    ],
)
def test_a_bad_cell_is_named_by_row_and_column(column, value, said):
    (fault,) = faults(ROW, with_cell(column, value))
    assert fault.startswith(f"row 3, column {column!r}")
    assert said in fault


TAP = "t1,pin/pin_hole,pin-pair,edge,,1,1,,50,,,,8.9,0.1,,phone"


def test_a_tap_test():
    (reading,) = parse(TAP).readings
    assert reading.tap
    assert (reading.value, reading.resolution) == (8.9, 0.1)
    assert reading.condition.mass == pytest.approx(0.050)
    mixed = parse(ROW, TAP).readings
    assert [r.tap for r in mixed] == [False, True]
    assert mixed[0].condition.place == mixed[1].condition.place


def test_a_file_of_taps_needs_no_ruler():
    header = "joint_type;rig;pose;load_g;frequency_hz;resolution_hz"
    (reading,) = parse("pin/pin_hole;pin-pair;flat;20;16,4;0,1", header=header).readings
    assert (reading.frequency, reading.condition.pose) == (16.4, "flat")


@pytest.mark.parametrize(
    ("row", "column", "said"),
    [
        (TAP.replace("8.9", ""), "reading_mm", "nothing was read"),
        (TAP.replace("8.9", "0"), "frequency_hz", "more than 0"),
        (TAP.replace("8.9", "-3"), "frequency_hz", "negative"),
        (TAP.replace("8.9", "9 Hz"), "frequency_hz", "unit stands in the header"),
        (TAP.replace(",0.1,", ",,"), "resolution_hz", "blank"),
        (TAP.replace(",,,,8.9", ",12.7,,,8.9"), "reading_mm", "one reading per row"),
    ],
)
def test_a_bad_tap_is_named_by_row_and_column(row, column, said):
    (fault,) = faults(ROW, row)
    assert fault.startswith(f"row 3, column {column!r}")
    assert said in fault


def test_every_fault_is_told_at_once():
    found = faults(with_cell("load_g", "-1"), ROW, with_cell("pose", "x"))
    assert [f.split(",")[0] for f in found] == ["row 2", "row 4"]
    many = faults(*[with_cell("load_g", "x")] * 50)
    assert len(many) == 21
    assert many[-1] == "and 30 more"


@pytest.mark.parametrize(
    ("old", "new", "said"),
    [
        ("load_g", "load_kg", "did you mean 'load_g'"),
        ("load_g", "load", "did you mean 'load_g'"),
        ("reading_mm", "reading_inch", "did you mean 'reading_mm'"),
        ("notes", "load_g", "2 times"),
        ("resolution_mm,", "", "'resolution_mm' is missing"),
        ("resolution_hz,", "", "'resolution_hz' is missing"),
    ],
)
def test_a_bad_header(old, new, said):
    found = faults(ROW, header=HEADER.replace(old, new, 1))
    assert any(said in fault for fault in found)


def test_a_header_without_readings():
    header = "joint_type,rig,pose,load_g,resolution_mm"
    (fault,) = faults("pin/pin_hole,pin-pair,edge,50,0.1", header=header)
    assert "neither a column 'reading_mm' nor 'frequency_hz'" in fault


def test_commas_that_split_a_number_are_noticed():
    (fault,) = faults(ROW.replace("12.7", "12,7"))
    assert "decimal comma need semicolons" in fault


@pytest.mark.parametrize("content", ["", "\n\n", HEADER, "# nothing\n"])
def test_an_empty_file(content):
    with pytest.raises(DataError):
        parse_csv(content, shipped_rigs())


def test_files_that_cannot_be_read(tmp_path):
    with pytest.raises(DataError, match="cannot be read"):
        read_csv(tmp_path / "none.csv", shipped_rigs())
    (tmp_path / "b.csv").write_bytes(b"\xff\xfe\x00")
    with pytest.raises(DataError, match="UTF-8"):
        read_csv(tmp_path / "b.csv", shipped_rigs())


def test_schema_beside_the_template_has_the_same_columns():
    folder = calibration.files().joinpath("template")
    schema = json.loads(folder.joinpath("readings.schema.json").read_text("utf-8"))
    assert [f["name"] for f in schema["fields"]] == list(COLUMNS)
    required = {f["name"] for f in schema["fields"] if f.get("constraints", {}).get("required")}
    assert required == {name for name, needed in COLUMNS.items() if needed}
    header = folder.joinpath("readings.csv").read_text("utf-8").splitlines()[1]
    assert header == ",".join(COLUMNS)


def test_samples_obey_the_schema():
    # a reading of the Table Schema standard by itself: frictionless is no dependency
    folder = calibration.files()
    package = json.loads(folder.joinpath("template", "datapackage.json").read_text("utf-8"))
    (resource,) = package["resources"]
    assert (resource["path"], resource["schema"]) == ("readings.csv", "readings.schema.json")
    assert resource["dialect"] == {"commentChar": "#"}
    schema = json.loads(folder.joinpath("template", resource["schema"]).read_text("utf-8"))
    kinds = {"string": str, "number": float, "integer": int}
    files = [folder.joinpath("template", "readings.csv")]
    files += [f for f in folder.joinpath("samples").iterdir() if f.name.endswith(".csv")]
    assert len(files) >= 7
    for file in files:
        lines = [x for x in file.read_text("utf-8").splitlines() if not x.startswith("#")]
        assert lines[0].split(",") == [field["name"] for field in schema["fields"]]
        for line in lines[1:]:
            for field, cell in zip(schema["fields"], line.split(","), strict=True):
                rules = field.get("constraints", {})
                if cell in schema["missingValues"]:
                    assert not rules.get("required"), (file.name, line, field["name"])
                    continue
                value = kinds[field["type"]](cell)
                assert cell in rules.get("enum", [cell])
                assert value >= rules.get("minimum", value)


def test_own_rigs(tmp_path):
    (tmp_path / "r.ldr").write_text("0 rig\n")
    text = """schema = "technic-rigs/1"
[rig.mine]
model = "r.ldr"
clamped = ["1:3001"]
loads = [{ place = "2:3001", span_mm = 10 }]
joints = { "stud/tube" = ["tilt"] }
[rig.mine.pose.up]
down = [0, 1, 0]
turn = [1, 0, 0]
"""
    path = tmp_path / "rigs.toml"
    path.write_text(text)
    assert read_rigs(path)["mine"].joints == {"stud/tube": ("tilt",)}
    for old, new, said in (
        ('"r.ldr"', '"no.ldr"', "no file"),
        ('["tilt"]', '["bend"]', "motions are"),
        ("technic-rigs/1", "x", "schema"),
        ("down = [0, 1, 0]", "down = [0, 0, 0]", "not all 0"),
        ('clamped = ["1:3001"]', "", "'clamped' is missing"),
        ("[rig.mine]", "[rig.mine", "not a TOML file"),
    ):
        assert old in text
        path.write_text(text.replace(old, new))
        with pytest.raises(DataError, match=said):
            read_rigs(path)
    with pytest.raises(DataError, match="cannot be read"):
        read_rigs(tmp_path / "none.toml")


def test_a_pose_that_is_a_little_off_turns_down():
    pose = shipped_rigs()["pin-pair"].poses["edge"]
    assert pose.down_at(90.0) == pytest.approx([0, 0, 1])
    assert pose.down_at(0.0) == pytest.approx(shipped_rigs()["pin-pair"].poses["flat"].down)
