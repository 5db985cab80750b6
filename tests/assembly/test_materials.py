"""A part of another plastic: mass, stiffness, and what is said about it."""

from __future__ import annotations

import numpy as np
import pytest

import technic
from technic.assembly.builder import Linkage
from technic.assembly.materials import apply_materials, known_material, material_in, parse_materials
from technic.assembly.model import Assembly, FindingKind
from technic.assembly.overrides import apply_overrides
from technic.errors import InputError, SchemaError, UsageError
from technic.parts.definition import FrameBody, Material
from technic.parts.materials import material
from technic.system.assemble import assemble, element_of
from tests.conftest import REPO

DEMO = REPO / "technic" / "data" / "rolling_chassis.mpd"


@pytest.fixture(scope="module")
def demo() -> Assembly:
    return technic.load(DEMO)


def rigidity(assembly: Assembly) -> float:
    found = technic.analyze(assembly, modes=1).rigidity
    assert found is not None
    return found.value


def made_of(assembly: Assembly, *texts: str) -> Assembly:
    return apply_materials(assembly, parse_materials(assembly, texts))


def test_whole_model_of_what_it_is_made_of_changes_nothing(demo: Assembly) -> None:
    assert rigidity(made_of(demo, "ABS")) == pytest.approx(rigidity(demo), rel=1e-9)


@pytest.mark.parametrize("parts", ["solid", "frame"])
def test_equal_poisson_ratio_scales_stiffness_and_mass_exactly(
    demo: Assembly, parts: technic.rigidity.analyze.PartModel
) -> None:
    """Parts twice as stiff and three times as heavy on joints twice as stiff: lambda doubles."""
    from dataclasses import replace

    abs_ = material()
    strong = Material("own", 2 * abs_.young_pa, abs_.poisson, 3 * abs_.density)
    stiff = apply_materials(demo, dict.fromkeys(range(len(demo.parts)), strong))
    joints = tuple(replace(j, stiffness=2.0 * j.stiffness) for j in demo.joints)
    stiff = replace(stiff, joints=joints)
    before = technic.analyze(demo, modes=1, parts=parts)
    after = technic.analyze(stiff, modes=1, parts=parts)
    assert before.rigidity is not None
    assert after.rigidity is not None
    assert after.mass == pytest.approx(3.0 * before.mass)
    assert after.rigidity.value == pytest.approx(2.0 * before.rigidity.value, rel=1e-6)


def test_all_parts_of_a_number_or_one_by_its_id(demo: Assembly) -> None:
    number = sum(p.number == "41239" for p in demo.parts)
    chosen = parse_materials(demo, ["41239=PC"])
    assert len(chosen) == number
    one = parse_materials(demo, [f"{demo.parts[0].id}=pc"])
    assert list(one) == [0]
    both = parse_materials(demo, ["41239=PC", "POM"])
    assert {both[k].name for k in chosen} == {"PC"}
    assert len(both) == len(demo.parts)
    after = made_of(demo, "41239=PC")
    share = material("PC").density / material("ABS").density
    for k in chosen:
        old, new = demo.parts[k].mass_properties, after.parts[k].mass_properties
        assert new.mass == pytest.approx(share * old.mass)
        np.testing.assert_allclose(new.inertia, share * old.inertia)
        assert material_in(after.parts[k]) == material("PC")
        body = after.parts[k].body
        assert isinstance(body, FrameBody)
        assert body.material == material("PC")
    assert rigidity(after) > rigidity(demo)


def test_equal_parts_go_on_sharing_their_matrices(demo: Assembly) -> None:
    before = {id(e) for e in assemble(demo, element=element_of).elements}
    after = {id(e) for e in assemble(made_of(demo, "PC"), element=element_of).elements}
    assert len(after) == len(before)


def test_another_poisson_ratio_is_said_with_its_size(demo: Assembly) -> None:
    said = [f for f in made_of(demo, "41239=POM").findings if f.kind is FindingKind.MATERIAL]
    assert len(said) == 1
    assert "2.2 % off" in said[0].message  # 1.38 / 1.35
    own = {"young_gpa": 3.0, "poisson": 0.35, "density": 1100}
    plain = apply_materials(demo, {0: known_material(own)})
    assert "off" not in next(f for f in plain.findings if f.kind is FindingKind.MATERIAL).message


@pytest.mark.parametrize(
    "value",
    [
        "FOO",
        "",
        7,
        None,
        {"young_gpa": 2.0},
        {"young_gpa": -2.0, "poisson": 0.3, "density": 1000},
        {"young_gpa": 2.0, "poisson": 0.5, "density": 1000},
        {"young_gpa": "2", "poisson": 0.3, "density": 1000},
        {"young_gpa": True, "poisson": 0.3, "density": 1000},
    ],
)
def test_unknown_material_is_bad_input(value: object) -> None:
    with pytest.raises(InputError) as caught:
        known_material(value)
    assert caught.value.exit_code == 3


def test_unknown_names_are_told(demo: Assembly) -> None:
    with pytest.raises(InputError, match="known: ABS, PA, PC, POM, SEBS"):
        parse_materials(demo, ["Ironn"])
    with pytest.raises(UsageError, match="no part is called"):
        parse_materials(demo, ["99999=PC"])


def test_corrections_file(demo: Assembly) -> None:
    rows = [{"material": "PC"}, {"part": "41239", "material": "POM"}]
    content = {"schema": "technic-overrides/1", "material": rows}
    after = apply_overrides(demo, content)
    names = {p.number: p.material.name for p in after.parts if p.material is not None}
    assert names["41239"] == "POM"
    assert set(names.values()) == {"PC", "POM"}
    bad = {"schema": "technic-overrides/1", "material": [{"part": "41239", "material": "Ironn"}]}
    with pytest.raises(SchemaError, match=r"material\[1\].material: no material"):
        apply_overrides(demo, bad)


def test_shapes_of_an_assembly_file() -> None:
    linkage = Linkage(dimension=2)
    linkage.bar("a", (0, 0), (0.1, 0))
    linkage.bar("b", (0.1, 0), (0.1, 0.1))
    linkage.rigid("c", (0, 0), (0, 0.1))
    linkage.hinge("a", "b", at=(0.1, 0))
    pair = linkage.assembly()
    after = made_of(pair, "a=PC")
    assert after.parts[0].mass_properties.mass > pair.parts[0].mass_properties.mass
    with pytest.raises(InputError, match="rigid shape"):
        made_of(pair, "c=PC")


def test_report_says_what_parts_are_made_of_and_how_that_is_known(demo: Assembly) -> None:
    rows = technic.analyze(made_of(demo, "41239=PC"), modes=1).to_dict()["model"]["materials"]
    assert {row["name"] for row in rows} == {"ABS", "PC"}
    assert sum(row["parts"] for row in rows) == len(demo.parts)
    assert all(row["source"] and row["young_gpa"] > 0 for row in rows)
