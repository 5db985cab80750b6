"""LDraw text: what a line means, what is refused and how the message helps."""

from __future__ import annotations

import contextlib
import os
from pathlib import Path

import pytest
from hypothesis import given
from hypothesis import strategies as st

from technic.errors import InputError
from technic.ldraw import syntax
from technic.ldraw.sections import read
from technic.ldraw.syntax import (
    Blank,
    Drawing,
    Meta,
    Reference,
    Text,
    Unreadable,
    decode,
    number_of,
    parse_line,
    parse_lines,
    read_bytes,
    split_lines,
)

HERE = Path("model.ldr")
PART = "1 71 0 0 0 1 0 0 0 1 0 0 0 1 32524.dat"


def error_of(text: str) -> InputError:
    with pytest.raises(InputError) as caught:
        parse_line(text, 7, HERE)
    assert caught.value.line == 7
    assert caught.value.remedy
    assert str(caught.value).startswith("model.ldr:7: ")
    return caught.value


def test_reference_keeps_numbers_name_and_text() -> None:
    text = "  1\t16 1.5 -2 .25 1 0 0 0 -1 0 0 0 1e0 8002 -  main part.ldr  "
    line = parse_line(text, 3, HERE)
    assert isinstance(line, Reference)
    assert line.text == text
    assert line.number == 3
    assert line.color == 16
    assert line.position == (1.5, -2.0, 0.25)
    assert list(line.matrix) == [1, 0, 0, 0, -1, 0, 0, 0, 1]
    assert line.name == "8002 -  main part.ldr"  # spaces inside are part of the name


@pytest.mark.parametrize(
    ("text", "kind"),
    [
        ("", Blank),
        (" \t ", Blank),
        ("\x1a", Blank),
        ("0", Meta),
        ("0 // hello", Meta),
        ("0 !LDCAD GROUP_DEF [topLevel=true]", Meta),
        ("2 24 0 0 0 1 1 1", Drawing),
        ("3 16 0 0 0 1 1 1 2 2 2", Drawing),
        ("4 16 nonsense is not looked at", Drawing),
        ("5 24 0 0 0 1 1 1 2 2 2 3 3 3", Drawing),
    ],
)
def test_line_types(text: str, kind: type) -> None:
    line = parse_line(text, 1, HERE)
    assert type(line) is kind
    assert line.text == text


def test_direct_colour() -> None:
    line = parse_line(PART.replace("71", "0x2FF8000", 1), 1, HERE)
    assert isinstance(line, Reference)
    assert line.color == 0x2FF8000


@pytest.mark.parametrize("fields", range(1, 15))
def test_truncated_reference(fields: int) -> None:
    text = " ".join(PART.split()[:fields])
    assert f"cut off: {fields} of 15 fields" in error_of(text).message
    if fields > 1:  # numbers missing in the middle, the file name still there
        text = " ".join([*PART.split()[:fields], "32524.dat"])
        assert fields == 14 or f"cut off: {fields + 1} of 15" in error_of(text).message


@pytest.mark.parametrize(
    ("token", "says"),
    [
        ("nan", "not a finite number"),
        ("-inf", "not a finite number"),
        ("Infinity", "not a finite number"),
        ("1.#QNAN", "is not a number"),
        ("1e999", "beyond"),
        ("1e300", "beyond"),
        ("-10000001", "beyond"),
        ("abc", "is not a number"),
        ("1_000", "is not a number"),  # Python would read it
        ("٣", "is not a number"),  # so it would this digit
        ("0x10", "is not a number"),
        ("--1", "is not a number"),
        ("1e", "is not a number"),
    ],
)
@pytest.mark.parametrize("field", range(2, 14))
def test_bad_number_names_field_and_token(token: str, says: str, field: int) -> None:
    tokens = PART.split()
    tokens[field] = token
    message = error_of(" ".join(tokens)).message
    assert says in message
    assert repr(token) in message
    assert message.startswith("xyzabcdefghi"[field - 2])


def test_decimal_comma_gets_its_own_advice() -> None:
    error = error_of(PART.replace(" 0 ", " 0,5 ", 1))
    assert "decimal point" in str(error.remedy)


@pytest.mark.parametrize("color", ["red", "1.5", "-1", "0x", "0xZZ", "1" * 5000])
def test_bad_colour(color: str) -> None:
    assert "colour" in error_of(PART.replace("71", color, 1)).message


@pytest.mark.parametrize("text", ["6 1 2 3", "hello", "10 16 0 0 0", "1,16,0,0,0", "-", "0FILE x"])
def test_unknown_line_type(text: str) -> None:
    assert "line type" in error_of(text).message


def test_a_megabyte_of_digits_is_refused_at_once() -> None:
    error_of("1 16 " + "1" * 1_000_000)
    error_of("1 16 " + "1." * 500_000)
    error_of("1 16 " + "1" * 1_000_000 + "x")


