"""Solid models of parts that a library draws: what is meshed, what is refused, and the cache."""

from __future__ import annotations

import os
import subprocess
import sys
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from technic.assembly.model import Assembly, Part
from technic.errors import InputError, UsageError
from technic.fem.solid.store import load
from technic.fem.solid.superelement import SuperElement, elastic_eigenvalues
from technic.geometry import Pose
from technic.parts.catalogue import catalogue
from technic.parts.definition import (
    LIBRARY_FAMILY,
    Drawing,
    MassProperties,
    PartDefinition,
    Port,
    PortKind,
    RigidBody,
)
from technic.system import drawn_solids, solid_cache
from technic.system.drawn_solids import frame_ports, outcome_of, prepare, solid_model
from technic.system.library_models import library_models
from technic.system.part_models import solid_element_of
from technic.system.solid_cache import Refusal, recall, remember, shrink, solids_folder
from technic.units import LDU, MM
from tests.conftest import REPO

SIZE = np.array([24.0, 8.0, 8.0]) * MM


@pytest.fixture(autouse=True)
def cache(tmp_path, monkeypatch) -> Path:
    """A cache folder of its own, and nothing remembered from other tests."""
    monkeypatch.setenv("TECHNIC_CACHE", str(tmp_path / "cache"))
    forget()
    return tmp_path / "cache"


def forget() -> None:
    """As in a new run of the program."""
    drawn_solids._memory.clear()
    drawn_solids._request.cache_clear()


def block(low=(0.0, 0.0, 0.0), size=SIZE) -> np.ndarray:
    """Triangles of a solid block."""
    corners = (
        np.array(low) + np.array([[i, j, k] for i in (0, 1) for j in (0, 1) for k in (0, 1)]) * size
    )
    quads = [(0, 1, 3, 2), (4, 6, 7, 5), (0, 4, 5, 1), (2, 3, 7, 6), (0, 2, 6, 4), (1, 5, 7, 3)]
    return corners[[t for a, b, c, d in quads for t in ((a, b, c), (a, c, d))]]


def stud(name: str, x: float, kind: PortKind = PortKind.STUD, z: float = 4.0) -> Port:
    """A stud sunk into the block: its surface lies in the material."""
    return Port(name, kind, np.array([x, 4.0, z]) * MM, np.array([0.0, -1.0, 0.0]), 4 * LDU)


def part(
    triangles=None,
    ports=None,
    *,
    cell: float = 1.6 * MM,
    number: str = "x1",
    fastener: bool = False,
) -> PartDefinition:
    drawn = block() if triangles is None else triangles
    return PartDefinition(
        id=number,
        title="Block",
        family=LIBRARY_FAMILY,
        ports=(stud("a", 4.0), stud("b", 20.0)) if ports is None else tuple(ports),
        body=RigidBody(),
        mass_properties=MassProperties(1.7e-3, SIZE / 2, 1e-8 * np.eye(3)),
        fastener=fastener,
        drawing=Drawing(lambda: drawn, cell),
    )


def placed(definition: PartDefinition, number: int = 0) -> Part:
    return Part(
        id=f"main/{number}:{definition.id}",
        number=definition.id,
        name=definition.title,
        pose=Pose.identity(),
        ports=definition.ports,
        body=definition.body,
        mass_properties=definition.mass_properties,
        fastener=definition.fastener,
        definition=definition,
    )


def reason(definition: PartDefinition) -> str:
    made = outcome_of(definition)
    assert isinstance(made, Refusal)
    assert solid_model(definition) is None
    return made.reason


# --- what is meshed ---------------------------------------------------------------------------
def test_a_drawn_block_gets_a_solid_model_of_its_mass():
    made = outcome_of(part())
    assert isinstance(made, SuperElement)
    assert made.ports == ("a", "b")
    np.testing.assert_allclose(made.centroid, SIZE / 2, atol=0.05 * MM)
    assert elastic_eigenvalues(made.stiffness, made.mass, 3).min() > 0.0
    element = solid_element_of(placed(part()), np.array([[4.0, 4, 4], [20, 4, 4]]) * MM, ("a", "b"))
    moved = element.rigid[:, 0] @ element.mass @ element.rigid[:, 0]
    assert moved == pytest.approx(1.7e-3)
    np.testing.assert_allclose(element.stiffness @ element.rigid, 0.0, atol=1e-3)


