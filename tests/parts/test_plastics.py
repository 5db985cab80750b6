"""What parts are made of, and that their masses follow."""

from __future__ import annotations

import json
from importlib.resources import files

import pytest

from technic.parts.catalogue import catalogue
from technic.parts.definition import FrameBody
from technic.parts.materials import material, material_of, materials


def test_every_material_has_a_source_and_sound_constants() -> None:
    assert {"ABS", "POM", "PC"} <= set(materials())
    for made_of in materials().values():
        assert made_of.source
        assert 0.0 < made_of.young_pa < 1e10
        assert 0.0 < made_of.poisson < 0.5
        assert 800.0 < made_of.density < 1500.0


@pytest.mark.parametrize("number", ["3704", "32062", "3705", "3706", "3708", "87083", "32209"])
def test_axles_are_of_pom(number: str) -> None:
    part = catalogue().get(number)
    assert part is not None
    assert material_of(part) == material("POM")
    assert isinstance(part.body, FrameBody)
    assert part.body.material == material("POM")


def test_masses_that_shapes_give_are_volume_times_density() -> None:
    text = files("parts_library").joinpath("mass.json").read_text(encoding="utf-8")
    rows = {part: row for part, row in json.loads(text).items() if row["source"] == "shape"}
    assert len(rows) > 50
    for number, row in rows.items():
        part = catalogue().get(number)
        assert part is not None
        expected = row["volume_m3"] * material_of(part).density
        assert row["mass_kg"] == pytest.approx(expected, rel=1e-3), number


def test_beams_are_of_abs() -> None:
    part = catalogue().get("32524")
    assert part is not None
    assert material_of(part) == material("ABS")
