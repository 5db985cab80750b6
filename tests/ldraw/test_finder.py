"""Parts that the catalogue does not have: from the library, from the model itself, or refused."""

from __future__ import annotations

from time import perf_counter

import pytest

from technic.errors import InputError, UsageError
from technic.ldraw.document import read
from technic.ldraw.finder import EmbeddedStore, PartFinder
from technic.ldraw.library import Library
from technic.ldraw.reader import load_ldraw, lookup
from tests.ldraw.small_library import files_with, line, part, there, write_folder

BEAM = "1 4 0 0 0 1 0 0 0 1 0 0 0 1 32316.dat\n"
PIN = "1 0 0 -10 40 0 1 0 1 0 0 0 0 1 2780.dat\n"
OWN = "1 4 0 -20 40 1 0 0 0 1 0 0 0 1 xbeam.dat\n"
HOLE = line("connhole.dat")
"""One bore along y, 20 deep."""


@pytest.fixture
def library(tmp_path):
    def make(**parts: str) -> Library:
        files = {f"parts/{name}.dat": text for name, text in parts.items()}
        return Library.open(write_folder(tmp_path / "library", files_with(files)))

    return make


@pytest.fixture
def model(tmp_path):
    def write(*lines: str):
        path = tmp_path / "model.mpd"
        path.write_text("".join(lines), encoding="utf-8")
        return path

    return write


def test_a_part_of_the_library_is_joined_like_any_other(library, model):
    place = library(xbeam=part(HOLE, title="Odd Beam"))
    assembly = load_ldraw(model(BEAM, PIN, OWN), library=place)
    assert not assembly.unknown
    assert [part.number for part in assembly.parts] == ["32316", "2780", "xbeam"]
    assert {joint.connection for joint in assembly.joints} == {"pin/pin_hole"}
    assert len(assembly.joints) == 2
    imported = assembly.imported
    assert imported is not None
    assert (imported.catalogue, imported.release) == (2, "2026-02")
    assert imported.library == str(place.path)
    (made,) = imported.from_library
    assert (made.number, made.title, made.count) == ("xbeam", "Odd Beam", 1)


def test_the_library_is_opened_only_for_a_part_that_needs_it(library, model):
    calls = []

    def opener():
        calls.append(1)
        return library(xbeam=part(HOLE))

    known = load_ldraw(model(BEAM, PIN), library=opener)
    assert not calls
    assert known.imported is not None
    assert not known.imported.library
    load_ldraw(model(BEAM, PIN, OWN, OWN), library=opener)
    assert calls == [1]


@pytest.mark.parametrize(
    ("text", "reason"),
    [
        (part("1 16 0 0 0 1 0 0 0 1 0 connhole.dat\n"), "14 tokens"),
        (part("1 16 0 0 nan 1 0 0 0 1 0 0 0 1 connhole.dat\n"), "not finite"),
        (part(line("xbeam.dat")), "includes itself"),
        (part(line("../../secret.dat")), "points out of the parts library"),
        (part(line("/etc/passwd")), "points out of the parts library"),
        (part("3 16 0 0 0 1 0 0 a b c\n"), "needs 9 numbers"),
        (part("4 16 " + "1 " * 12 + "\n") * 300_000, "triangles"),
    ],
)
def test_a_broken_part_is_listed_and_the_rest_is_read(library, model, text, reason):
    assembly = load_ldraw(model(BEAM, PIN, OWN), library=library(xbeam=text))
    assert len(assembly.parts) == 2
    (unknown,) = assembly.unknown
    assert unknown.number == "xbeam"
    assert reason in unknown.reason


def test_stubs_that_go_in_a_circle_are_listed(library, model):
    place = library(
        xbeam=part(line("other.dat"), title="~Moved to other"),
        other=part(line("xbeam.dat"), title="~Moved to xbeam"),
    )
    (unknown,) = load_ldraw(model(BEAM, PIN, OWN), library=place).unknown
    assert "circle" in unknown.reason


