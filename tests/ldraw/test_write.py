"""Writing: what was read comes back letter for letter; what is added is read back in its place."""

from __future__ import annotations

import os
from collections.abc import Callable
from pathlib import Path

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from technic.errors import UsageError
from technic.geometry import Pose, nearest_orthogonal
from technic.ldraw.document import document_from_text, placements, pose, read
from technic.ldraw.syntax import Text, decode, split_lines
from technic.ldraw.write import (
    NewPart,
    append_parts,
    format_number,
    new_document,
    reference_line,
    save,
)
from technic.units import LDU

HERE = Path("m.mpd")
PART = "1 4 0 0 0 1 0 0 0 1 0 0 0 1 3001.dat"
BEAM = NewPart("32524", 71, Pose(np.eye(3), np.array([20, -8, 0.5]) * LDU))
BEAM_LINE = "1 71 20 -8 0.5 1 0 0 0 1 0 0 0 1 32524.dat"


def with_beam(text: str) -> str:
    return append_parts(document_from_text(Text(text), HERE), [BEAM]).text


@pytest.mark.parametrize(
    ("value", "text"),
    [
        (0.0, "0"),
        (-0.0, "0"),
        (-4e-7, "0"),
        (20.0, "20"),
        (100.0, "100"),
        (-0.5, "-0.5"),
        (1 / 3, "0.333333"),
        (19.9999999999, "20"),
        (-1234567.8, "-1234567.8"),
        (1e-5, "0.00001"),  # no exponent
    ],
)
def test_numbers(value: float, text: str) -> None:
    assert format_number(value) == text


@given(st.floats(-1e7, 1e7))
def test_numbers_come_back_to_six_decimals(value: float) -> None:
    text = format_number(value)
    assert "e" not in text
    assert not text.endswith(".")
    assert len(text.partition(".")[2]) <= 6
    assert float(text) == pytest.approx(value, abs=5.01e-7, rel=1e-15)


@pytest.mark.parametrize("value", [float("nan"), float("inf")])
def test_no_line_with_a_number_that_is_none(value: float) -> None:
    with pytest.raises(ValueError, match="cannot be written"):
        reference_line(NewPart("3001", 4, Pose(np.eye(3), np.array([value, 0, 0]))))


def test_reference_line() -> None:
    assert reference_line(BEAM) == BEAM_LINE
    assert reference_line(NewPart("arm.ldr", 16, Pose.identity())).endswith(" 1 arm.ldr")
    direct = reference_line(NewPart("3001.DAT", 0x2FF8000, Pose.identity()))
    assert direct == "1 0x2FF8000 0 0 0 1 0 0 0 1 0 0 0 1 3001.DAT"
    for name in ("", " ", "a\nb"):
        with pytest.raises(ValueError, match="no part number"):
            reference_line(NewPart(name, 4, Pose.identity()))


MAIN = f"0 FILE m.ldr\r\n{PART}\r\n"
ARM = f"0 FILE a.ldr\r\n{PART}\r\n"


# --- where new parts go -----------------------------------------------------------------------
@pytest.mark.parametrize(
    ("before", "after"),
    [
        (f"{PART}\n", f"{PART}\n0 STEP\n{BEAM_LINE}\n"),
        (f"{PART}", f"{PART}\r\n0 STEP\r\n{BEAM_LINE}\r\n"),
        (f"{PART}\r\n", f"{PART}\r\n0 STEP\r\n{BEAM_LINE}\r\n"),
        (f"{PART}\r{PART}", f"{PART}\r{PART}\r0 STEP\r{BEAM_LINE}\r"),
        (f"{PART}\n0 STEP\n\n", f"{PART}\n0 STEP\n{BEAM_LINE}\n\n"),  # the step is new already
        (f"{MAIN}\r\n0 NOFILE\r\n{ARM}", f"{MAIN}0 STEP\r\n{BEAM_LINE}\r\n\r\n0 NOFILE\r\n{ARM}"),
        (
            f"junk\n0 FILE m.ldr\n{PART}\n0 FILE a.ldr\n{PART}",
            f"junk\n0 FILE m.ldr\n{PART}\n0 STEP\n{BEAM_LINE}\n0 FILE a.ldr\n{PART}",
        ),
        (f"0 FILE m.ldr\n0 FILE a.ldr\n{PART}", f"0 FILE m.ldr\n{BEAM_LINE}\n0 FILE a.ldr\n{PART}"),
        (
            f"{PART}\n0 !DATA x.png\n0 !: AA\n",
            f"{PART}\n0 STEP\n{BEAM_LINE}\n0 !DATA x.png\n0 !: AA\n",
        ),
        (f"{PART}\n\x1a", f"{PART}\n0 STEP\n{BEAM_LINE}\n\x1a"),
    ],
)
def test_new_parts_follow_the_main_model(before: str, after: str) -> None:
    assert with_beam(before) == after


