"""Teeth of turntables, rings, differentials, racks and worms; the table of teeth against the drawings."""

from __future__ import annotations

import re

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from technic.assembly.model import Part
from technic.errors import SchemaError
from technic.geometry import Pose
from technic.ldraw.gears import find_meshes
from technic.ldraw.imported import definition_from_library
from technic.ldraw.library import Library
from technic.ldraw.teeth import gears_of
from technic.ldraw.triangles import surface_of
from technic.parts.catalogue import catalogue
from technic.parts.definition import MassProperties, PartDefinition, RigidBody
from technic.parts.teeth import parse_teeth, teeth_table
from technic.units import LDU
from tests.ldraw.bricks import rotation, turn

LIBRARY = "ldraw-technic-2026-02.zip"


def bare(number: str, pose: Pose) -> Part:
    """A part of the table of teeth: of the catalogue, or one with its teeth and nothing else."""
    definition = catalogue().get(number)
    if definition is None or definition.id != number:
        mass = MassProperties(1e-3, np.zeros(3), 1e-8 * np.eye(3))
        definition = PartDefinition(number, number, "test", (), RigidBody(), mass)
    return Part(
        f"{number}@{pose.translation}",
        number,
        definition.title,
        pose,
        definition.ports,
        definition.body,
        definition.mass_properties,
        definition=definition,
    )


def put(number: str, at=(0, 0, 0), *, axis: str = "z", to: str = "z") -> Part:
    """The part with its coordinate axis `axis` turned to `to`, at a place in LDU."""
    return bare(number, Pose(turn(axis, to), np.array(at, dtype=float) * LDU))


def kinds(*parts: Part) -> list[str]:
    return [mesh.kind for mesh in find_meshes(parts)]


G8, G16, G24 = "10928", "94925", "3648b"
DOUBLE12, DOUBLE20 = "32270", "32269"


@pytest.mark.parametrize(
    ("ring", "y", "gear", "distance", "kind"),
    [
        ("2855", 9.5, G8, 80, "spur"),
        ("48168", -21, G8, 80, "spur"),
        ("48168", -21, G24, 100, "spur"),
        ("18938", 1, DOUBLE12, 90, "spur"),
        ("18938", 1, DOUBLE20, 100, "spur"),
        ("99010", 3, DOUBLE12, 50, "spur"),
        ("99010", 3, DOUBLE20, 60, "spur"),
        ("2856", 10, G8, 20, "ring"),
        ("48452", -20, G8, 20, "ring"),
        ("48452", -20, G16, 10, "ring"),
    ],
)
def test_gears_mesh_with_turntables(ring, y, gear, distance, kind):
    table = put(ring)
    assert kinds(table, put(gear, (distance, y, 0), axis="z", to="y")) == [kind]
    assert kinds(table, put(gear, (0, y, -distance), axis="z", to="y")) == [kind]
    assert kinds(table, put(gear, (distance + 2, y, 0), axis="z", to="y")) == []
    assert kinds(table, put(gear, (distance, y + 40, 0), axis="z", to="y")) == []


def test_the_two_halves_of_a_turntable_do_not_mesh():
    for first, second in (("2855", "2856"), ("48168", "48452"), ("99009", "99010")):
        assert kinds(put(first), put(second)) == []


def test_a_bevel_turns_the_side_of_a_turntable():
    """A double bevel of 12 teeth on a shaft across: 35 + 5 from the axis, 15 from the circle."""
    table = put("99010")
    assert kinds(table, put(DOUBLE12, (40, 20, 0), axis="z", to="x")) == ["bevel"]
    assert kinds(table, put(DOUBLE12, (40, -20, 0), axis="z", to="x")) == []  # no teeth there


@pytest.mark.parametrize(("ring", "radius"), [("24121", 175), ("78442", 75)])
def test_a_quarter_of_a_ring_has_teeth_in_its_quarter(ring, radius):
    distance = radius - 10
    side = distance * np.sqrt(0.5)
    quarter = put(ring)
    assert kinds(quarter, put(G8, (-side, 0, side), axis="z", to="y")) == ["ring"]
    assert kinds(quarter, put(G8, (side, 0, side), axis="z", to="y")) == []
    assert kinds(quarter, put(G8, (-side, 0, -side), axis="z", to="y")) == []


