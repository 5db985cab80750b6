"""The file of condensed parts: round trip, lazy reading, out-of-date entries, the shipped matrices."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from technic.errors import InputError
from technic.fem.solid import MeshSettings, SuperElement, store
from technic.fem.solid.superelement import rigid_motions
from technic.parts.catalogue import catalogue
from technic.parts.definition import PartDefinition
from technic.units import MM

COARSE = MeshSettings(cell=1.6e-3)


def definition(number: str) -> PartDefinition:
    found = catalogue().get(number)
    assert found is not None
    return found


@pytest.fixture(scope="module")
def built() -> dict[str, SuperElement]:
    told: list[tuple[str, str | None]] = []
    elements, failures = store.build(
        [definition("43857"), definition("60483"), definition("3023b")],
        COARSE,
        jobs=2,
        progress=lambda part, reason: told.append((part, reason)),
    )
    assert sorted(part for part, _ in told) == sorted([*elements, *failures])
    assert list(elements) == ["43857", "60483"]
    return elements


def same(a: SuperElement, b: SuperElement) -> bool:
    return (
        (a.stiffness == b.stiffness).all()
        and (a.mass == b.mass).all()
        and (a.points == b.points).all()
        and (a.id, a.ports, a.merged, a.key) == (b.id, b.ports, b.merged, b.key)
    )


def test_round_trip_is_exact_and_deterministic(
    built: dict[str, SuperElement], tmp_path: Path
) -> None:
    store.write(tmp_path / "a.zip", built, shapes={"43857": "s"})
    store.write(tmp_path / "b.zip", dict(reversed(built.items())), shapes={"43857": "s"})
    assert (tmp_path / "a.zip").read_bytes() == (tmp_path / "b.zip").read_bytes()
    for part, element in built.items():
        again = store.read(tmp_path / "a.zip", part)
        assert again is not None
        assert same(element, again)
    assert store.read(tmp_path / "a.zip", "nothing") is None


def test_a_file_that_is_no_store_is_refused(tmp_path: Path) -> None:
    (tmp_path / "x.zip").write_bytes(b"not a zip")
    with pytest.raises(InputError, match="super-elements"):
        store.read(tmp_path / "x.zip", "32523")


def test_the_key_follows_ports_material_and_settings() -> None:
    beam = definition("32523")
    made_of = store.material_of(beam)
    key = store.element_key(beam, made_of, MeshSettings())
    assert key == store.element_key(beam, made_of, MeshSettings())
    assert key != store.element_key(beam, replace(made_of, young_pa=3e9), MeshSettings())
    assert key != store.element_key(beam, made_of, COARSE)
    assert key != store.element_key(replace(beam, ports=beam.ports[:-1]), made_of, MeshSettings())
    moved = replace(beam.ports[0], position=beam.ports[0].position + 0.1 * MM)
    other = replace(beam, ports=(moved, *beam.ports[1:]))
    assert key != store.element_key(other, made_of, MeshSettings())


def test_an_out_of_date_entry_is_not_used(
    built: dict[str, SuperElement], tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    store.write(tmp_path / store.FILE, built)
    monkeypatch.setattr(store, "files", lambda _package: tmp_path)
    store._archive.cache_clear()
    store._stored_element.cache_clear()
    try:
        assert store.stored() == ("43857", "60483")
        assert store.load(definition("43857"), COARSE) is not None
        assert store.load(definition("43857"), MeshSettings()) is None
        assert store.load(definition("32524"), COARSE) is None
    finally:
        store._archive.cache_clear()
        store._stored_element.cache_clear()


# --- what is shipped ---------------------------------------------------------------------------

SHIPPED = store.stored()


@pytest.mark.parametrize("part", SHIPPED)
def test_every_shipped_part_is_sound(part: str) -> None:
    element = store.load(definition(part))
    assert element is not None, "out of date: rebuild the part"
    rigid = rigid_motions(element.points, element.centroid)
    values = np.linalg.eigvalsh(element.stiffness)
    if len(element.ports) > 1:
        assert np.abs(element.stiffness @ rigid).max() < 1e-12 * np.abs(element.stiffness).max()
        assert np.abs(values[:6]).max() < 1e-6 * values[6]
    assert np.linalg.eigvalsh(element.mass)[0] > 0.0
    total = rigid.T @ element.mass @ rigid
    assert total[0, 3:] == pytest.approx(np.zeros(3), abs=1e-6 * total[0, 0])


@pytest.mark.slow
@pytest.mark.parametrize("part", SHIPPED)
def test_mass_and_centroid_of_every_shipped_part(part: str) -> None:
    from technic.parts.shapes import mesh

    element = store.load(definition(part))
    assert element is not None
    surface = mesh(definition(part), "solid")
    mass = (rigid_motions(element.points, element.centroid).T @ element.mass)[0, ::6].sum()
    density = store.material_of(definition(part)).density
    assert mass == pytest.approx(density * surface.volume, rel=0.01)
    assert element.centroid == pytest.approx(surface.center_mass, abs=0.05 * MM)


@pytest.mark.slow
@pytest.mark.parametrize("part", [p for p in ("32523", "60483", "32140") if p in SHIPPED])
def test_a_sample_rebuilt_is_what_is_shipped(part: str) -> None:
    fresh, failures = store.build([definition(part)], MeshSettings())
    assert not failures
    shipped = store.load(definition(part))
    assert shipped is not None
    scale = np.abs(shipped.stiffness).max()
    assert fresh[part].stiffness == pytest.approx(shipped.stiffness, abs=1e-6 * scale)
    assert fresh[part].mass == pytest.approx(shipped.mass, abs=1e-6 * np.abs(shipped.mass).max())


@pytest.mark.parametrize("part", SHIPPED)
def test_every_shipped_part_is_built_from_the_shape_that_is_drawn(part: str) -> None:
    """Fails when a shape has changed since: rebuild with `technic parts build ID`."""
    assert store.stored_shape(part) == store.shape_key(definition(part))


def test_shape_key_sees_what_a_part_looks_like(monkeypatch: pytest.MonkeyPatch) -> None:
    from technic.parts import shapes

    drawn = shapes.mesh(definition("32523"), "solid")
    key = store.shape_key(definition("32523"))
    for change, same in ((0.05 * MM, False), (0.0005 * MM, True)):
        moved = drawn.copy()
        moved.vertices[0] += change
        monkeypatch.setattr(shapes, "mesh", lambda *_, moved=moved: moved)
        assert (store.shape_key(definition("32523")) == key) == same


def test_out_of_date_when_anything_it_is_made_from_changes() -> None:
    part = definition("32523")
    material, settings = store.material_of(part), MeshSettings()
    key = store.element_key(part, material, settings)
    hole = replace(part.ports[0], position=part.ports[0].position + 1e-4)
    for other in (
        store.element_key(replace(part, ports=(hole, *part.ports[1:])), material, settings),
        store.element_key(part, replace(material, young_pa=2.3e9), settings),
        store.element_key(part, replace(material, density=1060.0), settings),
        store.element_key(part, material, replace(settings, cell=0.9e-3)),
        store.element_key(part, material, replace(settings, divisions=5)),
        store.element_key(replace(part, id="32523b"), material, settings),
    ):
        assert other != key
    assert store.element_key(replace(part, title="Beam"), material, settings) == key
