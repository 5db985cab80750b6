"""Named vertices: the places that parts, joints and supports share, and how each of them may move.

Corners of bars, joint points and support points that coincide are one vertex: when it moves, all of
them move. A joint inside a stretch of a bar is carried by that stretch. What cannot move without
changing what a part is (corners of plates, meshes and rigid parts, supports, crossings of two bars)
stays where it is.
"""

from __future__ import annotations

import itertools
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field, replace
from typing import Final, Literal

import numpy as np
from numpy.typing import NDArray
from scipy import sparse

from technic.assembly.joint_types import JointType
from technic.assembly.model import Assembly
from technic.errors import UsageError
from technic.geometry import Array
from technic.parts.definition import FrameBody, TrussBody

__all__ = ["Freedom", "Geometry", "Rule", "find_geometry", "freedom", "rules_of"]

SAME: Final = 1e-6
"""Points closer than this share of the model's size are one vertex: files round to six digits."""

STRAIGHT: Final = 1e-6
"""A corner further than this share of a bar's length from the line of its ends is a bend."""

FOLLOWS: Final = (JointType.SLIDER, JointType.CYLINDRICAL, JointType.SLOT)
"""Joints whose line of sliding follows the bar it lies along."""


@dataclass(frozen=True, slots=True, eq=False)
class Geometry:
    """Vertices of an assembly and what hangs on them.

    Parameters
    ----------
    names : tuple of str
    positions : (v, 3) ndarray
        World coordinates (m).
    corners : mapping
        Part index to the vertices of its corners; bars and truss bars only.
    link_points : (links, v) sparse
        Points of joints, then of supports, as weighted means of vertices.
    lines : mapping
        Joint index to the two vertices whose direction is that of its sliding.
    carried : mapping
        Vertex to (vertex, vertex, share): it lies on a stretch between two others.
    pinned : mapping
        Vertex to the reason why it does not move.
    slides : mapping
        Vertex to the direction of the straight bar it lies on.
    """

    names: tuple[str, ...]
    positions: Array
    corners: Mapping[int, tuple[int, ...]]
    link_points: sparse.csr_array
    lines: Mapping[int, tuple[int, int]]
    carried: Mapping[int, tuple[int, int, float]]
    pinned: Mapping[int, str]
    slides: Mapping[int, Array]

    @property
    def stretches(self) -> NDArray[np.int64]:
        """Pairs of vertices that a bar joins, (e, 2), one per stretch of every bar."""
        pairs = [(a, b) for own in self.corners.values() for a, b in itertools.pairwise(own)]
        return np.array(pairs, dtype=np.int64).reshape(-1, 2)

    def index(self, name: str) -> int:
        """Return the vertex of this name.

        Raises
        ------
        UsageError
            There is none.
        """
        if name not in self.names:
            raise UsageError(
                f"there is no vertex {name!r}; the vertices are {', '.join(self.names)}"
            )
        return self.names.index(name)


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


@dataclass(slots=True)
class _Places:
    """Collects points; those that coincide are one."""

    near: float
    points: list[Array] = field(default_factory=list)

    def find(self, point: Array) -> int | None:
        for k, known in enumerate(self.points):
            if np.linalg.norm(known - point) <= self.near:
                return k
        return None

    def add(self, point: Array) -> int:
        found = self.find(point)
        if found is None:
            self.points.append(np.array(point, dtype=float))
            return len(self.points) - 1
        return found


def bar_points(assembly: Assembly, part: int) -> Array | None:
    """Return the corners of a bar or truss bar in world coordinates, None for another part."""
    body = assembly.parts[part].body
    if isinstance(body, FrameBody | TrussBody) and assembly.parts[part].shape:
        return assembly.parts[part].pose.points(body.points)
    return None