@pytest.mark.parametrize("number", ["32316", "3701"])
def test_draft_models_of_drawings_are_near_the_shipped_ones(ldraw_library, number):
    """From the LDraw surface with cells of 1.6 mm: too stiff by a third at most, never softer."""
    from technic.ldraw.imported import definition_from_library
    from technic.ldraw.library import Library

    drawn = definition_from_library(Library.open(ldraw_library), number)
    known = catalogue().get(number)
    assert drawn is not None
    assert known is not None
    shipped = load(known)
    assert shipped is not None
    ports = tuple(port for port in known.ports if port.name in shipped.ports)
    made = outcome_of(replace(drawn, id="copy", ports=ports))
    assert isinstance(made, SuperElement)
    assert made.ports == shipped.ports
    modes = elastic_eigenvalues(made.stiffness, made.mass, 3)
    ratio = modes / elastic_eigenvalues(shipped.stiffness, shipped.mass, 3)
    assert ratio.min() > 0.97
    assert ratio.max() < 1.35


def test_ports_without_material_take_the_nearest_frame():
    beside = stud("far", 60.0)
    made = outcome_of(part(ports=(stud("a", 4.0), stud("b", 20.0), beside)))
    assert isinstance(made, SuperElement)
    assert made.ports == ("a", "b")


