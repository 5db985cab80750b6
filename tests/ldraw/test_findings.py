"""What is said about the connections of a model, and why something is loose."""

from __future__ import annotations

import pytest

from technic.assembly.model import FindingKind
from technic.assembly.stiffness import default_table
from technic.ldraw.connect import connect
from technic.units import LDU
from tests.ldraw.bricks import Z, beam, define, pin, place, rotation, turn

UP = turn("x", "y")
"""Stands a pin upright, along y."""


def findings(parts, kind=None):
    found = connect(parts, default_table())[1]
    return [f for f in found if kind is None or f.kind is kind]


def pinned_pair():
    """Two beams on two pins: nothing to say about them."""
    return [
        place(beam(5), [0, 0, 0]),
        place(beam(5), [0, -20, 0]),
        place(pin(), [0, -10, 0], UP),
        place(pin(), [0, -10, 40], UP),
    ]


def test_a_sound_model_has_none():
    assert findings(pinned_pair()) == []


def test_off_grid_says_how_far():
    parts = pinned_pair()
    parts[3] = place(pin(), [2.24, -10, 40], UP)
    found = findings(parts)
    assert [f.kind for f in found] == [FindingKind.OFF_GRID] * 2
    assert found[0].distance == pytest.approx(2.24 * LDU)
    assert "placed off by 2.2 LDU" in found[0].message


@pytest.mark.parametrize(
    ("parts", "why"),
    [
        ([place(pin(), [6, -10, 40], UP)], "6.0 LDU (2.40 mm) beside it"),
        ([place(pin(), [0, -27.5, 40], UP)], "enters only 2.5 LDU"),
        ([place(pin(), [0, -10, 40], rotation(Z, 8) @ UP)], "turned by 8.0 degrees"),
    ],
)
def test_near_miss_says_by_how_much(parts, why):
    found = findings([place(beam(5), [0, 0, 0]), *parts], FindingKind.NEAR_MISS)
    assert len(found) == 1
    assert why in found[0].message
    assert found[0].parts == (1, 0)


def test_a_taken_hole_is_named():
    parts = [*pinned_pair(), place(pin(), [0, -10, 40], UP)]
    taken = [f for f in findings(parts, FindingKind.NEAR_MISS) if "already taken" in f.message]
    assert {f.parts for f in taken} == {(4, 0), (4, 1)}


def test_open_end_and_pin_in_one_part():
    parts = [*pinned_pair(), place(pin(), [0, 10, 20], UP)]
    found = findings(parts)
    assert [f.kind for f in found] == [FindingKind.OPEN_PORT, FindingKind.ONE_PART_PIN]
    assert found[0].parts == (4,)
    assert "nothing there" in found[0].message
    assert found[1].parts == (4, 0)


def test_a_part_on_a_single_pin():
    parts = [*pinned_pair(), place(beam(3), [0, -40, 20]), place(pin(), [0, -30, 20], UP)]
    (found,) = findings(parts)
    assert found.kind is FindingKind.SINGLE_PIN
    assert found.parts == (4, 5)


def test_holes_in_line_without_a_pin():
    parts = [*pinned_pair(), place(beam(3), [0, -40, 0])]
    no_pin, loose = findings(parts)
    assert no_pin.kind is FindingKind.NO_PIN
    assert no_pin.parts == (1, 4)
    # Its three holes lie over holes at -20, 0 and 20; a pin fills the one at 0.
    assert "2 holes line up" in no_pin.message
    assert loose.kind is FindingKind.LOOSE
    assert loose.parts == (4,)
    assert "no pin is placed" in loose.message


def test_holes_of_joined_parts_are_no_news():
    assert not findings(pinned_pair(), FindingKind.NO_PIN)


def test_loose_without_connectors():
    (found,) = findings([*pinned_pair(), place(define("s", "Sticker", []), [0, 0, 0])])
    assert found.kind is FindingKind.LOOSE
    assert "no known connector" in found.message


def test_loose_with_nothing_around():
    (found,) = findings([*pinned_pair(), place(beam(3), [900, 0, 0])])
    assert found.kind is FindingKind.LOOSE
    assert "nothing there" in found.message


def test_loose_with_a_hole_nearby_says_how_far():
    parts = [*pinned_pair(), place(pin(), [25, 10, 0], UP)]
    loose = findings(parts, FindingKind.LOOSE)
    assert loose[0].distance == pytest.approx(25 * LDU)
    assert "25.0 LDU" in loose[0].message


def test_a_loose_group_is_one_finding():
    away = [
        place(beam(5), [500, 0, 0]),
        place(pin(), [500, -10, 0], UP),
        place(beam(5), [500, -20, 0]),
    ]
    loose = findings([*pinned_pair(), *away], FindingKind.LOOSE)
    assert len(loose) == 1
    assert loose[0].parts == (4, 5, 6)
    assert "3 parts" in loose[0].message


def test_every_part_is_loose_when_nothing_is_joined():
    parts = [place(beam(3), [x, 0, 0]) for x in (0, 500, 1000)]
    assert [f.parts for f in findings(parts, FindingKind.LOOSE)] == [(0,), (1,), (2,)]


def test_a_single_part_is_no_finding():
    assert findings([place(beam(3), [0, 0, 0])]) == []


def test_findings_are_in_a_fixed_order():
    parts = [*pinned_pair(), place(pin(), [0, 10, 20], UP), place(beam(3), [900, 0, 0])]
    kinds = [f.kind for f in findings(parts)]
    order = list(FindingKind)
    assert kinds == sorted(kinds, key=order.index)
