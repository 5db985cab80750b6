"""New bars of linkages: where they may end, the forecast, the continuous search, the files."""

from __future__ import annotations

import json
from pathlib import Path

import numpy as np
import pytest
from scipy.stats import spearmanr

import technic
from technic.assembly.builder import Linkage
from technic.assembly.file import load_assembly
from technic.design.bar_file import with_bars, write_with_bars
from technic.design.bar_screen import BarScreen
from technic.design.bar_search import _places, suggest_bars
from technic.design.bars import Bar, Rules, cuts, end_at, legal, made_of, pattern_of, tracks
from technic.design.reanalysis import Reanalysis
from technic.design.reinforce import reinforce_bars
from technic.errors import UsageError
from technic.rigidity.analyze import analyze
from technic.rigidity.result import Verdict

GALLERY = Path(technic.__file__).parent / "data" / "gallery"


def gallery(name):
    return load_assembly(GALLERY / f"{name}.json")


def rigidity(name):
    return analyze(gallery(name), modes=1).rigidity.value


def part(assembly, name):
    return [p.id for p in assembly.parts].index(name)


@pytest.fixture(scope="module")
def square():
    return suggest_bars(gallery("fig09a_square"), count=2, starts=6)


def test_a_square_gets_a_bar_better_than_the_papers_diagonal(square):
    """Fig. 9: one bar between two parts makes the square rigid; ends need not be corners."""
    assert square.before.verdict is Verdict.FLEXIBLE
    best = square.suggestions[0]
    assert best.report.verdict is Verdict.RIGID
    assert best.stops == (1,)
    assert best.report.rigidity.value > rigidity("fig09b_square_braced")
    assert best.exact.rigidity == pytest.approx(best.report.rigidity.value, rel=1e-6)
    values = [s.report.rigidity.value for s in square.suggestions]
    assert values == sorted(values, reverse=True)


def test_twins_of_a_symmetric_linkage_are_counted(square):
    """The square turns into itself four ways and by reflection: places come in groups."""
    assert square.suggestions[0].twins >= 1


def test_the_papers_corner_brace_is_found_again():
    """Fig. 12 (a2): between these two parts, not longer than the paper's, it lies where theirs lies."""
    assembly = gallery("fig12a1_square")
    rules = Rules(
        between=(part(assembly, "up"), part(assembly, "right")), longest=0.02 * np.sqrt(2.0)
    )
    (best, *_) = suggest_bars(assembly, rules=rules).suggestions
    ends = sorted([best.bar.first.point, best.bar.second.point])
    assert np.allclose(ends, [(0.08, 0.1, 0.0), (0.1, 0.08, 0.0)], atol=1e-3)
    assert best.report.rigidity.value >= rigidity("fig12a2_square") * (1.0 - 1e-3)


@pytest.mark.slow
def test_two_braces_beat_the_papers():
    """Fig. 12 (a3) and (a4): with the same two bars of the same length, or shorter."""
    assembly = gallery("fig12a1_square")
    for name, longest in (("fig12a3_square", 0.02 * 2**0.5), ("fig12a4_square", 0.05 * 2**0.5)):
        answers = reinforce_bars(assembly, steps=2, rules=Rules(longest=longest))
        assert len(answers) == 2
        last = answers[-1].suggestions[0]
        assert last.bar.length <= longest * (1 + 1e-6)
        assert last.report.rigidity.value >= rigidity(name) * (1.0 - 1e-3)


