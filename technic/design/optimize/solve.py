"""Move vertices until no small move makes the linkage more rigid.

Sequential quadratic programming (SLSQP; D. Kraft, DFVLR-FB 88-28, 1988) inside a box of limited moves
around the best geometry so far. The box grows while it pays and shrinks when it does not; the smooth
minimum over the lowest modes is sharpened on the way. Long runs at the end find the optimum itself.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass, field
from time import perf_counter
from typing import Final, Literal

import numpy as np
from scipy import optimize as scipy_optimize

from technic.assembly.model import Assembly
from technic.design.optimize.freedom import Freedom, Rule, freedom, rules_of
from technic.design.optimize.limits import Limits, limits_of
from technic.design.optimize.moving import Model, moved
from technic.design.optimize.objective import Motions, Objective, Point, spectrum
from technic.design.optimize.vertices import Geometry, find_geometry
from technic.errors import NumericalError, UsageError
from technic.geometry import Array
from technic.system.inverse import single_thread

__all__ = ["Optimization", "Step", "optimize"]

SHARPNESS: Final = 30.0
"""Of the smooth minimum in the first search: within 2.5 % of the minimum where two modes meet."""

REACH: Final = 0.15
"""First limit of a move, in mean bar lengths."""

SMALL: Final = 5e-4
"""The search ends when moves are limited to this share of the mean bar length..."""

GAIN: Final = 5e-3
"""...or a round gains less than this share of the objective."""

POLISH: Final = (250.0, 1000.0)
"""Sharpness of the last searches, which run long enough for SLSQP to learn the curvature."""

CLOSE: Final = 0.1
"""Limit of a move in these, in mean bar lengths..."""

ROUNDS: Final = 6
"""...their number at most..."""

FINE: Final = 1e-3
"""...and the gain (share of the objective) below which they end."""

BROKEN: Final = 1e-6
"""Limits count as kept within this share of the mean bar length: what SLSQP keeps them to."""

Status = Literal["converged", "interrupted", "evaluations", "time"]


@dataclass(frozen=True, slots=True, eq=False)
class Step:
    """One improvement.

    Parameters
    ----------
    evaluation : int
    rigidity, second : float
        Lowest two eigenvalues (N/m).
    edges : float
        Total length (m).
    merit : float
        The objective (with the true minimum).
    positions : (v, 3) ndarray
    """

    evaluation: int
    rigidity: float
    second: float
    edges: float
    merit: float
    positions: Array


@dataclass(frozen=True, slots=True, eq=False)
class Optimization:
    """What `optimize` found.

    Parameters
    ----------
    before, after : Assembly
    geometry : Geometry
        Vertices at the start.
    positions : (v, 3) ndarray
        Vertices at the end (m).
    start, end : Point
    history : tuple of Step
        The path of the vertices, the start first.
    status : {"converged", "interrupted", "evaluations", "time"}
    evaluations : int
    seconds : float
    parameters : int
    internal : int
        Motions, before and after.
    limits : Limits
    """

    before: Assembly
    after: Assembly
    geometry: Geometry
    positions: Array
    start: Point
    end: Point
    history: tuple[Step, ...]
    status: Status
    evaluations: int
    seconds: float
    parameters: int
    internal: int
    limits: Limits

    @property
    def factor(self) -> float:
        """How many times more rigid."""
        return self.end.rigidity / self.start.rigidity

    @property
    def moves(self) -> Array:
        """Displacement of every vertex (m), (v, 3)."""
        return np.asarray(self.positions - self.geometry.positions)


class _Stop(Exception):
    """The search ends; why."""

    def __init__(self, status: Status) -> None:
        super().__init__(status)
        self.status = status


@dataclass(slots=True, eq=False)
class _Search:
    """The search: counts evaluations and keeps the best geometry that obeys the limits."""

    objective: Objective
    freedom: Freedom
    limits: Limits
    max_evaluations: int
    deadline: float
    progress: Callable[[Step], None] | None
    evaluations: int = 0
    best: float = np.inf
    best_q: Array = field(default_factory=lambda: np.zeros(0))
    best_point: Point | None = None
    history: list[Step] = field(default_factory=list)
    seen: tuple[bytes, float, Point] | None = None

    def point(self, q: Array) -> Point:
        key = q.tobytes()
        if self.seen is not None and self.seen[:2] == (key, self.objective.sharpness):
            return self.seen[2]
        if self.evaluations >= self.max_evaluations:
            raise _Stop("evaluations")
        if perf_counter() > self.deadline:
            raise _Stop("time")
        positions = self.freedom.positions(q)
        point = self.objective.at(positions)
        self.evaluations += 1
        self.seen = (key, self.objective.sharpness, point)
        merit = self.objective.merit(point)
        if point.rigidity > 0.0 and merit < self.best and self.limits.broken(positions) <= BROKEN:
            self.best, self.best_q, self.best_point = merit, q.copy(), point
            second = float(point.spectrum[1]) if len(point.spectrum) > 1 else np.inf
            step = Step(self.evaluations, point.rigidity, second, point.edges, merit, positions)
            self.history.append(step)
            if self.progress is not None:
                self.progress(step)
        return point

    def round(self, start: Array, reach: float, iterations: int) -> Array:
        """Run SLSQP inside the box around `start`."""
        unit = self.limits.unit
        low = np.maximum(self.freedom.lower, start - reach)
        high = np.minimum(self.freedom.upper, start + reach)
        basis = self.freedom
        # which pairs count is settled for the round: the optimiser needs a fixed number of limits
        positions = basis.positions(start)
        gaps = np.linalg.norm(
            positions[self.limits.pairs[:, 0]] - positions[self.limits.pairs[:, 1]], axis=1
        )
        near = gaps < self.limits.clearance + 4.0 * reach
        limits = Limits(
            self.limits.stretches,
            self.limits.shortest,
            self.limits.longest,
            self.limits.pairs[near],
            self.limits.clearance,
            self.limits.line_masses,
            self.limits.heaviest,
            unit,
        )
        found = scipy_optimize.minimize(
            lambda y: self.point(start + unit * y).value,
            np.zeros(len(start)),
            jac=lambda y: unit * basis.pull(self.point(start + unit * y).gradient),
            bounds=np.column_stack([(low - start) / unit, (high - start) / unit]),
            constraints={
                "type": "ineq",
                "fun": lambda y: limits.at(basis.positions(start + unit * y))[0],
                "jac": lambda y: unit * basis.pull(limits.at(basis.positions(start + unit * y))[1]),
            },
            method="SLSQP",
            options={"maxiter": iterations, "ftol": 1e-7},
        )
        return np.asarray(start + unit * found.x)

    def run(self, start: Array) -> None:
        """Search from one start."""
        unit = self.limits.unit
        self.objective.sharpness = SHARPNESS
        q, reach = start, REACH * unit
        while reach > SMALL * unit:
            end, gain = self.gained(q, reach, 8)
            if gain > 0.0:
                touched = float(np.abs(end - q).max()) > 0.9 * reach
                q = end
                reach *= 1.6 if touched else 0.5
            if gain < GAIN * max(1.0, abs(self.best)):
                break
        for sharpness in POLISH:
            self.objective.sharpness = sharpness
            for _ in range(ROUNDS):
                end, gain = self.gained(q, CLOSE * unit, 60)
                q = end if gain > 0.0 else q
                if gain < FINE * max(1.0, abs(self.best)):
                    break

    def gained(self, q: Array, reach: float, iterations: int) -> tuple[Array, float]:
        """Run a round from `q`; return its end and what the objective gained, 0 if limits are broken."""
        before = self.objective.merit(self.point(q))
        end = self.round(q, reach, iterations)
        gain = before - self.objective.merit(self.point(end))
        kept = self.limits.broken(self.freedom.positions(end)) <= BROKEN
        return end, gain if kept else 0.0


def optimize(
    assembly: Assembly,
    *,
    rules: Mapping[str, Rule] | None = None,
    names: Mapping[str, Array] | None = None,
    rigid_weight: float = -1.0,
    geometry_weight: float = 0.002,
    lengths: tuple[float, float] = (0.5, 2.0),
    clearance: float | None = None,
    max_mass: float | None = None,
    restarts: int = 0,
    max_evaluations: int = 500,
    max_seconds: float = np.inf,
    seed: int = 0,
    progress: Callable[[Step], None] | None = None,
) -> Optimization:
    """Move the vertices of a linkage so that it resists its worst load better.

    Parameters
    ----------
    assembly : Assembly
        Of an assembly file; bars and truss bars move with their vertices.
    rules : mapping, optional
        Rule of a vertex by its name; other vertices are free where that is possible.
    names : mapping, optional
        Names for places (m).
    rigid_weight, geometry_weight : float
        The paper's weights; see `technic.design.optimize.objective.Objective` for the units.
    lengths : (float, float)
        Shortest and longest a bar may become, as shares of its length at the start.
    clearance : float, optional
        Least distance of two joints (m); the widest bar's width if left out.
    max_mass : float, optional
        kg.
    restarts : int
        Further searches, from geometries near the best one.
    max_evaluations : int
    max_seconds : float
    seed : int
        Of the restarts.
    progress : callable, optional
        Told about every improvement.

    Returns
    -------
    Optimization
        The best geometry found, also when it was interrupted from the keyboard.

    Raises
    ------
    UsageError
        Nothing can move, or the limits leave no room.
    NumericalError
        The assembly has no rigidity to begin with.
    """
    began = perf_counter()
    geometry = find_geometry(assembly, names)
    freed = freedom(geometry, rules_of(geometry, rules), assembly.dimension)
    model = Model(assembly, geometry)
    motions = Motions(model)
    with single_thread():
        values, _ = spectrum(model, motions, freed.start)
    if not len(values):
        raise NumericalError("the assembly's rigidity at the start could not be computed")
    objective = Objective(model, motions, rigid_weight, geometry_weight, float(values[0]), 1.0)
    stretches = geometry.stretches
    ends = freed.start[stretches]
    objective.start_edges = float(np.linalg.norm(ends[:, 1] - ends[:, 0], axis=1).sum())
    limits = limits_of(
        model,
        freed,
        objective.line_masses(),
        lengths=lengths,
        clearance=clearance,
        max_mass=max_mass,
    )
    search = _Search(objective, freed, limits, max_evaluations, began + max_seconds, progress)
    random = np.random.default_rng(seed)
    status: Status = "converged"
    zero = np.zeros(freed.size)
    try:
        with single_thread():
            start = search.point(zero)
            search.run(zero)
            for _ in range(restarts):
                step = 0.1 * limits.unit * random.standard_normal(freed.size)
                search.run(np.clip(search.best_q + step, freed.lower, freed.upper))
    except _Stop as stop:
        status = stop.status
    except KeyboardInterrupt:
        status = "interrupted"
    if search.best_point is None:
        raise UsageError("the geometry at the start breaks the limits")
    positions = freed.positions(search.best_q)
    return Optimization(
        before=assembly,
        after=moved(model, positions),
        geometry=geometry,
        positions=positions,
        start=start,
        end=search.best_point,
        history=tuple(search.history),
        status=status,
        evaluations=search.evaluations,
        seconds=perf_counter() - began,
        parameters=freed.size,
        internal=motions.internal,
        limits=limits,
    )
