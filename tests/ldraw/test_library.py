"""Finding and reading an LDraw parts library."""

from __future__ import annotations

import os
import zipfile
from concurrent.futures import ThreadPoolExecutor

import numpy as np
import pytest

from technic.errors import InputError, MissingDependency
from technic.folders import cache_folder
from technic.ldraw.library import Library, candidate_folders, find_library, reference_key
from technic.ldraw.primitives import ports_from_primitives
from technic.ldraw.storage import ZipStore
from tests.ldraw.small_library import files_with, line, part, there, write_folder, write_zip


@pytest.fixture(autouse=True)
def cache(tmp_path, monkeypatch):
    """Keep the index cache of these tests to themselves."""
    monkeypatch.setenv("TECHNIC_CACHE", str(tmp_path / "cache"))
    monkeypatch.delenv("LDRAWDIR", raising=False)
    return tmp_path / "cache"


FILES = files_with({"parts/1.dat": part(title="Brick"), "parts/s/1s01.dat": part(title="~Sub")})


@pytest.mark.parametrize("kind", ["folder", "prefix", "bare", "capitals"])
def test_every_layout_is_read(tmp_path, kind):
    if kind == "folder":
        place = write_folder(tmp_path / "ldraw", FILES)
    elif kind == "capitals":
        place = write_folder(tmp_path / "ldraw", {k.upper(): text for k, text in FILES.items()})
    else:
        place = write_zip(tmp_path / "l.zip", FILES, "ldraw/" if kind == "prefix" else "")
    library = Library.open(place)
    assert len(library) == len(FILES)
    assert library.find("1.DAT") == "parts/1.dat"
    assert library.find("S\\1S01.dat") == "parts/s/1s01.dat"
    assert library.find("48\\4-4cyli.dat") == "p/48/4-4cyli.dat"
    assert library.find("2.dat") is None
    assert library.file("parts/1.dat").title == "Brick"
    assert list(library.part_numbers()) == ["1"]
    assert library.release() == "2026-02"


def test_unofficial_parts_come_after_official_ones(tmp_path):
    official = write_zip(tmp_path / "complete.zip", FILES, "ldraw/")
    unofficial = {"parts/1.dat": part(title="Changed"), "parts/2.dat": part(title="New")}
    library = Library.open(official, write_zip(tmp_path / "ldrawunf.zip", unofficial))
    assert library.file(there(library.key_of("1"))).title == "Brick"
    assert library.file(there(library.key_of("2"))).title == "New"
    inside = {**FILES, "unofficial/parts/3.dat": part(title="Inside")}
    assert Library.open(write_folder(tmp_path / "both", inside)).key_of("3") == (
        "unofficial/parts/3.dat"
    )


def test_latin_1_and_byte_order_mark_are_understood(tmp_path):
    folder = write_folder(tmp_path / "l", FILES)
    (folder / "parts/2.dat").write_bytes("0 Bügel\n".encode("latin-1"))
    (folder / "parts/3.dat").write_bytes("\ufeff0 Bügel\n".encode())
    library = Library.open(folder)
    assert library.file("parts/2.dat").title == library.file("parts/3.dat").title == "Bügel"


def test_moved_stubs_are_followed_with_their_transform(tmp_path):
    turn = (0, 0, -1, 0, 1, 0, 1, 0, 0)
    files = {
        **FILES,
        "parts/1a.dat": part(line("connhole.dat"), title="Beam"),
        "parts/1b.dat": part(line("1a.dat", (0, 0, 20), turn), title="~Moved to 1a"),
        "parts/1c.dat": part(line("1b.dat", (5, 0, 0)), title="~Moved to 1b"),
        "parts/9.dat": part(line("1a.dat"), title="=Beam"),
    }
    library = Library.open(write_folder(tmp_path / "l", files))
    found = there(library.resolve("1c"))
    assert (found.key, found.via) == ("parts/1a.dat", ("parts/1c.dat", "parts/1b.dat"))
    np.testing.assert_allclose(found.matrix, np.reshape(turn, (3, 3)))
    np.testing.assert_allclose(found.offset, [5, 0, 20])
    assert there(library.resolve("9")).key == "parts/9.dat"  # an alias is a part like any other
    assert len(there(ports_from_primitives(library, "9"))) == 1
    assert library.resolve("77") is None


def test_the_frame_that_turned_when_it_moved(shared_library):
    found = there(shared_library.resolve("32531"))
    assert found.key == "parts/32531a.dat"
    np.testing.assert_allclose(found.matrix, [[0, 0, -1], [0, 1, 0], [1, 0, 0]])


