"""Ports from an LDCad shadow library."""

from __future__ import annotations

import csv

import numpy as np
import pytest

from technic.errors import InputError, MissingDependency
from technic.ldraw.agreement import Cause, differences
from technic.ldraw.library import Library
from technic.ldraw.primitives import ports_from_primitives
from technic.ldraw.shadow import ShadowLibrary, find_shadow, snaps_of
from technic.ldraw.shadow_ports import ports_from_shadow
from technic.parts.definition import Port, PortKind
from technic.units import LDU
from tests.ldraw.small_library import files_with, line, part, there, write_folder, write_zip


@pytest.fixture(autouse=True)
def cache(tmp_path, monkeypatch):
    """Keep the index cache of these tests to themselves."""
    monkeypatch.setenv("TECHNIC_CACHE", str(tmp_path / "cache"))


@pytest.fixture
def ports(tmp_path):
    """Ports of a part given by its lines and its shadow (and shadows of other files)."""

    def read(lines: str, shadow: str, **others: str) -> list[str] | None:
        files = files_with({"parts/1.dat": part(lines), "parts/2.dat": part()})
        shadows = {"parts/1.dat": shadow, **{f"p/{k}.dat": v for k, v in others.items()}}
        library = Library.open(write_folder(tmp_path / "l", files))
        known = ShadowLibrary.open(write_zip(tmp_path / "s.zip", shadows))
        found = ports_from_shadow(library, known, "1")
        return None if found is None else [text(port) for port in found]

    return read


def text(port: Port) -> str:
    """A port in one line: kind, middle, axis, length; an f for friction."""
    middle = " ".join(f"{value:g}" for value in (port.position / LDU).round(2) + 0.0)
    axis = " ".join(f"{value:g}" for value in port.axis.round(2) + 0.0)
    return f"{port.name} ({middle}) ({axis}) {port.length / LDU:.4g}{' f' * port.friction}"


def meta(name: str, options: str) -> str:
    """A snap line."""
    return f"0 !LDCAD SNAP_{name} {options}\n"


HOLE = "[gender=F] [caps=none] [secs=R 8 2   R 6 16   R 8 2] [center=true] [slide=true]"
NOTHING = "0 !LDCAD SNAP_CLEAR [id=nothing]\n"
"""Says that the part is described, and changes nothing."""

PIN = "[gender=M] [caps=one] [secs=R 8 2   R 6 16   _L 6.25 2]"


@pytest.mark.parametrize(
    ("options", "expected"),
    [
        (HOLE, ["hole1 (0 0 0) (0 1 0) 20"]),
        # a shape that is not centred grows from its base along -y
        (HOLE.replace("[center=true]", ""), ["hole1 (0 -10 0) (0 1 0) 20"]),
        (f"{HOLE} [pos=1 2 3] [ori=0 -1 0 1 0 0 0 0 1]", ["hole1 (1 2 3) (1 0 0) 20"]),
        # a panel's pair of holes, with a clearance between them
        (
            HOLE.replace("R 6 16", "R 6 16   _L 6.5 32   L_ 6.5 32   R 6 16"),
            ["hole1 (0 -40 0) (0 1 0) 20", "hole2 (0 40 0) (0 1 0) 20"],
        ),
        (
            "[gender=F] [caps=none] [secs=R 8 2   R 6 16   R 8 4   R 6 16   R 8 2] [center=true]",
            ["hole1 (0 -10 0) (0 1 0) 20", "hole2 (0 10 0) (0 1 0) 20"],
        ),
        ("[gender=F] [caps=none] [secs=A 6 20] [center=true]", ["axlehole1 (0 0 0) (0 1 0) 20"]),
        (PIN, ["pin1 (0 -10 0) (0 -1 0) 20"]),
        (
            "[secs=L_ 6.25 2   R 6 16   R 8 4   R 6 16   _L 6.25 2] [center=true]",
            ["pin1 (0 -10 0) (0 -1 0) 20", "pin2 (0 10 0) (0 1 0) 20"],
        ),
        (
            "[gender=M] [caps=none] [secs=A 6 78   R 8 2] [center=true]",
            ["axle1 (0 1 0) (0 1 0) 78", "stop1 (0 -39 0) (0 1 0) 2"],
        ),
        # a sleeve in the middle of an axle
        (
            "[gender=M] [caps=none] [secs=A 6 20   R 6 20   A 6 40] [center=true]",
            ["axle1 (0 0 0) (0 1 0) 80"],
        ),
        ("[gender=M] [caps=one] [secs=R 6 4]", ["stud1 (0 -2 0) (0 -1 0) 4"]),
        ("[gender=F] [caps=one] [secs=S 6 4] [pos=0 24 0]", ["tube1 (0 22 0) (0 1 0) 4"]),
        # a bar, a clip-on bar hole, and a snap that fits only its own group
        ("[gender=M] [caps=none] [secs=R 4 20]", []),
        ("[gender=F] [caps=none] [secs=R 4 20]", []),
        (f"{HOLE} [group=crane]", []),
    ],
)
def test_cylinders(ports, options, expected):
    assert ports("", meta("CYL", options)) == expected


