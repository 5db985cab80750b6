"""How vertices may move: rules for each of them, and the parameters that the rules leave."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Literal

import numpy as np

from technic.design.optimize.vertices import Geometry
from technic.errors import UsageError
from technic.geometry import Array

__all__ = ["Freedom", "Rule", "freedom", "rules_of"]


@dataclass(frozen=True, slots=True, eq=False)
class Rule:
    """How a vertex may move.

    Parameters
    ----------
    kind : {"free", "fixed", "line", "mirror"}
    direction : (3,) ndarray or None
        Of a line.
    box : (2, 3) ndarray or None
        Lowest and highest coordinates (m).
    of : int or None
        For "mirror": the vertex whose mirror image this one stays.
    plane : (2, 3) ndarray or None
        For "mirror": a point of the plane and its normal.
    """

    kind: Literal["free", "fixed", "line", "mirror"] = "free"
    direction: Array | None = None
    box: Array | None = None
    of: int | None = None
    plane: Array | None = None


@dataclass(frozen=True, slots=True, eq=False)
class Freedom:
    """Positions as a linear function of the parameters: ``X = start + (basis @ q).reshape(v, 3)``.

    Parameters
    ----------
    start : (v, 3) ndarray
    basis : (3 v, n) ndarray
    lower, upper : (n,) ndarray
        Bounds of the parameters (m); infinite where there is none.
    """

    start: Array
    basis: Array
    lower: Array
    upper: Array

    @property
    def size(self) -> int:
        """Number of parameters."""
        return int(self.basis.shape[1])

    def positions(self, q: Array) -> Array:
        """Return the vertices' positions, (v, 3)."""
        return np.asarray(self.start + (self.basis @ q).reshape(-1, 3))

    def pull(self, gradient: Array) -> Array:
        """Return the derivative by the parameters from that by the positions, (..., v, 3)."""
        return np.asarray(gradient.reshape(*gradient.shape[:-2], -1) @ self.basis)


def rules_of(geometry: Geometry, given: Mapping[str, Rule] | None = None) -> list[Rule]:
    """Return the rule of every vertex: as given, else what its place allows.

    Raises
    ------
    UsageError
        A rule frees a vertex that cannot move.
    """
    rules = []
    for v in range(len(geometry.names)):
        if v in geometry.pinned:
            rules.append(Rule("fixed"))
        elif v in geometry.slides:
            rules.append(Rule("line", direction=geometry.slides[v]))
        else:
            rules.append(Rule())
    for name, rule in (given or {}).items():
        v = geometry.index(name)
        reason = geometry.pinned.get(v, "")
        if rule.kind != "fixed" and reason and not reason.startswith("end of"):
            raise UsageError(f"vertex {name} cannot move: {reason}")
        if rule.kind != "fixed" and v in geometry.carried:
            raise UsageError(f"vertex {name} lies inside a bar: it moves with the bar's ends")
        rules[v] = rule
    return rules


def freedom(geometry: Geometry, rules: Sequence[Rule], dimension: int) -> Freedom:
    """Return the parameters that the rules leave.

    Raises
    ------
    UsageError
        Mirror images of mirror images, or nothing can move.
    """
    count = len(rules)
    blocks: dict[int, list[tuple[int, Array]]] = {}
    start = geometry.positions.copy()
    low: list[float] = []
    high: list[float] = []
    for v, rule in enumerate(rules):
        if v in geometry.carried or rule.kind in ("fixed", "mirror"):
            continue
        axes = np.eye(3)[:dimension] if rule.direction is None else rule.direction[None]
        axes = axes / np.linalg.norm(axes, axis=1, keepdims=True)
        blocks[v] = []
        for axis in axes:
            blocks[v].append((len(low), axis))
            room = _room(axis, start[v], rule.box)
            low.append(room[0])
            high.append(room[1])
    basis = np.zeros((count, 3, len(low)))
    for v, own in blocks.items():
        for column, axis in own:
            basis[v, :, column] = axis
    for v, rule in enumerate(rules):
        if rule.kind != "mirror":
            continue
        if rule.of is None or rule.plane is None or rules[rule.of].kind == "mirror":
            raise UsageError(f"vertex {geometry.names[v]}: the mirror image of what cannot be one")
        origin, normal = rule.plane[0], rule.plane[1] / np.linalg.norm(rule.plane[1])
        flip = np.eye(3) - 2.0 * np.outer(normal, normal)
        image = origin + flip @ (start[rule.of] - origin)
        away = float(np.linalg.norm(image - start[v]))
        if away > 1e-3 * float(np.ptp(start, axis=0).max()):
            raise UsageError(
                f"vertices {geometry.names[rule.of]} and {geometry.names[v]} are no mirror images: "
                f"{1e3 * away:.3g} mm apart"
            )
        start[v] = image
        basis[v] = flip @ basis[rule.of]
    for _ in geometry.carried:  # a stretch may end on another stretch
        for v, (a, b, t) in geometry.carried.items():
            basis[v] = (1.0 - t) * basis[a] + t * basis[b]
    if not basis.shape[2]:
        raise UsageError("no vertex can move: all are fixed")
    return Freedom(start, basis.reshape(3 * count, -1), np.array(low), np.array(high))


def _room(axis: Array, at: Array, box: Array | None) -> tuple[float, float]:
    """Return how far a vertex can go along an axis before it leaves its box."""
    if box is None:
        return -np.inf, np.inf
    moves = np.abs(axis) > 1e-12
    steps = (box[:, moves] - at[moves]) / axis[moves]
    low, high = float(steps.min(axis=0).max()), float(steps.max(axis=0).min())
    if low > 0.0 or high < 0.0:
        raise UsageError(f"a vertex at {at.tolist()} stands outside its box")
    return low, high
