"""Shapes are closed, and their volumes are those of the LDraw surfaces."""

from __future__ import annotations

import functools
import json
import re
from collections import Counter
from importlib.resources import files
from pathlib import Path
from typing import Any

import numpy as np
import pytest
import trimesh
from scipy.sparse import coo_array
from scipy.sparse.csgraph import connected_components

from technic.errors import SchemaError, UsageError
from technic.fem.solid.inside import fill_fractions
from technic.fem.solid.store import ASSEMBLIES, MOST_PORTS, material_of, solid_ports, stored
from technic.ldraw.library import Library
from technic.ldraw.triangles import surface_of
from technic.parts.catalogue import catalogue
from technic.parts.definition import PartDefinition
from technic.parts.shapes import has_shape, is_approximate, mesh
from technic.parts.shapes.kernel import area_radius, axle_outline, circle_points
from technic.units import LDU

HERE = Path(__file__).parent
MEASURED = json.loads((HERE / "ldraw_volumes.json").read_text(encoding="utf-8"))
"""Volume (mm3) that the LDraw surface of a part encloses."""

MASSES = json.loads(files("parts_library").joinpath("mass.json").read_text(encoding="utf-8"))

EXACT = re.compile(r"^(beam|frame|pin|axle|bush|connector|cross-block|angle)")
"""Families whose volume must be right within 2 %; all others within 10 %."""

SAMPLE = ("32524", "32140", "2780", "3705", "6536", "32013", "64179", "3701")


@functools.cache
def listed_differences() -> dict[str, float]:
    """Differences in percent that docs/shape_differences.md lists, by part."""
    page = HERE.parents[1] / "docs" / "shape_differences.md"
    rows = re.findall(
        r"^\| (\S+) \|[^|]*\| ([+-]\d+\.\d) \|", page.read_text("utf-8"), re.MULTILINE
    )
    return {part: float(percent) for part, percent in rows}


def definition(part: str) -> PartDefinition:
    found = catalogue().get(part)
    assert found is not None, part
    return found


@pytest.mark.parametrize("part", catalogue().ids())
def test_every_definition_has_a_closed_shape_of_the_right_volume(part: str) -> None:
    shape = mesh(definition(part), "solid")
    assert shape.is_watertight
    assert shape.is_winding_consistent
    volume = shape.volume * 1e9
    assert volume > 0.0
    if part in MEASURED["volume_mm3"]:
        percent = 100.0 * (volume / MEASURED["volume_mm3"][part] - 1.0)
        expected = listed_differences().get(part)
        if expected is None:
            assert abs(percent) <= (2.0 if EXACT.search(definition(part).family) else 10.0)
        else:
            assert percent == pytest.approx(expected, abs=0.3)


def pieces(surface: Any) -> int:
    """Count the separate bodies of a closed surface (enclosed hollows are not bodies)."""
    sides = surface.face_adjacency
    graph = coo_array((np.ones(len(sides)), sides.T), (len(surface.faces),) * 2)
    _, label = connected_components(graph, directed=False)
    corners = surface.triangles - surface.centroid
    volumes = np.einsum("ij,ij->i", corners[:, 0], np.cross(corners[:, 1], corners[:, 2]))
    return int((np.bincount(label, weights=volumes) > 0.0).sum())


@pytest.mark.parametrize(
    "part", [p for p in catalogue().ids() if not is_approximate(definition(p))]
)
def test_a_part_is_one_body(part: str) -> None:
    """Bodies that only touch would float apart in a solid model; overlapping ones are one."""
    assert pieces(mesh(definition(part), "solid")) == 1


@pytest.mark.parametrize(
    "part", [p for p in catalogue().ids() if not is_approximate(definition(p))]
)
def test_mass_file_is_that_of_the_shapes(part: str) -> None:
    """Fails when a shape has changed since: run `scripts/build_mass`."""
    entry, solid = MASSES[part], mesh(definition(part), "solid").copy()
    solid.density = material_of(definition(part)).density
    assert entry["mass_kg"] == pytest.approx(solid.mass, rel=1e-4)
    assert entry["centroid_m"] == pytest.approx(solid.center_mass, abs=1e-7)
    scale = np.trace(solid.moment_inertia)
    assert np.allclose(entry["inertia_kg_m2"], solid.moment_inertia, rtol=0.0, atol=1e-4 * scale)


def test_two_bodies_and_a_hollow_one_are_told_apart() -> None:
    ball, far = trimesh.creation.icosphere(1, 1.0), trimesh.creation.icosphere(1, 1.0)
    far.apply_translation((3.0, 0.0, 0.0))
    assert pieces(trimesh.util.concatenate([ball, far])) == 2
    hollow = trimesh.creation.icosphere(1, 0.5)
    hollow.invert()
    assert pieces(trimesh.util.concatenate([ball, hollow])) == 1


def test_the_page_names_every_simplified_part_and_no_other() -> None:
    page = (HERE.parents[1] / "docs" / "shape_differences.md").read_text("utf-8")
    lists = re.findall(r"^- (?:Flat-faced|Bodies of|Gears).*: (.+)\.$", page, re.MULTILINE)
    assert len(lists) == 3
    named = sorted(part for line in lists for part in line.split(", "))
    assert named == sorted(p for p in catalogue().ids() if is_approximate(definition(p)))


def reason_without_solid_model(part: PartDefinition) -> str:
    """Return the first words of the row of docs/shape_differences.md that explains it."""
    frames = len(solid_ports(part))
    if part.fastener:
        return "fastener"
    if part.family.startswith(ASSEMBLIES):
        return "inner motion"
    if frames < 2:
        return "one frame" if frames else "no frame"
    if frames > MOST_PORTS:
        return "more than"
    return "simplified form" if is_approximate(part) else "the frame"


