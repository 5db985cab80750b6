"""Every beam that the holes of a model can take: where it would lie and what would fasten it.

A beam lies in a layer, one beam deep, across the lines of its holes. Two sites of a layer whose distance
is a whole number of pitches take a straight beam (on the grid, 3-4-5, 5-12-13 and their multiples
come out of the distances themselves); bent beams are laid by any two of their holes.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from functools import lru_cache
from typing import Final

import numpy as np

from technic.assembly.model import Assembly
from technic.design.sites import Bundle, Fastening, bundles
from technic.errors import UsageError
from technic.geometry import Array, Pose, readonly
from technic.parts.catalogue import catalogue
from technic.parts.definition import PartDefinition, PortKind
from technic.units import LDU, PITCH

__all__ = ["BENT", "STRAIGHT", "Attachment", "Candidate", "candidates", "describe_fit"]

STRAIGHT: Final = {
    2: "43857", 3: "32523", 5: "32316", 7: "32524", 9: "40490", 11: "32525", 13: "41239", 15: "32278",
}  # fmt: skip
"""Straight thick beams by their number of holes."""

BENT: Final = ("32526", "32140", "32348", "32271", "6629")
"""Thick bent beams: two of 90 degrees and three of 53.13."""

EXACT: Final = 0.05e-3
"""Holes that miss each other by less than this (m) fit: it is half the play of a pin in its hole."""

_LAYER: Final = 0.5 * LDU
"""Sites whose places along their lines differ by less than this lie in one layer."""


@dataclass(frozen=True, slots=True)
class Attachment:
    """A hole of the new beam and what fastens it.

    Parameters
    ----------
    hole : int
        Number of the hole in the beam's list of pin holes.
    point : tuple of float
        Middle of the hole in the world (m).
    line_point : tuple of float
        The site's own place: what the hole would have to meet (m).
    fastening : Fastening
    """

    hole: int
    point: tuple[float, float, float]
    line_point: tuple[float, float, float]
    fastening: Fastening


@dataclass(frozen=True, slots=True, eq=False)
class Candidate:
    """A beam in its place.

    Parameters
    ----------
    number : str
    pose : Pose
    axis : (3,) ndarray
        Direction of its holes.
    attachments : tuple of Attachment
        Two or more, in the order of the holes.
    mismatch : float
        How far the worst hole misses its line (m).
    """

    number: str
    pose: Pose
    axis: Array
    attachments: tuple[Attachment, ...]
    mismatch: float

    @property
    def definition(self) -> PartDefinition:
        """The beam's definition."""
        return _beam(self.number)[0]

    @property
    def parts(self) -> tuple[int, ...]:
        """The parts of structure that it ties together."""
        return tuple(sorted({p for a in self.attachments for p in a.fastening.parts}))

    @property
    def snug(self) -> bool:
        """Whether holes miss by more than `EXACT`."""
        return self.mismatch > EXACT

    @property
    def fasteners(self) -> int:
        """How many new pins it needs, exchanged ones included."""
        return sum(a.fastening.kind != "present" for a in self.attachments)


def describe_fit(candidate: Candidate) -> str:
    """Return how well the holes meet, in words."""
    if not candidate.snug:
        return "fits exactly"
    return f"snug: holes miss by {candidate.mismatch * 1e3:.2f} mm"


@lru_cache(maxsize=64)
def _beam(number: str) -> tuple[PartDefinition, Array, Array]:
    """Return a beam's definition, the places of its pin holes, and their frame (rows: axis, across)."""
    definition = catalogue().get(number)
    if definition is None:
        raise UsageError(f"part {number} is not in the catalogue")
    holes = [p for p in definition.ports if p.kind is PortKind.PIN_HOLE]
    points = np.array([p.position for p in holes])
    return definition, readonly(points), readonly(holes[0].axis)


@lru_cache(maxsize=64)
def holes_of(number: str) -> tuple[str, ...]:
    """Return the names of a beam's pin holes, in order."""
    return tuple(p.name for p in _beam(number)[0].ports if p.kind is PortKind.PIN_HOLE)


