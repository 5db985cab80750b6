"""The fit on made-up readings with known truth."""

from __future__ import annotations

import numpy as np
import pytest

from calibration.dataset import GRAVITY, parse_csv
from calibration.diagnose import cure, grid_check, warnings
from calibration.errors import FitError
from calibration.fit import fit
from calibration.rigs import Condition, shipped_rigs
from tests.calibration.synthetic import BOTH, PAIR, SHEAR, TILT, pin_model, text

TRUTH = np.array([SHEAR, TILT])
FAR_START = np.array([9e3, 1.5])
EDGE, FLAT = PAIR[:1], PAIR[1:]
HOLE = "9:32526:hole1"


def readings(*args, **kwargs):
    return parse_csv(text(*args, **kwargs), shipped_rigs()).readings


@pytest.mark.parametrize("plan", [PAIR, BOTH])
@pytest.mark.parametrize("loss", ["linear", "huber"])
def test_data_without_noise_return_the_truth(plan, loss):
    found = fit(readings(plan), pin_model(), FAR_START, loss=loss)
    assert found.active == (0, 1)
    assert np.exp(found.log_stiffness) == pytest.approx(TRUTH, rel=1e-6)
    assert found.scatter == 0.0
    assert found.offsets == ()


@pytest.mark.slow
def test_intervals_hold_the_truth_as_often_as_they_say():
    # 0.1 mm steps and 5 % scatter: 90 to 98 % of 200 seeds
    hits = np.zeros(2)
    for seed in range(200):
        found = fit(readings(seed=seed), pin_model(), FAR_START)
        assert found.active == (0, 1)
        hits += [
            low <= t <= high
            for (low, high), t in zip(map(found.interval, (0, 1)), TRUTH, strict=True)
        ]
    assert np.all((hits >= 180) & (hits <= 196)), hits / 200


def test_scatter_is_found():
    found = fit(readings(BOTH, seed=3, repeats=60), pin_model(), FAR_START)
    assert found.scatter == pytest.approx(0.05, rel=0.15)
    assert found.chi2 == pytest.approx(found.dof, rel=1e-6)


def test_one_pose_tells_the_shear_only():
    data = readings(EDGE, seed=1)
    found = fit(data, pin_model(), TRUTH)
    assert found.active == (0,)
    low, high = found.interval(0)
    assert low < SHEAR < high
    assert np.exp(found.log_stiffness[1]) == pytest.approx(TILT)
    assert any("one pose only" in said for said in warnings(data, found))
    # and what would tell the other
    candidates = [
        Condition("pin-pair", "edge", 90.0, "9:32526:hole1"),
        Condition("pin-pair", "flat", 0.0, "9:32526:hole1"),
    ]
    best, deviation = cure(1, candidates, pin_model(), found)
    assert best.pose == "flat"
    assert deviation < 0.1


def test_a_pose_that_only_tilts_pins_does_not_tell_the_shear():
    found = fit(readings(FLAT, seed=1), pin_model(), TRUTH)
    assert found.active == (1,)


def test_grid_search_finds_the_same_point():
    for seed in (None, 4):
        data = readings(BOTH, seed=seed)
        found = fit(data, pin_model(), FAR_START)
        grid = grid_check(data, pin_model(), found, FAR_START)
        assert grid.agrees, grid
        assert grid.chi2 >= found.chi2 * (1 - 1e-9)


def test_free_play_and_hysteresis_are_estimated():
    plan = [(rig, pose, span, (20, 50, 90)) for rig, pose, span, _ in PAIR]
    data = readings(plan, seed=2, repeats=8, scatter=0.01, free_play=0.3, hysteresis=0.2)
    found = fit(data, pin_model(), FAR_START)
    kinds = {
        (o.kind, o.pose): v * 1e3 for o, v in zip(found.offsets, found.offset_values, strict=True)
    }
    for pose in ("edge", "flat"):
        assert kinds["free_play", pose] == pytest.approx(0.3, abs=0.1)
        assert kinds["hysteresis", pose] == pytest.approx(0.2, abs=0.07)
    for k, truth in enumerate(TRUTH):
        low, high = found.interval(k)
        assert low < truth < high
    without = fit(data, pin_model(), FAR_START, offsets="off")
    assert without.offsets == ()
    assert without.scatter > found.scatter


def test_robust_loss_withstands_slips():
    rows = text(BOTH, seed=5, repeats=10).splitlines()
    for k in (3, 17, 31, 44):
        cells = rows[k].split(",")
        cells[9] = str(float(cells[9]) + 2.5)
        rows[k] = ",".join(cells)
    data = parse_csv("\n".join(rows), shipped_rigs()).readings
    plain = fit(data, pin_model(), FAR_START)
    robust = fit(data, pin_model(), FAR_START, loss="huber")

    def errors(found):
        return np.abs(found.log_stiffness - np.log(TRUTH))

    assert errors(robust).max() < 0.15
    assert errors(robust).max() < errors(plain).max()
    assert any("far from the rest" in said for said in warnings(data, robust))