def find_geometry(assembly: Assembly, names: Mapping[str, Array] | None = None) -> Geometry:
    """Find the vertices of an assembly.

    Parameters
    ----------
    assembly : Assembly
    names : mapping, optional
        Names for places (m); other vertices are called v1, v2, ...

    Raises
    ------
    UsageError
        A part is a LEGO part, or a name stands for a place without a vertex.
    """
    for part in assembly.parts:
        if not part.shape:
            raise UsageError(
                f"part {part.id} is a LEGO part: its holes cannot move. "
                "Use `technic suggest`, or describe the linkage in an assembly file"
            )
    lines = {k: p for k in range(len(assembly.parts)) if (p := bar_points(assembly, k)) is not None}
    everything = [*lines.values(), *(j.point[None] for j in assembly.joints)]
    size = float(np.ptp(np.vstack(everything), axis=0).max()) if everything else 1.0
    places = _Places(SAME * size)
    corners = {p: tuple(places.add(x) for x in points) for p, points in lines.items()}
    links: list[tuple[Array | None, tuple[int, ...]]] = [
        (j.point, j.parts) for j in assembly.joints
    ]
    links += [(s.point, (s.part,)) for s in assembly.supports]
    pinned: dict[int, str] = {}
    carried: dict[int, tuple[int, int, float]] = {}
    rows: list[dict[int, float]] = []
    for k, (point, parts) in enumerate(links):
        support = k >= len(assembly.joints)
        if point is None:
            for v in corners.get(parts[0], ()):
                pinned.setdefault(v, f"{assembly.parts[parts[0]].id} is held")
            rows.append({places.add(assembly.parts[parts[0]].centroid): 1.0})
            pinned.setdefault(next(iter(rows[-1])), "support")
            continue
        new = places.find(point) is None
        vertex = places.add(point)
        rows.append({vertex: 1.0})
        inside = [s for p in parts if (s := _stretch(lines, corners, p, vertex, point)) is not None]
        if support:
            pinned.setdefault(vertex, "support")
        solid = [p for p in parts if p not in lines]
        if solid:
            pinned.setdefault(vertex, f"{assembly.parts[solid[0]].id} is no bar")
        if new and not inside and not solid:
            pinned.setdefault(vertex, "it is on no bar")
        if inside and vertex not in carried:
            carried[vertex] = inside[0]
        ends = {(a, b) for a, b, _ in inside}
        ends |= {carried[vertex][:2]} if vertex in carried else set()
        if len(ends) > 1 or (inside and (support or solid)):
            for v in (v for pair in ends for v in pair):
                pinned.setdefault(v, "bars cross inside their stretches")
    matrix = sparse.lil_array((len(links), len(places.points)))
    for k, row in enumerate(rows):
        for v, weight in row.items():
            matrix[k, v] = weight
    slides = _straight(corners, places.points, pinned)
    positions = np.array(places.points).reshape(-1, 3)
    return Geometry(
        names=_named(positions, names or {}, 1e-3 * size),
        positions=positions,
        corners=corners,
        link_points=sparse.csr_array(matrix),
        lines=_sliding_lines(assembly, corners, positions),
        carried=carried,
        pinned=pinned,
        slides=slides,
    )


def _stretch(
    lines: Mapping[int, Array],
    corners: Mapping[int, tuple[int, ...]],
    part: int,
    vertex: int,
    point: Array,
) -> tuple[int, int, float] | None:
    """Return the stretch of a bar that a point lies inside, with the share along it."""
    if part not in lines or vertex in corners[part]:
        return None
    points = lines[part]
    best: tuple[float, int, float] | None = None
    for k, (p, q) in enumerate(itertools.pairwise(points)):
        span = q - p
        t = float(np.clip((point - p) @ span / (span @ span), 0.0, 1.0))
        gap = float(np.linalg.norm(p + t * span - point))
        if best is None or gap < best[0]:
            best = gap, k, t
    assert best is not None  # a bar has two corners or more
    gap, k, t = best
    length = float(np.linalg.norm(points[k + 1] - points[k]))
    if gap > STRAIGHT * length:
        return None
    return corners[part][k], corners[part][k + 1], t


def _straight(
    corners: Mapping[int, tuple[int, ...]], points: Sequence[Array], pinned: dict[int, str]
) -> dict[int, Array]:
    """Find inner corners of straight bars: they slide along the bar, whose ends stay."""
    slides: dict[int, Array] = {}
    for own in corners.values():
        if len(own) < 3:
            continue
        start, end = points[own[0]], points[own[-1]]
        length = float(np.linalg.norm(end - start))
        if length == 0.0:
            continue
        along = (end - start) / length
        off = [np.linalg.norm(np.cross(points[v] - start, along)) for v in own[1:-1]]
        if max(off) > STRAIGHT * length:
            continue
        for v in (own[0], own[-1]):
            pinned.setdefault(v, "end of a straight bar that others are joined along")
        slides.update(dict.fromkeys(own[1:-1], along))
    return slides


def _named(positions: Array, names: Mapping[str, Array], near: float) -> tuple[str, ...]:
    out = [f"v{k + 1}" for k in range(len(positions))]
    for name, place in names.items():
        gaps = np.linalg.norm(positions - place, axis=1)
        k = int(np.argmin(gaps))
        if gaps[k] > near:
            raise UsageError(f"vertex {name!r}: no joint and no corner is at {list(place)}")
        out[k] = name
    if len(set(out)) < len(out):
        raise UsageError("two vertices have the same name")
    return tuple(out)


def _sliding_lines(
    assembly: Assembly, corners: Mapping[int, tuple[int, ...]], positions: Array
) -> dict[int, tuple[int, int]]:
    """Find two vertices in the direction of every sliding joint."""
    out: dict[int, tuple[int, int]] = {}
    for k, joint in enumerate(assembly.joints):
        if joint.type not in FOLLOWS:
            continue
        along = joint.axes[1] if joint.type is JointType.SLOT else joint.axes[0]
        both = [v for p in joint.parts for v in corners.get(p, ())]
        pairs = [
            pair
            for p in joint.parts
            for pair in zip(corners.get(p, ()), corners.get(p, ())[1:], strict=False)
        ]
        pairs += [(a, b) for i, a in enumerate(both) for b in both[i + 1 :] if a != b]
        for a, b in pairs:
            span = positions[b] - positions[a]
            if np.linalg.norm(np.cross(along, span)) <= 1e-6 * np.linalg.norm(span):
                out[k] = (a, b) if along @ span > 0.0 else (b, a)
                break
    return out


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


def with_box(rule: Rule, box: Array) -> Rule:
    """Return the rule with a box."""
    return replace(rule, box=np.asarray(box, dtype=float))
