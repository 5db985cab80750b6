"""Shapes of the assembly file: from a shape's description to what the mechanics needs.

Each kind of shape is one function, registered in `MAKERS`; the schema has the same kinds.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from itertools import pairwise
from pathlib import Path
from typing import Any, Final

import numpy as np
from numpy.typing import NDArray

from technic.errors import InputError
from technic.geometry import Array, plane_axes
from technic.parts.definition import (
    Body,
    FrameBody,
    MassProperties,
    Material,
    MeshBody,
    PlateBody,
    RigidBody,
    Section,
    TrussBody,
)
from technic.parts.profiles import circle, rectangle, tube

__all__ = ["BAR_ELEMENTS", "PLAIN_SIZE", "Made", "ShapeFault", "make_shape", "section_size"]

PLAIN_SIZE: Final = 0.01
"""Size (m) of whatever has no section of its own: 1 cm (design, section 5)."""

BAR_ELEMENTS: Final = 4
"""Elements of each stretch of a bar unless the file says otherwise: the third bending mode of a stretch
then comes out within 1 %."""

PLATE_DIVISIONS: Final = 10
"""A plate is divided into triangles with edges of this share of its longest side's box, unless the file
says otherwise."""

SLAB_DIVISIONS: Final = 6
"""The same in space, where each triangle becomes three tetrahedra of ten nodes."""

FLAT: Final = 1e-6
"""Corners of a plate may leave its plane by this share of its size: coordinates in files are rounded."""


class ShapeFault(Exception):
    """What is wrong with a shape; the path within the shape and a sentence."""

    def __init__(self, path: str, message: str) -> None:
        super().__init__(message)
        self.path = path
        self.message = message


@dataclass(frozen=True, slots=True, eq=False)
class Made:
    """A body, its mass, and the points that a shape without geometry was given."""

    body: Body
    mass_properties: MassProperties
    points: Array | None = None


def make_shape(
    shape: Mapping[str, Any],
    material: Material,
    dimension: int,
    joint_points: Sequence[Array],
    folder: Path,
) -> Made:
    """Return body and mass of a shape that obeys the schema.

    Parameters
    ----------
    shape : mapping
    material : Material
    dimension : int
        2 or 3.
    joint_points : sequence of (3,) ndarray
        Where joints and supports attach: the geometry of a rigid part that has none of its own.
    folder : Path
        Where files of meshes are looked for.

    Raises
    ------
    ShapeFault
        A length is zero, points coincide, the shape needs another dimension...
    """
    return MAKERS[shape["kind"]](shape, material, dimension, joint_points, folder)


def as_points(values: Sequence[Sequence[float]], dimension: int, path: str) -> Array:
    """Return points (n, 3) of a file; in two dimensions z may be left out and must be 0."""
    out = np.zeros((len(values), 3))
    for k, value in enumerate(values):
        if dimension == 3 and len(value) != 3:
            raise ShapeFault(f"{path}[{k}]", "a point in three dimensions has 3 coordinates")
        if dimension == 2 and len(value) == 3 and value[2] != 0.0:
            raise ShapeFault(f"{path}[{k}][2]", "must be 0 in a two-dimensional assembly")
        out[k, : len(value)] = value
    return out


def section_size(body: Body) -> float:
    """Return the size of a part's section, the root of its area (m), or 1 cm if it has none."""
    if isinstance(body, FrameBody):
        return float(np.sqrt(max(s.area for s in body.sections)))
    if isinstance(body, TrussBody):
        return float(np.sqrt(body.area))
    return PLAIN_SIZE


def _stretches(points: Array) -> list[float]:
    lengths = [float(np.linalg.norm(q - p)) for p, q in pairwise(points)]
    for k, length in enumerate(lengths):
        if length == 0.0:
            raise ShapeFault(f".points[{k + 1}]", "is the same point as the one before it")
    return lengths


def _spread(masses: Array, points: Array, own: Array) -> MassProperties:
    """Return mass, centroid and inertia of masses at points, each with its `own` inertia (n, 3, 3)."""
    mass = float(masses.sum())
    centroid = masses @ points / mass
    arms = points - centroid
    inertia = own.sum(axis=0)
    for m, r in zip(masses, arms, strict=True):
        inertia = inertia + m * ((r @ r) * np.eye(3) - np.outer(r, r))
    return MassProperties(mass, centroid, inertia)