def test_the_page_says_why_parts_have_no_solid_model() -> None:
    page = (HERE.parents[1] / "docs" / "shape_differences.md").read_text("utf-8")
    missing = [part for part in catalogue().ids() if part not in stored()]
    reasons = Counter(reason_without_solid_model(definition(part)) for part in missing)
    for reason, count in reasons.items():
        assert re.search(rf"^\| {reason}[^|]*\| {count} \|$", page, re.MULTILINE), (reason, count)
    assert f"has {len(stored())} of {len(catalogue().ids())} parts" in page


def test_only_parts_out_of_tolerance_are_listed_as_such() -> None:
    for part in listed_differences():
        percent = 100.0 * (
            mesh(definition(part), "solid").volume * 1e9 / MEASURED["volume_mm3"][part] - 1.0
        )
        assert abs(percent) > 2.0


@pytest.mark.parametrize("part", ["32524", "2780", "3705", "6536", "3701", "3648b"])
def test_drawn_shape_is_closed_and_light(part: str) -> None:
    drawn, solid = mesh(definition(part)), mesh(definition(part), "solid")
    assert drawn.is_watertight
    assert len(drawn.faces) < len(solid.faces)
    assert drawn.volume == pytest.approx(solid.volume, rel=0.03)
    assert np.allclose(drawn.bounds, solid.bounds, atol=0.3 * LDU)


def test_liftarm_has_pockets_counterbores_and_bores() -> None:
    """Material is where LDraw's 32524 has it: web, rims, walls; and is missing in the pockets."""
    shape = mesh(definition("32524"), "solid")
    inside = {
        "web between holes": (0, 0, 10),
        "side wall": (7.5, 6, 10),
        "rim around a hole": (7, 5, 0),
    }
    outside = {
        "pocket": (0, 4, 10),
        "pocket on the other face": (0, -4, 10),
        "bore": (0, 0, 0),
        "counterbore": (7, 9, 0),
        "beyond the face": (8.5, 10.5, 10),
    }
    points = np.array([*inside.values(), *outside.values()], dtype=float) * LDU
    assert winding(shape.triangles, points).tolist() == [1] * len(inside) + [0] * len(outside)


def winding(triangles: np.ndarray, points: np.ndarray) -> np.ndarray:
    """How often a closed surface goes around each point (sum of solid angles, van Oosterom 1983)."""
    arms = triangles[None] - points[:, None, None]
    a, b, c = arms[:, :, 0], arms[:, :, 1], arms[:, :, 2]
    la, lb, lc = (np.linalg.norm(v, axis=-1) for v in (a, b, c))
    volume = np.einsum("pti,pti->pt", a, np.cross(b, c))
    ab, bc, ca = ((u * v).sum(-1) for u, v in ((a, b), (b, c), (c, a)))
    angle = 2.0 * np.arctan2(volume, la * lb * lc + ab * lc + bc * la + ca * lb)
    return np.asarray(np.rint(angle.sum(axis=1) / (4.0 * np.pi)), dtype=int)


def test_bounds_of_a_liftarm_are_its_nominal_ones() -> None:
    assert np.allclose(
        mesh(definition("32316"), "solid").bounds / LDU, [[-9, -10, -49], [9, 10, 49]], atol=1e-6
    )


def test_polygons_have_the_area_of_the_circle() -> None:
    x, y = circle_points(3.0, 20).T
    area = 0.5 * abs(np.dot(x, np.roll(y, -1)) - np.dot(y, np.roll(x, -1)))
    assert area == pytest.approx(np.pi * 9.0)
    assert area_radius(48) == pytest.approx(1.0, abs=2e-3)


def test_axle_section_agrees_with_the_design_value() -> None:
    """13.6 mm2 for arms of 1.8 mm by 4.8 mm; LDraw's arms are 1.6 mm thick."""
    x, y = axle_outline().T
    area = 0.5 * abs(np.dot(x, np.roll(y, -1)) - np.dot(y, np.roll(x, -1))) * (LDU * 1e3) ** 2
    assert area == pytest.approx(4.8 * 1.6 * 2 - 1.6**2, rel=0.06)


def test_meshes_are_kept() -> None:
    assert mesh(definition("32524")) is mesh(definition("32524"))


def test_unknown_detail_and_missing_shape_are_told() -> None:
    part = definition("32524")
    with pytest.raises(UsageError, match="draw, solid"):
        mesh(part, "rough")
    nameless = PartDefinition("none", "None", "none", (), part.body, part.mass_properties)
    assert not has_shape(nameless)
    with pytest.raises(SchemaError, match="has no shape"):
        mesh(nameless)


@functools.cache
def _library(path: Path) -> Library:
    return Library.open(path)


@pytest.mark.slow
@pytest.mark.parametrize("part", SAMPLE)
def test_measured_volumes_can_be_measured_again(part: str, ldraw_library: Path) -> None:
    surface = surface_of(_library(ldraw_library), part)
    assert surface is not None
    triangles = np.asarray(surface.triangles)
    size = 0.5 * LDU
    low = triangles.min(axis=(0, 1)) - 3 * size
    shape = np.ceil((triangles.max(axis=(0, 1)) + 3 * size - low) / size).astype(int)
    filling = fill_fractions(triangles, low, size, (int(shape[0]), int(shape[1]), int(shape[2])))
    volume = filling.fraction.sum() * (size * 1e3) ** 3
    assert volume == pytest.approx(MEASURED["volume_mm3"][part], rel=0.03)
