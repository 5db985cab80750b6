"""What parts become: solid models by default, said where not."""

from __future__ import annotations

import numpy as np
import pytest

import technic
from technic.assembly.builder import Linkage
from technic.assembly.model import Assembly, Part
from technic.fem.solid.store import load
from technic.fem.solid.superelement import MASS_ERROR, elastic_eigenvalues
from technic.geometry import Pose
from technic.ldraw.reader import load_ldraw
from technic.parts.catalogue import catalogue
from technic.parts.definition import PartDefinition
from technic.rigidity.result import RigidityReport
from technic.system.assemble import assemble
from technic.system.part_models import FACTORIES, model_of, models_of, plain_parts
from tests.conftest import REPO

DEMO = REPO / "technic" / "data" / "rolling_chassis.mpd"


def definition(number: str) -> PartDefinition:
    found = catalogue().get(number)
    assert found is not None
    return found


def part(number: str) -> Part:
    kind = definition(number)
    return Part(
        id=number,
        number=number,
        name=kind.title,
        pose=Pose(np.eye(3), np.zeros(3)),
        ports=kind.ports,
        body=kind.body,
        mass_properties=kind.mass_properties,
        fastener=kind.fastener,
        definition=kind,
    )


def rigidity(report: RigidityReport) -> float:
    assert report.rigidity is not None
    return report.rigidity.value


def test_solid_is_the_default_everywhere() -> None:
    model = technic.load(DEMO)
    report = technic.analyze(model, modes=1)
    assert report.part_models["solid"] == 57
    assert report.unknowns == technic.assemble(model).size
    frame = technic.analyze(model, modes=1, parts="frame")
    assert rigidity(report) == pytest.approx(rigidity(frame), rel=0.3)
    assert rigidity(report) != rigidity(frame)


def test_what_has_no_solid_model_is_counted_and_named() -> None:
    report = technic.analyze(technic.load(DEMO), modes=1)
    said = report.to_dict()["model"]
    assert sum(said["part_models"].values()) == said["parts"]
    assert sum(row["count"] for row in said["plain_parts"]) == said["part_models"]["rigid"]
    assert {"part_number", "name", "count", "model", "reason"} == set(said["plain_parts"][0])
    assert technic.analyze(technic.load(DEMO), modes=1, parts="frame").plain_parts == ()


def test_part_joined_to_nothing_is_what_it_is_counted_as() -> None:
    """A free beam's own first mode: the solid model's, within the share that its few frames cost."""
    beam = part("32524")
    alone = Assembly("beam", (beam,))
    assert models_of(alone, "solid") == {"solid": 1}
    stored = load(definition("32524"))
    assert stored is not None
    element = FACTORIES["solid"](beam, np.zeros((0, 3)), ())
    assert element.size % 6 == 0
    assert element.size <= len(stored.stiffness)
    system = assemble(alone)
    assert system.mass == pytest.approx(beam.mass_properties.mass)
    # its rigid motions cost nothing and carry its mass
    assert np.abs(element.stiffness @ element.rigid).max() < 1e-6 * np.abs(element.stiffness).max()
    inertia = element.rigid.T @ element.mass @ element.rigid
    np.testing.assert_allclose(
        inertia[:3, :3], beam.mass_properties.mass * np.eye(3), rtol=1e-9, atol=1e-12
    )
    exact = elastic_eigenvalues(stored.stiffness, stored.mass, 1)[0] * beam.mass_properties.mass
    scale = beam.mass_properties.mass / float(stored.mass[::6, ::6].sum())
    report = technic.analyze(alone, modes=1)
    assert rigidity(report) == pytest.approx(exact / scale, rel=MASS_ERROR)


def test_without_a_solid_model_the_own_body_is_taken() -> None:
    pin, axle, brick = part("2780"), part("3706"), part("3001")
    assert [model_of(p, "solid") for p in (pin, axle)] == ["rigid", "frame"]
    assert load(definition("3001")) is None  # a brick with studs and tubes only
    told = plain_parts(Assembly("three", (pin, axle, brick)), "solid")
    assert {row.number for row in told} == {"2780", "3706", "3001"}
    assert all(row.reason for row in told)
    for each in (pin, axle, brick):
        own = FACTORIES["frame"](each, np.zeros((1, 3)), (None,))
        asked = FACTORIES["solid"](each, np.zeros((1, 3)), (None,))
        np.testing.assert_array_equal(own.stiffness, asked.stiffness)


def test_shapes_of_an_assembly_file_are_what_the_file_says() -> None:
    linkage = Linkage(dimension=2)
    linkage.bar("a", (0, 0), (0.1, 0))
    linkage.bar("b", (0.1, 0), (0.1, 0.1))
    linkage.hinge("a", "b", at=(0.1, 0))
    report = technic.analyze(linkage.assembly(), modes=1)
    assert report.part_models == {"frame": 2}
    assert report.plain_parts == ()


def test_stored_matrices_are_read_for_the_parts_of_the_model_only() -> None:
    from technic.fem.solid import store

    store._stored_element.cache_clear()
    technic.analyze(load_ldraw(DEMO), modes=1)
    kinds = {p.definition.id for p in load_ldraw(DEMO).parts if p.definition is not None}
    assert store._stored_element.cache_info().currsize <= len(kinds)
