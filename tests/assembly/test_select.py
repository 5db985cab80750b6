"""What a person types to name a part or a port."""

from __future__ import annotations

import numpy as np
import pytest

from technic.assembly.model import Assembly, Part
from technic.assembly.select import find_part, find_place, parse_fix
from technic.errors import UsageError
from technic.geometry import Pose
from technic.parts.definition import MassProperties, Port, PortKind, RigidBody

UP = np.array([0.0, 1.0, 0.0])


def part(ident, number, name, x=0.0):
    ports = (
        Port("hole1", PortKind.PIN_HOLE, np.array([0.0, 0.0, 0.01]), UP, 0.008),
        Port("hole2", PortKind.PIN_HOLE, np.array([0.0, 0.0, 0.02]), UP, 0.008),
    )
    mass = MassProperties(1e-3, np.zeros(3), 1e-7 * np.eye(3))
    pose = Pose(np.eye(3), np.array([x, 0.0, 0.0]))
    return Part(ident, number, name, pose, ports, RigidBody(), mass)


@pytest.fixture
def assembly():
    return Assembly(
        "m",
        (
            part("main.ldr/2:32524", "32524", "Beam 7"),
            part("main.ldr/12:32524", "32524", "Beam 7", 0.1),
            part("main.ldr/arm.ldr/3:2780", "2780", "Pin with friction", 0.2),
        ),
    )


@pytest.mark.parametrize(
    ("text", "index"),
    [
        ("main.ldr/2:32524", 0),
        ("MAIN.LDR/2:32524", 0),
        ("2:32524", 0),
        ("12:32524", 1),
        ("arm.ldr/3:2780", 2),
        ("2780", 2),
    ],
)
def test_part_by_id_end_of_id_and_unique_number(assembly, text, index):
    assert find_part(assembly, text) == index


def test_ambiguous_number_lists_the_parts(assembly):
    with pytest.raises(UsageError, match=r"can mean 2 parts") as caught:
        find_part(assembly, "32524")
    assert "main.ldr/2:32524" in str(caught.value)
    assert "main.ldr/12:32524" in str(caught.value)


def test_end_of_an_id_counts_from_a_border_only(assembly):
    with pytest.raises(UsageError):
        find_part(assembly, ":32524")


def test_unknown_part_suggests_similar_ones(assembly):
    with pytest.raises(UsageError, match="did you mean") as caught:
        find_part(assembly, "2781")
    assert "2780" in str(caught.value)


def test_nothing_similar_lists_examples(assembly):
    with pytest.raises(UsageError, match="for example"):
        find_part(assembly, "@@@@")


@pytest.mark.parametrize("text", ["", "   "])
def test_empty_text_names_no_part(assembly, text):
    with pytest.raises(UsageError):
        find_part(assembly, text)


def test_port_after_the_last_colon(assembly):
    place = find_place(assembly, "12:32524:hole2")
    assert (place.part, place.port) == (1, "hole2")


def test_unknown_port_lists_the_ports(assembly):
    with pytest.raises(UsageError, match="hole1, hole2"):
        find_place(assembly, "2780:hole9")


def test_fix_a_part_holds_it_as_a_whole(assembly):
    support = parse_fix(assembly, "2780")
    assert support.part == 2
    assert support.point is None
    assert support.held.all()


def test_fix_a_port_holds_it_where_it_stands_in_the_world(assembly):
    support = parse_fix(assembly, "12:32524:HOLE2")
    assert support.point is not None
    np.testing.assert_allclose(support.point, np.array([0.1, 0.0, 0.02]))


def test_fix_with_an_ambiguous_part_and_a_port_says_which(assembly):
    with pytest.raises(UsageError, match="can mean 2 parts"):
        parse_fix(assembly, "32524:hole1")