def test_a_differential_has_two_rings():
    casing = put("6573")
    assert kinds(casing, put(G8, (30, 0, -30))) == ["spur"]  # 16 + 8 teeth
    assert kinds(casing, put(G8, (40, 0, 30))) == ["spur"]  # 24 + 8
    assert kinds(casing, put(G8, (40, 0, -30))) == []
    assert kinds(casing, put(G8, (40, 0, 0))) == []


def test_a_bevel_turns_a_differential():
    """The ring looks along -z, so a shaft of 20 teeth crosses in the middle of the casing."""
    assert kinds(put("62821"), put(DOUBLE20, (40, 0, 0), axis="z", to="x")) == ["bevel"]
    assert kinds(put("62821"), put(DOUBLE20, (40, 0, 50), axis="z", to="x")) == []


def test_planets_mesh_with_the_suns_and_not_with_each_other():
    """Four bevels of 12 teeth around the middle of a differential, as they stand in 65414c01."""
    suns = [
        bare("6589", Pose(turn("z", "z"), np.array([0, 0, -17.0]) * LDU)),
        bare("6589", Pose(rotation([1, 0, 0], 180), np.array([0, 0, 17.0]) * LDU)),
    ]
    planets = [
        bare("6589", Pose(rotation([0, 1, 0], -90), np.array([17.0, 0, 0]) * LDU)),
        bare("6589", Pose(rotation([0, 1, 0], 90), np.array([-17.0, 0, 0]) * LDU)),
    ]
    for parts in ((*suns, *planets), (*planets, *suns)):
        meshes = find_meshes(parts)
        assert sorted(mesh.parts for mesh in meshes) == [(0, 2), (0, 3), (1, 2), (1, 3)]
        assert {mesh.kind for mesh in meshes} == {"bevel"}
    turned = bare("6589", Pose(rotation([0, 1, 0], 90), np.array([17.0, 0, 0]) * LDU))
    assert kinds(suns[0], turned) == []  # its teeth look away


@pytest.mark.parametrize(
    ("rack", "gear", "height"),
    [
        ("3743", G8, -14),
        ("3743", "3649", -54),
        ("64781", G8, -20),
        ("64781", G24, -40),
        ("87761", DOUBLE12, -22.5),
    ],
)
def test_a_gear_rolls_on_a_rack(rack, gear, height):
    (mesh,) = find_meshes([put(rack), put(gear, (10, height, 0))])
    assert mesh.kind == "rack"
    lever = np.linalg.norm(np.cross(mesh.point - np.array([10, height, 0]) * LDU, [0, 0, 1]))
    teeth = gears_of(put(gear), 0)[0].teeth.teeth
    assert lever == pytest.approx(teeth * 0.5e-3)
    assert kinds(put(rack), put(gear, (10, -height, 0))) == []  # at its back
    assert kinds(put(rack), put(gear, (10, height - 5, 0))) == []
    assert kinds(put(rack), put(gear, (10, height, 0), axis="z", to="x")) == []


def test_a_narrow_and_a_wide_worm():
    assert kinds(put("4716"), put(G8, (20, 0, 0), axis="z", to="y")) == ["worm"]
    assert kinds(put("27938"), put(DOUBLE12, (30, 0, 0), axis="z", to="y")) == ["worm"]
    assert kinds(put("27938"), put(G8, (20, 0, 0), axis="z", to="y")) == []


def test_a_crown_turns_a_gear_on_a_crossing_shaft():
    crown = put("3650b")
    assert kinds(crown, put(G8, (30, 0, -17), axis="z", to="x")) == ["bevel"]
    assert kinds(crown, put(G8, (30, 0, 17), axis="z", to="x")) == []
    assert kinds(crown, put(G8, (0, 0, -17), axis="z", to="x")) == []


