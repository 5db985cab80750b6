"""Ports read from the primitives of LDraw parts."""

from __future__ import annotations

import numpy as np
import pytest

from technic.errors import InputError
from technic.ldraw.library import Library
from technic.ldraw.primitives import ports_from_primitives
from technic.parts.definition import PortKind
from technic.units import LDU
from tests.ldraw.small_library import files_with, line, part, there, write_folder

ALONG_X = (0, 1, 0, 1, 0, 0, 0, 0, 1)
"""Turns a primitive's y into the part's x."""

AGAINST_X = (0, -1, 0, 1, 0, 0, 0, 0, 1)


def text(port) -> str:
    """A port in one line: kind, middle, axis, length; an f for friction."""
    middle = " ".join(f"{value:g}" for value in (port.position / LDU).round(2) + 0.0)
    axis = " ".join(f"{value:g}" for value in port.axis.round(2) + 0.0)
    return f"{port.name} ({middle}) ({axis}) {port.length / LDU:.4g}{' f' * port.friction}"


@pytest.fixture(scope="module")
def shared_library(ldraw_library, tmp_path_factory):
    """Technic subset of the official library."""
    with pytest.MonkeyPatch.context() as patch:
        patch.setenv("TECHNIC_CACHE", str(tmp_path_factory.mktemp("cache")))
        return Library.open(ldraw_library)


@pytest.fixture
def ports(tmp_path, monkeypatch):
    """Ports of a part given by its lines, in one line each."""
    monkeypatch.setenv("TECHNIC_CACHE", str(tmp_path / "cache"))

    def read(*lines: str, **subparts: str) -> list[str]:
        extra = {f"parts/s/{name}.dat": body for name, body in subparts.items()}
        files = files_with({"parts/1.dat": part(*lines), **extra})
        library = Library.open(write_folder(tmp_path / "l", files))
        return [text(port) for port in there(ports_from_primitives(library, "1"))]

    return read


# --- real parts -------------------------------------------------------------------------------
@pytest.mark.parametrize(
    ("number", "expected"),
    [
        ("32523", [f"hole{n} (0 0 {20 * n - 40}) (0 1 0) 20" for n in (1, 2, 3)]),
        # a thin liftarm: half holes
        ("32017", [f"hole{n} (0 0 {20 * n - 60}) (0 1 0) 10" for n in range(1, 6)]),
        ("60483", ["hole1 (0 0 20) (0 1 0) 20", "axlehole1 (0 0 0) (0 1 0) 20"]),
        # pins: outward directions, friction told by the primitive or by ridges
        ("3673", ["pin1 (-10 0 0) (-1 0 0) 20", "pin2 (10 0 0) (1 0 0) 20"]),
        ("2780", ["pin1 (-10 0 0) (-1 0 0) 20 f", "pin2 (10 0 0) (1 0 0) 20 f"]),
        ("61332", ["pin1 (-10 0 0) (-1 0 0) 20 f", "pin2 (10 0 0) (1 0 0) 20 f"]),
        # long pins are divided, whatever their middle is made of
        *(
            (
                number,
                [
                    f"pin1 (-20 0 0) (-1 0 0) 20{mark}",
                    f"pin2 (0 0 0) (-1 0 0) 20{mark}",
                    f"pin3 (20 0 0) (1 0 0) 20{mark}",
                ],
            )
            for number, mark in (("6558", " f"), ("42924", " f"), ("32556", ""), ("32556b", ""))
        ),
        ("32002", ["pin1 (-10 0 0) (-1 0 0) 20", "pin2 (5 0 0) (1 0 0) 10"]),
        ("43093", ["pin1 (-10 0 0) (-1 0 0) 20 f", "axle1 (10 0 0) (1 0 0) 20"]),
        # axles: one port, over notches and sleeves
        ("32062", ["axle1 (0 0 0) (1 0 0) 40"]),
        ("3737", ["axle1 (0 0 0) (1 0 0) 200"]),
        ("99008", ["axle1 (0 0 0) (1 0 0) 80"]),
        ("87083", ["axle1 (-1 0 0) (1 0 0) 78", "stop1 (39 0 0) (1 0 0) 2"]),
        ("3713", ["axlehole1 (0 0 0) (0 0 1) 20"]),
        ("6577", ["axlehole1 (0 0 0) (0 0 1) 10"]),
        # four mirrored quarters of one hole, drawn 0.2 off the line
        ("4019", ["axlehole1 (0 0 0) (0 0 1) 20"]),
        ("59443", ["axlehole1 (0 0 -10) (0 0 1) 20", "axlehole2 (0 0 10) (0 0 1) 20"]),
        ("6536", ["hole1 (0 20 0) (0 0 1) 20", "axlehole1 (0 0 0) (1 0 0) 20"]),
        # crossing bores without a common wall
        ("75535", ["hole1 (-10 0 0) (1 0 0) 20", "hole2 (10 0 0) (1 0 0) 20"]),
        ("6628", ["pin1 (10 0 0) (1 0 0) 20 f", "ball1 (-10 0 0) (0 -1 0) 16"]),
        # a rod of cross-shaped section is no axle
        ("32005", ["socket1 (0 0 0) (0 1 0) 16", "socket2 (0 0 100) (0 1 0) 16"]),
        ("2637", ["hole1 (0 0 -300) (0 1 0) 20", "hole2 (0 0 0) (0 1 0) 20"]),
    ],
)
def test_known_parts(shared_library, number, expected):
    assert [text(port) for port in there(ports_from_primitives(shared_library, number))] == expected


