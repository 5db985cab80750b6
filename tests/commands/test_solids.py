"""Before an analysis the solid models of library parts are made, and shown to who watches."""

from __future__ import annotations

import pytest

from technic.commands import progress as bars
from technic.commands.solids import make_solids
from technic.ldraw.library import Library
from technic.ldraw.reader import load_ldraw
from technic.system import drawn_solids
from tests.ldraw.small_library import files_with, line, part, write_folder


@pytest.fixture
def assembly(tmp_path, monkeypatch):
    """A beam and two kinds of library part, one of which has connectors to be meshed between."""
    monkeypatch.setenv("TECHNIC_CACHE", str(tmp_path / "cache"))
    drawn_solids._memory.clear()
    box = (
        "4 16 -12 -10 -8 -12 -10 28 12 -10 28 12 -10 -8\r\n4 16 -12 10 -8 12 10 -8 12 10 28 -12 10 28\r\n"
        "4 16 -12 -10 -8 12 -10 -8 12 10 -8 -12 10 -8\r\n4 16 -12 -10 28 -12 10 28 12 10 28 12 -10 28\r\n"
        "4 16 -12 -10 -8 -12 10 -8 -12 10 28 -12 -10 28\r\n4 16 12 -10 -8 12 -10 28 12 10 28 12 10 -8\r\n"
    )
    two = part(box, line("connhole.dat"), line("connhole.dat", (0, 0, 20)))
    library = Library.open(
        write_folder(
            tmp_path / "library",
            files_with({"parts/two.dat": two, "parts/one.dat": part(box, line("connhole.dat"))}),
        )
    )
    path = tmp_path / "m.ldr"
    path.write_text("0 m\n" + line("32316.dat") + line("two.dat", (0, 0, 99)) + line("one.dat"))
    return load_ldraw(path, library=library)


@pytest.fixture
def told(monkeypatch):
    """What the bar is told; None when there is no bar."""
    from contextlib import contextmanager

    calls: list[tuple[str, int, int]] = []

    @contextmanager
    def bar():
        yield lambda *now: calls.append(now)

    monkeypatch.setattr(bars, "progress_bar", bar)
    return calls


def test_the_bar_goes_from_nothing_to_all_and_then_stays_away(assembly, told):
    make_solids(assembly, "solid", quiet=False)
    assert told == [("library parts", 0, 1), ("library parts", 1, 1)]
    make_solids(assembly, "solid", quiet=False)
    assert len(told) == 2


def test_nothing_is_shown_or_made_unless_wanted(assembly, told):
    make_solids(assembly, "frame", quiet=False)
    assert not drawn_solids._memory
    make_solids(assembly, "solid", quiet=True)
    assert len(drawn_solids._memory) == 1
    assert not told


@pytest.mark.slow
def test_library_parts_of_a_model_are_solids_or_say_why(
    model, ldraw_library, tmp_path, capsys, monkeypatch
):
    """The rover has 36 parts that only a library knows: bricks, hinges, clips, a figure."""
    import json
    import sys
    from contextlib import suppress

    from technic.cli import main

    def analyze(*more: str) -> tuple[dict, str]:
        target = tmp_path / "report.json"
        words = ["analyze", str(model("omr_31066_rover.mpd")), "--json", str(target), *more]
        monkeypatch.setattr(sys, "argv", ["technic", *words])
        with suppress(SystemExit):
            main()
        return json.loads(target.read_text())["model"], " ".join(capsys.readouterr().out.split())

    said, text = analyze("--library", str(ldraw_library))
    found = said["import"]
    assert found["from_library"] > 30
    assert found["solid_models"] > 15
    assert found["solid_models"] + found["rigid_by_choice"] == found["from_library"]
    assert sum(kind["count"] for kind in found["rigid_parts"]) == found["rigid_by_choice"]
    assert all(kind["reason"] for kind in found["rigid_parts"])
    assert f"{found['solid_models']} parts from the library are meshed from the drawing" in text
    assert f"{found['rigid_by_choice']} parts from the library are taken as rigid" in text
    off, text = analyze("--library", str(ldraw_library), "--library-solids", "off")
    assert off["import"]["solid_models"] == 0
    assert off["import"]["rigid_by_choice"] == found["from_library"]
    assert "meshing is turned off" in text
    without, text = analyze("--no-library")
    assert without["import"]["from_library"] == 0
    assert "With an LDraw parts library their connectors, mass and stiffness would be read" in text