def test_no_parts_no_change() -> None:
    source = Text(PART, "latin-1", b"")
    assert append_parts(document_from_text(source, HERE), []) is source


FILE_ENDS = st.sampled_from(["\n", "\r\n", "\r"])
LINES = st.one_of(
    st.just(PART),
    st.sampled_from(["", "0 STEP", "0 // note", "0 !LDCAD GROUP_NXT [ids=1]", "2 24 0 0 0 1 1 1"]),
    st.text(st.characters(codec="utf-8", categories=("L", "N", "P")), max_size=8).map("0 ".__add__),
    st.just("0 FILE other.ldr"),
    st.just("0 NOFILE"),
)
ENCODINGS = st.sampled_from(
    [("utf-8", b""), ("utf-8", b"\xef\xbb\xbf"), ("utf-16-le", b"\xff\xfe")]
)


@given(st.lists(st.tuples(LINES, FILE_ENDS), max_size=12), ENCODINGS, st.booleans())
def test_every_old_line_stays(
    lines: list[tuple[str, str]], encoding: tuple[str, bytes], multipart: bool
) -> None:
    """Old lines are all there, in order, byte by byte, around one block of new ones."""
    head = "0 FILE main.ldr\r\n" if multipart else "0 title\n"
    source = Text(head + "".join(text + end for text, end in lines), *encoding)
    raw = source.to_bytes()
    document = document_from_text(decode(raw, HERE), HERE)
    assert document.source.to_bytes() == raw
    written = append_parts(document, [BEAM, BEAM])
    old, new = split_lines(source.text), split_lines(written.text)
    at = new.index(BEAM_LINE)
    block = 3 if new[at - 1] == "0 STEP" and len(new) - len(old) == 3 else 2
    first = at - (block - 2)
    assert new[first + block :] == old[first:]
    assert new[:first] == old[:first]
    assert new[first + block - 2 : first + block] == [BEAM_LINE] * 2
    again = document_from_text(decode(written.to_bytes(), HERE), HERE)
    found = placements(again, lambda _: True)
    added = [p for p in found if p.number == "32524"]
    assert [p.submodel for p in added] == [again.main.name] * 2
    steps = sum(line.text == "0 STEP" for line in again.main.lines if line.number < added[0].line)
    assert added[0].step == added[1].step == 1 + steps
    parts_before = [p.step for p in found if p.section is again.main and p.line < added[0].line]
    assert all(step < added[0].step for step in parts_before)


coordinates = st.floats(-10, 10)
poses_of = st.tuples(
    st.lists(st.integers(-100, 100), min_size=9, max_size=9),
    st.tuples(coordinates, coordinates, coordinates),
).filter(lambda pair: abs(np.linalg.det(np.reshape(pair[0], (3, 3)))) > 1e4)


