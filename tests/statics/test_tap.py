"""The tapped rig against the whole model, a closed form, finite differences, and the fit with known truth."""

from __future__ import annotations

import numpy as np
import pytest
from scipy import linalg

from calibration.dataset import COLUMNS, GRAVITY, parse_csv
from calibration.fit import fit
from calibration.rigs import Condition, shipped_rigs
from technic.assembly.stiffness import default_table
from technic.statics.forward import forward_model, held_rig
from technic.statics.loads import parse_probe
from technic.statics.rig import rig_system
from technic.statics.tap import tap_model
from technic.system.assemble import element_of, rigid_element_of
from technic.system.parameters import Parameter
from tests.calibration.synthetic import BOTH, PAIR, PIN, SHEAR, TILT, pin_model, text
from tests.statics.test_rig import closed_form, table_with

TRUTH = np.array([SHEAR, TILT])
FAR_START = np.array([9e3, 1.5])
CASES = [
    (name, hole.place, connection, motions)
    for name, rig in shipped_rigs().items()
    for hole in rig.loads[:1]
    for connection, motions in rig.joints.items()
]


def whole_model(rig, place, parameters, values, mass, down):
    """Frequency (Hz) of the unreduced eigenproblem; the mode that sags most under the weight."""
    table = table_with(dict(zip(parameters, values, strict=True)))
    assembly = held_rig(rig, table)
    full = rig_system(assembly, parse_probe(assembly, place), parameters, table)
    free = full.free
    k = free.T @ (full.system.K + full.system.J) @ free
    p = full.point @ free
    m = free.T @ full.system.mass_matrix @ free + mass * p.T @ p
    values, shapes = linalg.eigh(k, m)
    elastic = values > 1e-6 * values[-1] / len(values) ** 4
    sag = np.where(elastic, (down @ p @ shapes) ** 2 / np.where(elastic, values, 1.0), 0.0)
    return np.sqrt(values[sag.argmax()]) / (2 * np.pi)


@pytest.mark.parametrize(("name", "place", "connection", "motions"), CASES)
@pytest.mark.parametrize(("scale", "mass"), [(0.2, 0.0), (1.0, 0.05), (6.0, 0.3)])
def test_equals_the_whole_model_at_any_stiffness_and_weight(
    name, place, connection, motions, scale, mass
):
    rig, table = shipped_rigs()[name], default_table()
    parameters = [Parameter(connection, m) for m in motions]
    assembly = held_rig(rig, table)
    model = tap_model(assembly, parse_probe(assembly, place), parameters, table)
    values = scale * 1.3 ** np.arange(len(parameters)) * model.start
    for pose in rig.poses.values():
        down = pose.down_at(pose.angle_deg)
        (found,), _ = model.response(values, [mass], down[None])
        said = whole_model(rig, place, parameters, values, mass, down)
        assert found == pytest.approx(said, rel=1e-6)


@pytest.mark.parametrize(("name", "place", "connection", "motions"), CASES)
def test_derivative_equals_finite_differences(name, place, connection, motions):
    rig, table = shipped_rigs()[name], default_table()
    parameters = [Parameter(connection, m) for m in motions]
    assembly = held_rig(rig, table)
    model = tap_model(assembly, parse_probe(assembly, place), parameters, table, element=element_of)
    downs = np.array([pose.down_at(pose.angle_deg) for pose in rig.poses.values()])
    at, step = 0.6 * model.start, 1e-5
    weights = np.linspace(0.0, 0.1, len(downs))
    value, slope = model.response(at, weights, downs)
    for k in range(len(parameters)):
        up, down = (
            model.response(at * np.exp(s * step * np.eye(len(at))[k]), weights, downs)[0]
            for s in (1, -1)
        )
        assert slope[:, k] == pytest.approx((up - down) / (2 * step), rel=1e-5, abs=1e-7)
    assert np.all(value > 0)


@pytest.mark.parametrize("down", [[0, 0, 1], [0, 1, 0]], ids=["edge", "flat"])
def test_closed_form_of_a_heavy_weight_on_a_spring(down):
    # lambda = m omega^2: a weight far heavier than the beams swings on the compliance of the pins
    rig, table = shipped_rigs()["pin-pair"], default_table()
    assembly = held_rig(rig, table)
    probe = parse_probe(assembly, "9:32526:hole1")
    pins = np.array([p.pose.translation for p in assembly.parts if p.number == "2780"])
    model = tap_model(assembly, probe, list(PIN), table, element=rigid_element_of)
    mass, push = 5.0, np.array([down], dtype=float)
    (found,), _ = model.response(TRUTH, [mass], push)
    if down[1] == 1:
        sag = closed_form(pins, probe.point, push[0], SHEAR, TILT, 0.008)
        assert found == pytest.approx(np.sqrt(1 / (sag * mass)) / (2 * np.pi), rel=0.01)
        return
    # on its edge the beam also shifts along the leg, so the weight swings at a slant: the compliance of
    # the plane is a matrix, its largest principal value the softest spring
    x, z = np.eye(3)[0], np.eye(3)[2]
    along, across, slant = (
        closed_form(pins, probe.point, way, SHEAR, TILT, 0.008)
        for way in (x, z, (x + z) / np.sqrt(2))
    )
    mixed = slant - (along + across) / 2
    softest = np.linalg.eigvalsh([[along, mixed], [mixed, across]])[-1]
    assert found == pytest.approx(np.sqrt(1 / (softest * mass)) / (2 * np.pi), rel=0.01)


