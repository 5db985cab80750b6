"""Named vertices: the places that parts, joints and supports share, and how each of them may move.

Corners of bars, joint points and support points that coincide are one vertex: when it moves, all of
them move. A joint inside a stretch of a bar is carried by that stretch. What cannot move without
changing what a part is (corners of plates, meshes and rigid parts, supports, crossings of two bars)
stays where it is.
"""

from __future__ import annotations

import itertools
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from typing import Final

import numpy as np
from numpy.typing import NDArray
from scipy import sparse

from technic.assembly.joint_types import JointType
from technic.assembly.model import Assembly
from technic.errors import UsageError
from technic.geometry import Array
from technic.parts.definition import FrameBody, TrussBody

__all__ = ["Geometry", "find_geometry"]

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
