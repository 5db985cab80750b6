"""Suggestions on real models: built, written, read again, and as good as promised."""

from __future__ import annotations

from collections import Counter
from pathlib import Path

import pytest

import technic
from technic.design.apply import write_reinforced
from technic.design.collide import solid_overlaps
from technic.design.filters import Filters, needs
from technic.design.reinforce import reinforce
from technic.design.suggest import suggest
from technic.ldraw.reader import load_ldraw
from technic.rigidity.analyze import analyze
from technic.rigidity.result import Verdict

DEMO = Path(technic.__file__).parent / "data" / "rolling_chassis.mpd"


def keep_promise(path, assembly, taken, target):
    """Write a model with what was suggested, read it again and compare with the promise."""
    promised = taken[-1].report
    write_reinforced(path, target, assembly, [s.change for s in taken])
    again = load_ldraw(target)
    found = analyze(again)
    assert found.verdict is promised.verdict
    assert found.mobility.structural == promised.mobility.structural
    assert found.rigidity.value == pytest.approx(promised.rigidity.value, rel=1e-6)
    gone = {name for s in taken for name in s.change.removed}
    kept = [p for p in assembly.parts if p.id not in gone]
    new = again.parts[len(kept) :]
    wanted = sum((needs(s.candidate) for s in taken), Counter())
    assert Counter(p.definition.id for p in new) == wanted
    assert solid_overlaps(again, range(len(kept), len(again.parts))) == []
    joined = {k for j in again.joints for k in j.parts}
    assert joined >= set(range(len(kept), len(again.parts)))  # nothing floats
    assert len(found.components) <= len(analyze(assembly).components)
    return found


@pytest.mark.parametrize("name", ["square.ldr", "trapezoid.ldr"])
def test_one_part_makes_a_flexible_frame_rigid(model, name, tmp_path):
    path = model(name)
    assembly = load_ldraw(path)
    answer = suggest(assembly, count=3)
    assert answer.before.verdict is Verdict.FLEXIBLE
    assert len(answer.suggestions) == 3
    for suggestion in answer.suggestions:
        assert suggestion.report.verdict is Verdict.RIGID
        assert suggestion.stops == (1,)
        found = keep_promise(path, assembly, [suggestion], tmp_path / f"{suggestion.rank}.ldr")
        assert found.verdict is Verdict.RIGID


@pytest.mark.slow
@pytest.mark.parametrize("name", ["cube7.ldr", "cube9_simple.ldr"])
def test_cubes_lose_at_least_half_of_their_motions(model, name, tmp_path):
    path = model(name)
    assembly = load_ldraw(path)
    answers = reinforce(assembly, steps=2, shortlist=12)
    taken = [a.suggestions[0] for a in answers if a.suggestions]
    before = answers[0].before.mobility.structural
    assert before == 7
    assert sum(sum(needs(s.candidate).values()) for s in taken) <= 7  # pins counted
    after = keep_promise(path, assembly, taken, tmp_path / name)
    assert after.mobility.structural <= before // 2


@pytest.mark.slow
def test_the_demo_chassis_becomes_three_times_as_rigid_with_at_most_eight_parts(tmp_path):
    """Eight parts more than before: a pin that another takes the place of does not count twice."""
    assembly = load_ldraw(DEMO)
    before = analyze(assembly).rigidity.value
    answers = reinforce(
        assembly, steps=8, target=3.0 * before, shortlist=20, filters=Filters(max_parts=3)
    )
    taken = [a.suggestions[0] for a in answers if a.suggestions]
    more = sum(len(s.change.added) - len(s.change.removed) for s in taken)
    assert more <= 8
    after = keep_promise(DEMO, assembly, taken, tmp_path / "chassis.mpd")
    assert after.rigidity.value >= 3.0 * before


@pytest.mark.slow
def test_one_frame_on_pins_more_than_triples_the_demo_chassis(tmp_path):
    """At most eight new parts, every pin counted; the paper's chassis went from 8.656 to 26.91."""
    assembly = load_ldraw(DEMO)
    filters = Filters(max_parts=8, frames=True)
    (answer,) = reinforce(assembly, steps=1, shortlist=10, filters=filters)
    best = answer.suggestions[0]
    assert sum(needs(best.candidate).values()) <= 8
    after = keep_promise(DEMO, assembly, [best], tmp_path / "chassis.mpd")
    assert after.rigidity.value >= 3.0 * answer.before.rigidity.value