def test_specimens_that_differ_widen_the_intervals():
    data = readings(BOTH, seed=6, repeats=4, scatter=0.01, specimens=8, specimen_scatter=0.1)
    found = fit(data, pin_model(), FAR_START)
    assert found.clustered
    assert any("specimens differ" in said for said in warnings(data, found))
    alone = fit(readings(BOTH, seed=6, repeats=32, scatter=0.01), pin_model(), FAR_START)
    assert np.all(found.deviations > 2 * alone.deviations)


def test_contradictory_readings_are_refused():
    lines = text(seed=1).splitlines()
    wrong = [
        ",".join([*c[:9], str(float(c[10]) + 9.0 * (i % 3)), *c[10:]])
        for i, c in enumerate(x.split(",") for x in lines[1:])
    ]
    data = parse_csv("\n".join([lines[0], *wrong]), shipped_rigs()).readings
    with pytest.raises(FitError, match="contradict each other"):
        fit(data, pin_model(), TRUTH)


def test_a_rig_unlike_its_model_is_noticed():
    # the shelf pose sags twice what it should: no pair of stiffnesses explains the sandwich too
    plan = [*BOTH, ("pin-sandwich", "flat", 32, (50, 100))]
    lines = text(plan, seed=8, repeats=8, scatter=0.01).splitlines()
    out = [lines[0]]
    for line in lines[1:]:
        c = line.split(",")
        if c[2:4] == ["pin-sandwich", "flat"]:
            c[9] = str(2 * float(c[9]) - float(c[10]))
        out.append(",".join(c))
    data = parse_csv("\n".join(out), shipped_rigs()).readings
    found = fit(data, pin_model(), TRUTH)
    assert any("different conditions contradict" in said for said in warnings(data, found))


def test_creep_and_coarse_rulers_are_warned_about():
    lines = text(BOTH, seed=9, repeats=12, scatter=0.01).splitlines()
    out = [lines[0]]
    for line in lines[1:]:
        c = line.split(",")
        c[9] = str(float(c[9]) + 0.02 * int(c[6]))
        out.append(",".join(c))
    data = parse_csv("\n".join(out), shipped_rigs()).readings
    said = warnings(data, fit(data, pin_model(), TRUTH))
    assert any("from repeat to repeat" in s for s in said)
    coarse = readings(seed=1, resolution=1.0)
    said = warnings(coarse, fit(coarse, pin_model(), TRUTH))
    assert any("three times the resolution" in s for s in said)


def test_no_weight_tells_nothing():
    plan = [(rig, pose, span, (0,)) for rig, pose, span, _ in PAIR]
    with pytest.raises(FitError, match="no stiffness shows"):
        fit(readings(plan), pin_model(), TRUTH)


def test_many_rows_narrow_the_answer_and_agree_with_the_grid():
    # ten thousand rows and their time: benchmarks/calibration.py
    data = readings(BOTH, seed=1, repeats=300)
    found = fit(data, pin_model(), FAR_START)
    assert grid_check(data, pin_model(), found, FAR_START).agrees
    assert found.log_stiffness == pytest.approx(np.log(TRUTH), abs=0.02)


def test_own_weight_counts_where_no_unloaded_reading_was_taken():
    rigs, values = shipped_rigs(), np.log(TRUTH)
    lines = [text().splitlines()[0]]
    for pose in ("edge", "flat"):
        condition = Condition("pin-pair", pose, rigs["pin-pair"].poses[pose].angle_deg, HOLE)
        answer = pin_model()([condition], values)
        for load in (5, 10, 20):
            force = load * 1e-3 * GRAVITY
            down = 1e3 * float(force * answer.per_newton[0] + answer.own_weight[0])
            lines.append(f"t,pin/pin_hole,pin-pair,{pose},,1,1,32,{load},{down!r},NA,0.1,,,,")
    data = parse_csv("\n".join(lines), rigs).readings
    found = fit(data, pin_model(), FAR_START)
    assert np.exp(found.log_stiffness) == pytest.approx(TRUTH, rel=1e-6)


def test_the_measured_angle_of_a_pose_counts():
    rigs = shipped_rigs()
    lines = [text().splitlines()[0]]
    for pose, angle in (("edge", 78.0), ("flat", 9.0)):
        condition = Condition("pin-pair", pose, angle, HOLE)
        per_newton = float(pin_model()([condition], np.log(TRUTH)).per_newton[0])
        for load in (10, 20):
            down = 1e3 * per_newton * load * 1e-3 * GRAVITY
            lines.append(f"t,pin/pin_hole,pin-pair,{pose},{angle},1,1,32,{load},{down!r},0,0.1,,,,")
    exact = parse_csv("\n".join(lines), rigs).readings
    found = fit(exact, pin_model(), FAR_START)
    assert np.exp(found.log_stiffness) == pytest.approx(TRUTH, rel=1e-6)
    blank = parse_csv(
        "\n".join(lines).replace(",78.0,", ",,").replace(",9.0,", ",,"), rigs
    ).readings
    off = fit(blank, pin_model(), FAR_START)
    assert np.abs(off.log_stiffness - np.log(TRUTH)).max() > 0.02
