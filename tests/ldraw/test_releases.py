"""The same part drawn in the manner of two releases of the parts library has the same ports.

Releases until 2024 draw an axle with one scaled primitive, a hole with two mouths and a wall, a joiner
with its primitives in the part file; that of 2026-02 draws an axle's sides and ends, a hole with one
primitive, a joiner in a subpart. Both manners are written here from the measures of the parts.
"""

from __future__ import annotations

import subprocess
import sys

import pytest

from technic.ldraw.agreement import differences
from technic.ldraw.library import Library
from technic.ldraw.primitives import ports_from_primitives
from technic.parts.definition import PortKind
from tests.ldraw.small_library import SQUARE, files_with, line, part, there, write_folder

INVERT = "0 BFC INVERTNEXT\r\n"
EXTRA = (
    *("axleend20", "axleend", "axlehol2", "axlehol9", "axl3hol2", "axl3hol8", "axl3hol9"),
    *("beamhole", "bush", "bush0", "npeghol2", "npeghol7", "npeghol7a", "4-4disc", "4-4cylc"),
)


def along_x(length: float) -> tuple[float, ...]:
    """Matrix of a primitive whose y is stretched to `length` along the part's x."""
    return (0, length, 0, 1, 0, 0, 0, 0, 1)


def along_z(length: float) -> tuple[float, ...]:
    return (1, 0, 0, 0, 0, 1, 0, length, 0)


def wall(at, length: float) -> str:
    """A bore's wall along x, seen from inside."""
    return INVERT + line("4-4cyli.dat", at, (0, length, 0, 6, 0, 0, 0, 0, 6))


def half_walls(at, length: float) -> str:
    """The same from two halves."""
    return "".join(
        INVERT + line("2-4cyli.dat", at, (0, length, 0, 6 * side, 0, 0, 0, 0, 6 * side))
        for side in (1, -1)
    )


MOUTHS = line("peghole.dat", (-10, 0, 0), along_x(1)) + line("peghole.dat", (10, 0, 0), along_x(-1))
JOINER = tuple(
    line(f"axl3hol{n}.dat", (0, 0, z), along_z(sign * (20 if n == 8 else 1)))
    for z, sign in ((-30, 1), (30, -1))
    for n in (8, 9, 2)
)

STYLES = {
    "axle": (
        [line("axle.dat", (110, 0, 0), along_x(-220))],
        [
            line("axleend2.dat", (110, 0, 0), along_x(-1)),
            line("axleend2.dat", (-110, 0, 0), along_x(1)),
            line("axlehol8.dat", (107.5, 0, 0), along_x(-215)),
        ],
        ["axle (0, 0, 0) 220"],
    ),
    "axle with a stop": (
        [
            line("axle.dat", (-30, 0, 0), along_x(58)),
            line("4-4cylc.dat", (30, 0, 0), (0, -2, 0, 8, 0, 0, 0, 0, 8)),
        ],
        [
            line("axleend2.dat", (-30, 0, 0), along_x(1)),
            line("axlehol8.dat", (-27.5, 0, 0), along_x(55.5)),
            line("axlehol2.dat", (28, 0, 0), along_x(1)),
            line("axlehol9.dat", (28, 0, 0), along_x(1)),
            line("4-4cylc.dat", (30, 0, 0), (0, -2, 0, 8, 0, 0, 0, 0, 8)),
        ],
        ["axle (-1, 0, 0) 58"],
    ),
    "axle pin": (
        [line("axle.dat", (-10, 0, 0), along_x(40)), line("confric.dat", (-10, 0, 0), along_x(1))],
        [
            line("axlehol2.dat", (-10, 0, 0), along_x(1)),
            line("axlehol9.dat", (-10, 0, 0), along_x(1)),
            line("axlehol8.dat", (-10, 0, 0), along_x(37.5)),
            line("axleend2.dat", (30, 0, 0), along_x(-1)),
            line("confric.dat", (-10, 0, 0), along_x(1)),
        ],
        ["axle (10, 0, 0) 40", "pin (-20, 0, 0) 20 friction"],
    ),
    "hole": (
        [MOUTHS, wall((-8, 0, 0), 16)],
        [line("connhole.dat", (0, 0, 0), along_x(1))],
        ["pin_hole (0, 0, 0) 20"],
    ),
    "hole in the corner of a bent beam": (
        [MOUTHS, half_walls((-8, 0, 0), 16), line("npeghol2.dat", (-10, 0, 0), along_x(1))],
        [
            line("connhole.dat", (0, 0, 0), along_x(1)),
            line("npeghol7.dat", (-10, 0, 0), along_x(8)),
            line("npeghol7a.dat", (-10, 0, 0), along_x(8)),
        ],
        ["pin_hole (0, 0, 0) 20"],
    ),
    "axle hole from a subpart": (
        list(JOINER),
        [line("s/1s02.dat")],
        ["axle_hole (0, 0, -20) 20", "axle_hole (0, 0, 20) 20"],
    ),
}


@pytest.fixture
def read(tmp_path, monkeypatch):
    """Ports of a part given by its lines."""
    monkeypatch.setenv("TECHNIC_CACHE", str(tmp_path / "cache"))

    def ports(name: str, lines):
        files = files_with({f"p/{n}.dat": part(SQUARE, title=n) for n in EXTRA})
        files |= {"parts/1.dat": part(*lines), "parts/s/1s02.dat": part(*JOINER)}
        library = Library.open(write_folder(tmp_path / name, files))
        return there(ports_from_primitives(library, "1"))

    return ports


def text(port) -> str:
    x, y, z = (round(float(v) / 4e-4) + 0 for v in port.position)
    return f"{port.kind} ({x}, {y}, {z}) {port.length / 4e-4:.0f}" + " friction" * port.friction


@pytest.mark.parametrize("name", sorted(STYLES))
def test_both_manners_give_the_same_ports(read, name):
    old, new, expected = STYLES[name]
    first, second = read("2022", old), read("2026", new)
    for ports in (first, second):
        known = [port for port in ports if port.kind is not PortKind.STOP]
        assert sorted(map(text, known)) == expected
    assert differences(first, second) == ()
    assert [p.kind for p in first] == [p.kind for p in second]


@pytest.mark.slow
def test_nine_parts_in_ten_agree_with_the_shadow_library(ldraw_library, shared, repo):
    """All beams, bricks, frames, pins, axles, connectors, bushes, gears and panels of the library."""
    shadow = shared / "ldraw" / "ldcad-shadow-2026-03.zip"
    script = repo / "scripts" / "compare_ports.py"
    done = subprocess.run(
        [sys.executable, script, ldraw_library, shadow, "--quiet"],
        capture_output=True,
        text=True,
        check=False,
    )
    assert done.returncode == 0, done.stdout
    assert "312 of 334 parts agree" in done.stdout