def candidates(
    assembly: Assembly,
    *,
    lengths: Sequence[int] | None = None,
    bent: bool = True,
    snug: float = 0.0,
    exclude: frozenset[int] = frozenset(),
) -> list[Candidate]:
    """Return every place for a beam, without regard to what else is in its way.

    Parameters
    ----------
    assembly : Assembly
    lengths : sequence of int, optional
        Lengths of straight beams; default all.
    bent : bool
        Offer bent beams too.
    snug : float
        Largest mismatch of holes (m); at most `EXACT` when 0.
    exclude : frozenset of int
        Parts that nothing may be tied to.
    """
    lengths = sorted(lengths or STRAIGHT)
    unknown = [n for n in lengths if n not in STRAIGHT]
    if unknown:
        raise UsageError(
            f"there is no straight beam with {unknown[0]} holes; there are "
            + ", ".join(map(str, STRAIGHT))
        )
    numbers = [STRAIGHT[n] for n in lengths] + (list(BENT) if bent else [])
    found: list[Candidate] = []
    for bundle in bundles(assembly, exclude=exclude):
        for layer in _layers(bundle):
            found += _layer_candidates(assembly, bundle, layer, numbers, max(snug, EXACT))
    return found


def _layers(bundle: Bundle) -> Iterator[list[int]]:
    order = sorted(range(len(bundle.sites)), key=lambda k: bundle.sites[k].t)
    layer: list[int] = []
    for k in order:
        if layer and bundle.sites[k].t - bundle.sites[layer[0]].t > _LAYER:
            yield layer
            layer = []
        layer.append(k)
    if layer:
        yield layer


def _layer_candidates(
    assembly: Assembly, bundle: Bundle, layer: list[int], numbers: Sequence[str], tolerance: float
) -> Iterator[Candidate]:
    from scipy.spatial import cKDTree

    if len(layer) < 2:
        return
    sites = [bundle.sites[k] for k in layer]
    flat = np.array([bundle.lines[s.line].uv for s in sites])
    tree = cKDTree(flat)
    pairs = tree.query_pairs(14 * PITCH + tolerance, output_type="ndarray")
    pairs = np.array(
        [(i, j) for i, j in pairs if _ties(sites[i].fastening, sites[j].fastening)]
    ).reshape(-1, 2)
    if not len(pairs):
        return
    seen: set[tuple[object, ...]] = set()
    for number in numbers:
        for angle, origin, turned in _placements(number, flat, pairs, tolerance, seen):
            made = _candidate(bundle, sites, tree, number, angle, origin, turned, tolerance)
            if made is not None:
                yield made


def _ties(first: Fastening, second: Fastening) -> bool:
    """Tell whether two fastenings tie parts together that neither of them holds alone."""
    a, b = set(first.parts), set(second.parts)
    return bool(a - b) and bool(b - a)


def _placements(
    number: str, flat: Array, pairs: Array, tolerance: float, seen: set[tuple[object, ...]]
) -> Iterator[tuple[Array, Array, bool]]:
    """Yield where a beam can lie by two of its holes: direction of its own z, its origin, turned over.

    A straight beam lies by its end hole and any other when the distance asks for it (the shortest beam
    that reaches, in every position along the line that covers both sites).
    """
    _, points, _ = _beam(number)
    plane = points[:, [2, 0]]  # z along, x across
    straight = number in STRAIGHT.values()
    start, end = flat[pairs[:, 0]], flat[pairs[:, 1]]
    between = end - start
    distance = np.linalg.norm(between, axis=1)
    wanted: list[tuple[int, int]]
    if straight:
        count = len(plane)
        shorter = max((n for n in STRAIGHT if n < count), default=1)
        wanted = [(i, i + k) for k in range(max(1, shorter), count) for i in range(count - k)]
    else:
        wanted = _across(plane)
    for i, j in wanted:
        span = plane[j] - plane[i]
        length = float(np.linalg.norm(span))
        for turned in (False,) if straight else (False, True):
            hole = plane * np.array([1.0, -1.0]) if turned else plane
            span = hole[j] - hole[i]
            fits = np.flatnonzero(np.abs(distance - length) < 2 * tolerance)
            for k in fits:
                for a, b in ((start[k], end[k]), (end[k], start[k])):
                    step = (b - a) / float(distance[k])
                    along = _turn(span / length, step)
                    # half of the mismatch at either end
                    middle = (a + b) / 2 - _apply(along, (hole[i] + hole[j]) / 2)
                    key = _key(number, along, middle, straight)
                    if (key, turned) not in seen:
                        seen.add((key, turned))
                        yield along, middle, turned


