"""Libraries that are broken or made to break things: a model is read all the same, in bounded time.

Each file here is the file of one part of a model; the part must end as unknown with its reason, or as
a part with bounded work behind it. Nothing may be written outside the cache folder.
"""

from __future__ import annotations

import os
import re
import struct
from pathlib import Path

import numpy as np
import pytest

from technic.errors import InputError
from technic.ldraw import storage
from technic.ldraw.library import MAX_REFERENCES, Library
from technic.ldraw.primitives import MAX_OCCURRENCES
from technic.ldraw.reader import load_ldraw
from technic.ldraw.shadow import ShadowLibrary
from technic.ldraw.storage import list_size
from technic.system.drawn_solids import outcome_of
from technic.system.solid_cache import Refusal
from tests.ldraw.small_library import files_with, line, part, write_folder, write_zip

MODEL = "0 m\r\n" + line("32524.dat") + line("2780.dat") + line("evil.dat")
BOX = "".join(
    f"4 16 {quad}\r\n"
    for quad in (
        "-8 0 -8 8 0 -8 8 0 8 -8 0 8",
        "-8 9 8 8 9 8 8 9 -8 -8 9 -8",
        "-8 0 -8 -8 9 -8 -8 9 8 -8 0 8",
        "8 0 8 8 9 8 8 9 -8 8 0 -8",
        "-8 0 8 -8 9 8 8 9 8 8 0 8",
        "8 0 -8 8 9 -8 -8 9 -8 -8 0 -8",
    )
)


@pytest.fixture(autouse=True)
def cache(tmp_path, monkeypatch) -> Path:
    monkeypatch.setenv("TECHNIC_CACHE", str(tmp_path / "cache"))
    monkeypatch.delenv("LDRAWDIR", raising=False)
    return tmp_path / "cache"


@pytest.fixture
def read(tmp_path):
    """Read the model with a library, and say why the part is unknown."""

    def run(library: Library, **options) -> str:
        path = tmp_path / "model.ldr"
        path.write_text(MODEL, encoding="utf-8")
        assembly = load_ldraw(path, library=library, **options)
        assert [p.number for p in assembly.parts] == ["32524", "2780"]
        (unknown,) = assembly.unknown
        assert unknown.number == "evil"
        return unknown.reason

    return run


def folder(tmp_path: Path, evil: str, **more: str) -> Library:
    extra = {"parts/evil.dat": evil, "p/box.dat": part(BOX)}
    extra |= {f"parts/s/{name}.dat": text for name, text in more.items()}
    return Library.open(write_folder(tmp_path / "library", files_with(extra)))


# --- references -------------------------------------------------------------------------------
@pytest.mark.parametrize(
    ("evil", "reason"),
    [
        (part(BOX, line("../../../etc/passwd.dat")), "points out of the parts library"),
        (part(BOX, line("/etc/passwd")), "points out of the parts library"),
        (part(BOX, line("C:\\x.dat")), "points out of the parts library"),
        (part(BOX, line("evil.dat")), "includes itself"),
        (part(BOX, line("s/a.dat")), r"includes itself: .* \(parts/"),
        (part(BOX) + line("nothing.dat") * (MAX_REFERENCES + 1), "references"),
        (
            part(BOX, *(line("stud.dat", (20 * k, 0, 0)) for k in range(MAX_OCCURRENCES + 1))),
            "primitives",
        ),
        (part(line("box.dat", matrix=(1e6, 0, 0, 0, 1, 0, 0, 0, 1))), "further than 10 m"),
        (part(line("s/b.dat", matrix=(1e150, 0, 0, 0, 1e150, 0, 0, 0, 1e150))), "further than"),
    ],
    ids=[
        "climbs",
        "absolute",
        "drive",
        "itself",
        "in a ring",
        "references",
        "primitives",
        "long",
        "overflow",
    ],
)
def test_the_part_is_unknown_with_its_reason(tmp_path, read, evil, reason):
    library = folder(
        tmp_path,
        evil,
        a=part(BOX, line("evil.dat")),
        b=part(line("box.dat", matrix=(1e170, 0, 0, 0, 1e170, 0, 0, 0, 1e170))),
    )
    before = everything(tmp_path)
    assert re.search(reason, read(library))
    assert everything(tmp_path) - before <= {"model.ldr"}


def everything(place: Path) -> set[str]:
    """All files below a folder, those of the cache left out."""
    return {
        str(path.relative_to(place))
        for path in place.rglob("*")
        if path.relative_to(place).parts[0] != "cache"
    }


@pytest.mark.parametrize("kind", ["device", "pipe"])
@pytest.mark.skipif(not hasattr(os, "mkfifo"), reason="no pipes on this system")
def test_what_is_no_file_is_not_read(tmp_path, read, kind):
    library = folder(tmp_path, part(BOX))
    path = tmp_path / "library" / "parts" / "evil.dat"
    path.unlink()
    if kind == "device":
        path.symlink_to("/dev/zero")
    else:
        os.mkfifo(path)
    assert "no regular file" in read(library)


def test_a_huge_file_is_not_read(tmp_path, read):
    library = folder(tmp_path, part(BOX))
    with open(tmp_path / "library" / "parts" / "evil.dat", "r+b") as stream:
        stream.truncate(2**40)  # a hole: it takes no space
    assert "larger than any part" in read(library)