def _rigid(
    shape: Mapping[str, Any],
    material: Material,
    dimension: int,
    joint_points: Sequence[Array],
    _folder: Path,
) -> Made:
    """Make a body that does not deform: its mass sits at its points in equal shares.

    Each share is a cube of 1 cm. Without a mass, the body weighs as much as such a cube and bars of
    1 cm square from its middle to its points.
    """
    if "points" in shape:
        points = as_points(shape["points"], dimension, ".points")
    elif joint_points:
        points = np.unique(np.array(joint_points).round(12), axis=0)
    else:
        raise ShapeFault("", "a rigid part needs points when no joint or support attaches to it")
    reach = float(np.linalg.norm(points - points.mean(axis=0), axis=1).sum())
    mass = float(shape.get("mass", material.density * PLAIN_SIZE**2 * (PLAIN_SIZE + reach)))
    share = np.full(len(points), mass / len(points))
    own = share[:, None, None] * PLAIN_SIZE**2 / 6.0 * np.eye(3)
    return Made(RigidBody(), _spread(share, points, own), points)


def _section(shape: Mapping[str, Any], material: Material) -> tuple[Section, float, float]:
    """Return the section with its second moments per area about z and y."""
    given = shape["section"]
    if given["kind"] == "circle":
        section = circle(float(given["diameter"]), material.poisson)
    elif given["kind"] == "tube":
        if not 2.0 * given["wall"] < given["diameter"]:
            raise ShapeFault(".section.wall", "is thicker than the tube")
        section = tube(float(given["diameter"]), float(given["wall"]), material.poisson)
    else:
        section = rectangle(float(given["width"]), float(given["height"]), material.poisson)
    return section, section.inertia_z / section.area, section.inertia_y / section.area


def default_normal(direction: Array) -> Array:
    """Return the direction of a bar's width: z, or x for a bar along z."""
    along_z = abs(direction[2]) > 0.999 * np.linalg.norm(direction)
    return np.array([1.0, 0.0, 0.0]) if along_z else np.array([0.0, 0.0, 1.0])


def _normals(shape: Mapping[str, Any], spans: Array, dimension: int) -> Array:
    if "normal" not in shape:
        return np.array([default_normal(span) for span in spans])
    given = shape["normal"]
    many = isinstance(given[0], list | tuple)
    if many and len(given) != len(spans):
        raise ShapeFault(".normal", f"expected 1 or {len(spans)} directions, found {len(given)}")
    normals = np.array(given if many else [given] * len(spans), dtype=float)
    for k, (normal, span) in enumerate(zip(normals, spans, strict=True)):
        if np.linalg.norm(np.cross(normal, span)) < 1e-6 * np.linalg.norm(span):
            raise ShapeFault(".normal", f"is parallel to stretch {k} of the bar")
        if dimension == 2 and np.abs(normal[:2]).max() > 1e-9 * abs(normal[2]):
            raise ShapeFault(".normal", "is the z axis in a two-dimensional assembly")
    return normals


def _bar(
    shape: Mapping[str, Any],
    material: Material,
    dimension: int,
    _joint_points: Sequence[Array],
    _folder: Path,
) -> Made:
    """Make a rigidly continuous polyline; each stretch is divided by itself."""
    corners = as_points(shape["points"], dimension, ".points")
    lengths = np.array(_stretches(corners))
    section, across_y, across_z = _section(shape, material)
    spans = np.diff(corners, axis=0)
    normals = _normals(shape, spans, dimension)
    pieces = int(shape.get("elements", BAR_ELEMENTS))
    first = np.arange(len(lengths))
    body = FrameBody(
        points=corners,
        members=np.column_stack([first, first + 1]),
        sections=(section,) * len(first),
        normals=normals,
        material=material,
        max_stretch=lengths / pieces,
    )
    masses = material.density * section.area * lengths
    own = np.zeros((len(lengths), 3, 3))
    for k, (mass, length) in enumerate(zip(masses, lengths, strict=True)):
        x = spans[k] / length
        z = normals[k] - (normals[k] @ x) * x
        z = z / np.linalg.norm(z)
        y = np.cross(z, x)
        second = mass * (
            length**2 / 12.0 * np.outer(x, x)
            + across_y * np.outer(y, y)
            + across_z * np.outer(z, z)
        )
        own[k] = np.trace(second) * np.eye(3) - second
    return Made(body, _spread(masses, (corners[:-1] + corners[1:]) / 2.0, own))


def _truss(
    shape: Mapping[str, Any],
    material: Material,
    dimension: int,
    _joint_points: Sequence[Array],
    _folder: Path,
) -> Made:
    """Make a straight bar that resists stretching only."""
    ends = as_points(shape["points"], dimension, ".points")
    (length,) = _stretches(ends)
    area = float(shape["area"])
    mass = material.density * area * length
    x = (ends[1] - ends[0]) / length
    across = np.eye(3) - np.outer(x, x)
    inertia = mass * length**2 / 12.0 * across + mass * area / (2.0 * np.pi) * np.outer(x, x)
    properties = MassProperties(mass, ends.mean(axis=0), inertia)
    return Made(TrussBody(ends, area, material), properties)