# --- the row of a mesh is what rolling leaves free ------------------------------------------------
PAIRS = {
    "spur": (G8, (0, 0, 0), "z", G24, (24, 32, 0), "z"),
    "ring": ("48452", (0, 20, 0), "z", G8, (12, 0, 16), "y"),
    "bevel": (DOUBLE12, (0, 0, 0), "z", DOUBLE20, (-20, 0, 30), "x"),
    "rack": ("3743", (0, 0, 0), "z", G8, (5, -14, 0), "z"),
    "worm": ("4716", (0, 0, 0), "z", G24, (40, 0, 5), "y"),
}
unit = st.floats(-1.0, 1.0, allow_nan=False).map(lambda x: round(x, 6))
vector = st.tuples(unit, unit, unit).map(np.array)


def speeds(mesh, omegas, velocities, centers) -> float:
    """How fast the teeth of a mesh move through each other."""
    first, second = (
        (v + np.cross(w, mesh.point - c)) @ mesh.direction
        for w, v, c in zip(omegas, velocities, centers, strict=True)
    )
    return float(first - second)


@given(
    kind=st.sampled_from(sorted(PAIRS)),
    carrier=st.tuples(vector, vector),
    turned=st.floats(-2.0, 2.0),
    axis=vector.filter(lambda v: np.linalg.norm(v) > 0.1),
    angle=st.floats(-180.0, 180.0),
)
def test_rolling_teeth_do_not_move_through_each_other(kind, carrier, turned, axis, angle):
    """Whatever carries the gears, and however they lie in space: rolling in the ratio of the teeth is
    free, and turning one gear alone is not (but for the worm, whose own turning is free).
    """
    number, at, to, other, place, other_to = PAIRS[kind]
    world = Pose(rotation(axis, angle), np.array([0.1, -0.2, 0.05]))
    parts = []
    for n, where, direction in ((number, at, to), (other, place, other_to)):
        local = put(n, where, axis="z", to=direction)
        parts.append(bare(n, world @ local.pose))
    (mesh,) = find_meshes(parts)
    assert mesh.kind == kind
    one, two = (gear.teeth for gear in mesh.gears)
    swirl, drift = carrier
    centers = (one.center, two.center)

    def carried(center):
        return drift + np.cross(swirl, center)

    # Rolling: the touching points have one speed u along the teeth's direction.
    roll = []
    for teeth in (one, two):
        if teeth.kind == "rack":
            roll.append((np.zeros(3), turned * teeth.axis))
        elif teeth.kind == "worm":
            roll.append((turned * teeth.axis, np.zeros(3)))
        else:
            arm = mesh.point - teeth.center
            gain = float(np.cross(teeth.axis, arm) @ mesh.direction)
            u = 0.0 if kind == "worm" else turned
            roll.append((u / gain * teeth.axis, np.zeros(3)))
    free = speeds(
        mesh,
        [swirl + w for w, _ in roll],
        [carried(c) + v for c, (_, v) in zip(centers, roll, strict=True)],
        centers,
    )
    assert abs(free) < 1e-9 * (1.0 + abs(turned))
    # speeds of rolling are in the ratio of the teeth
    if one.teeth and two.teeth:
        rates = [np.linalg.norm(w) for w, _ in roll]
        assert rates[0] * one.teeth == pytest.approx(rates[1] * two.teeth)
    gear = two if two.teeth else one
    alone = [np.zeros(3), np.zeros(3)]
    alone[(one, two).index(gear)] = gear.axis
    slip = speeds(mesh, alone, [np.zeros(3)] * 2, centers)
    assert abs(slip) == pytest.approx(gear.teeth * 0.5e-3, rel=0.15)