def test_a_part_that_the_model_draws_is_read_with_the_primitives_of_the_library(library, model):
    text = (
        "0 FILE main.ldr\n" + BEAM + PIN + OWN,
        "0 FILE xbeam.dat\n0 Own Beam\n0 !LDRAW_ORG Unofficial_Part\n" + line("s\\half.dat"),
        "0 FILE s\\half.dat\n0 ~Half\n0 !LDRAW_ORG Unofficial_Subpart\n" + HOLE,
    )
    path = model(*text)
    assert len(EmbeddedStore(read(path))) == 2
    assert [u.number for u in load_ldraw(path).unknown] == ["xbeam"]
    place = library(xbeam=part(title="Another of that name, without bores"))
    assembly = load_ldraw(path, library=place)
    assert not assembly.unknown
    assert len(assembly.joints) == 2
    assert assembly.imported is not None
    assert assembly.imported.library == str(place.path)


def test_a_sticker_drawn_in_the_model_is_left_out_with_its_reason(library, model):
    path = model(
        "0 FILE main.ldr\n" + BEAM + PIN + OWN,
        "0 FILE xbeam.dat\n0 Sticker\n0 !LDRAW_ORG Unofficial_Part\n4 16 0 0 0 1 0 0 1 0 1 0 0 1\n",
    )
    (unknown,) = load_ldraw(path, library=library()).unknown
    assert "without anything to connect it with" in unknown.reason


def test_an_embedded_name_that_leaves_the_library_is_no_file_of_it(model):
    path = model(
        "0 FILE main.ldr\n" + BEAM,
        "0 FILE ../../xbeam.dat\n0 Bad\n0 !LDRAW_ORG Unofficial_Part\n",
    )
    assert len(EmbeddedStore(read(path))) == 0


def test_nothing_known_says_what_would_help(library, model):
    with pytest.raises(InputError, match="Give an LDraw parts library"):
        load_ldraw(model(OWN))
    with pytest.raises(InputError, match="does not have them either"):
        load_ldraw(model(OWN), library=library())


def test_the_shadow_library_needs_a_library():
    with pytest.raises(UsageError, match="adds to an LDraw library"):
        PartFinder(None, shadow=lambda: None)
    assert lookup()("32316") is not None


def test_submodels_are_not_looked_for_in_the_library():
    def opener():
        raise AssertionError("not needed")

    assert PartFinder(opener)("arm.ldr") is None


def test_files_that_double_at_every_level_take_no_time(library, model):
    chain = {f"level{k}": part(line(f"level{k + 1}.dat") * 2) for k in range(50)}
    start = perf_counter()
    empty = library(xbeam=part(line("level0.dat")), level50=part(), **chain)
    (unknown,) = load_ldraw(model(BEAM, PIN, OWN), library=empty).unknown
    assert "no surface" in unknown.reason
    assert perf_counter() - start < 5.0


def test_surfaces_that_double_at_every_level_are_refused(library, model):
    chain = {f"level{k}": part(line(f"level{k + 1}.dat") * 2) for k in range(50)}
    full = library(xbeam=part(line("level0.dat")), level50=part(HOLE), **chain)
    (unknown,) = load_ldraw(model(BEAM, PIN, OWN), library=full).unknown
    assert "more than" in unknown.reason


# --- solid models of library parts ------------------------------------------------------------
@pytest.mark.parametrize(("solids", "cell"), [("draft", 1.6e-3), ("fine", 0.8e-3), ("off", 0.0)])
def test_how_finely_library_parts_are_to_be_meshed(library, model, solids, cell):
    place = library(xbeam=part(HOLE))
    assembly = load_ldraw(model(BEAM, OWN), library=place, solids=solids)
    known, drawn = (there(p.definition) for p in assembly.parts)
    assert known.drawing is None
    drawing = there(drawn.drawing)
    assert drawing.cell == pytest.approx(cell)
    assert drawing.triangles().shape[1:] == (3, 3)


def test_parts_that_move_inside_are_never_meshed(library):
    from technic.ldraw.imported import definition_from_library
    from technic.parts.inner import inner_parts

    number = next(iter(inner_parts()))
    made = there(definition_from_library(library(**{number: part(HOLE)}), number))
    assert there(made.drawing).cell == 0.0


def test_an_unknown_setting_is_refused(model):
    with pytest.raises(UsageError, match="solids is"):
        load_ldraw(model(BEAM), solids="coarse")
