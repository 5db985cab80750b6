"""The catalogue against the LDraw library, the reference list, and itself."""

from __future__ import annotations

import csv
import tomllib
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from technic.errors import SchemaError
from technic.geometry import Pose
from technic.ldraw.library import Library
from technic.ldraw.primitives import ports_from_primitives
from technic.parts.catalogue import Catalogue, catalogue
from technic.parts.definition import FrameBody, Port, PortKind
from technic.units import LDU
from tests.parts.port_runs import runs

HERE = Path(__file__).parent
PITCH = 20 * LDU

RULES = tomllib.loads((HERE / "accepted_differences.toml").read_text(encoding="utf-8"))
NOT_COMPARED = {PortKind(name) for name in RULES["not_compared"]}


def _accepted() -> dict[str, dict[str, Any]]:
    found: dict[str, dict[str, Any]] = {}
    for group in RULES["accepted"]:
        assert len(group["reason"]) > 20
        for part, sides in group["parts"].items():
            assert part not in found, f"{part} is accepted twice"
            found[part] = sides
    return found


ACCEPTED = _accepted()

NOT_COVERED = {
    "68488": "small SPIKE motor: its files came after the 2022-06 library and are not in the subset",
}
"""Parts of the reference list without a definition, and why."""


def _compared(ports: tuple[Port, ...]) -> set[str]:
    return set(runs(port for port in ports if port.kind not in NOT_COMPARED))


@pytest.fixture(scope="module")
def reference(shared: Path) -> list[dict[str, str]]:
    """The list of 259 Technic parts."""
    with (shared / "reference" / "technic_parts.csv").open(encoding="utf-8") as file:
        return list(csv.DictReader(file))


@pytest.fixture(scope="module")
def library(shared: Path) -> Library:
    """The LDraw library 2026-02, Technic subset."""
    return Library.open(shared / "ldraw" / "ldraw-technic-2026-02.zip")


# --- against LDraw ----------------------------------------------------------------------------
def test_ports_agree_with_the_primitives_of_every_part(library: Library) -> None:
    faults = []
    seen = 0
    for part in catalogue():
        drawn = ports_from_primitives(library, part.id)
        if drawn is None:
            continue
        seen += 1
        ours, theirs = _compared(part.ports), _compared(drawn)
        sides = ACCEPTED.get(part.id, {})
        if ours - theirs != set(sides.get("catalogue", ())):
            faults.append(f"{part.id}: only in the catalogue: {sorted(ours - theirs)}")
        if theirs - ours != set(sides.get("primitives", ())):
            faults.append(f"{part.id}: only in the primitives: {sorted(theirs - ours)}")
    assert not faults, "\n".join(faults)
    assert seen >= 240


def test_accepted_differences_name_parts_that_exist() -> None:
    assert set(ACCEPTED) <= set(catalogue().ids())


def test_aliases_lie_in_their_own_file_as_the_pose_says(library: Library) -> None:
    parts = catalogue()
    faults = []
    for number in parts.numbers():
        found = parts.resolve(number)
        assert found is not None
        part, pose = found
        drawn = ports_from_primitives(library, number)
        if number == part.id or drawn is None:
            continue
        placed = tuple(
            Port(
                port.name,
                port.kind,
                pose.points(port.position),
                pose.directions(port.axis),
                port.length,
                port.friction,
            )
            for port in part.ports
        )
        difference = _compared(placed) ^ _compared(drawn)
        sides = ACCEPTED.get(part.id, {})
        allowed = {*sides.get("catalogue", ()), *sides.get("primitives", ())}
        if not difference <= allowed:
            faults.append(f"{number} -> {part.id}: {sorted(difference - allowed)}")
    assert not faults, "\n".join(faults)


def test_parts_beyond_the_library_name_their_source(library: Library) -> None:
    for part in catalogue():
        if library.resolve(part.id) is None:
            assert "LDraw parts library 2026-02" not in part.source, part.id


# --- against the reference list ---------------------------------------------------------------
def test_every_part_of_the_reference_list_resolves(reference: list[dict[str, str]]) -> None:
    parts = catalogue()
    missing = {row["ldraw_id"] for row in reference if parts.get(row["ldraw_id"]) is None}
    assert missing == set(NOT_COVERED)


def test_aliases_of_the_reference_list_lead_to_the_same_part(
    reference: list[dict[str, str]],
) -> None:
    parts = catalogue()
    faults = []
    for row in reference:
        part = parts.get(row["ldraw_id"])
        for alias in f"{row['aliases']} {row['moved_from']}".split():
            if parts.get(alias) is not part:
                faults.append(f"{alias} of {row['ldraw_id']}")
    assert not faults


def test_straight_beams_have_the_length_of_the_reference_list(
    reference: list[dict[str, str]],
) -> None:
    for row in reference:
        part = catalogue().get(row["ldraw_id"])
        if row["family"] != "beam-thick" or part is None:
            continue
        assert len(part.ports) == int(row["length_L"]), part.id


# --- numbers ----------------------------------------------------------------------------------
@pytest.mark.parametrize(
    ("number", "part"),
    [
        ("61332", "2780"),
        ("4459.dat", "2780"),
        ("42924", "6558"),
        ("65304", "32054"),
        ("6590", "3713"),
        ("32123", "32123a"),
        ("4265B.DAT", "6577"),
        ("3649p01", "3649"),
        ("32556", "32556a"),
        ("8002 - 33299a.dat", "33299a"),
    ],
)
def test_variants_and_moved_numbers_resolve(number: str, part: str) -> None:
    found = catalogue().resolve(number)
    assert found is not None
    assert found[0].id == part
    assert np.allclose(found[1].rotation, np.eye(3))