@pytest.fixture(scope="module")
def shared_library(ldraw_library, tmp_path_factory):
    """Technic subset of the official library."""
    with pytest.MonkeyPatch.context() as patch:
        patch.setenv("TECHNIC_CACHE", str(tmp_path_factory.mktemp("cache")))
        return Library.open(ldraw_library)


def test_stubs_in_a_circle_are_refused(tmp_path):
    files = {
        **FILES,
        "parts/5.dat": part(line("6.dat"), title="~Moved to 6"),
        "parts/6.dat": part(line("5.dat"), title="~Moved to 5"),
    }
    library = Library.open(write_folder(tmp_path / "l", files))
    with pytest.raises(InputError, match=r"circle: parts/5\.dat -> parts/6\.dat -> parts/5\.dat"):
        there(library.resolve("5"))


@pytest.mark.parametrize("name", ["/etc/passwd", "..\\x.dat", "s/../../x.dat", "C:\\x.dat", "a\0b"])
def test_references_that_leave_the_library_are_refused(tmp_path, name):
    with pytest.raises(InputError, match="points out of the parts library"):
        reference_key(name)
    library = Library.open(write_folder(tmp_path / "l", {**FILES, "parts/2.dat": part(line(name))}))
    with pytest.raises(InputError, match=r"parts/2\.dat:5: .*points out"):
        library.file("parts/2.dat")


@pytest.mark.parametrize(
    ("text", "message"),
    [
        ("1 16 0 0 0 1 0 0 0 1 0 0 0 1\n", "needs 14 tokens"),
        ("1 16 0 0 0 1 0 0 zero 1 0 0 0 1 x.dat\n", "not a number"),
        ("1 16 0 0 0 1 0 0 0 nan 0 0 0 1 x.dat\n", "not finite"),
    ],
)
def test_broken_lines_are_named(tmp_path, text, message):
    library = Library.open(write_folder(tmp_path / "l", {**FILES, "parts/2.dat": part(text)}))
    with pytest.raises(InputError, match=rf"parts/2\.dat:5: .*{message}"):
        library.file("parts/2.dat")


def test_a_file_that_includes_itself_is_refused(tmp_path):
    files = {
        **FILES,
        "parts/2.dat": part(line("s\\2s01.dat")),
        "parts/s/2s01.dat": part(line("2.dat")),
    }
    library = Library.open(write_folder(tmp_path / "l", files))
    with pytest.raises(InputError, match=r"includes itself: parts/2\.dat -> parts/s/2s01\.dat"):
        there(ports_from_primitives(library, "2"))


