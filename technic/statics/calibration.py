"""Calibration: from readings of real joints to stiffnesses with intervals."""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence
from contextlib import ExitStack
from dataclasses import dataclass, replace
from importlib.resources import as_file
from pathlib import Path
from typing import Final

import numpy as np

from calibration.dataset import GRAVITY, Dataset, read_csv
from calibration.diagnose import GridCheck, cure, grid_check, warnings
from calibration.errors import DataError, FitError
from calibration.fit import Fit, Loss, Switch, fit
from calibration.model import Forward, Response
from calibration.rigs import Condition, Rig, read_rigs, shipped_rigs
from technic.assembly.model import Assembly
from technic.assembly.select import parse_fix
from technic.assembly.stiffness import StiffnessTable, default_table
from technic.errors import InputError, SchemaError
from technic.geometry import Array
from technic.loading import load
from technic.statics.loads import parse_probe
from technic.statics.rig import RigModel, rig_model
from technic.system.assemble import ElementFactory, element_of
from technic.system.parameters import Parameter

__all__ = ["Calibration", "Measured", "calibrate", "forward_model"]

UNITS: Final = {"axial": "N/m", "shear": "N/m", "spin": "N m/rad", "tilt": "N m/rad"}


@dataclass(frozen=True, slots=True)
class Measured:
    """One stiffness after a calibration.

    Parameters
    ----------
    parameter : Parameter
    value : float
        N/m or N m/rad; of the table, not measured, when it could not be identified.
    interval_95 : (float, float) or None
    identifiable : bool
    advice : str
        For one that could not be identified: what would.
    """

    parameter: Parameter
    value: float
    interval_95: tuple[float, float] | None
    identifiable: bool
    advice: str = ""

    @property
    def unit(self) -> str:
        """Unit of the value."""
        return UNITS[self.parameter.motion]


@dataclass(frozen=True, slots=True, eq=False)
class Calibration:
    """Everything a calibration found.

    Parameters
    ----------
    dataset : Dataset
    measured : tuple of Measured
        All stiffnesses that the rigs can tell.
    fit : Fit
    grid : GridCheck
    warnings : tuple of str
    table : StiffnessTable
        The table that the search started from, and whose values were taken for all else.
    parts : str
        What the parts were made of ("frame", "solid"...): beams that bend take their share of the sag.
    """

    dataset: Dataset
    measured: tuple[Measured, ...]
    fit: Fit
    grid: GridCheck
    warnings: tuple[str, ...]
    table: StiffnessTable
    parts: str

    @property
    def identified(self) -> tuple[Measured, ...]:
        """Stiffnesses that were measured, in the order of the fit's covariance."""
        return tuple(self.measured[k] for k in self.fit.active)

    @property
    def log_covariance(self) -> Array:
        """Covariance of the logarithms of the identified stiffnesses, scaled to normal intervals."""
        count = len(self.fit.active)
        # so that 1.96 deviations reach to the ends of the interval, few readings or many
        return self.fit.covariance[:count, :count] * (self.fit.quantile / 1.959964) ** 2

    @property
    def correlation(self) -> Array:
        """Correlation of the identified stiffnesses, (a, a)."""
        covariance = self.log_covariance
        deviations = np.sqrt(np.diag(covariance))
        return np.asarray(covariance / np.outer(deviations, deviations))


def calibrate(
    path: str | Path,
    *,
    rigs: str | Path | None = None,
    table: StiffnessTable | None = None,
    loss: Loss = "linear",
    offsets: Switch = "auto",
    element: ElementFactory = element_of,
    parts: str = "frame",
) -> Calibration:
    """Return the joint stiffnesses that a file of readings tells.

    Parameters
    ----------
    path : path-like
        CSV, see `calibration.dataset`.
    rigs : path-like, optional
        File of further rigs.
    table : StiffnessTable, optional
        Where the search starts, and the values of what is not measured; default: the shipped one.
    loss : {"linear", "huber"}
    offsets : {"auto", "off"}
        Whether free play and hysteresis are looked for.
    element : callable
        What parts are made of, and `parts`, its name.

    Raises
    ------
    SchemaError
        Faults of the file, by row and column.
    InputError
        The readings tell nothing, or contradict each other.
    """
    table = table or default_table()
    known = dict(shipped_rigs())
    if rigs is not None:
        try:
            known |= read_rigs(rigs)
        except DataError as error:
            raise SchemaError(error.faults, path=rigs) from error
    try:
        dataset = read_csv(path, known)
    except DataError as error:
        raise SchemaError(error.faults, path=path) from error
    readings = dataset.readings
    used = sorted({r.condition.rig for r in readings})
    wanted = dict.fromkeys(
        Parameter(joint, motion)
        for joint in sorted({r.joint_type for r in readings})
        for name in used
        for motion in known[name].joints.get(joint, ())
    )
    parameters = tuple(wanted)
    candidates = _candidates(known, {p.connection for p in parameters})
    places = {(r.condition.rig, r.condition.place) for r in readings}
    places |= {(c.rig, c.place) for c in candidates}
    forward = forward_model(known, places, parameters, table, element)
    start = np.array([table.get(p.connection).values[p.motion].value for p in parameters])
    try:
        found = fit(readings, forward, start, loss=loss, offsets=offsets)
    except FitError as error:
        raise InputError(str(error), path=path) from error
    measured = _measured(parameters, found, candidates, forward, {r.condition for r in readings})
    said = warnings(readings, found)
    said += [
        f"{m.parameter} cannot be told from these data{m.advice}" for m in measured if m.advice
    ]
    grid = grid_check(readings, forward, found, start)
    if not grid.agrees:
        said.append(
            f"the grid search ended {grid.distance:.1f} standard deviations from the fit: "
            "the best point is not well defined"
        )
    return Calibration(dataset, measured, found, grid, tuple(said), table, parts)


