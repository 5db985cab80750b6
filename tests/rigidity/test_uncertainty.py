"""Interval of the rigidity: derivative against finite differences, delta method against Monte Carlo."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from technic.assembly.stiffness import StiffnessValue, default_table, read_table
from technic.errors import SchemaError
from technic.loading import load
from technic.rigidity.analyze import analyze
from technic.rigidity.uncertainty import energy_shares
from technic.system.assemble import assemble, element_of
from technic.system.parameters import Parameter

PAIR = """0 Pair of 5L beams, two pins
1 4 0 0 0 1 0 0 0 1 0 0 0 1 32316.dat
1 4 0 -20 60 1 0 0 0 1 0 0 0 1 32316.dat
1 0 0 -10 40 0 1 0 1 0 0 0 0 1 2780.dat
1 0 0 -10 20 0 1 0 1 0 0 0 0 1 2780.dat
"""
TABLE = """schema = "technic-stiffness/1"
[sources]
calibrated = "made up"
paper = "paper"
[calibration]
parameters = ["pin/pin_hole shear", "pin/pin_hole tilt"]
log_covariance = [[0.04, -0.006], [-0.006, 0.01]]
[connection."pin/pin_hole"]
type = "hinge"
axial = { value = 1e8, provenance = "paper" }
shear = { value = 65625.0, provenance = "calibrated", interval_95 = [44000.0, 97000.0] }
tilt = { value = 0.240, provenance = "calibrated", interval_95 = [0.197, 0.292] }
"""
NAMES = ("shear", "tilt")


@pytest.fixture
def pair(tmp_path):
    path = tmp_path / "pair.ldr"
    path.write_text(PAIR)
    return path


@pytest.fixture
def table(tmp_path):
    path = tmp_path / "table.toml"
    path.write_text(TABLE)
    return read_table(path)


def changed(table, factors):
    """The table with shear and tilt multiplied."""
    entry = table.get("pin/pin_hole")
    values = {**entry.values}
    for name, factor in zip(NAMES, factors, strict=True):
        values[name] = StiffnessValue(factor * entry.values[name].value, "test")
    connections = {**table.connections, "pin/pin_hole": replace(entry, values=values)}
    return replace(table, connections=connections)


def rigidity(path, table):
    return analyze(load(path, table=table), modes=1).rigidity.value


def test_energy_shares_are_the_derivatives(pair, table):
    assembly = load(pair, table=table)
    report = analyze(assembly)
    parameters = tuple(Parameter("pin/pin_hole", name) for name in NAMES)
    shares = energy_shares(assemble(assembly), report.modes[0].unknowns, parameters)
    assert 0.0 < shares.sum() < 1.0
    step = 1e-4
    for k in range(2):
        up, down = (
            np.log(rigidity(pair, changed(table, np.exp(s * step * np.eye(2)[k])))) for s in (1, -1)
        )
        assert shares[k] == pytest.approx((up - down) / (2 * step), rel=1e-4)


def test_studs_that_act_together_share_their_stiffnesses(tmp_path):
    # two bricks on two plates: rows of rotation are made of axial, shear and tilt through lever arms
    path = tmp_path / "studs.ldr"
    path.write_text(
        "0 Studs\n1 4 0 0 0 1 0 0 0 1 0 0 0 1 3001.dat\n"
        "1 4 40 -24 20 1 0 0 0 1 0 0 0 1 3001.dat\n1 4 0 -24 -20 1 0 0 0 1 0 0 0 1 3001.dat\n"
    )
    motions = ("axial", "shear", "tilt")
    parameters = tuple(Parameter("stud/tube", name) for name in motions)

    def value(factors):
        entry = default_table().get("stud/tube")
        values = {
            name: StiffnessValue(factor * entry.values[name].value, "test")
            for name, factor in zip(motions, factors, strict=True)
        }
        connections = {**default_table().connections, "stud/tube": replace(entry, values=values)}
        table = replace(default_table(), connections=connections)
        return analyze(load(path, table=table), modes=1, parts="frame")

    uneven = np.array([1.0, 0.7, 3.0])
    report = value(uneven)
    system = assemble(report.assembly, element=element_of)
    shares = energy_shares(system, report.modes[0].unknowns, parameters)
    step = 1e-4
    for k in range(3):
        up, down = (
            np.log(value(uneven * np.exp(s * step * np.eye(3)[k])).rigidity.value) for s in (1, -1)
        )
        assert shares[k] == pytest.approx((up - down) / (2 * step), rel=1e-3, abs=1e-6)
    assert np.all(shares > 1e-4)


def test_delta_method_agrees_with_monte_carlo(pair, table):
    value = analyze(load(pair, table=table), modes=1, table=table).rigidity
    low, high = value.interval_95
    assert low < value.value < high
    random = np.random.default_rng(1)
    factors = np.exp(random.multivariate_normal([0, 0], table.log_covariance, size=300))
    drawn = np.log([rigidity(pair, changed(table, f)) for f in factors])
    # the standard deviation of 300 draws is known to 4 %; the curve of lambda adds a little
    half = 1.959964 * drawn.std(ddof=1)
    assert np.log(high / low) / 2 == pytest.approx(half, rel=0.15)


def test_without_measurements_there_is_no_interval(pair, table):
    assembly = load(pair, table=table)
    assert analyze(assembly, modes=1).rigidity.interval_95 is None
    assert analyze(assembly, modes=1, table=default_table()).rigidity.interval_95 is None


def test_intervals_alone_stand_for_a_covariance(pair, tmp_path):
    path = tmp_path / "alone.toml"
    lines = TABLE.splitlines()
    start = lines.index("[calibration]")
    path.write_text("\n".join(lines[:start] + lines[start + 3 :]))
    table = read_table(path)
    assert table.measured == (("pin/pin_hole", "shear"), ("pin/pin_hole", "tilt"))
    expected = np.log([97 / 44, 0.292 / 0.197]) / (2 * 1.959964)
    assert np.sqrt(np.diag(table.log_covariance)) == pytest.approx(expected)
    assert analyze(load(pair, table=table), modes=1, table=table).rigidity.interval_95 is not None


@pytest.mark.parametrize(
    ("old", "new", "said"),
    [
        ("[[0.04, -0.006], [-0.006, 0.01]]", "[[0.04, 0.5], [0.5, 0.01]]", "semi-definite"),
        ("[[0.04, -0.006], [-0.006, 0.01]]", "[[0.04]]", "2 rows"),
        ("[[0.04, -0.006], [-0.006, 0.01]]", '"none"', "2 rows"),
        ('"pin/pin_hole tilt"]', '"pin/pin_hole spin"]', "no spin of pin/pin_hole"),
        ('["pin/pin_hole shear", "pin/pin_hole tilt"]', "[1, 2]", "expected names"),
    ],
)
def test_a_broken_covariance_is_refused(tmp_path, old, new, said):
    path = tmp_path / "table.toml"
    assert old in TABLE
    path.write_text(TABLE.replace(old, new))
    with pytest.raises(SchemaError, match=said):
        read_table(path)