# --- damaged and hostile zips -----------------------------------------------------------------
def test_a_damaged_zip_is_refused(tmp_path):
    whole = write_zip(tmp_path / "l.zip", FILES).read_bytes()
    (tmp_path / "cut.zip").write_bytes(whole[: len(whole) // 2])
    with pytest.raises(InputError, match="damaged"):
        Library.open(tmp_path / "cut.zip")


def test_a_damaged_entry_is_refused(tmp_path):
    path = write_zip(tmp_path / "l.zip", FILES)
    with zipfile.ZipFile(path) as archive:
        offset = archive.getinfo("parts/1.dat").header_offset
    data = bytearray(path.read_bytes())
    for position in range(offset + 45, offset + 60):
        data[position] ^= 0xFF
    path.write_bytes(data)
    library = Library.open(path)
    with pytest.raises(InputError, match=r"parts/1\.dat: .*damaged"):
        library.text("parts/1.dat")


def test_a_zip_bomb_is_refused_before_it_is_unpacked(tmp_path):
    bomb = "0 x\n" + "0 " + " " * (20 * 2**20)
    path = write_zip(tmp_path / "l.zip", {**FILES, "parts/2.dat": bomb})
    assert path.stat().st_size < 2**18
    with pytest.raises(InputError, match="larger than any part"):
        Library.open(path).text("parts/2.dat")


def test_an_entry_that_unpacks_to_more_than_announced_is_refused(tmp_path):
    path = write_zip(tmp_path / "l.zip", FILES)
    store = ZipStore(path)
    offset, packed, size, method, crc = store._entries["parts/1.dat"]
    store._entries["parts/1.dat"] = (offset, packed, size - 10, method, crc)
    with pytest.raises(InputError, match="damaged"):
        store.read("parts/1.dat")


def test_paths_in_a_zip_never_leave_it(tmp_path):
    files = {**FILES, "parts/../../evil.dat": "0 x\n", "other/x.dat": "0 x\n"}
    assert len(Library.open(write_zip(tmp_path / "l.zip", files))) == len(FILES)


@pytest.mark.parametrize("make", ["nothing", "empty folder", "other zip", "text"])
def test_what_is_no_library_is_refused(tmp_path, make):
    place = tmp_path / "place"
    if make == "empty folder":
        place.mkdir()
    elif make == "other zip":
        write_zip(place, {"readme.txt": "x"})
    elif make == "text":
        place.write_text("hello")
    with pytest.raises(InputError):
        Library.open(place)


# --- index cache ------------------------------------------------------------------------------
@pytest.mark.parametrize("kind", ["folder", "zip"])
def test_the_index_follows_changes(tmp_path, cache, kind):
    more = {**FILES, "parts/2.dat": part(title="Second")}
    write = write_folder if kind == "folder" else write_zip
    place = write(tmp_path / "library", FILES)
    assert Library.open(place).find("2.dat") is None
    assert len(list(cache.rglob("*.txt"))) == 1
    assert Library.open(place).find("1.dat") == "parts/1.dat"  # from the cache
    if kind == "folder":
        write_folder(place, {"parts/2.dat": more["parts/2.dat"]})
        os.utime(place / "parts", ns=(1, 1))  # coarse clocks may not see the change
    else:
        write_zip(place, more)
    assert Library.open(place).find("2.dat") == "parts/2.dat"


@pytest.mark.parametrize("damage", [b"", b"garbage", b"\xff\xfe\x00"])
def test_a_damaged_index_is_made_anew(tmp_path, cache, damage):
    place = write_zip(tmp_path / "l.zip", FILES)
    Library.open(place)
    (index,) = cache.rglob("*.txt")
    whole = index.read_bytes()
    index.write_bytes(damage or whole[:-20])
    assert Library.open(place).text("parts/1.dat").startswith("0 Brick")
    assert index.read_bytes() == whole


def test_an_index_that_cannot_be_written_is_no_fault(tmp_path, monkeypatch):
    (tmp_path / "file").write_text("not a folder")
    monkeypatch.setenv("TECHNIC_CACHE", str(tmp_path / "file"))
    assert Library.open(write_folder(tmp_path / "l", FILES)).find("1.dat")


def test_many_may_open_it_at_once(tmp_path, cache):
    place = write_folder(tmp_path / "l", FILES)
    with ThreadPoolExecutor(8) as pool:
        sizes = list(pool.map(lambda _: len(Library.open(place)), range(24)))
    assert set(sizes) == {len(FILES)}
    assert [path.suffix for path in cache.rglob("*") if path.is_file()] == [".txt"]


# --- search order -----------------------------------------------------------------------------
def test_search_order(tmp_path, monkeypatch):
    monkeypatch.setenv("HOME", str(tmp_path / "home"))
    monkeypatch.setenv("USERPROFILE", str(tmp_path / "home"))
    monkeypatch.setenv("TECHNIC_DATA", str(tmp_path / "data"))
    monkeypatch.delenv("LDRAWDIR", raising=False)
    (tmp_path / "home").mkdir()
    fetched, home = candidate_folders()[:2]
    assert home == tmp_path / "home" / "ldraw"
    write_folder(home, FILES)
    assert there(find_library()).path == home
    fetched.mkdir(parents=True)
    write_zip(fetched / "complete.zip", FILES, "ldraw/")
    assert there(find_library()).path == tmp_path / "data" / "ldraw" / "complete.zip"
    other = write_folder(tmp_path / "other", FILES)
    monkeypatch.setenv("LDRAWDIR", str(other))
    assert there(find_library()).path == other
    explicit = write_zip(tmp_path / "l.zip", FILES)
    assert there(find_library(explicit)).path == explicit
    with pytest.raises(MissingDependency, match="no LDraw parts library at"):
        there(find_library(tmp_path / "missing"))


def test_a_zip_in_the_usual_place_is_found(tmp_path, monkeypatch):
    monkeypatch.setenv("HOME", str(tmp_path))
    monkeypatch.setenv("TECHNIC_DATA", str(tmp_path / "data"))
    monkeypatch.delenv("LDRAWDIR", raising=False)
    monkeypatch.setenv("USERPROFILE", str(tmp_path))
    (tmp_path / "ldraw").mkdir()
    write_zip(tmp_path / "ldraw" / "complete.zip", FILES, "ldraw/")
    assert there(find_library()).path.name == "complete.zip"


def test_the_cache_folder_can_be_named(cache):
    assert cache_folder() == cache
