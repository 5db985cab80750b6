"""Every beam that the holes of a model can take: where it would lie and what would fasten it.

A beam lies in a layer, one beam deep, across the lines of its holes. Two sites of a layer whose distance
is a whole number of pitches take a straight beam (on the grid, 3-4-5, 5-12-13 and their multiples
come out of the distances themselves); bent beams are laid by any two of their holes.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass
from itertools import combinations
from typing import Final

import numpy as np

from technic.assembly.model import Assembly
from technic.design.faces import faces
from technic.design.placements import Placed, across_arms, along_line, place
from technic.design.sites import Bundle, Fastening, Site, bundles
from technic.errors import UsageError
from technic.geometry import Array, Pose
from technic.parts.definition import PartDefinition
from technic.units import LDU

__all__ = [
    "BENT",
    "FRAMES",
    "STRAIGHT",
    "THIN",
    "Attachment",
    "Candidate",
    "candidates",
    "describe_fit",
]

STRAIGHT: Final = {
    2: "43857", 3: "32523", 5: "32316", 7: "32524", 9: "40490", 11: "32525", 13: "41239", 15: "32278",
}  # fmt: skip
"""Straight thick beams by their number of holes."""

BENT: Final = ("32526", "32140", "32348", "32271", "6629")
"""Thick bent beams: two of 90 degrees and three of 53.13."""

FRAMES: Final = ("64179", "64178", "39794", "39790", "67491")
"""Frames: 5 x 7, 5 x 11, 7 x 11, 11 x 15, 3 x 19."""

THIN: Final = {5: "32017", 6: "32063", 7: "32065"}
"""Straight thin beams by their number of holes."""

THIN_BENT: Final = ("2905", "99773")
"""Thin triangles, by their pin holes."""

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
    face : int
        Which holes it is pinned by; see `faces.Face`.
    """

    number: str
    pose: Pose
    axis: Array
    attachments: tuple[Attachment, ...]
    mismatch: float
    face: int = 0

    @property
    def definition(self) -> PartDefinition:
        """The beam's definition."""
        return faces(self.number)[0].definition

    @property
    def frame(self) -> Array:
        """From the axes of its face, where holes lie along y, to the world, (3, 3)."""
        return np.asarray(self.pose.rotation @ faces(self.number)[self.face].turn.T)

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