def _across(plane: Array) -> list[tuple[int, int]]:
    """Return the pairs of holes of a bent beam that do not lie on one arm."""
    step = np.diff(plane, axis=0)
    step = step / np.linalg.norm(step, axis=1, keepdims=True)
    turn = np.abs(step[1:, 0] * step[:-1, 1] - step[1:, 1] * step[:-1, 0]) > 0.1
    arm = np.concatenate([[0, 0], np.cumsum(turn)])
    corner = [k + 1 for k in np.flatnonzero(turn)]
    return [
        (i, j)
        for i in range(len(plane))
        for j in range(i + 1, len(plane))
        if arm[i] != arm[j] and i not in corner and j not in corner
    ]


def _turn(a: Array, b: Array) -> Array:
    """Return (cos, sin) of the rotation that takes direction a to direction b."""
    return np.array([a @ b, a[0] * b[1] - a[1] * b[0]])


def _apply(turn: Array, point: Array) -> Array:
    c, s = turn
    return np.asarray(point @ np.array([[c, s], [-s, c]]))


def _key(number: str, turn: Array, middle: Array, straight: bool) -> tuple[object, ...]:
    """Return what two equal placements share; a straight beam lies the same either way round."""
    c, s = (round(float(v), 4) + 0.0 for v in turn)
    if straight and (c < 0.0 or (c == 0.0 and s < 0.0)):
        c, s = -c + 0.0, -s + 0.0
    x, y = (round(float(v) / LDU * 4) for v in middle)
    return (number, c, s, x, y)


def _candidate(
    bundle: Bundle,
    sites: list,  # type: ignore[type-arg]
    tree,  # type: ignore[no-untyped-def]
    number: str,
    turn: Array,
    origin: Array,
    turned: bool,
    tolerance: float,
) -> Candidate | None:
    """Return the beam with everything that can fasten it, or None when it ties nothing together."""
    _, points, _ = _beam(number)
    plane = points[:, [2, 0]] * (np.array([1.0, -1.0]) if turned else 1.0)
    flat = _apply(turn, plane) + origin
    distance, nearest = tree.query(flat, distance_upper_bound=tolerance)
    hits = [(k, int(nearest[k])) for k in range(len(flat)) if np.isfinite(distance[k])]
    chosen = _needed(flat, [(k, sites[s].fastening) for k, s in hits])
    kept = [(k, s) for k, s in hits if k in chosen]
    held = [sites[s].fastening for _, s in kept]
    if not any(_ties(a, b) for a in held for b in held):
        return None
    n, u, v = bundle.axes
    t = float(np.mean([sites[s].t for _, s in kept]))
    along = turn[0] * u + turn[1] * v
    normal = n if not turned else -n
    # part axes in the world: holes along y, the beam along z; x = y x z (or its mirror, turned over)
    rotation = np.column_stack([np.cross(normal, along), normal, along]) + 0.0
    world = origin[0] * u + origin[1] * v + t * n
    offset = rotation @ np.array([0.0, points[0, 1], 0.0])
    attachments = []
    for k, s in kept:
        where = flat[k, 0] * u + flat[k, 1] * v + t * n
        own = bundle.point(sites[s].line, sites[s].t)
        attachments.append(
            Attachment(k, tuple(map(float, where)), tuple(map(float, own)), sites[s].fastening)
        )
    mismatch = max(float(distance[k]) for k, _ in kept)
    return Candidate(number, Pose(rotation, world - offset), n, tuple(attachments), mismatch)


def _needed(flat: Array, hits: list[tuple[int, Fastening]]) -> set[int]:
    """Return the holes to pin: for each part the two furthest apart; exchanges only where it takes one.

    Two pins hold a beam on a part; more cost pins and bring little.
    """
    by_part: dict[int, list[int]] = {}
    simple = [(k, f) for k, f in hits if f.kind != "exchange"]
    for k, f in simple:
        for p in f.parts:
            by_part.setdefault(p, []).append(k)
    for k, f in hits:
        if f.kind == "exchange" and any(p not in by_part for p in f.parts):
            for p in f.parts:
                by_part.setdefault(p, []).append(k)
    chosen = {k for k, f in hits if f.kind == "present"}  # they hold, wanted or not
    for own in by_part.values():
        middle = flat[own].mean(axis=0)
        first = max(own, key=lambda k: (round(float(np.linalg.norm(flat[k] - middle)), 9), -k))
        last = max(own, key=lambda k: (round(float(np.linalg.norm(flat[k] - flat[first])), 9), -k))
        chosen |= {first, last}
    return chosen