def test_studs_and_tubes_point_outward(shared_library):
    found = [text(port) for port in there(ports_from_primitives(shared_library, "3700"))]
    assert found == [
        "hole1 (0 10 0) (0 0 1) 20",
        "tube1 (0 21 0) (0 1 0) 6",
        "stud1 (-10 -2 0) (0 -1 0) 4",
        "stud2 (10 -2 0) (0 -1 0) 4",
    ]


def test_a_moved_number_keeps_its_own_axes(shared_library):
    old, new = (there(ports_from_primitives(shared_library, n)) for n in ("32531", "32531a"))
    holes = [[p for p in ports if p.kind is PortKind.PIN_HOLE] for ports in (old, new)]
    turn = np.array([[0, 0, -1], [0, 1, 0], [1, 0, 0]])
    expected = sorted(tuple((turn @ port.position / LDU).round(3) + 0.0) for port in holes[1])
    assert sorted(tuple((port.position / LDU).round(3) + 0.0) for port in holes[0]) == expected


def test_unknown_number(shared_library):
    assert ports_from_primitives(shared_library, "no such part") is None


# --- pieces -----------------------------------------------------------------------------------
WALL = "0 BFC INVERTNEXT\r\n" + line("4-4cyli.dat", (2, 0, 0), (0, 16, 0, 6, 0, 0, 0, 0, 6))


@pytest.mark.parametrize("walls", [(WALL,), ()])
def test_two_mouths_make_one_hole(ports, walls):
    mouths = line("peghole.dat", (0, 0, 0), ALONG_X), line("peghole.dat", (20, 0, 0), AGAINST_X)
    assert ports(*mouths, *walls) == ["hole1 (10 0 0) (1 0 0) 20"]


def test_one_mouth_counts_as_nominal_length(ports):
    assert ports(line("peghole.dat", (0, 0, 0), ALONG_X), WALL) == ["hole1 (10 0 0) (1 0 0) 20"]


def test_a_long_bore_is_divided(ports):
    wall = line("4-4cyli.dat", (2, 0, 0), (0, 56, 0, 6, 0, 0, 0, 0, 6))
    mouths = line("peghole.dat", (0, 0, 0), ALONG_X), line("peghole.dat", (60, 0, 0), AGAINST_X)
    expected = [f"hole{n} ({20 * n - 10} 0 0) (1 0 0) 20" for n in (1, 2, 3)]
    assert ports(*mouths, "0 BFC INVERTNEXT\r\n" + wall) == expected


def test_holes_in_two_walls_apart_stay_two(ports):
    lines = [line("connhole.dat", (x, 0, 0), ALONG_X) for x in (0, 60)]
    assert ports(*lines) == ["hole1 (0 0 0) (1 0 0) 20", "hole2 (60 0 0) (1 0 0) 20"]