@given(st.lists(poses_of, min_size=1, max_size=5))
def test_a_fresh_document_is_read_back(given_poses: list[tuple[list[int], tuple]]) -> None:
    parts = [
        NewPart(f"p{k}", k, Pose(nearest_orthogonal(np.reshape(q, (3, 3))), np.array(t)))
        for k, (q, t) in enumerate(given_poses)
    ]
    text = new_document("frame.ldr", [parts[:1], parts[1:]], title="A frame", author="Me")
    lines = text.text.split("\r\n")
    assert lines[:5] == [
        "0 FILE frame.ldr",
        "0 A frame",
        "0 Name: frame.ldr",
        "0 Author: Me",
        "0 !LDRAW_ORG Model",
    ]
    assert "\n" not in text.text.replace("\r\n", "")
    found = placements(document_from_text(text, HERE), lambda _: True)
    assert [(p.number, p.color) for p in found] == [(p.number, p.color) for p in parts]
    assert [p.step for p in found] == [1] + [2] * (len(parts) - 1)
    for part, placement in zip(parts, found, strict=True):
        placed, error = pose(placement)
        assert error < 2e-6
        np.testing.assert_allclose(placed.translation, part.pose.translation, atol=5.1e-7 * LDU)
        np.testing.assert_allclose(placed.rotation, part.pose.rotation, atol=2e-6)


def test_header_lines_have_no_breaks() -> None:
    with pytest.raises(ValueError, match="line break"):
        new_document("a.ldr", [[BEAM]], title="two\nlines")


@pytest.mark.parametrize(
    "name",
    [
        "square.ldr",
        "fll_robot.mpd",
        "omr_42020_twin_rotor.mpd",
        "omr_8002_destroyer_droid.mpd",
        "omr_10212_imperial_shuttle.mpd",
    ],
)
def test_real_models_come_back(model: Callable[[str], Path], tmp_path: Path, name: str) -> None:
    document = read(model(name))
    save(tmp_path / name, document.source)
    assert (tmp_path / name).read_bytes() == model(name).read_bytes()
    save(tmp_path / name, append_parts(document, [BEAM]))
    again = read(tmp_path / name)
    before = placements(document, lambda _: True)
    after = placements(again, lambda _: True)
    assert len(after) == len(before) + 1
    added = [p for p in after if p.submodel == again.main.name][-1]
    assert added.number == "32524"
    # In a step of its own: nothing else is in it, and no step before it is passed over.
    words = [line.text.split()[1:2] for line in again.main.lines if line.number < added.line]
    assert added.step == 1 + sum(word in (["STEP"], ["ROTSTEP"]) for word in words)
    assert not any(p.section is document.main and p.step >= added.step for p in before)
    others = [p for p in after if p is not added]
    assert [p.number for p in others] == [p.number for p in before]
    assert all(np.array_equal(a.position, b.position) for a, b in zip(before, others, strict=True))


# --- files ------------------------------------------------------------------------------------
def test_save_replaces_in_one_move(tmp_path: Path) -> None:
    path = tmp_path / "m.ldr"
    save(path, Text("0 one\n"))
    assert path.stat().st_mode & 0o777 == 0o666 & ~_umask()
    path.chmod(0o640)
    save(path, Text("0 two\n"))
    assert path.read_text() == "0 two\n"
    assert path.stat().st_mode & 0o777 == 0o640
    assert [p.name for p in tmp_path.iterdir()] == ["m.ldr"]


def _umask() -> int:
    mask = os.umask(0)
    os.umask(mask)
    return mask


def test_save_follows_a_link(tmp_path: Path) -> None:
    (tmp_path / "real.ldr").write_text("0 one\n")
    (tmp_path / "link.ldr").symlink_to("real.ldr")
    save(tmp_path / "link.ldr", Text("0 two\n"))
    assert (tmp_path / "link.ldr").is_symlink()
    assert (tmp_path / "real.ldr").read_text() == "0 two\n"


def test_failed_save_leaves_everything_as_it_was(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    path = tmp_path / "m.ldr"
    path.write_text("0 one\n")
    with pytest.raises(UsageError, match="latin-1"):
        save(path, Text("0 \u2603\n", "latin-1"))
    with pytest.raises(UsageError, match="directory"):
        save(tmp_path, Text("0\n"))
    with pytest.raises(UsageError, match="No such file"):
        save(tmp_path / "nowhere" / "m.ldr", Text("0\n"))

    def fail(*_: object) -> None:
        raise OSError(28, "No space left on device")

    monkeypatch.setattr(os, "replace", fail)
    with pytest.raises(UsageError, match="No space left"):
        save(path, Text("0 two\n"))
    assert path.read_text() == "0 one\n"
    assert [p.name for p in tmp_path.iterdir()] == ["m.ldr"]