def test_balls_and_sockets(ports):
    shadow = meta("GEN", "[gender=M] [bounding=sph 8] [pos=0 0 30]")
    shadow += meta("GEN", "[gender=F] [bounding=sph 12.7]") + meta("GEN", "[bounding=box 4 4 4]")
    assert ports("", shadow) == ["socket1 (0 0 0) (0 -1 0) 25.4", "ball1 (0 0 30) (0 -1 0) 16"]


def test_clips_and_fingers_are_no_ports(ports):
    shadow = meta("CLP", "[radius=4] [length=8]")
    shadow += meta("FGR", "[genderOfs=F] [seq=4 4 4] [radius=4]")
    assert ports("", shadow) == []


@pytest.mark.parametrize(
    ("grid", "places"),
    [
        ("C 3 1 20 0", [(-20, 0, 0), (0, 0, 0), (20, 0, 0)]),
        ("2 1 20 0", [(0, 0, 0), (20, 0, 0)]),
        ("C 2 C 2 20 40", [(-10, 0, -20), (-10, 0, 20), (10, 0, -20), (10, 0, 20)]),
        ("1 2 1 0 -60 0", [(0, -60, 0), (0, 0, 0)]),
    ],
)
def test_grids(ports, grid, places):
    found = ports("", meta("CYL", f"{HOLE} [grid={grid}]"))
    assert found == [
        f"hole{n} ({x} {y} {z}) (0 1 0) 20" for n, (x, y, z) in enumerate(places, start=1)
    ]


def test_a_grid_lies_in_the_axes_of_its_line(ports):
    """The holes of a gear: turned about x, the grid's second direction is the part's -y."""
    turned = f"{HOLE} [ori=1 0 0 0 0 1 0 -1 0] [grid=1 2 0 20]"
    assert ports("", meta("CYL", turned)) == [
        "hole1 (0 0 0) (0 0 1) 20",
        "hole2 (0 20 0) (0 0 1) 20",
    ]


def test_snaps_are_inherited_through_references(ports):
    moved = line("connhole.dat", (0, 0, 40), (0, -1, 0, 1, 0, 0, 0, 0, 1))
    assert ports(moved, NOTHING, connhole=meta("CYL", HOLE)) == ["hole1 (0 0 40) (1 0 0) 20"]


@pytest.mark.parametrize(
    ("clear", "left"), [("", 1), ("[id=hole]", 1), ("[id=HOLE]", 1), ("[id=other]", 2)]
)
def test_clear_drops_what_was_inherited(ports, clear, left):
    shadow = meta("CLEAR", clear) + meta("CYL", f"{HOLE} [pos=0 0 20]")
    inherited = meta("CYL", f"[ID=hole] {HOLE}")
    assert len(ports(line("connhole.dat"), shadow, connhole=inherited)) == left


