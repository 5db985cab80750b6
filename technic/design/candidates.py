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
from technic.design.placements import Placed, across_arms, along_line, place
from technic.design.sites import Bundle, Fastening, Site, bundles
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
    stock: frozenset[str] | None = None,
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
    stock : frozenset of str, optional
        Only these beams; a longer one may then stand in for one that is missing.
    """
    lengths = sorted(lengths or STRAIGHT)
    unknown = [n for n in lengths if n not in STRAIGHT]
    if unknown:
        raise UsageError(
            f"there is no straight beam with {unknown[0]} holes; there are "
            + ", ".join(map(str, STRAIGHT))
        )
    curved: tuple[str, ...] = BENT if bent else ()
    if stock is not None:
        lengths = [n for n in lengths if STRAIGHT[n] in stock]
        curved = tuple(number for number in curved if number in stock)
    found: list[Candidate] = []
    for bundle in bundles(assembly, exclude=exclude):
        for layer in _layers(bundle):
            found += _layer_candidates(bundle, layer, lengths, curved, max(snug, EXACT))
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
    bundle: Bundle,
    layer: list[int],
    lengths: Sequence[int],
    bent: Sequence[str],
    tolerance: float,
) -> Iterator[Candidate]:
    from scipy.spatial import cKDTree

    if len(layer) < 2:
        return
    sites = [bundle.sites[k] for k in layer]
    flat = np.array([bundle.lines[s.line].uv for s in sites])
    tree = cKDTree(flat)
    near = tree.query_pairs((max(STRAIGHT) - 1) * PITCH + tolerance, output_type="ndarray")
    held = [frozenset(s.fastening.parts) for s in sites]
    pairs = np.array(
        [(i, j) for i, j in near.tolist() if _ties(held[i], held[j])], dtype=np.intp
    ).reshape(-1, 2)
    if not len(pairs):
        return
    shorter = 1
    beams: list[tuple[str, list[tuple[int, int]], bool]] = []
    for length in lengths:
        beams.append((STRAIGHT[length], along_line(length, shorter), True))
        shorter = length
    beams += [(number, across_arms(_beam(number)[1][:, [2, 0]]), False) for number in bent]
    for number, wanted, straight in beams:
        plane = _beam(number)[1][:, [2, 0]]
        placed = place(plane, wanted, flat, pairs, tolerance, straight=straight)
        if not len(placed.turns):
            continue
        distance, nearest = tree.query(placed.holes, distance_upper_bound=tolerance)
        for k in range(len(placed.turns)):
            holes = np.flatnonzero(np.isfinite(distance[k])).tolist()
            hits = [(hole, int(nearest[k, hole])) for hole in holes]
            made = _candidate(bundle, sites, number, placed, k, hits)
            if made is not None:
                yield made


def _ties(first: frozenset[int], second: frozenset[int]) -> bool:
    """Tell whether two fastenings tie parts together that neither of them holds alone."""
    return not (first <= second or second <= first)


def _candidate(
    bundle: Bundle,
    sites: Sequence[Site],
    number: str,
    placed: Placed,
    index: int,
    hits: list[tuple[int, int]],
) -> Candidate | None:
    """Return the beam with what is to fasten it, or None when it ties nothing together.

    `hits` are pairs of a hole and the site that it lies on.
    """
    flat = placed.holes[index]
    chosen = _needed(flat, [(hole, sites[s].fastening) for hole, s in hits])
    kept = [(hole, sites[s]) for hole, s in hits if hole in chosen]
    held = [frozenset(site.fastening.parts) for _, site in kept]
    if not any(_ties(a, b) for k, a in enumerate(held) for b in held[:k]):
        return None
    n, u, v = bundle.axes
    t = sum(site.t for _, site in kept) / len(kept)
    cosine, sine = placed.turns[index]
    along = cosine * u + sine * v
    normal = -n if placed.turned_over[index] else n
    # part axes in the world: holes along y, the beam along z; x = y x z
    across = (cosine * v - sine * u) * (-1.0 if placed.turned_over[index] else 1.0)
    rotation = np.column_stack([across, normal, along]) + 0.0
    x, y = placed.origins[index]
    origin = x * u + y * v + t * n - _beam(number)[1][0, 1] * normal
    worst = 0.0
    attachments = []
    for hole, site in kept:
        x, y = flat[hole]
        where = x * u + y * v + t * n
        own = bundle.point(site.line, site.t)
        across_line = (where - own) - ((where - own) @ n) * n
        worst = max(worst, float(np.sqrt(across_line @ across_line)))
        attachments.append(Attachment(hole, _triple(where), _triple(own), site.fastening))
    return Candidate(number, Pose(rotation, origin), n, tuple(attachments), worst)


def _triple(point: Array) -> tuple[float, float, float]:
    x, y, z = point.tolist()
    return x, y, z


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
        first, last = own[0], own[-1]
        if len(own) > 2:
            points = flat[own]
            far = np.linalg.norm(points[:, None] - points[None], axis=2).round(9)
            i, j = divmod(int(np.argmax(far)), len(own))
            first, last = own[i], own[j]
        chosen |= {first, last}
    return chosen
