"""Calibration: from readings of real joints to stiffnesses with intervals."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Final

import numpy as np

from calibration.dataset import Dataset, read_csv
from calibration.diagnose import GridCheck, cure, grid_check, warnings
from calibration.errors import DataError, FitError
from calibration.fit import Fit, Loss, Switch, fit
from calibration.model import Forward
from calibration.rigs import Condition, Rig, read_rigs, shipped_rigs
from technic.assembly.stiffness import StiffnessTable, default_table
from technic.errors import InputError, SchemaError
from technic.geometry import Array
from technic.statics.forward import forward_model
from technic.system.assemble import ElementFactory, solid_element_of
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
    element: ElementFactory = solid_element_of,
    parts: str = "solid",
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