def test_include_brings_the_snaps_of_another_file(ports):
    shadow = meta(
        "INCL", "[ref=connhole.dat] [pos=0 10 0] [ori=1 0 0 0 0 1 0 -1 0] [grid=C 2 1 20 0]"
    )
    assert ports("", shadow, connhole=meta("CYL", HOLE)) == [
        "hole1 (-10 10 0) (0 0 1) 20",
        "hole2 (10 10 0) (0 0 1) 20",
    ]


@pytest.mark.parametrize(
    ("scale", "matrix", "expected"),
    [
        ("YOnly", (1, 0, 0, 0, 16, 0, 0, 0, 1), ["axlehole1 (0 8 0) (0 1 0) 16"]),
        ("none", (1, 0, 0, 0, 40, 0, 0, 0, 1), []),
        ("YOnly", (2, 0, 0, 0, 1, 0, 0, 0, 2), []),
        ("none", (0, 0, 1, 0, 1, 0, -1, 0, 0), ["axlehole1 (0 0.5 0) (0 1 0) 1"]),
    ],
)
def test_scaled_references(ports, scale, matrix, expected):
    """A snap says which scaling it bears; others drop it."""
    snap = meta("CYL", f"[gender=F] [caps=none] [secs=A 6 1] [pos=0 1 0] [scale={scale}]")
    assert ports(line("axlehole.dat", matrix=matrix), NOTHING, axlehole=snap) == expected


@pytest.mark.parametrize(("mirror", "count"), [("none", 0), ("cor", 1)])
def test_mirrored_references(ports, mirror, count):
    snap = meta("CYL", f"{HOLE} [mirror={mirror}]")
    mirrored = line("connhole.dat", matrix=(-1, 0, 0, 0, 1, 0, 0, 0, 1))
    assert len(ports(mirrored, NOTHING, connhole=snap)) == count


def test_friction_comes_from_the_primitive(ports):
    found = ports(line("confric.dat"), meta("CYL", PIN) + meta("CYL", f"{PIN} [pos=40 0 0]"))
    assert found == ["pin1 (0 -10 0) (0 -1 0) 20 f", "pin2 (40 -10 0) (0 -1 0) 20"]


def test_friction_comes_from_the_title_where_no_primitive_tells(tmp_path):
    files = files_with(
        {
            "parts/1.dat": part(title="Technic Pin with Friction"),
            "parts/2.dat": part(title="Technic Pin Long without Friction"),
        }
    )
    library = Library.open(write_folder(tmp_path / "l", files))
    shadow = write_folder(tmp_path / "s", {f"parts/{n}.dat": meta("CYL", PIN) for n in (1, 2)})
    known = ShadowLibrary.open(shadow)
    rough = [there(ports_from_shadow(library, known, n))[0].friction for n in ("1", "2")]
    assert rough == [True, False]


def test_a_part_without_shadow_has_no_answer(tmp_path):
    """Neither does one that a shadow describes in part only: the axle's ends have no shadow."""
    files = files_with(
        {
            "parts/1.dat": part(line("connhole.dat")),
            "parts/2.dat": part(line("s/2s.dat"), line("axleend2.dat")),
            "parts/s/2s.dat": part(line("connhole.dat")),
        }
    )
    library = Library.open(write_folder(tmp_path / "l", files))
    shadows = {"p/connhole.dat": meta("CYL", HOLE), "parts/s/2s.dat": NOTHING}
    known = ShadowLibrary.open(write_folder(tmp_path / "s", shadows))
    assert [ports_from_shadow(library, known, n) for n in ("1", "2", "3")] == [None] * 3