def test_a_moved_number_with_a_turn_keeps_it() -> None:
    found = catalogue().resolve("32531")
    assert found is not None
    part, pose = found
    assert part.id == "32531a"
    # 6 studs along x in the new file, along z in the old one
    along = [pose.points(port.position) for port in part.ports if port.kind is PortKind.STUD]
    assert np.ptp(along, axis=0) == pytest.approx([60 * LDU, 0.0, 100 * LDU])


def test_unknown_numbers_give_none() -> None:
    parts = catalogue()
    assert parts.get("no-such-part") is None
    assert parts.resolve("0") is None
    assert parts.get("42020-1 - sticker rescue left.dat") is None
    assert "32524" in parts
    assert "999999" not in parts


def test_parts_that_look_alike_stay_apart() -> None:
    parts = catalogue()
    two_holes, axle_end = parts.get("43857"), parts.get("60483")
    assert two_holes is not None
    assert axle_end is not None
    assert {p.kind for p in two_holes.ports} == {PortKind.PIN_HOLE}
    assert {p.kind for p in axle_end.ports} == {PortKind.PIN_HOLE, PortKind.AXLE_HOLE}


# --- every definition -------------------------------------------------------------------------
def test_every_definition_builds_and_is_sound() -> None:
    for part in catalogue():
        assert part.title
        assert part.family
        assert part.source
        mass = part.mass_properties
        assert 1e-5 < mass.mass < 1.0, part.id
        moments = np.linalg.eigvalsh(mass.inertia)
        assert moments[0] > 0.0, part.id
        # a body's principal moments obey the triangle inequality
        assert moments[2] <= moments[0] + moments[1] + 1e-15, part.id
        for port in part.ports:
            assert np.linalg.norm(port.axis) == pytest.approx(1.0)
            longest = 32 * PITCH if port.kind is PortKind.AXLE else 1.7 * PITCH
            assert 0.0 < port.length <= longest, (part.id, port.name)


def test_frames_run_through_the_ports_of_beams_and_axles() -> None:
    frames = 0
    for part in catalogue():
        body = part.body
        if not isinstance(body, FrameBody):
            continue
        frames += 1
        start, end = body.points[body.members[:, 0]], body.points[body.members[:, 1]]
        for port in part.ports:
            if port.kind not in (PortKind.PIN_HOLE, PortKind.AXLE_HOLE, PortKind.AXLE):
                continue
            span = end - start
            share = np.einsum("ij,ij->i", port.position - start, span)
            share = np.clip(share / np.einsum("ij,ij->i", span, span), 0.0, 1.0)
            gap = np.linalg.norm(start + share[:, None] * span - port.position, axis=1).min()
            # 2825's second bore sits beside its thin arm, half an arm's thickness off
            assert gap <= 10.1 * LDU, (part.id, port.name)
    assert frames >= 55


def test_families_cover_the_mechanics_of_technic() -> None:
    families = {part.family.split("-")[0] for part in catalogue()}
    assert families >= {
        "angle", "axle", "ball", "beam", "brick", "bush", "connector", "cross", "differential",
        "frame", "gear", "hub", "linear", "link", "motor", "panel", "pin", "plate", "rack", "shock",
        "steering", "suspension", "turntable", "tyre", "universal", "wheel",
    }  # fmt: skip
    assert len(catalogue()) >= 160


def test_fasteners_are_pins_axles_bushes_and_joiners() -> None:
    for part in catalogue():
        if part.fastener:
            assert part.family.split("-")[0] in ("pin", "axle", "bush"), part.id
            lines = {tuple(np.round(np.abs(port.axis), 3)) for port in part.ports}
            across = part.family in (
                "pin-with-hole",
                "pin-perpendicular",
            )  # alone they turn in place
            assert len(lines) <= 1 + across, f"{part.id} joins across more than one line"


def test_stops_the_primitives_hide() -> None:
    def kinds(number: str) -> list[PortKind]:
        part = catalogue().get(number)
        assert part is not None
        return [port.kind for port in part.ports]

    assert kinds("4274") == [PortKind.PIN, PortKind.STUD]
    assert kinds("99008") == [PortKind.AXLE, PortKind.STOP]
    assert kinds("87083") == [PortKind.AXLE, PortKind.STOP]


# --- files ------------------------------------------------------------------------------------
def test_a_number_given_twice_is_refused() -> None:
    rows: dict[str, tuple[str, dict[str, Any]]] = {
        "1": ("part", {"id": "1", "aliases": ["2"]}),
        "2": ("part", {"id": "2"}),
    }
    with pytest.raises(SchemaError, match="2 is given by 1 and by 2"):
        Catalogue(rows, {})


@pytest.mark.parametrize(
    ("ports", "message"),
    [
        ("bore x 0 0 0", "bore"),
        ("pin w 0 0 0", "w"),
        ("pin x 0 0", "three coordinates"),
        ("pin x 0 0 0 30", "whole pitches"),
        ("pin x 0 0 0 20 *0 1 0 0", "repetition"),
    ],
)
def test_a_broken_port_names_part_and_phrase(ports: str, message: str) -> None:
    rows = {"1": ("part", {"id": "1", "title": "T", "family": "f", "ports": ports})}
    masses = {"1": {"mass_kg": 1.0, "centroid_m": [0, 0, 0], "inertia_kg_m2": np.eye(3)}}
    with pytest.raises(SchemaError, match=message) as caught:
        Catalogue(rows, masses).get("1")
    assert ports in str(caught.value)


def test_identity_pose_for_plain_numbers() -> None:
    found = catalogue().resolve("32524")
    assert found is not None
    assert isinstance(found[1], Pose)
    assert not found[1].translation.any()