@pytest.mark.parametrize("name", ["pin-pair", "pin-sandwich", "axle-lever"])
def test_many_weights_are_interpolated_exactly_enough(name):
    rig, table = shipped_rigs()[name], default_table()
    (connection, motions), *_ = rig.joints.items()
    parameters = [Parameter(connection, m) for m in motions]
    assembly = held_rig(rig, table)
    model = tap_model(assembly, parse_probe(assembly, rig.loads[0].place), parameters, table)
    random = np.random.default_rng(2)
    weights = random.uniform(0.01, 0.2, 60)
    downs = [pose.down_at(pose.angle_deg) for pose in rig.poses.values()]
    down = np.array([downs[k % len(downs)] for k in range(len(weights))])
    together = model.response(0.8 * model.start, weights, down)
    alone = [
        model.response(0.8 * model.start, [m], d[None]) for m, d in zip(weights, down, strict=True)
    ]
    for k in range(2):
        expected = np.concatenate([answer[k] for answer in alone])
        assert together[k] == pytest.approx(expected, rel=1e-6, abs=1e-7 * np.abs(expected).max())


def taps(plan=BOTH, *, seed=None, repeats=4, scatter=0.01, step=0.1, values=(SHEAR, TILT)):
    """CSV rows of tap tests; without a seed they are exact."""
    rigs, random = shipped_rigs(), None if seed is None else np.random.default_rng(seed)
    out = []
    for rig, pose, span, loads in plan:
        for load in loads:
            place = rigs[rig].hole(float(span)).place
            angle = rigs[rig].poses[pose].angle_deg
            condition = Condition(rig, pose, angle, place, tap=True, mass=load * 1e-3)
            true = float(pin_model()([condition], np.log(values)).frequency[0])
            for repeat in range(1, repeats + 1):
                read = true
                if random is not None:
                    read = round(true * (1 + scatter * random.standard_normal()) / step) * step
                out.append(
                    f"t,pin/pin_hole,{rig},{pose},,1,{repeat},{span},{load},,,,{read!r},{step},,tap"
                )
    return out


def parsed(*rows):
    return parse_csv("\n".join([",".join(COLUMNS), *rows, ""]), shipped_rigs()).readings


@pytest.mark.parametrize("loss", ["linear", "huber"])
def test_taps_alone_return_the_truth(loss):
    found = fit(parsed(*taps()), pin_model(), FAR_START, loss=loss)
    assert found.active == (0, 1)
    assert np.exp(found.log_stiffness) == pytest.approx(TRUTH, rel=1e-6)


def test_taps_and_sags_together_return_the_truth():
    rows = text(BOTH).splitlines()[1:]
    found = fit(parsed(*rows, *taps()), pin_model(), FAR_START)
    assert np.exp(found.log_stiffness) == pytest.approx(TRUTH, rel=1e-6)
    assert found.offsets == ()


def test_each_kind_has_its_own_scatter_and_taps_sharpen_the_answer():
    sags = text(PAIR, seed=5, repeats=12, scatter=0.08).splitlines()[1:]
    alone = fit(parsed(*sags), pin_model(), FAR_START)
    both = fit(parsed(*sags, *taps(seed=6, repeats=12)), pin_model(), FAR_START)
    assert both.scatter == pytest.approx(0.08, rel=0.3)
    assert both.tap_scatter == pytest.approx(0.01, rel=0.3)
    assert np.all(both.deviations[:2] < 0.5 * alone.deviations[:2])
    assert np.all(np.abs(both.log_stiffness - np.log(TRUTH)) < 3 * both.deviations[:2])


def test_one_tap_borrows_the_scatter_of_the_sags():
    sags = text(PAIR, seed=5, repeats=12).splitlines()[1:]
    found = fit(parsed(*sags, *taps(PAIR[:1], seed=1, repeats=1)[:1]), pin_model(), FAR_START)
    assert found.tap_scatter == pytest.approx(found.scatter / 2)


@pytest.mark.slow
def test_intervals_from_taps_hold_the_truth_as_often_as_they_say():
    hits = np.zeros(2)
    for seed in range(100):
        rows = [*text(PAIR, seed=seed, repeats=3).splitlines()[1:], *taps(seed=1000 + seed)]
        found = fit(parsed(*rows), pin_model(), FAR_START)
        hits += [
            low <= t <= high
            for (low, high), t in zip(map(found.interval, (0, 1)), TRUTH, strict=True)
        ]
    assert np.all((hits >= 88) & (hits <= 99)), hits


def test_the_weight_in_grams_is_a_mass_not_a_force():
    (reading,) = parsed(taps(PAIR[:1], repeats=1)[0])
    assert reading.tap
    assert reading.condition.mass == pytest.approx(0.020)
    assert reading.force == pytest.approx(0.020 * GRAVITY)
    assert reading.rounding == pytest.approx(0.1 / 12**0.5)
    assert not reading.own_weight


def test_forward_model_answers_both_kinds_at_once():
    rigs = shipped_rigs()
    place = rigs["pin-pair"].loads[0].place
    forward = forward_model(rigs, [("pin-pair", place)], PIN, default_table())
    sag = Condition("pin-pair", "edge", 90.0, place)
    tap = Condition("pin-pair", "edge", 90.0, place, tap=True, mass=0.05)
    answer = forward([sag, tap], np.log(TRUTH))
    assert np.array_equal(answer.per_newton > 0, [True, False])
    assert np.array_equal(answer.frequency > 0, [False, True])
