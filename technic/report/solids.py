"""The drawn shape of every part of an assembly: triangles and sharp edges, in world coordinates."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from itertools import combinations

import numpy as np

from technic.assembly.model import Part
from technic.geometry import Array
from technic.parts.definition import (
    FrameBody,
    MeshBody,
    PartDefinition,
    PlateBody,
    TrussBody,
)
from technic.report.arrows import tube
from technic.report.palette import NEUTRAL
from technic.report.scene import Faces, Surface, merge
from technic.units import LDU

__all__ = ["Solid", "sharp_edges", "solid_of", "world_points"]

_SHARP = np.cos(np.radians(30.0))
"""Neighbouring triangles that meet at more than this show an edge; circles have 20 sides (18 degrees)."""

_DRAWN_MOST = 20_000
"""Triangles of a library part that are drawn; the parts of real models have some thousand."""

_SAME_CORNER = 0.01 * LDU

_PORT_RADIUS = 4 * LDU
_STRUT_RADIUS = 2 * LDU

_RINGS = 13
"""Circles along a member that bends: enough for a curve to look like one."""


@dataclass(frozen=True, slots=True, eq=False)
class Solid:
    """Triangles and sharp edges of a part, in part coordinates (m).

    Parameters
    ----------
    points : (n, 3) ndarray
    faces : (m, 3) ndarray of int
    edges : (k, 2) ndarray of int
    stand_in : bool
        True when the part has no shape of its own and is drawn as tubes along its features.
    """

    points: Array
    faces: Faces
    edges: Faces
    stand_in: bool = False


def sharp_edges(points: Array, faces: Faces) -> Faces:
    """Return the edges, (k, 2), where two triangles meet at an angle, and edges of one triangle."""
    corners = points[faces]
    normals = np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0])
    normals /= np.maximum(np.linalg.norm(normals, axis=1), 1e-300)[:, None]
    edges = np.sort(np.concatenate([faces[:, [0, 1]], faces[:, [1, 2]], faces[:, [2, 0]]]), axis=1)
    owner = np.tile(np.arange(len(faces)), 3)
    key = edges[:, 0] * np.int64(len(points)) + edges[:, 1]
    order = np.argsort(key, kind="stable")
    key, owner, edges = key[order], owner[order], edges[order]
    _, first, times = np.unique(key, return_index=True, return_counts=True)
    paired = first[times == 2]
    flat = np.einsum("ij,ij->i", normals[owner[paired]], normals[owner[paired + 1]]) > _SHARP
    return np.concatenate([edges[paired[~flat]], edges[first[times == 1]]])


def _struts(points: Array) -> list[Surface]:
    """Return the shortest net of bars that joins all points (Prim's minimum spanning tree)."""
    pieces: list[Surface] = []
    nearest = np.zeros(len(points), dtype=np.int64)
    distance = np.linalg.norm(points - points[0], axis=1)
    distance[0] = np.inf
    for _ in range(len(points) - 1):
        k = int(np.argmin(distance))
        if distance[k] > LDU:
            pieces.append(tube(points[nearest[k]], points[k], _STRUT_RADIUS, NEUTRAL))
        distance[k] = np.inf
        away = np.linalg.norm(points - points[k], axis=1)
        closer = (away < distance) & np.isfinite(distance)
        distance[closer], nearest[closer] = away[closer], k
    return pieces


def _tubes(part: Part | PartDefinition) -> Surface:
    """Return tubes along the members of a frame body, or along the ports with struts between."""
    pieces: list[Surface] = []
    body = part.body
    if isinstance(body, FrameBody):
        for (a, b), section in zip(body.members, body.sections, strict=True):
            radius = float(np.sqrt(section.area / np.pi))
            pieces.append(tube(body.points[a], body.points[b], radius, NEUTRAL, _RINGS))
    if isinstance(body, TrussBody):
        p, q = body.points
        pieces.append(tube(p, q, float(np.sqrt(body.area / np.pi)), NEUTRAL))
    for port in part.ports:
        half = 0.5 * max(port.length, _PORT_RADIUS) * port.axis
        pieces.append(tube(port.position - half, port.position + half, _PORT_RADIUS, NEUTRAL))
    centroid = part.mass_properties.centroid
    if not isinstance(body, FrameBody) and part.ports:
        # The centroid too: loads act there.
        pieces += _struts(np.array([*(port.position for port in part.ports), centroid]))
    if not pieces:
        half = np.array([0.0, _PORT_RADIUS, 0.0])
        pieces.append(tube(centroid - half, centroid + half, _PORT_RADIUS, NEUTRAL))
    return merge(pieces)


def _skin(body: PlateBody | MeshBody) -> Solid:
    """Return the surface of a plate, both sides of it, or of a body of tetrahedra."""
    if isinstance(body, PlateBody):
        from technic.fem.plate import divide, slab

        if body.spatial:
            points, cells = slab(body.outline, body.thickness, body.size)
        else:
            points, cells = divide(body.outline, body.size)
    else:
        points, cells = np.asarray(body.points), body.cells
    sides = list(combinations(range(cells.shape[1]), cells.shape[1] - 1))
    owned = cells[:, sides].reshape(-1, cells.shape[1] - 1)
    _, first, times = np.unique(
        np.sort(owned, axis=1), axis=0, return_index=True, return_counts=True
    )
    outer = owned[first[times == 1]]
    if cells.shape[1] == 3:  # the outline's edges become walls between front and back
        n, half = len(points), np.array([0.0, 0.0, body.thickness / 2.0])
        a, b = outer.T
        walls = np.concatenate([np.column_stack([a, b, b + n]), np.column_stack([a, b + n, a + n])])
        outer = np.concatenate([cells, cells[:, ::-1] + n, walls])
        points = np.concatenate([points + half, points - half])
    return Solid(points, outer, sharp_edges(points, outer))


def _drawn(triangles: Array) -> Solid | None:
    """Return the surface that a parts library draws; None for one too heavy for a picture."""
    if not 0 < len(triangles) <= _DRAWN_MOST:
        return None
    corners = triangles.reshape(-1, 3)
    # corners that are meant to be one differ by the digits of the files
    _, first, number = np.unique(
        np.rint(corners / _SAME_CORNER), axis=0, return_index=True, return_inverse=True
    )
    faces = number.reshape(-1, 3)
    flat = (faces == np.roll(faces, 1, axis=1)).any(axis=1)
    points, faces = corners[first], faces[~flat]
    return Solid(points, faces, sharp_edges(points, faces)) if len(faces) else None


def _build(part: Part | PartDefinition, definition: PartDefinition | None) -> Solid:
    if definition is not None:
        from technic.parts import shapes

        if shapes.has_shape(definition):
            shape = shapes.mesh(definition, "draw")
            points = np.asarray(shape.vertices, dtype=float)
            faces = np.asarray(shape.faces, dtype=np.int64)
            return Solid(points, faces, sharp_edges(points, faces))
        if definition.drawing is not None:
            drawn = _drawn(np.asarray(definition.drawing.triangles()))
            if drawn is not None:
                return drawn
    if isinstance(part.body, PlateBody | MeshBody):
        return _skin(part.body)
    stand_in = _tubes(part)
    edges = sharp_edges(stand_in.points, stand_in.faces)
    return Solid(stand_in.points, stand_in.faces, edges, stand_in=True)


def solid_of() -> Callable[[Part | PartDefinition], Solid]:
    """Return a function from a part (or definition) to its solid that builds each type once."""
    built: dict[str, Solid] = {}

    def solid(part: Part | PartDefinition) -> Solid:
        definition = part if isinstance(part, PartDefinition) else part.definition
        if definition is None:
            return _build(part, None)
        if definition.id not in built:
            built[definition.id] = _build(part, definition)
        return built[definition.id]

    return solid


def world_points(part: Part, solid: Solid) -> Array:
    """Return the points of a solid where the part stands, (n, 3) in m."""
    return part.pose.points(solid.points)
