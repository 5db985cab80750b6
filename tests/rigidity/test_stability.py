"""What the calibration leaves open, against full re-analysis of every draw."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from technic.assembly.stiffness import StiffnessValue, default_table
from technic.loading import load
from technic.rigidity.analyze import analyze
from technic.rigidity.provenance import spots_sentence, stability_dict
from technic.rigidity.stability import DRAWS, draw

# three beams in a stack, pins below, axles above: two kinds of joint compete for the first rank
MODEL = """0 Three beams
1 4 0 0 0 1 0 0 0 1 0 0 0 1 32524.dat
1 4 0 -20 80 1 0 0 0 1 0 0 0 1 32524.dat
1 0 0 -10 20 0 1 0 1 0 0 0 0 1 2780.dat
1 0 0 -10 60 0 1 0 1 0 0 0 0 1 2780.dat
1 4 0 -40 160 1 0 0 0 1 0 0 0 1 32524.dat
1 0 0 -30 100 0 1 0 1 0 0 0 0 1 3705.dat
1 0 0 -30 120 0 1 0 1 0 0 0 0 1 3705.dat
1 7 0 0 100 1 0 0 0 0 1 0 -1 0 3713.dat
1 7 0 0 120 1 0 0 0 0 1 0 -1 0 3713.dat
1 7 0 -60 100 1 0 0 0 0 1 0 -1 0 3713.dat
1 7 0 -60 120 1 0 0 0 0 1 0 -1 0 3713.dat
"""
NAMES = (("pin/pin_hole", "tilt"), ("axle/pin_hole", "tilt"), ("axle/pin_hole", "shear"))


def table_with(factors, covariance):
    table = default_table()
    connections = dict(table.connections)
    for (name, motion), factor in zip(NAMES, factors, strict=True):
        entry = connections[name]
        value = StiffnessValue(factor * entry.values[motion].value, "calibrated")
        connections[name] = replace(entry, values={**entry.values, motion: value})
    return replace(
        table, connections=connections, measured=NAMES, log_covariance=np.asarray(covariance)
    )


WIDE = np.array([[0.16, 0.02, 0.0], [0.02, 0.25, -0.05], [0.0, -0.05, 0.09]])


@pytest.fixture
def path(tmp_path):
    file = tmp_path / "mixed.ldr"
    file.write_text(MODEL)
    return file


def examined(path, covariance, factors=(1.0, 1.0, 1.0)):
    table = table_with(factors, covariance)
    return analyze(load(path, table=table), table=table, parts="frame")


def spot_id(report, spot):
    items = report.assembly.joints if spot.kind == "joint" else report.assembly.parts
    return spot.kind, items[spot.index].id


def test_draws_have_the_covariance_and_are_the_same_every_time():
    table = table_with((1, 1, 1), WIDE)
    drawn = draw(table, 20_000)
    assert np.abs(drawn.mean(axis=0)).max() < 1e-12
    assert np.cov(drawn.T) == pytest.approx(WIDE, abs=0.01)
    assert np.array_equal(draw(table), draw(table))


def test_shapes_give_what_a_full_analysis_of_each_draw_gives(path):
    base = examined(path, WIDE)
    changes = draw(table_with((1, 1, 1), WIDE))[: DRAWS // 2 : 4]
    ids = [spot_id(base, spot) for spot in base.weak_spots[:10]]
    drawn = []
    for change in changes:
        report = examined(path, WIDE, np.exp(change))
        shares = {spot_id(report, spot): spot.energy_share for spot in report.weak_spots}
        drawn.append([shares[i] for i in ids])
    drawn = np.array(drawn)
    # fifty draws know the deviation to ten per cent; the ends of the ranges follow from it and the skew
    for k, spot in enumerate(base.stability.spots):
        low, high = spot.energy_shares
        inside = np.mean((drawn[:, k] >= low) & (drawn[:, k] <= high))
        assert inside >= 0.86
        assert high - low < 1.35 * (drawn[:, k].max() - drawn[:, k].min())


def test_wide_uncertainty_leaves_the_order_open_and_narrow_does_not(path):
    wide, narrow = examined(path, WIDE), examined(path, 1e-8 * WIDE)
    assert wide.stability.first_open is not None
    assert "not sure" in spots_sentence(wide)
    assert stability_dict(wide)["weak_spots"]["stable"] is False
    # equal spots of a symmetric model change places for nothing: only those that differ are asked
    for rank, spot in enumerate(narrow.stability.spots, start=1):
        low, high = spot.ranks
        between = {round(s.energy_share, 4) for s in narrow.weak_spots[low - 1 : high]}
        assert low <= rank <= high
        assert len(between) == 1
    assert stability_dict(wide)["verdict"]["stable"] is True


def test_weak_spots_say_their_range(path):
    content = examined(path, WIDE).to_dict()
    first = content["weak_spots"][0]
    low, high = first["energy_share_interval_95"]
    assert low < first["energy_share"] < high
    assert first["rank_interval_95"][0] == 1
    assert len(content["rigidity"]["log_slopes"]) == 3
    assert content["stability"]["draws"] == DRAWS


def test_nothing_measured_leaves_nothing_to_say(path):
    report = analyze(load(path), parts="frame")
    content = report.to_dict()
    assert report.stability is None
    assert content["stability"] is None
    assert content["weak_spots"][0]["rank_interval_95"] is None
    assert spots_sentence(report) == ""
    assert content["stiffness_table"]["found"] == "shipped"
