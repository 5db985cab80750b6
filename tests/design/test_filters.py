"""What the caller rules out is not suggested."""

from __future__ import annotations

import pytest

from technic.design.candidates import candidates
from technic.design.filters import Filters, allowed, carried_over, needs
from technic.design.reinforce import reinforce
from technic.design.suggest import suggest
from technic.errors import UsageError
from technic.report.suggest_text import cure_words
from technic.units import LDU
from tests.design.made import ALONG_Z, PIN_Y, SQUARE, build


@pytest.fixture(scope="module")
def square():
    return build(*SQUARE)


def test_between_two_parts(square):
    found = allowed(candidates(square), Filters(between=(0, 2)))
    assert found
    assert all({0, 2} <= set(c.parts) for c in found)


def test_inside_a_box(square):
    low, high = (-60.0, -60.0, -60.0), (60.0, -10.0, 60.0)
    box = (tuple(v * LDU for v in low), tuple(v * LDU for v in high))
    found = allowed(candidates(square), Filters(box=box))
    assert found
    assert all(a.point[1] < 0 for c in found for a in c.attachments)


def test_at_most_so_many_parts(square):
    found = allowed(candidates(square), Filters(max_parts=3))
    assert found
    assert all(sum(needs(c).values()) <= 3 for c in found)


def test_an_inventory_limits_beams_and_pins(square):
    answer = suggest(square, count=3, filters=Filters(inventory={"32526": 1, "2780": 3}))
    assert answer.suggestions
    for suggestion in answer.suggestions:
        assert suggestion.candidate.number == "32526"
        assert set(needs(suggestion.candidate)) <= {"32526", "2780"}
    nothing = suggest(square, filters=Filters(inventory={"32526": 1}))
    assert nothing.suggestions == ()
    assert nothing.places == 0


def test_a_longer_beam_stands_in_for_one_that_is_not_in_stock():
    pair = build(f"0 0 0 {ALONG_Z} 32316", f"80 0 0 {ALONG_Z} 32316")
    stock = frozenset({"32524"})
    assert {c.number for c in candidates(pair, stock=stock)} == {"32524"}


def test_an_inventory_is_used_up(square):
    stock = {"32526": 1, "2780": 9}
    answers = reinforce(square, steps=3, filters=Filters(inventory=stock))
    taken = [a.suggestions[0] for a in answers if a.suggestions]
    assert len(taken) == 1
    assert answers[-1].suggestions == ()


def test_filters_follow_the_parts_of_a_changed_model(square):
    answer = suggest(square, count=30, filters=Filters(lengths=(7,), bent=False))
    taken = next(s for s in answer.suggestions if s.change.removed)
    new = taken.report.assembly
    filters = Filters(between=(0, 1), keep_out=frozenset({7}), inventory={"32524": 1, "6558": 2})
    moved = carried_over(filters, square, new, taken.candidate, taken.change)
    assert moved.between == (0, 1)
    assert moved.inventory["32524"] == 0
    # the pins that were taken out are there to be used
    used = needs(taken.candidate)["2780"]
    assert moved.inventory["2780"] == len(taken.change.removed) - used
    kept = square.parts[7].id
    assert {new.parts[k].id for k in moved.keep_out} == {kept} - set(taken.change.removed)


def test_steps_stop_at_the_target(square):
    answers = reinforce(square, steps=5, target=1.0)
    assert len(answers) == 1
    assert answers[0].suggestions[0].report.verdict == "rigid"
    assert reinforce(answers[0].suggestions[0].report.assembly, steps=5, target=1.0) == []


def test_a_model_without_holes_says_that_there_is_no_place():
    lonely = build(f"0 0 0 {ALONG_Z} 32316")
    answer = suggest(lonely)
    assert (answer.suggestions, answer.places) == ((), 0)


def test_only_lego_models_get_suggestions(square):
    from dataclasses import replace

    with pytest.raises(UsageError, match="LDraw"):
        suggest(replace(square, source={"format": "assembly"}))


def test_separate_pieces_are_joined_first():
    pieces = build(
        f"0 0 0 {ALONG_Z} 32316",
        f"0 -20 0 {ALONG_Z} 32316",
        f"0 -10 -40 {PIN_Y} 2780",
        f"0 -10 40 {PIN_Y} 2780",
        f"100 0 0 {ALONG_Z} 32316",
    )
    answer = suggest(pieces, count=1)
    assert len(answer.before.components) == 2
    (best,) = answer.suggestions
    assert len(best.report.components) == 1
    assert best.factor is None
    assert cure_words(answer.before, best) == "joins 1 separate piece to the rest"