def test_many_studs_are_thinned_and_holes_are_kept():
    studs = [stud(f"s{i}", 8.0 * (i % 8), z=8.0 * (i // 8)) for i in range(48)]
    holes = [stud(f"h{i}", 3.0 + i, PortKind.PIN_HOLE) for i in range(3)]
    stop = stud("end", 0.0, PortKind.STOP)
    chosen = frame_ports(part(ports=(*studs, *holes, stop)))
    assert len(chosen) == drawn_solids.MOST_FRAMES
    names = {port.name for port in chosen}
    assert {"h0", "h1", "h2"} <= names
    assert "end" not in names
    # spread: the far corners are among them
    assert {"s7", "s40", "s47"} <= names


# --- what is refused --------------------------------------------------------------------------
def test_refusals_say_why():
    assert reason(part(fastener=True)).startswith("a pin or small connector")
    assert reason(part(ports=(stud("a", 4.0),))) == "fewer than two connections to bend between"
    holes = [stud(f"h{i}", 0.1 * i, PortKind.PIN_HOLE) for i in range(65)]
    assert "65 connections" in reason(part(ports=holes))
    assert "material at 1 of its 2" in reason(part(ports=(stud("a", 4.0), stud("b", 90.0))))
    apart = np.concatenate([block(), block(low=(0, 0, 0.1))])
    assert "separate pieces" in reason(part(apart))
    sheet = block()[:2]
    assert "encloses no material" in reason(part(sheet))
    assert "too large" in reason(part(block(size=40 * SIZE)))


def test_a_drawing_with_a_million_triangles_is_refused_at_once():
    many = np.broadcast_to(block()[:1], (1_000_000, 3, 3))
    assert "1000000 triangles" in reason(part(many))


def test_broken_files_are_a_reason_not_an_end():
    def broken() -> np.ndarray:
        raise InputError("a type 3 line needs 9 numbers", path="x.dat", line=7)

    definition = replace(part(), drawing=Drawing(broken, 1.6 * MM))
    assert reason(definition) == "a type 3 line needs 9 numbers"


def test_frames_that_depend_on_each_other_are_refused(monkeypatch):
    from technic.fem.solid import condense

    monkeypatch.setattr(condense, "DEPENDENT", 1.0)  # in real parts the frames never are
    assert "depend on each other" in reason(part())


def test_the_models_of_library_parts_are_counted_with_reasons():
    blocks = [placed(part(), k) for k in range(3)]
    lone = part(ports=(stud("a", 4.0),), number="x2")
    assembly = Assembly("m", (*blocks, placed(lone, 3), placed(lone, 4)))
    models = library_models(assembly, "solid")
    assert models.solid == 3
    assert models.cell == pytest.approx(1.6 * MM)
    (kind,) = models.rigid
    assert (kind.number, kind.count, kind.model) == ("x2", 2, "rigid")
    assert kind.reason == "fewer than two connections to bend between"
    frames = library_models(assembly, "frame")
    assert (frames.solid, frames.rigid_count) == (0, 5)


# --- the cache --------------------------------------------------------------------------------
def test_what_was_built_is_found_again(monkeypatch):
    first = outcome_of(part())
    assert isinstance(first, SuperElement)
    lone = part(ports=(stud("a", 4.0), stud("b", 90.0)), number="x3")
    refused = reason(lone)
    forget()
    monkeypatch.setattr(drawn_solids, "build_drawn", None)  # building again would fail
    again = outcome_of(part())
    assert isinstance(again, SuperElement)
    np.testing.assert_array_equal(again.stiffness, first.stiffness)
    np.testing.assert_array_equal(again.mass, first.mass)
    assert reason(lone) == refused


def test_every_input_is_in_the_key():
    def key(definition: PartDefinition) -> str:
        request = drawn_solids._request(definition)
        assert not isinstance(request, Refusal)
        return request.key

    moved = block()
    moved[0, 0, 0] += 1e-6
    base = key(part())
    assert key(part()) == base
    others = [
        part(moved),
        part(cell=0.8 * MM),
        part(number="x9"),
        part(ports=(stud("a", 4.0), stud("b", 19.0))),
        part(ports=(stud("a", 4.0), stud("c", 20.0))),
        replace(part(), shape={"material": "POM"}),
    ]
    assert len({base, *map(key, others)}) == 7


@pytest.mark.parametrize("damage", ["cut", "empty", "other", "text"])
def test_a_damaged_file_is_built_anew(cache, damage):
    first = outcome_of(part())
    assert isinstance(first, SuperElement)
    (file,) = (cache / "solids").glob("*.zip")
    data = file.read_bytes()
    if damage == "other":
        other = outcome_of(part(number="x9"))
        assert isinstance(other, SuperElement)
        solid_cache.write(file, {"x1": other})  # the key inside is another one
    else:
        file.write_bytes({"cut": data[: len(data) // 2], "empty": b"", "text": b"hello"}[damage])
    forget()
    again = outcome_of(part())
    assert isinstance(again, SuperElement)
    np.testing.assert_array_equal(again.stiffness, first.stiffness)
    forget()
    assert recall(first.key, "x1") is not None


def test_a_folder_that_cannot_be_written_costs_time_only(tmp_path, monkeypatch):
    blocked = tmp_path / "file"
    blocked.write_text("no folder")
    monkeypatch.setenv("TECHNIC_CACHE", str(blocked))
    assert isinstance(outcome_of(part()), SuperElement)
    assert blocked.read_text() == "no folder"


def test_what_was_not_used_for_longest_goes_first(cache, monkeypatch):
    folder = cache / "solids"
    monkeypatch.setenv("TECHNIC_CACHE_MB", "1000")
    for k in range(5):
        remember(f"{k}" * 32, "p", Refusal("no " + "x" * 900))
        path = folder / (f"{k}" * 32 + ".txt")
        os.utime(path, (1000.0 + k, 1000.0 + k))
    size = path.stat().st_size
    stranger = folder / "mine.odt"
    stranger.write_bytes(b"x" * 10_000)
    assert isinstance(recall("0" * 32, "p"), Refusal)  # used now
    shrink(folder, 4 * size)
    left = {path.name[0] for path in folder.glob("*.txt")}
    assert left == {"0", "3", "4"}  # below nine tenths of the limit
    assert stranger.exists()
    monkeypatch.setenv("TECHNIC_CACHE_MB", "0")
    remember("9" * 32, "p", Refusal("no"))
    assert not list(folder.glob("*.txt"))


@pytest.mark.parametrize("text", ["lots", "-1", "nan", "inf"])
def test_a_limit_that_is_no_size_is_refused(monkeypatch, text):
    monkeypatch.setenv("TECHNIC_CACHE_MB", text)
    with pytest.raises(UsageError, match="TECHNIC_CACHE_MB"):
        solid_cache.limit()


WORKER = """
import sys
sys.path[:0] = [{repo!r}]
import numpy as np
from tests.system.test_drawn_solids import part, stud
from technic.system.drawn_solids import outcome_of
for k in range(3):
    for n in range(4):
        made = outcome_of(part(ports=(stud("a", 4.0), stud("b", 16.0 + n)), number=f"x{{n}}"))
        print(made.stiffness.sum().hex())
    from technic.system import drawn_solids
    drawn_solids._memory.clear()
"""


@pytest.mark.slow
def test_two_programs_at_once_do_not_disturb_each_other():
    """Both build, write and read the same parts at the same time; both get the same numbers."""
    code = WORKER.format(repo=str(REPO))
    runs = [
        subprocess.Popen(
            [sys.executable, "-c", code], stdout=subprocess.PIPE, stderr=subprocess.PIPE
        )
        for _ in range(2)
    ]
    said = [run.communicate(timeout=300) for run in runs]
    assert [run.returncode for run in runs] == [0, 0], said
    assert said[0][0] == said[1][0]
    assert len(said[0][0].split()) == 12
    files = [path.name for path in solids_folder().iterdir()]
    assert len(files) == 4
    assert all(name.endswith(".zip") for name in files)  # no temporary file is left


@pytest.mark.slow
def test_parts_are_built_in_parallel_and_shown():
    parts = [
        placed(part(ports=(stud("a", 4.0), stud("b", 16.0 + n)), number=f"x{n}"), n)
        for n in range(3)
    ]
    lone = placed(part(ports=(stud("a", 4.0), stud("b", 90.0)), number="x9"), 9)
    assembly = Assembly("m", (*parts, *parts, lone))
    shown: list[tuple[int, int, str]] = []
    assert prepare(assembly, jobs=2, progress=lambda *now: shown.append(now)) == (4, 0)
    assert [now[:2] for now in shown] == [(k, 4) for k in range(5)]
    parallel = [outcome_of(p.definition) for p in assembly.parts if p.definition]
    forget()
    assert prepare(assembly, jobs=2) == (0, 4)
    for made, p in zip(parallel, assembly.parts, strict=True):
        assert p.definition is not None
        again = outcome_of(p.definition)
        if isinstance(made, SuperElement):
            assert isinstance(again, SuperElement)
            np.testing.assert_array_equal(made.stiffness, again.stiffness)
        else:
            assert again == made


def die(*_: object) -> None:
    """What a process does that the system kills for want of memory."""
    os._exit(9)


@pytest.mark.slow
def test_processes_that_are_killed_leave_rigid_bodies_and_no_trace(monkeypatch):
    parts = [
        placed(part(ports=(stud("a", 4.0), stud("b", 16.0 + n)), number=f"x{n}"), n)
        for n in range(6)
    ]
    assembly = Assembly("m", tuple(parts))
    real = drawn_solids.build_drawn
    monkeypatch.setattr(drawn_solids, "build_drawn", die)
    assert prepare(assembly, jobs=2) == (6, 0)
    models = library_models(assembly, "solid")
    assert models.rigid_count == 6
    assert all("for want of memory" in kind.reason for kind in models.rigid)
    forget()  # the next run tries again
    monkeypatch.setattr(drawn_solids, "build_drawn", real)
    assert library_models(assembly, "solid").solid == 6
