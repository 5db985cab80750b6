"""No suggestion on any shared model fails when its file is read again: joined, apart, as promised."""

from __future__ import annotations

import pytest

from technic.design.filters import Filters
from technic.design.suggest import suggest
from technic.ldraw.reader import load_ldraw
from tests.design.test_suggest_models import keep_promise

SMALL = (
    "hinged_L.ldr",
    "triangle.ldr",
    "square.ldr",
    "trapezoid.ldr",
    "cube7.ldr",
    "cube9_simple.ldr",
)
LARGE = (
    "fll_robot.mpd",
    "omr_42004_mini_backhoe.mpd",
    "omr_31066_rover.mpd",
    "omr_42020_twin_rotor.mpd",
    "omr_8002_destroyer_droid.mpd",
)


@pytest.mark.slow
@pytest.mark.parametrize("name", [*SMALL, *LARGE])
def test_no_suggestion_fails_when_it_is_read_again(model, name, tmp_path):
    path = model(name)
    assembly = load_ldraw(path)
    small = name in SMALL
    answer = suggest(assembly, count=4 if small else 2, shortlist=16 if small else 8, pairs=False)
    if not answer.suggestions:
        # nothing fits: there is no place, or every place has its reason
        assert answer.places == 0 or sum(answer.refused.values()) > 0
    for suggestion in answer.suggestions:
        target = tmp_path / f"{suggestion.rank}-{name}"
        keep_promise(path, assembly, [suggestion], target)
        promised = suggestion.report.rigidity.value
        assert suggestion.exact.rigidity == pytest.approx(promised, rel=1e-6)


@pytest.mark.slow
@pytest.mark.parametrize("name", ["square.ldr", "trapezoid.ldr", "cube9_simple.ldr"])
def test_neither_do_thin_beams_frames_and_snug_ones(model, name, tmp_path):
    path = model(name)
    assembly = load_ldraw(path)
    filters = Filters(thin=True, frames=True, snug=0.2e-3)
    answer = suggest(assembly, count=6, shortlist=24, filters=filters, pairs=False)
    assert answer.suggestions
    for suggestion in answer.suggestions:
        keep_promise(path, assembly, [suggestion], tmp_path / f"{suggestion.rank}-{name}")