def test_the_same_hole_drawn_twice_is_one(ports):
    assert (
        len(
            ports(
                line("connhole.dat"),
                line("connhole.dat"),
                line("s/a.dat"),
                a=part(line("connhole.dat")),
            )
        )
        == 1
    )


def test_a_cylinder_seen_from_outside_is_no_hole(ports):
    """A mirrored cylinder still shows its outside; INVERTNEXT twice over does too."""
    cylinder = line("4-4cyli.dat", (0, 0, 0), (6, 0, 0, 0, 20, 0, 0, 0, -6))
    assert ports(cylinder) == []
    inverted = "0 BFC INVERTNEXT\r\n" + cylinder
    assert ports(inverted) == ["hole1 (0 10 0) (0 1 0) 20"]
    assert ports("0 BFC INVERTNEXT\r\n" + line("s/a.dat"), a=part(inverted)) == []


@pytest.mark.parametrize(
    ("lines", "expected"),
    [
        # releases until 2024: one scaled primitive
        ([line("axle.dat", (-40, 0, 0), (0, 80, 0, 1, 0, 0, 0, 0, 1))], "axle1 (0 0 0) (1 0 0) 80"),
        # 2026: sides with two ends
        (
            [
                line("axlehol8.dat", (-37.5, 0, 0), (0, 75, 0, 1, 0, 0, 0, 0, 1)),
                line("axleend2.dat", (-40, 0, 0), ALONG_X),
                line("axleend2.dat", (40, 0, 0), AGAINST_X),
            ],
            "axle1 (0 0 0) (1 0 0) 80",
        ),
        # sides next to a hole's primitive are a hole
        (
            [
                line("axlehole.dat", (0, 0, 0), (0, 10, 0, 1, 0, 0, 0, 0, 1)),
                line("axlehol8.dat", (10, 0, 0), (0, 10, 0, 1, 0, 0, 0, 0, 1)),
            ],
            "axlehole1 (10 0 0) (1 0 0) 20",
        ),
        # sides seen from inside are a hole
        (
            [
                "0 BFC INVERTNEXT\r\n"
                + line("axlehol8.dat", (0, 0, 0), (0, 20, 0, 1, 0, 0, 0, 0, 1))
            ],
            "axlehole1 (10 0 0) (1 0 0) 20",
        ),
        # sides alone are a rod
        ([line("axlehol8.dat", (0, 0, 0), (0, 20, 0, 1, 0, 0, 0, 0, 1))], None),
    ],
)
def test_axles_and_axle_holes(ports, lines, expected):
    assert ports(*lines) == ([expected] if expected else [])


def test_a_mirrored_subpart_is_read(ports):
    half = part(line("connect.dat", (5, 0, 0), (0, -1, 0, 1, 0, 0, 0, 0, 1)))
    mirrored = line("s/half.dat", matrix=(-1, 0, 0, 0, 1, 0, 0, 0, 1))
    assert ports(line("s/half.dat"), mirrored, half=half) == [
        "pin1 (-15 0 0) (-1 0 0) 20",
        "pin2 (15 0 0) (1 0 0) 20",
    ]


def test_names_do_not_depend_on_the_order_of_lines(ports):
    lines = [line("connhole.dat", (x, 0, z)) for x in (0, 20) for z in (-20, 0, 20)]
    assert ports(*lines) == ports(*reversed(lines))


def test_a_missing_subfile_is_passed_over(ports):
    assert ports(line("not-there.dat"), line("connhole.dat")) == ["hole1 (0 0 0) (0 1 0) 20"]


def test_too_many_primitives_are_refused(ports):
    """Eight levels of eight references each would be 16 million holes."""
    levels = {f"l{n}": part(*[line(f"s/l{n + 1}.dat")] * 8) for n in range(7)}
    levels["l7"] = part(*[line("connhole.dat")] * 8)
    with pytest.raises(InputError, match="more than 10000 primitives"):
        ports(line("s/l0.dat"), **levels)


def test_deep_nesting_is_refused(ports):
    levels = {f"l{n}": part(line(f"s/l{n + 1}.dat")) for n in range(80)}
    with pytest.raises(InputError, match="nest deeper"):
        ports(line("s/l0.dat"), **levels)
