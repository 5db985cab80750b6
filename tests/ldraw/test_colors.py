"""Colours: the built-in table against a library's, direct colours, broken definitions."""

from __future__ import annotations

import zipfile
from pathlib import Path

import pytest

from technic.errors import InputError
from technic.ldraw.colors import (
    EDGE,
    MAIN,
    Color,
    builtin_colors,
    color_of,
    parse_config,
    read_config,
)


def test_builtin_table_agrees_with_the_library(ldraw_library: Path) -> None:
    with zipfile.ZipFile(ldraw_library) as archive:
        theirs = parse_config(archive.read("ldraw/LDConfig.ldr").decode())
    ours = builtin_colors()
    assert len(ours) > 150
    assert {code: theirs[code] for code in ours} == dict(ours)
    missing = {code for code in theirs if code < 1000} - set(ours)
    assert missing == {MAIN, EDGE}


@pytest.mark.parametrize(
    ("code", "name", "text", "alpha"),
    [
        (0, "Black", "#1B2A34", 255),
        (4, "Red", "#B40000", 255),
        (71, "Light Bluish Grey", "#969696", 255),
        (36, "Trans Red", "#C91A09", 128),
        (0x2FF8000, "#FF8000", "#FF8000", 255),
        (0x300FF01, "#00FF01", "#00FF01", 128),
    ],
)
def test_common_colours(code: int, name: str, text: str, alpha: int) -> None:
    color = color_of(code)
    assert (color.code, color.name, color.hex, color.alpha) == (code, name, text, alpha)
    assert color.known
    assert all(0 <= v <= 1 for v in color.rgba)


def test_unknown_code_says_so() -> None:
    color = color_of(987654)
    assert not color.known
    assert color.name == "unknown colour 987654"
    assert not color_of(-1).known
    assert color_of(MAIN).known
    assert color_of(EDGE).known


def test_definitions() -> None:
    table = parse_config(
        "0 LDraw.org Configuration File\r\n"
        "0 // LEGOID 26\r\n"
        "0 !COLOUR My_Red CODE 4 VALUE #FF0000 EDGE 0\r\n"
        "0 !COLOUR Black   CODE 0   VALUE 0x010203 EDGE #808080 CHROME\r\n"
        "0 !COLOUR Glitter CODE 114 VALUE #DF6695 EDGE #B9275F ALPHA 128 LUMINANCE 15 "
        "MATERIAL GLITTER VALUE #923978 FRACTION 0.17 VFRACTION 0.2 SIZE 1\r\n"
    )
    assert table == {
        4: Color(4, "My Red", (255, 0, 0), 255, (1, 2, 3)),  # its EDGE is the code of black
        0: Color(0, "Black", (1, 2, 3), 255, (0x80, 0x80, 0x80), "chrome"),
        114: Color(114, "Glitter", (0xDF, 0x66, 0x95), 128, (0xB9, 0x27, 0x5F), "material"),
    }
    assert color_of(4, table).name == "My Red"


@pytest.mark.parametrize(
    "line",
    [
        "0 !COLOUR X VALUE #FF0000 EDGE #000000",
        "0 !COLOUR X CODE 4 EDGE #000000",
        "0 !COLOUR X CODE four VALUE #FF0000 EDGE #000000",
        "0 !COLOUR X CODE 4 VALUE #FF00 EDGE #000000",
        "0 !COLOUR X CODE 4 VALUE #GG0000 EDGE #000000",
        "0 !COLOUR X CODE 4 VALUE #FF0000 EDGE #000000 ALPHA 256",
    ],
)
def test_broken_definitions(line: str, tmp_path: Path) -> None:
    path = tmp_path / "LDConfig.ldr"
    path.write_text("0 title\n" + line + "\n")
    with pytest.raises(InputError, match="colour 'X'") as caught:
        read_config(path)
    assert caught.value.line == 2
    assert caught.value.path == str(path)
