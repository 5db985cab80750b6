"""The worst case as a field: how far points of the model go under its worst load of 1 N.

The worst load pushes every piece of material in the direction in which it goes, in proportion to its
mass and to how far it goes (``f = lambda M x``): the field shows movement and load at once.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from technic.geometry import Array
from technic.rigidity.result import RigidityReport
from technic.rigidity.serialize import unit_load

__all__ = ["WorstField", "worst_field"]


@dataclass(frozen=True, slots=True, eq=False)
class WorstField:
    """Displacements of sample points under the worst-case load of 1 N.

    Parameters
    ----------
    parts : (n,) ndarray of int
        The part of each sample.
    points, displacements : (n, 3) ndarray
        World coordinates (m), displacement (m).
    weights : (n,) ndarray
        Mass that each sample stands for (kg).
    load_per_mass : float
        Load on the material per kilogram where it goes one metre (N/kg/m).
    """

    parts: Array
    points: Array
    displacements: Array
    weights: Array
    load_per_mass: float

    @property
    def strongest(self) -> float:
        """The largest load on the material (N/kg)."""
        return float(np.linalg.norm(self.displacements, axis=1).max()) * self.load_per_mass

    def furthest(self, part: int) -> Array | None:
        """Return the displacement of the sample of a part that goes furthest; None without samples."""
        mine = self.displacements[self.parts == part]
        return mine[int(np.argmax(np.linalg.norm(mine, axis=1)))] if len(mine) else None


def worst_field(report: RigidityReport) -> WorstField | None:
    """Return the field, sampled at the nodes, or at centroid and ports, of the heaviest component.

    None when there is no elastic mode.
    """
    load = unit_load(report)
    if load is None:
        return None
    _, twists = load
    value = report.modes[0].value
    parts, points, ways, weights = [], [], [], []
    for k in report.components[0].parts:
        part = report.assembly.parts[k]
        nodes = report.node_points.get(k)
        if nodes is not None and len(nodes) > 1:
            where = np.asarray(nodes)
            way = np.asarray(report.node_displacements[k]) / value
        else:
            ports = [part.pose.points(port.position) for port in part.ports]
            where = np.array([part.centroid, *ports])
            way = twists[k, :3] + np.cross(twists[k, 3:], where - part.centroid)
        parts += [k] * len(where)
        points.append(where)
        ways.append(way)
        weights += [part.mass_properties.mass / len(where)] * len(where)
    mass = report.components[0].mass
    return WorstField(
        np.array(parts),
        np.concatenate(points),
        np.concatenate(ways),
        np.array(weights),
        value / mass,
    )