def test_many_studs(tmp_path):
    """The largest baseplates have 2,304 studs, drawn through groups: seconds, not minutes."""
    from technic.ldraw.imported import definition_from_library

    row = part(*(line("stud.dat", (20 * k, 0, 0)) for k in range(48)))
    library = folder(tmp_path, part(*(line("s/a.dat", (0, 0, 20 * k)) for k in range(48))), a=row)
    (tmp_path / "library" / "p" / "stud.dat").write_text(part(BOX))
    library = Library.open(tmp_path / "library")
    made = definition_from_library(library, "evil")
    assert made is not None
    assert len(made.ports) == 48 * 48


# --- folders and zips -------------------------------------------------------------------------
def test_a_folder_that_cannot_be_read_is_named(tmp_path, monkeypatch):
    place = write_folder(tmp_path / "library", files_with({}))
    real = os.scandir

    def closed(path):
        if str(path).endswith("parts") or str(path) == str(place):
            raise PermissionError(13, "Permission denied", str(path))
        return real(path)

    monkeypatch.setattr(storage.os, "scandir", closed)
    with pytest.raises(InputError, match="Permission denied") as caught:
        Library.open(place)
    assert caught.value.path == str(place)
    assert "permissions" in str(caught.value)


def test_one_broken_entry_does_not_spoil_a_zip(tmp_path, read):
    """Naming the release reads a sample of the files; a bomb among them is passed over."""
    files = files_with({"parts/evil.dat": "0 x\n0 " + " " * (20 * 2**20)})
    library = Library.open(write_zip(tmp_path / "l.zip", files))
    assert library.release() == "2026-02"
    assert "larger than any part" in read(library)


@pytest.mark.parametrize("form", ["plain", "zip64"])
def test_a_zip_that_lists_millions_of_files_is_refused_unread(tmp_path, form):
    path = tmp_path / "l.zip"
    size, count = 40 * 2**20, 900_000
    with open(path, "wb") as stream:
        stream.truncate(size)
        stream.seek(size)
        if form == "plain":
            stream.write(struct.pack("<4s4H2LH", b"PK\5\6", 0, 0, 9, 9, size, 0, 0))
        else:
            stream.write(
                struct.pack("<4sQ2H2L4Q", b"PK\6\6", 44, 45, 45, 0, 0, count, count, size, 0)
            )
            stream.write(struct.pack("<4sLQL", b"PK\6\7", 0, size, 1))
            stream.write(
                struct.pack("<4s4H2LH", b"PK\5\6", 0, 0, *[0xFFFF] * 2, *[2**32 - 1] * 2, 0)
            )
    assert list_size(path) == size
    with pytest.raises(InputError, match="list of files has 41943040 bytes"):
        Library.open(path)


@pytest.mark.parametrize("content", [b"", b"PK\5\6", b"PK\6\7" + b"\xff" * 60, b"x" * 100_000])
def test_what_has_no_list_is_no_zip(tmp_path, content):
    path = tmp_path / "l.zip"
    path.write_bytes(content)
    assert list_size(path) == 0
    with pytest.raises(InputError, match="damaged"):
        Library.open(path)


def test_the_list_of_a_good_zip_has_its_size(tmp_path):
    path = write_zip(tmp_path / "l.zip", files_with({}))
    assert 46 * len(files_with({})) < list_size(path) < 2000


# --- shadow library ---------------------------------------------------------------------------
@pytest.mark.parametrize(
    "metas",
    [
        "0 !LDCAD SNAP_CYL [gender=F] [secs=R 6 banana]",
        "0 !LDCAD SNAP_CYL [gender=F] [secs=R 6 20] [grid=C 9999 C 9999 1 1]",
        "0 !LDCAD SNAP_CYL [gender=F] [secs=R 6 1e999]",
        "0 !LDCAD SNAP_CYL [pos=0 nan 0] [secs=R 6 20]",
        "0 !LDCAD SNAP_INCL [ref=../../x.dat]",
        "0 !LDCAD SNAP_INCL [ref=evil.dat]",
    ],
)
def test_broken_metas_of_a_shadow_file_spoil_one_part(tmp_path, metas):
    library = folder(tmp_path, part(BOX, line("peghole.dat")))
    shadow = write_folder(tmp_path / "shadow", {"parts/evil.dat": f"0 x\r\n{metas}\r\n"})
    path = tmp_path / "model.ldr"
    path.write_text(MODEL, encoding="utf-8")
    assembly = load_ldraw(path, library=library, shadow=ShadowLibrary.open(shadow))
    assert {p.number for p in assembly.parts} >= {"32524", "2780"}
    reasons = [unknown.reason for unknown in assembly.unknown]
    known = [p for p in assembly.parts if p.number == "evil"]
    # listed with the reason, or read without the broken line
    assert len(reasons) + len(known) == 1
    for reason in reasons:
        assert "unusable" in reason
        assert "evil.dat" in reason


# --- solids -----------------------------------------------------------------------------------
def test_dense_and_large_drawings_are_no_solids(tmp_path):
    """Layers upon layers of large triangles: refused before they are shot at."""
    from dataclasses import replace

    from technic.ldraw.imported import definition_from_library

    layers = np.zeros((150_000, 3, 3))
    layers[:, 1, 0] = layers[:, 2, 2] = 0.4
    layers[:, :, 1] = np.linspace(0.0, 0.01, 150_000)[:, None]
    library = folder(tmp_path, part(BOX, line("peghole.dat"), line("peghole.dat", (0, 20, 0))))
    made = definition_from_library(library, "evil")
    assert made is not None
    assert made.drawing is not None
    ports = tuple(replace(made.ports[0], name=name) for name in ("a", "b"))
    dense = replace(made, ports=ports, drawing=replace(made.drawing, triangles=lambda: layers))
    answer = outcome_of(dense)
    assert isinstance(answer, Refusal)
    assert "too large" in answer.reason
