"""The order of two reinforced models under the calibration's uncertainty, against full re-analysis."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from technic.assembly.stiffness import StiffnessValue, default_table
from technic.design.confidence import RANK_SURE, confidences
from technic.loading import load
from technic.report.suggest_json import confidence_dict
from technic.rigidity.analyze import analyze

NAMES = (("pin/pin_hole", "tilt"), ("axle/pin_hole", "tilt"))
COVARIANCE = np.array([[0.09, 0.02], [0.02, 0.16]])
BEAMS = """0 Two beams
1 4 0 0 0 1 0 0 0 1 0 0 0 1 32524.dat
1 4 0 -20 80 1 0 0 0 1 0 0 0 1 32524.dat
"""
PINS = BEAMS + "".join(f"1 0 0 -10 {z} 0 1 0 1 0 0 0 0 1 2780.dat\n" for z in (20, 60))
AXLES = BEAMS + "".join(
    f"1 0 0 -10 {z} 0 1 0 1 0 0 0 0 1 3705.dat\n1 7 0 20 {z} 1 0 0 0 0 1 0 -1 0 3713.dat\n"
    f"1 7 0 -40 {z} 1 0 0 0 0 1 0 -1 0 3713.dat\n"
    for z in (20, 60)
)


def table_with(factors):
    connections = dict(default_table().connections)
    for (name, motion), factor in zip(NAMES, factors, strict=True):
        entry = connections[name]
        value = StiffnessValue(factor * entry.values[motion].value, "calibrated")
        connections[name] = replace(entry, values={**entry.values, motion: value})
    return replace(
        default_table(), connections=connections, measured=NAMES, log_covariance=COVARIANCE
    )


@pytest.fixture
def examined(tmp_path):
    paths = []
    for name, text in (("pins", PINS), ("axles", AXLES)):
        paths.append(tmp_path / f"{name}.ldr")
        paths[-1].write_text(text)

    def call(factors):
        table = table_with(factors)
        return [analyze(load(p, table=table), table=table, modes=1, parts="frame") for p in paths]

    return call


def test_probability_of_the_order_agrees_with_full_re_analysis(examined):
    # factors that bring both close together, so that their order is open
    plain = examined((1.0, 1.0))
    ratio = plain[0].rigidity.value / plain[1].rigidity.value
    factors = (1.0, ratio**1.1)
    reports = sorted(examined(factors), key=lambda r: -r.rigidity.value)
    names = [r.assembly.name for r in reports]
    first, _ = confidences(reports[1], reports, [True, True], table_with(factors), "frame")
    random = np.random.default_rng(4)
    ahead = []
    for change in np.exp(random.multivariate_normal([0, 0], COVARIANCE, size=120)):
        drawn = {r.assembly.name: r.rigidity.value for r in examined(np.array(factors) * change)}
        ahead.append(drawn[names[0]] > drawn[names[1]])
    # 120 draws know a probability to five per cent
    assert first.beats_next == pytest.approx(np.mean(ahead), abs=0.12)
    assert first.basis == "calibration"
    assert confidence_dict(first)["rank_stable"] is (first.beats_next >= RANK_SURE)


def test_a_clear_order_is_stable(examined):
    reports = sorted(examined((1.0, 40.0)), key=lambda r: -r.rigidity.value)
    if reports[0].rigidity.value < 3 * reports[1].rigidity.value:
        reports = sorted(examined((40.0, 1.0)), key=lambda r: -r.rigidity.value)
    table = table_with((1.0, 1.0))
    first, last = confidences(reports[1], reports, [True, True], table, "frame")
    assert confidence_dict(first)["rank_stable"] is True
    assert last.beats_next is None
    assert confidence_dict(last)["rank_stable"] is None
