"""The rigs' forward model against the static solution, finite differences, and a closed form by hand."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from calibration.rigs import shipped_rigs
from technic.assembly.select import parse_fix
from technic.assembly.stiffness import StiffnessValue, default_table
from technic.errors import UsageError
from technic.loading import load
from technic.statics.loads import parse_probe
from technic.statics.rig import rig_model
from technic.statics.solve import Load, deflect
from technic.system.assemble import element_of, rigid_element_of
from technic.system.parameters import Parameter

CASES = [
    (name, hole.place, connection, motions)
    for name, rig in shipped_rigs().items()
    for hole in rig.loads
    for connection, motions in rig.joints.items()
]


def table_with(values):
    """The shipped table with some stiffnesses changed."""
    table = default_table()
    connections = dict(table.connections)
    for parameter, value in values.items():
        entry = connections[parameter.connection]
        changed = {**entry.values, parameter.motion: StiffnessValue(value, "test")}
        connections[parameter.connection] = replace(entry, values=changed)
    return replace(table, connections=connections)


def held(rig, table):
    assembly = load(rig.model, table=table)
    return replace(assembly, supports=tuple(parse_fix(assembly, p) for p in rig.clamped))


@pytest.mark.parametrize(("name", "place", "connection", "motions"), CASES)
@pytest.mark.parametrize("scale", [0.1, 1.0, 7.0])
def test_equals_the_static_solution_at_any_stiffness(name, place, connection, motions, scale):
    rig, table = shipped_rigs()[name], default_table()
    parameters = [Parameter(connection, m) for m in motions]
    assembly = held(rig, table)
    probe = parse_probe(assembly, place)
    model = rig_model(assembly, probe, parameters, table)
    factors = scale * 1.3 ** np.arange(len(parameters))
    value, _ = model.response(factors * model.start)
    changed = dict(zip(parameters, factors * model.start, strict=True))
    other = held(rig, table_with(changed))
    for axis in range(3):
        force = Load(probe.part, probe.point, np.eye(3)[axis], np.zeros(3), probe.port)
        said = deflect(other, (force,)).probe_twists[0, :3]
        assert value[:, axis] == pytest.approx(said, rel=1e-6, abs=1e-6 * abs(said).max())
        said = deflect(other, (), gravity=np.eye(3)[axis], probes=(probe,)).probe_twists[0, :3]
        assert value[:, 3 + axis] == pytest.approx(said, rel=1e-6, abs=1e-6 * abs(said).max())


@pytest.mark.parametrize(("name", "place", "connection", "motions"), CASES)
def test_derivative_equals_finite_differences(name, place, connection, motions):
    rig, table = shipped_rigs()[name], default_table()
    parameters = [Parameter(connection, m) for m in motions]
    assembly = held(rig, table)
    model = rig_model(assembly, parse_probe(assembly, place), parameters, table)
    at = 0.6 * model.start
    value, slope = model.response(at)
    step = 1e-5
    for k in range(len(parameters)):
        up, down = (model.response(at * np.exp(s * step * np.eye(len(at))[k]))[0] for s in (1, -1))
        difference = (up - down) / (2 * step)
        assert slope[k] == pytest.approx(difference, rel=1e-5, abs=1e-7 * abs(value).max())


def closed_form(points, arm, down, shear, tilt, gap):
    """Sag per newton of a rigid beam on pins, by hand (m/N).

    Each pin is a rigid body between two bores `gap` apart along y, with a shear spring and a tilt
    spring in either bore. A lateral shift of one beam against the other needs, per newton on one
    pin, 2/shear for the springs across and gap^2 / (2 tilt) for the pin that tilts; a turn about a
    line across the pins, tilt/2 per pin. Along their lines pins do not move (1e8 N/m).

    Parameters
    ----------
    points : (n, 3) ndarray
        Middle of every pin.
    arm : (3,) ndarray
        The loaded point; both may have any common origin.
    """
    lateral = 1.0 / (2.0 / shear + gap**2 / (2.0 * tilt))
    centre = points.mean(axis=0)
    r = arm - centre
    if abs(down[1]) < 0.5:  # in the plane of the beams: shift, and turn about y
        turning = lateral * np.sum((points - centre) ** 2)
        moment = np.cross(r, down)[1]
        return 1.0 / (len(points) * lateral) + moment**2 / turning
    # across the plane: the turn about the line of the pins (z), which only tilt resists
    moment = np.cross(r, down)[2]
    return moment**2 / (len(points) * tilt / 2.0)


@pytest.mark.parametrize("place", ["9:32526:hole1", "9:32526:hole3"])
@pytest.mark.parametrize("down", [[0, 0, 1], [0, 1, 0]], ids=["edge", "flat"])
def test_closed_form_of_rigid_beams_on_springs(place, down):
    rig, table = shipped_rigs()["pin-pair"], default_table()
    assembly = held(rig, table)
    probe = parse_probe(assembly, place)
    parameters = [Parameter("pin/pin_hole", m) for m in ("shear", "tilt")]
    pins = np.array([p.pose.translation for p in assembly.parts if p.number == "2780"])
    assert len(pins) == 2
    for shear, tilt in ((65625.0, 0.24), (3e4, 0.4), (2e5, 0.1)):
        sag = {}
        for kind, element in (("rigid", rigid_element_of), ("frame", element_of)):
            model = rig_model(assembly, probe, parameters, table, element=element)
            value, _ = model.response(np.array([shear, tilt]))
            sag[kind] = np.array(down) @ value[:, :3] @ np.array(down)
        expected = closed_form(pins, probe.point, np.array(down), shear, tilt, 0.008)
        assert sag["rigid"] == pytest.approx(expected, rel=0.02)
        # beams that bend and twist sag more, but on a good rig the joints decide
        assert sag["rigid"] < sag["frame"] < 1.3 * sag["rigid"]


def test_studs_that_act_together_are_refused(tmp_path):
    path = tmp_path / "studs.ldr"
    path.write_text(
        "0 studs\n1 4 0 0 0 1 0 0 0 1 0 0 0 1 3700.dat\n1 4 0 -24 0 1 0 0 0 1 0 0 0 1 3700.dat\n"
    )
    assembly = load(path)
    assembly = replace(assembly, supports=(parse_fix(assembly, "2:3700"),))
    probe = parse_probe(assembly, "3:3700:hole1")
    with pytest.raises(UsageError, match="several studs"):
        rig_model(assembly, probe, [Parameter("stud/tube", "tilt")], default_table())


def test_a_rig_without_the_joint_is_refused():
    assembly = held(shipped_rigs()["pin-pair"], default_table())
    probe = parse_probe(assembly, "9:32526:hole1")
    with pytest.raises(UsageError, match="no joint that holds shear of ball/socket"):
        rig_model(assembly, probe, [Parameter("ball/socket", "shear")], default_table())