# --- the table against the library ------------------------------------------------------------------
def profile(triangles: np.ndarray, teeth, bins: int = 1440) -> np.ndarray:
    """Where a surface is furthest out (of inner teeth: furthest in) by angle, in LDU."""
    low, high = teeth.half * 0.3, teeth.half * 0.3
    corners = triangles / LDU
    steps = np.linspace(0.0, 1.0, 25)
    u, v = (grid.ravel() for grid in np.meshgrid(steps, steps))
    keep = u + v <= 1.0
    u, v = u[keep], v[keep]
    points = (
        corners[:, 0, None]
        + u[:, None] * (corners[:, 1] - corners[:, 0])[:, None]
        + v[:, None] * (corners[:, 2] - corners[:, 0])[:, None]
    ).reshape(-1, 3)
    from_center = points - teeth.center / LDU
    along = from_center @ teeth.axis
    near = (along > -low / LDU) & (along < high / LDU)
    across = from_center[near] - along[near, None] * teeth.axis
    radius = np.linalg.norm(across, axis=1)
    helper = np.eye(3)[int(np.argmin(np.abs(teeth.axis)))]
    x = np.cross(teeth.axis, helper)
    y = np.cross(teeth.axis, x)
    place = ((np.arctan2(across @ y, across @ x) / (2 * np.pi) % 1.0) * bins).astype(int) % bins
    out = np.full(bins, np.nan)
    for p in range(bins):
        here = radius[place == p]
        if len(here):
            out[p] = here.min() if teeth.inner else here.max()
    known = np.flatnonzero(np.isfinite(out))
    return np.interp(np.arange(bins), known, out[known], period=bins)


@pytest.mark.slow
def test_the_library_draws_the_teeth_that_are_said(shared):
    """Every gear of the library by its title, and every ring of the table: as many teeth around the
    axis as said, and tips half a module to almost two beyond the rolling circle.
    """
    library = Library.open(shared / "ldraw" / LIBRARY)
    looked, wrong = 0, []
    for number in library.part_numbers():
        title = library.file(found.key).title if (found := library.resolve(number)) else ""
        if "moved to" in title.lower():
            continue
        if number not in teeth_table() and not re.match(r"[~=_| ]*technic gear", title.lower()):
            continue
        definition = definition_from_library(library, number)
        assert definition is not None
        part = bare(number, Pose.identity())
        part = Part(
            number,
            number,
            definition.title,
            Pose.identity(),
            definition.ports,
            definition.body,
            definition.mass_properties,
            definition=definition,
        )
        for gear in gears_of(part, 0):
            teeth = gear.teeth
            if not teeth.teeth or teeth.kind in ("crown", "knob") or teeth.sector is not None:
                continue
            surface = surface_of(library, number, fine=False)
            assert surface is not None
            found_profile = profile(surface.triangles, teeth)
            waves = np.abs(np.fft.rfft(found_profile - found_profile.mean()))
            count = int(np.argmax(waves[: 2 * teeth.teeth]))
            radius = teeth.radius / LDU
            tip = radius - found_profile.min() if teeth.inner else found_profile.max() - radius
            looked += 1
            if count != teeth.teeth or not 0.5 <= tip <= 4.5:
                wrong.append((number, title, count, tip))
    assert not wrong
    assert looked > 40


@pytest.mark.parametrize(
    "row",
    [
        {"ring": [{"kind": "spur"}]},
        {"ring": [{"kind": "star", "count": 8, "center": [0, 0, 0], "axis": [0, 0, 1], "half": 5}]},
        {"ring": [{"kind": "spur", "count": 8, "center": [0, 0], "axis": [0, 0, 1], "half": 5}]},
        {"ring": [{"kind": "spur", "count": 8, "center": [0, 0, 0], "axis": [0, 0, 0], "half": 5}]},
        {"rack": [{"center": [0, 0, 0], "along": [1, 0, 0], "out": [0, 1, 0], "half": 0}]},
        {"worm": [{"center": [0, 0, 0], "axis": [1, 0, 0], "half": 5, "radius": -1}]},
    ],
)
def test_faults_of_the_table_are_said(row):
    with pytest.raises(SchemaError, match="part 1"):
        parse_teeth({"part": [{"ids": ["1"], **row}]})
    with pytest.raises(SchemaError, match="given twice"):
        parse_teeth({"part": [{"ids": ["1"]}, {"ids": ["1"]}]})