def test_skipping_keeps_the_bad_line_and_its_reason() -> None:
    lines = parse_lines([PART, "1 2 3", PART], 10, HERE, skip_bad_lines=True)
    assert [type(line) for line in lines] == [Reference, Unreadable, Reference]
    assert lines[1].number == 11
    assert isinstance(lines[1], Unreadable)
    assert "cut off" in lines[1].reason


@pytest.mark.parametrize(
    ("name", "number"),
    [
        ("32524.dat", "32524"),
        ("32524.DAT", "32524"),
        ("S\\3001s01.dat", "s/3001s01"),
        ("arm.ldr", "arm.ldr"),
        ("3001.dat.dat", "3001.dat"),
    ],
)
def test_part_number(name: str, number: str) -> None:
    assert number_of(name) == number


def test_only_line_ends_end_lines() -> None:
    assert split_lines("a\nb\r\nc\rd\x0be\u2028f\x0c") == ["a", "b", "c", "d\x0be\u2028f\x0c"]
    assert split_lines("a\n\nb\n") == ["a", "", "b"]
    assert split_lines("") == []


# --- files ------------------------------------------------------------------------------------
SAMPLE = "0 Modèle\r\n" + PART + "\r\n"


@pytest.mark.parametrize(
    ("raw", "encoding"),
    [
        (SAMPLE.encode(), "utf-8"),
        (b"\xef\xbb\xbf" + SAMPLE.encode(), "utf-8"),
        (b"\xff\xfe" + SAMPLE.encode("utf-16-le"), "utf-16-le"),
        (b"\xfe\xff" + SAMPLE.encode("utf-16-be"), "utf-16-be"),
        (SAMPLE.encode("utf-16-le"), "utf-16-le"),
        (SAMPLE.encode("utf-16-be"), "utf-16-be"),
        (SAMPLE.encode("latin-1"), "latin-1"),
        (b"\xef\xbb\xbf0 \xe9\n", "latin-1"),  # a byte order mark and then no UTF-8 after all
    ],
)
def test_encodings_come_and_go_unchanged(raw: bytes, encoding: str) -> None:
    text = decode(raw, HERE)
    assert text.encoding == encoding
    assert text.to_bytes() == raw
    assert "\0" not in text.text
    assert text.text.startswith("0 ")


@given(st.text(st.characters(codec="utf-8", exclude_characters="\0"), min_size=1))
def test_decoding_loses_nothing(words: str) -> None:
    raw = ("0 comment " + words).encode()
    controls = sum(ord(c) < 32 or ord(c) == 127 for c in words)
    try:
        text = decode(raw, HERE)
    except InputError:
        assert controls
    else:
        assert text.to_bytes() == raw


@pytest.mark.parametrize(
    ("raw", "says"),
    [
        (b"", "empty"),
        (b" \r\n\t\n", "empty"),
        (b"\xef\xbb\xbf", "empty"),
        (b"\xff\xfe", "empty"),
        (b"\x1a", "empty"),
        (bytes(range(256)) * 20, "binary"),
        (b"\x7fELF\x02\x01\x01\0\0\0\0\0\0", "binary"),
        (b"0 title\n\0\0\0\0", "binary"),
        (b"\x89PNG\r\n\x1a\n", "PNG"),
        (b"%PDF-1.4", "PDF"),
        (b"\x1f\x8b\x08", "gzip"),
        (b"\xff\xfe0\x00\x00\xd8", "UTF-16"),  # half a surrogate pair
    ],
)
def test_what_is_no_text(tmp_path: Path, raw: bytes, says: str) -> None:
    path = tmp_path / "model.ldr"
    path.write_bytes(raw)
    with pytest.raises(InputError, match=says) as caught:
        read(path)
    assert caught.value.path == str(path)
    assert caught.value.remedy
    assert caught.value.exit_code == 3


def test_what_is_no_file(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    with pytest.raises(InputError, match="no such file"):
        read(tmp_path / "nothing.ldr")
    with pytest.raises(InputError, match="directory"):
        read(tmp_path)
    with pytest.raises(InputError, match=r"cannot be read|no such file"):
        read(tmp_path / "a\0b")
    with pytest.raises(InputError):
        read(tmp_path / ("x" * 5000))
    fifo = tmp_path / "pipe.ldr"
    os.mkfifo(fifo)
    with pytest.raises(InputError, match="not a regular file"):
        read(fifo)
    big = tmp_path / "big.ldr"
    big.write_text(PART * 10)
    monkeypatch.setattr(syntax, "MAX_BYTES", 100)
    with pytest.raises(InputError, match="at most"):
        read_bytes(big)


@given(st.text(max_size=200))
def test_any_line_is_read_or_refused(text: str) -> None:
    """Fuzz: nothing but InputError ever comes out, and a line that is read is kept as it is."""
    with contextlib.suppress(InputError):
        assert parse_line(text, 1, HERE).text == text


def test_text_is_plain_utf8_by_default() -> None:
    assert Text("0 é").to_bytes() == "0 é".encode()
