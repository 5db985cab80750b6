"""Interval of a sag against Monte Carlo."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from calibration.rigs import shipped_rigs
from technic.assembly.select import parse_fix
from technic.assembly.stiffness import StiffnessValue, default_table
from technic.loading import load
from technic.statics.loads import parse_load, parse_probe
from technic.statics.solve import deflect
from technic.statics.uncertainty import displacement_interval

COVARIANCE = np.array([[0.04, -0.006], [-0.006, 0.01]])
NAMES = ("shear", "tilt")
GRAVITY = np.array([0, 9.8, 0])


def table_with(factors):
    table = default_table()
    entry = table.get("pin/pin_hole")
    values = dict(entry.values)
    for name, factor in zip(NAMES, factors, strict=True):
        values[name] = StiffnessValue(factor * values[name].value, "test")
    return replace(
        table,
        connections={**table.connections, "pin/pin_hole": replace(entry, values=values)},
        measured=tuple(("pin/pin_hole", name) for name in NAMES),
        log_covariance=COVARIANCE,
    )


def held(table):
    rig = shipped_rigs()["pin-pair"]
    assembly = load(rig.model, table=table)
    return replace(assembly, supports=tuple(parse_fix(assembly, p) for p in rig.clamped))


def sag(assembly):
    """A loaded and a probed point under a force and the own weight."""
    loads = (parse_load(assembly, "9:32526:hole1:0.1,0.2,0.4"),)
    probes = (parse_probe(assembly, "9:32526:hole3"),)
    return deflect(assembly, loads, gravity=GRAVITY, probes=probes), (*loads, *probes)


def test_delta_method_agrees_with_monte_carlo():
    table = table_with((1.0, 1.0))
    answer, points = sag(held(table))
    random = np.random.default_rng(3)
    factors = np.exp(random.multivariate_normal([0, 0], COVARIANCE, size=150))
    way = answer.probe_twists[:, :3] / np.linalg.norm(answer.probe_twists[:, :3], axis=1)[:, None]
    drawn = np.array(
        [np.sum(sag(held(table_with(f)))[0].probe_twists[:, :3] * way, axis=1) for f in factors]
    )
    for k in range(2):
        low, high = displacement_interval(answer, points, k, table)
        assert low < np.linalg.norm(answer.probe_twists[k, :3]) < high
        # the deviation of 150 draws is known to 6 %
        half = 1.959964 * np.log(drawn[:, k]).std(ddof=1)
        assert np.log(high / low) / 2 == pytest.approx(half, rel=0.18)


def test_nothing_measured_no_interval():
    answer, points = sag(held(default_table()))
    assert displacement_interval(answer, points, 0, default_table()) is None