@pytest.mark.parametrize(
    "shadow",
    [
        meta("CYL", "[gender=F]"),
        meta("CYL", f"{HOLE} [pos=1 2]"),
        meta("CYL", f"{HOLE} [pos=1 2 x]"),
        meta("CYL", f"{HOLE} [pos=1 2 nan]"),
        meta("CYL", f"{HOLE} [ori=1 0 0 0 0 0 0 0 1]"),
        meta("CYL", f"{HOLE} [grid=C 3]"),
        meta("CYL", f"{HOLE} [grid=C 3 0 20 20]"),
        meta("CYL", f"{HOLE} [grid=100000 100000 1 1]"),
        meta("CYL", "[secs=R six 4]"),
        meta("CLP", "[radius=wide]"),
        meta("INCL", "[pos=0 0 0]"),
        meta("INCL", "[ref=../../secret.dat]"),
        meta("INCL", "[ref=1.dat]"),
    ],
)
def test_broken_lines_are_named(ports, shadow):
    with pytest.raises(InputError, match=r"s\.zip/parts/1\.dat:2: broken SNAP_"):
        ports("", "0 comment\n" + shadow)


def test_too_many_snaps_are_refused(ports):
    many = meta("CYL", f"{HOLE} [grid=64 64 1 1]") * 13
    with pytest.raises(InputError, match="more than 50000 snaps"):
        ports("", many)


# --- against primitives -----------------------------------------------------------------------
@pytest.mark.slow
def test_agrees_with_primitives(ldraw_library, shared):
    """Kind, position, axis and length agree for at least 92 % of the parts that builders use most."""
    library = Library.open(ldraw_library)
    shadow = ShadowLibrary.open(shared / "ldraw" / "ldcad-shadow-2026-03.zip")
    with (shared / "reference" / "technic_parts.csv").open(encoding="utf-8") as stream:
        numbers = [row["ldraw_id"] for row in csv.DictReader(stream)]
    wrong, total = {}, 0
    for number in numbers:
        first = ports_from_primitives(library, number)
        second = ports_from_shadow(library, shadow, number)
        if first is None or second is None:
            continue
        total += 1
        if different := differences(first, second):
            wrong[number] = [str(difference) for difference in different]
    assert total > 170
    assert len(wrong) <= 0.08 * total, wrong


def test_differences_name_their_cause():
    def port(kind, x, length):
        return Port("p", kind, np.array([x, 0, 0]) * LDU, np.array([1, 0, 0]), length * LDU)

    hole, axle_hole = PortKind.PIN_HOLE, PortKind.AXLE_HOLE
    base = port(hole, 0, 20)
    assert differences([base], [port(hole, 1, 18)]) == ()
    assert [d.cause for d in differences([base], [port(hole, 4, 20)])] == [Cause.EXTENT]
    assert [d.cause for d in differences([base], [port(axle_hole, 0, 20)])] == [Cause.KIND]
    assert [d.cause for d in differences([base], [])] == [Cause.FIRST]
    (only,) = differences([], [base])
    assert only.cause is Cause.SECOND
    assert str(only) == "only in the second: - / pin_hole at (0, 0, 0) along (1, 0, 0), 20 LDU"


def test_snaps_are_read_once(tmp_path):
    library = Library.open(write_folder(tmp_path / "l", files_with({"parts/1.dat": part()})))
    shadow = ShadowLibrary.open(write_folder(tmp_path / "s", {"parts/1.dat": meta("CYL", HOLE)}))
    assert snaps_of(shadow, library, "parts/1.dat") is snaps_of(shadow, library, "parts/1.dat")


def test_the_shadow_library_is_named_by_the_user(tmp_path, monkeypatch):
    monkeypatch.delenv("TECHNIC_SHADOW", raising=False)
    assert find_shadow() is None
    place = write_zip(tmp_path / "s.zip", {"parts/1.dat": meta("CYL", HOLE)}, "downloaded-main/")
    assert there(find_shadow(place)).has("parts/1.dat")
    monkeypatch.setenv("TECHNIC_SHADOW", str(place))
    assert there(find_shadow()).has("parts/1.dat")
    with pytest.raises(MissingDependency, match="no LDCad shadow library"):
        find_shadow(tmp_path / "missing")