def _candidates(rigs: Mapping[str, Rig], joints: set[str]) -> list[Condition]:
    return [
        Condition(name, pose, entry.angle_deg, hole.place)
        for name, rig in rigs.items()
        if joints & set(rig.joints)
        for pose, entry in rig.poses.items()
        for hole in rig.loads
    ]


def _measured(
    parameters: Sequence[Parameter],
    found: Fit,
    candidates: Sequence[Condition],
    forward: Forward,
    seen: set[Condition],
) -> tuple[Measured, ...]:
    out = []
    for k, parameter in enumerate(parameters):
        value = float(np.exp(found.log_stiffness[k]))
        if k in found.active:
            interval = found.interval(found.active.index(k))
            out.append(Measured(parameter, value, interval, identifiable=True))
            continue
        best = cure(k, candidates, forward, found)
        unit = UNITS[parameter.motion]
        advice = f"; {value:g} {unit} of the table was taken, and what was found holds with it. "
        if best is None:
            advice += "No known rig tells it apart from the rest."
        elif best[0] in seen:
            advice += f"More readings in pose {best[0].pose} of rig {best[0].rig} would tell it."
        else:
            advice += f"Measure also pose {best[0].pose} of rig {best[0].rig}."
        out.append(Measured(parameter, value, None, identifiable=False, advice=advice))
    return tuple(out)


def forward_model(
    rigs: Mapping[str, Rig],
    places: Iterable[tuple[str, str]],
    parameters: Sequence[Parameter],
    table: StiffnessTable,
    element: ElementFactory = element_of,
) -> Forward:
    """Return the mechanics as the fit wants it; every rig is solved once for each loaded hole.

    Parameters
    ----------
    rigs : mapping of str to Rig
    places : iterable of (str, str)
        Rig and loaded hole.
    parameters : sequence of Parameter
        Those that a rig does not have are zero in its derivatives.
    table : StiffnessTable
    element : callable
    """
    models: dict[tuple[str, str], tuple[RigModel, list[int]]] = {}
    assemblies: dict[str, Assembly] = {}
    for name, place in sorted(set(places)):
        rig = rigs[name]
        if name not in assemblies:
            with ExitStack() as stack:
                path = stack.enter_context(as_file(rig.model))
                assembly = load(path, table=table)
            supports = tuple(parse_fix(assembly, text) for text in rig.clamped)
            assemblies[name] = replace(assembly, supports=assembly.supports + supports)
        own = [k for k, p in enumerate(parameters) if p.motion in rig.joints.get(p.connection, ())]
        model = rig_model(
            assemblies[name],
            parse_probe(assemblies[name], place),
            [parameters[k] for k in own],
            table,
            element=element,
        )
        models[name, place] = (model, own)

    known: dict[tuple[Condition, ...], tuple[Array, list[tuple[RigModel, list[int], Array]]]] = {}

    def grouped(
        conditions: tuple[Condition, ...],
    ) -> tuple[Array, list[tuple[RigModel, list[int], Array]]]:
        """Return down for every condition, and the conditions of each model."""
        if conditions not in known:
            down = np.array([rigs[c.rig].poses[c.pose].down_at(c.angle_deg) for c in conditions])
            groups = [
                (
                    *models[key],
                    np.array([k for k, c in enumerate(conditions) if (c.rig, c.place) == key]),
                )
                for key in sorted({(c.rig, c.place) for c in conditions})
            ]
            known[conditions] = (down, groups)
        return known[conditions]

    def forward(conditions: Sequence[Condition], log_stiffness: Array) -> Response:
        down, groups = grouped(tuple(conditions))
        stiffness = np.exp(np.asarray(log_stiffness, dtype=float))
        c, k = len(down), len(parameters)
        value, slope = np.zeros((2, c)), np.zeros((2, c, k))
        for model, own, members in groups:
            answer, change = model.response(stiffness[own])
            d = down[members]
            for half, scale in ((0, 1.0), (1, GRAVITY)):
                columns = slice(3 * half, 3 * half + 3)
                value[half, members] = scale * np.einsum("ci,ij,cj->c", d, answer[:, columns], d)
                sloped = np.einsum("ci,pij,cj->cp", d, change[:, :, columns], d)
                slope[half][np.ix_(members, np.array(own))] = scale * sloped
        return Response(value[0], value[1], slope[0], slope[1])

    return forward