def _polygon(
    shape: Mapping[str, Any],
    material: Material,
    dimension: int,
    _joint_points: Sequence[Array],
    _folder: Path,
) -> Made:
    """Make a plate: in two dimensions it deforms in its plane, in space it bends, too."""
    outline = as_points(shape["points"], dimension, ".points")
    _stretches(np.vstack([outline, outline[:1]]))
    axes, middle, flat = np.eye(3), np.zeros(3), outline
    box = float(np.ptp(outline, axis=0).max())
    if dimension == 3:
        try:
            axes, middle = plane_axes(outline), outline.mean(axis=0)
        except ValueError as error:
            raise ShapeFault(".points", "encloses no area") from error
        flat = (outline - middle) @ axes.T
        off = np.abs(flat[:, 2])
        if off.max() > FLAT * box:
            raise ShapeFault(f".points[{int(off.argmax())}]", "leaves the plane of the others")
    # a fan of triangles with signs: right for any simple polygon
    fan = np.array([[0, k, k + 1] for k in range(1, len(outline) - 1)])
    divisions = PLATE_DIVISIONS if dimension == 2 else SLAB_DIVISIONS
    size = float(shape.get("size", box / divisions))
    body = PlateBody(outline, float(shape["thickness"]), material, size, dimension == 3)
    try:
        mass = simplex_mass(flat, fan, body.thickness, material)
    except InputError as error:
        raise ShapeFault(".points", error.message) from error
    inertia = axes.T @ mass.inertia @ axes
    return Made(body, MassProperties(mass.mass, mass.centroid @ axes + middle, inertia))


def simplex_mass(
    points: Array, cells: NDArray[np.int64], thickness: float, material: Material
) -> MassProperties:
    """Return the mass properties of triangles (plates of a thickness) or tetrahedra.

    Cells may overlap with opposite orientation, as in a fan over a polygon that is not convex.
    """
    d = cells.shape[1] - 1
    corner = points[cells]
    spans = corner[:, :d, :d] - corner[:, d:, :d]
    volumes = np.linalg.det(spans) / (2.0 if d == 2 else 6.0)
    total = float(volumes.sum())
    if abs(total) < 1e-12 * float(np.ptp(points, axis=0).max()) ** d:
        raise InputError("encloses no area" if d == 2 else "encloses no volume")
    volumes = volumes * np.sign(total)
    depth = thickness if d == 2 else 1.0
    masses = material.density * depth * volumes
    mass = float(masses.sum())
    middles = corner.mean(axis=1)
    centroid = masses @ middles / mass
    arms = corner - centroid
    # integral of r r^T over a simplex: V / ((d+1)(d+2)) (sum_i r_i r_i^T + (sum r)(sum r)^T)
    sums = arms.sum(axis=1)
    second = np.einsum("m,mci,mcj->ij", masses, arms, arms)
    second += np.einsum("m,mi,mj->ij", masses, sums, sums)
    second /= (d + 1) * (d + 2)
    if d == 2:
        second[2, 2] += mass * thickness**2 / 12.0
    return MassProperties(mass, centroid, np.trace(second) * np.eye(3) - second)


def _mesh(
    shape: Mapping[str, Any],
    material: Material,
    dimension: int,
    _joint_points: Sequence[Array],
    folder: Path,
) -> Made:
    """Make a body from a mesh file: triangles in two dimensions, tetrahedra in three."""
    from technic.assembly.meshes import read_mesh

    points, cells = read_mesh(folder / shape["file"], dimension)
    points = points * float(shape.get("scale", 1.0))
    thickness = 0.0
    if dimension == 2:
        if "thickness" not in shape:
            raise ShapeFault(".thickness", "is missing: triangles of a plate need one")
        thickness = float(shape["thickness"])
        # a mesh has no order of corners to speak of: all areas count as positive
    spans = points[cells[:, :dimension], :dimension] - points[cells[:, dimension:], :dimension]
    flip = np.linalg.det(spans) < 0.0
    cells = cells.copy()
    cells[np.ix_(flip, [0, 1])] = cells[np.ix_(flip, [1, 0])]
    body = MeshBody(points, cells, material, thickness, int(shape.get("order", 2)) == 2)
    try:
        return Made(body, simplex_mass(points, cells, thickness, material))
    except InputError as error:
        raise ShapeFault(".file", error.message) from error


Maker = Callable[[Mapping[str, Any], Material, int, Sequence[Array], Path], Made]

MAKERS: Final[dict[str, Maker]] = {
    "rigid": _rigid,
    "bar": _bar,
    "truss": _truss,
    "polygon": _polygon,
    "mesh": _mesh,
}
"""Maker of each kind of shape."""