@pytest.mark.parametrize("name", ["fig09a_square", "fig12a1_square", "fig12a2_square"])
def test_forecasts_put_bars_in_the_exact_order(name):
    assembly = gallery(name)
    pattern = pattern_of(assembly)
    model = Reanalysis(assembly)
    from collections import Counter

    places = _places(assembly, pattern, Rules(), Counter())
    chosen = places[:: max(1, len(places) // 40)]
    bars = [start.bar for start in chosen]
    spots = [(end.parts[0], end.point) for bar in bars for end in (bar.first, bar.second)]
    forecasts = BarScreen(assembly, pattern, spots).forecasts(bars)
    exact = []
    for bar in bars:
        new, joints, _ = made_of(assembly, bar, pattern, "new", len(assembly.parts))
        exact.append(model.exact_with([new], joints))
    assert [f.removed for f in forecasts] == [e.removed for e in exact]
    order = spearmanr([f.rigidity for f in forecasts], [e.rigidity for e in exact])[0]
    assert order >= 0.7


def test_the_file_keeps_the_promise(square, tmp_path):
    path = GALLERY / "fig09a_square.json"
    for suggestion in square.suggestions[:2]:
        target = tmp_path / f"{suggestion.rank}.json"
        write_with_bars(path, target, [suggestion])
        again = analyze(load_assembly(target))
        promised = suggestion.report
        assert again.verdict is promised.verdict
        assert again.rigidity.value == pytest.approx(promised.rigidity.value, rel=1e-6)
        old, new = (json.loads(p.read_text()) for p in (path, target))
        assert new["parts"][:-1] == old["parts"]
        assert new["joints"][: len(old["joints"])] == old["joints"]
    with pytest.raises(UsageError, match="must not replace"):
        write_with_bars(path, path, [])


@pytest.mark.slow
@pytest.mark.parametrize(
    "name", ["fig08a_bridge", "fig10d_octahedron", "fig13a_three_bar", "fig14c_drying_rack_1"]
)
def test_other_linkages_keep_the_promise(name, tmp_path):
    path = GALLERY / f"{name}.json"
    answer = suggest_bars(load_assembly(path), count=1)
    for suggestion in answer.suggestions:
        write_with_bars(path, tmp_path / "new.json", [suggestion])
        again = analyze(load_assembly(tmp_path / "new.json"))
        assert again.verdict is suggestion.report.verdict
        assert again.mobility == suggestion.report.mobility
        promised = suggestion.report.rigidity.value
        assert again.rigidity.value == pytest.approx(promised, rel=1e-6)


def test_an_end_near_a_pin_takes_the_pin_and_all_on_it():
    assembly = gallery("fig09a_square")
    track = tracks(assembly)[0]
    end = end_at(assembly, track, 0.001, 0.003)
    assert end.point == (0.0, 0.0, 0.0)
    assert set(end.parts) == {part(assembly, "ab"), part(assembly, "da")}
    away = end_at(assembly, track, 0.05, 0.003)
    assert away.parts == (part(assembly, "ab"),)


def test_bars_along_a_part_or_too_short_are_not_offered():
    assembly = gallery("fig09a_square")
    first, second = tracks(assembly)[:2]
    corner, middle = (end_at(assembly, first, s, 0.003) for s in (0.1, 0.05))
    near = end_at(assembly, second, 0.004, 0.003)
    far = end_at(assembly, second, 0.06, 0.003)
    assert not legal(Bar(corner, far), Rules(), 0.003)  # along the second part
    assert not legal(Bar(end_at(assembly, first, 0.096, 0.003), near), Rules(), 0.003)
    assert legal(Bar(middle, far), Rules(), 0.003)
    assert not legal(Bar(middle, far), Rules(longest=0.05), 0.003)
    assert not legal(Bar(middle, far), Rules(shortest=0.09), 0.003)
    assert not legal(Bar(middle, far), Rules(keep_out=frozenset({1})), 0.003)
    assert not legal(Bar(middle, far), Rules(between=(0, 2)), 0.003)
    assert legal(Bar(middle, far), Rules(between=(1, 0)), 0.003)
    assert not legal(Bar(middle, far), Rules(box=((0, 0, 0), (0.09, 1, 0))), 0.003)


def test_bars_in_space_do_not_run_through_others():
    linkage = Linkage(dimension=3)
    linkage.bar("a", (0, 0, 0), (0.1, 0, 0), section=0.004)
    linkage.bar("b", (0, 0.1, 0), (0.1, 0.1, 0), section=0.004)
    linkage.bar("c", (0.05, 0.05, -0.1), (0.05, 0.05, 0.1), section=0.004)
    assembly = linkage.assembly()
    one, two, _ = tracks(assembly)
    through = Bar(end_at(assembly, one, 0.05, 0.004), end_at(assembly, two, 0.05, 0.004))
    beside = Bar(end_at(assembly, one, 0.08, 0.004), end_at(assembly, two, 0.08, 0.004))
    assert cuts(assembly, through, 0.004)
    assert not cuts(assembly, beside, 0.004)


def test_the_pattern_is_what_most_bars_are():
    linkage = Linkage(dimension=2)
    linkage.bar("a", (0, 0), (0.1, 0), section=0.004)
    linkage.bar("b", (0.1, 0), (0.1, 0.1), section=0.004)
    linkage.bar("c", (0.1, 0.1), (0, 0.1), section=0.01)
    assert pattern_of(linkage.assembly()).size == pytest.approx(0.004)
    rows = with_bars({"parts": [{"id": "x"}]}, [])
    assert rows == {"parts": [{"id": "x"}], "joints": []}


def test_nothing_to_add_says_so():
    assembly = gallery("fig09a_square")
    answer = suggest_bars(assembly, rules=Rules(longest=0.001))
    assert (answer.suggestions, answer.places) == ((), 0)
    linkage = Linkage(dimension=2)
    linkage.rigid("block", (0, 0), (1, 0))
    with pytest.raises(UsageError, match="no part of the model is a bar"):
        suggest_bars(linkage.assembly())


def test_steps_stop_at_the_target():
    assembly = gallery("fig09a_square")
    near = Rules(between=(0, 1))
    answers = reinforce_bars(assembly, steps=4, target=1000.0, rules=near)
    assert len(answers) == 1
    made = answers[0].suggestions[0].report.assembly
    assert reinforce_bars(made, steps=4, target=1000.0) == []