def candidates(
    assembly: Assembly,
    *,
    lengths: Sequence[int] | None = None,
    bent: bool = True,
    thin: bool = False,
    frames: bool = False,
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
    thin, frames : bool
        Offer thin beams, frames too.
    snug : float
        Largest mismatch of holes (m); at most `EXACT` when 0.
    exclude : frozenset of int
        Parts that nothing may be tied to.
    stock : frozenset of str, optional
        Only these beams; a longer one may then stand in for one that is missing.
    """
    unknown = [n for n in lengths or () if n not in STRAIGHT and not (thin and n in THIN)]
    if unknown:
        raise UsageError(
            f"there is no straight beam with {unknown[0]} holes; there are "
            + ", ".join(map(str, STRAIGHT))
        )
    thick = _choices(STRAIGHT, BENT if bent else (), lengths, stock)
    flat = _choices(THIN, THIN_BENT if bent else (), lengths, stock) if thin else []
    if frames:
        thick += [
            _Choice(number, face, _every_pair(len(each.names)), straight=False)
            for number in FRAMES
            if stock is None or number in stock
            for face, each in enumerate(faces(number))
        ]
    tolerance = max(snug, EXACT)
    found: list[Candidate] = []
    for bundle in bundles(assembly, exclude=exclude, thin=thin):
        for layer in _layers(bundle.sites):
            found += _layer_candidates(bundle, layer, thick, tolerance)
        for layer in _layers(bundle.thin):
            found += _layer_candidates(bundle, layer, flat, tolerance)
    return found


@dataclass(frozen=True, slots=True)
class _Choice:
    """A face of a part, and the pairs of its holes by which it is laid."""

    number: str
    face: int
    pairs: list[tuple[int, int]]
    straight: bool


def _choices(
    straight: Mapping[int, str],
    bent: Sequence[str],
    lengths: Sequence[int] | None,
    stock: frozenset[str] | None,
) -> list[_Choice]:
    """Return straight beams, each by the pairs that no shorter one reaches, then bent ones."""
    out = []
    shorter = 1
    for length in sorted(straight):
        number = straight[length]
        if (lengths and length not in lengths) or (stock is not None and number not in stock):
            continue
        out.append(_Choice(number, 0, along_line(length, shorter), straight=True))
        shorter = length
    for number in bent:
        if stock is None or number in stock:
            out.append(_Choice(number, 0, across_arms(faces(number)[0].plane), straight=False))
    return out


def _every_pair(count: int) -> list[tuple[int, int]]:
    return list(combinations(range(count), 2))


def _layers(sites: Sequence[Site]) -> Iterator[list[Site]]:
    layer: list[Site] = []
    for site in sorted(sites, key=lambda site: site.t):
        if layer and site.t - layer[0].t > _LAYER:
            yield layer
            layer = []
        layer.append(site)
    if layer:
        yield layer


def _layer_candidates(
    bundle: Bundle, sites: list[Site], choices: Sequence[_Choice], tolerance: float
) -> Iterator[Candidate]:
    from scipy.spatial import cKDTree
    from scipy.spatial.distance import pdist

    if len(sites) < 2 or not choices:
        return
    flat = np.array([bundle.lines[s.line].uv for s in sites])
    tree = cKDTree(flat)
    reach = max(float(pdist(faces(c.number)[c.face].plane).max()) for c in choices)
    near = tree.query_pairs(reach + 2.0 * tolerance, output_type="ndarray")
    held = [frozenset(s.fastening.parts) for s in sites]
    pairs = np.array(
        [(i, j) for i, j in near.tolist() if _ties(held[i], held[j])], dtype=np.intp
    ).reshape(-1, 2)
    if not len(pairs):
        return
    for choice in choices:
        plane = faces(choice.number)[choice.face].plane
        placed = place(plane, choice.pairs, flat, pairs, tolerance, straight=choice.straight)
        if not len(placed.turns):
            continue
        distance, nearest = tree.query(placed.holes, distance_upper_bound=tolerance)
        seen: set[bytes] = set()
        for k in range(len(placed.turns)):
            if choice.number in FRAMES and _seen(placed.holes[k], seen):
                continue
            holes = np.flatnonzero(np.isfinite(distance[k])).tolist()
            hits = [(hole, int(nearest[k, hole])) for hole in holes]
            made = _candidate(bundle, sites, choice, placed, k, hits)
            if made is not None:
                yield made


def _seen(holes: Array, seen: set[bytes]) -> bool:
    """Return whether a part with these holes has been here: frames turned by half are the same."""
    places = np.unique(np.round(holes / (LDU / 4)).astype(np.int64), axis=0).tobytes()
    if places in seen:
        return True
    seen.add(places)
    return False


def _ties(first: frozenset[int], second: frozenset[int]) -> bool:
    """Tell whether two fastenings tie parts together that neither of them holds alone."""
    return not (first <= second or second <= first)


def _candidate(
    bundle: Bundle,
    sites: Sequence[Site],
    choice: _Choice,
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
    face = faces(choice.number)[choice.face]
    rotation = np.column_stack([across, normal, along]) @ face.turn + 0.0
    x, y = placed.origins[index]
    origin = x * u + y * v + t * n - face.points[0, 1] * normal
    worst = 0.0
    attachments = []
    for hole, site in kept:
        x, y = flat[hole]
        where = x * u + y * v + t * n
        own = bundle.point(site.line, site.t)
        across_line = (where - own) - ((where - own) @ n) * n
        worst = max(worst, float(np.sqrt(across_line @ across_line)))
        attachments.append(Attachment(hole, _triple(where), _triple(own), site.fastening))
    pose = Pose(rotation, origin)
    return Candidate(choice.number, pose, n, tuple(attachments), worst, choice.face)


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
