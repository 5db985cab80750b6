"""The exact answer for one candidate against the analysis of the whole reinforced model."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

import technic
from technic.design.apply import Change, change_of, extend
from technic.design.candidates import candidates
from technic.design.lowest import lowest_eigenvalue
from technic.design.reanalysis import Reanalysis
from technic.ldraw.reader import load_ldraw
from technic.rigidity.analyze import analyze
from tests.design.made import ALONG_Z, PIN_Y, build

DEMO = Path(technic.__file__).parent / "data" / "rolling_chassis.mpd"


def moving(report):
    """Motions in which parts of structure move, those of separate pieces included."""
    mobility = report.mobility
    pieces = len(report.components) - 1
    return mobility.structural + mobility.spinning + mobility.sliding + 6 * pieces


def compare(assembly, chosen, parts):
    """Compare the exact answer for each candidate with the analysis of the reinforced model."""
    before = analyze(assembly, modes=1, parts=parts)
    model = Reanalysis(assembly, parts=parts)
    for candidate in chosen:
        change = change_of(assembly, candidate)
        exact = model.exact(change)
        whole = analyze(extend(assembly, [change]), modes=1, parts=parts)
        assert exact.rigidity == pytest.approx(whole.rigidity.value, rel=1e-6)
        assert exact.removed == moving(before) - moving(whole)


@pytest.mark.parametrize("parts", ["solid", "frame", "rigid"])
def test_exact_means_what_the_whole_analysis_says(model, parts):
    assembly = load_ldraw(model("square.ldr"))
    compare(assembly, candidates(assembly)[::40], parts)


@pytest.mark.slow
@pytest.mark.parametrize(
    ("name", "every"),
    [
        ("square.ldr", 3),
        ("trapezoid.ldr", 25),
        ("cube7.ldr", 7),
        ("cube9_simple.ldr", 20),
        ("fll_robot.mpd", 150),
        ("omr_42004_mini_backhoe.mpd", 150),
    ],
)
def test_exact_on_real_models(model, name, every):
    assembly = load_ldraw(model(name))
    compare(assembly, candidates(assembly)[::every], "solid")


@pytest.mark.slow
def test_exact_on_the_demo():
    assembly = load_ldraw(DEMO)
    compare(assembly, candidates(assembly)[::120], "solid")


def test_pieces_that_a_beam_joins():
    pieces = build(
        f"0 0 0 {ALONG_Z} 32316",
        f"0 -20 0 {ALONG_Z} 32316",
        f"0 -10 -40 {PIN_Y} 2780",
        f"0 -10 40 {PIN_Y} 2780",
        f"100 0 0 {ALONG_Z} 32316",
    )
    compare(pieces, candidates(pieces)[::15], "solid")


def test_nothing_added_is_the_model_itself(model):
    """Without new joints nothing changes; a pin alone makes no beam, so the change is empty."""
    assembly = load_ldraw(model("triangle.ldr"))
    found = candidates(assembly)
    change = change_of(assembly, found[0])
    beam_far_away = Change((change.added[0],), ())
    with_beam = analyze(extend(assembly, [beam_far_away]), modes=1)
    exact = Reanalysis(assembly).exact(beam_far_away)
    assert exact.rigidity == pytest.approx(with_beam.rigidity.value, rel=1e-6)


def test_lanczos_finds_the_lowest_of_known_values():
    from scipy import sparse

    values = np.concatenate([[3.0, 3.1], np.linspace(5.0, 1e6, 200)])
    stiffness = sparse.csr_array(sparse.diags_array(values))
    measure = sparse.csr_array(sparse.eye_array(len(values)))
    found = lowest_eigenvalue(lambda load: load / values, stiffness, measure, np.ones(len(values)))
    assert found == pytest.approx(3.0, rel=1e-10)


def test_lanczos_says_when_it_does_not_converge():
    from scipy import sparse

    values = np.linspace(1.0, 1.01, 3000)
    stiffness = sparse.csr_array(sparse.diags_array(values))
    measure = sparse.csr_array(sparse.eye_array(len(values)))
    start = np.cos(np.arange(len(values)))
    assert lowest_eigenvalue(lambda load: load / values, stiffness, measure, start) is None
    assert lowest_eigenvalue(lambda load: 0.0 * load, stiffness, measure, start) is None
