"""Ports, bodies and part definitions: what the rest of the program knows about a part.

All lengths are in metres and part coordinates (LDraw's axes: -y is up), masses in kilograms.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field
from enum import StrEnum
from typing import Any, Final

import numpy as np
from numpy.typing import NDArray

from technic.geometry import Array, readonly

__all__ = [
    "LIBRARY_FAMILY",
    "Body",
    "Drawing",
    "FrameBody",
    "MassProperties",
    "Material",
    "MeshBody",
    "PartDefinition",
    "PlateBody",
    "Port",
    "PortKind",
    "RigidBody",
    "Section",
    "TrussBody",
    "outline",
]


LIBRARY_FAMILY: Final = "library"
"""Family of every definition that is made from files of a parts library."""


class PortKind(StrEnum):
    """What a port is, in the builders' words. Bores and sockets receive, the others enter."""

    PIN_HOLE = "pin_hole"
    AXLE_HOLE = "axle_hole"
    SOCKET = "socket"
    TUBE = "tube"
    PIN = "pin"
    AXLE = "axle"
    BALL = "ball"
    STUD = "stud"
    STOP = "stop"
    """A collar that is wider than a bore: it stops the axle it sits on."""


@dataclass(frozen=True, slots=True, eq=False)
class Port:
    """A place where another part can attach.

    Parameters
    ----------
    name : str
        Unique within the part, e.g. ``"hole3"``.
    kind : PortKind
    position : (3,) array_like
        Middle of the feature (m).
    axis : (3,) array_like
        Unit vector along the bore or shaft; for studs, tubes, balls and sockets the outward direction.
    length : float
        Extent along the axis (m), centred at `position`. A pin or a bore longer than one pitch is
        divided into ports of one pitch; an axle is one port.
    friction : bool
        True for a pin with friction ridges.
    """

    name: str
    kind: PortKind
    position: Array
    axis: Array
    length: float
    friction: bool = False

    def __post_init__(self) -> None:
        object.__setattr__(self, "position", readonly(self.position))
        axis = np.asarray(self.axis, dtype=float)
        norm = float(np.linalg.norm(axis))
        if self.position.shape != (3,) or axis.shape != (3,) or norm == 0.0:
            raise ValueError(f"port {self.name!r}: position and axis must be 3 numbers, axis not 0")
        object.__setattr__(self, "axis", readonly(axis / norm))


@dataclass(frozen=True, slots=True)
class Material:
    """An isotropic linear elastic material.

    Parameters
    ----------
    name : str
    young_pa, density : float
        Young's modulus (Pa) and density (kg/m3).
    poisson : float
    source : str
        Where the numbers come from.
    """

    name: str
    young_pa: float
    poisson: float
    density: float
    source: str = ""

    @property
    def shear_pa(self) -> float:
        """Shear modulus ``E / (2 (1 + nu))`` (Pa)."""
        return self.young_pa / (2.0 * (1.0 + self.poisson))


@dataclass(frozen=True, slots=True)
class Section:
    """Cross-section constants of a frame member.

    Parameters
    ----------
    area : float
        (m2)
    inertia_y, inertia_z : float
        Second moments of area about the member's own y and z axis (m4): `inertia_z` resists
        bending in the plane of x and y.
    torsion : float
        Saint-Venant torsion constant (m4).
    shear_y, shear_z : float
        Shear areas (m2) for forces along y and z; infinite for a shear-rigid (Euler-Bernoulli) member.
    source : str
    """

    area: float
    inertia_y: float
    inertia_z: float
    torsion: float
    shear_y: float = float("inf")
    shear_z: float = float("inf")
    source: str = ""


@dataclass(frozen=True, slots=True, eq=False)
class MassProperties:
    """Mass (kg), centroid (m) and inertia about the centroid (kg m2), in part coordinates."""

    mass: float
    centroid: Array
    inertia: Array

    def __post_init__(self) -> None:
        object.__setattr__(self, "centroid", readonly(self.centroid))
        object.__setattr__(self, "inertia", readonly(self.inertia))


@dataclass(frozen=True, slots=True, eq=False)
class RigidBody:
    """A body that does not deform: six unknowns, whatever its shape."""


@dataclass(frozen=True, slots=True, eq=False)
class FrameBody:
    """A body made of straight prismatic members, rigidly connected at shared points.

    Joints may attach anywhere along a member: the element places a node there.

    Parameters
    ----------
    points : (n, 3) array_like
        End points of members (m).
    members : (m, 2) array_like of int
        Indices into `points`.
    sections : sequence of Section
        One per member.
    normals : (m, 3) array_like
        Direction of each member's own z axis (made orthogonal to the member).
    material : Material
    max_stretch : float or (m,) array_like
        Members are divided into elements not longer than this (m), or than each member's own.
    """

    points: Array
    members: Array
    sections: tuple[Section, ...]
    normals: Array
    material: Material
    max_stretch: float | Array = float("inf")

    def __post_init__(self) -> None:
        object.__setattr__(self, "points", readonly(self.points))
        object.__setattr__(self, "members", readonly(self.members, dtype=np.int64))
        object.__setattr__(self, "normals", readonly(self.normals))
        object.__setattr__(self, "sections", tuple(self.sections))


@dataclass(frozen=True, slots=True, eq=False)
class TrussBody:
    """A straight bar that resists stretching only; it cannot bend or twist.

    Parameters
    ----------
    points : (2, 3) array_like
        Its ends (m).
    area : float
        Of its section (m2).
    material : Material
    """

    points: Array
    area: float
    material: Material

    def __post_init__(self) -> None:
        object.__setattr__(self, "points", readonly(self.points))


@dataclass(frozen=True, slots=True, eq=False)
class PlateBody:
    """A flat plate: in the plane z = 0, deforming in its plane (plane stress), or in space.

    Parameters
    ----------
    outline : (n, 3) array_like
        Corners of a simple polygon, in order, either way round (m): the middle of the thickness.
    thickness : float
        (m)
    material : Material
    size : float
        Edge length of the triangles it is divided into (m).
    spatial : bool
        True for a plate in any plane that bends, too: each triangle becomes a prism of tetrahedra.
    """

    outline: Array
    thickness: float
    material: Material
    size: float
    spatial: bool = False

    def __post_init__(self) -> None:
        object.__setattr__(self, "outline", readonly(self.outline))


@dataclass(frozen=True, slots=True, eq=False)
class MeshBody:
    """A body given as a mesh: triangles of a plate in the plane z = 0, or tetrahedra.

    Parameters
    ----------
    points : (n, 3) array_like
        (m)
    cells : (m, 3) or (m, 4) array_like of int
        Corners of the triangles or tetrahedra.
    material : Material
    thickness : float
        Of a mesh of triangles (m); 0 for tetrahedra.
    quadratic : bool
        True for displacements that are quadratic in every cell, False for linear ones.
    """

    points: Array
    cells: NDArray[np.int64]
    material: Material
    thickness: float = 0.0
    quadratic: bool = True

    def __post_init__(self) -> None:
        object.__setattr__(self, "points", readonly(self.points))
        object.__setattr__(self, "cells", readonly(self.cells, dtype=np.int64))


Body = RigidBody | FrameBody | TrussBody | PlateBody | MeshBody


def outline(body: Body) -> Array:
    """Return the points that a body spans, (n, 3), part coordinates; none for a rigid body."""
    if isinstance(body, PlateBody):
        return body.outline
    return np.zeros((0, 3)) if isinstance(body, RigidBody) else body.points


@dataclass(frozen=True, slots=True, eq=False)
class Drawing:
    """The surface of a part as its library files draw it, from which a solid model can be made.

    Parameters
    ----------
    triangles : callable
        Returns the corners, (n, 3, 3), part coordinates (m), counter-clockwise seen from outside. They
        are read when they are asked for. The surface need not be closed.
    cell : float
        Edge of the cells that the solid model is to be made of (m); 0: it is not to be meshed.
    """

    triangles: Callable[[], Array]
    cell: float


@dataclass(frozen=True, slots=True, eq=False)
class PartDefinition:
    """A kind of part.

    Parameters
    ----------
    id : str
        LDraw number without ``.dat``, e.g. ``"32524"``.
    title : str
        Name in the builders' words, e.g. ``"Beam 7"``.
    family : str
        E.g. ``"beam-thick"``.
    ports : sequence of Port
    body : Body
        What the mechanics makes of the part when it is not given a solid model.
    mass_properties : MassProperties
    fastener : bool
        True for pins, axles, bushes and the like: parts that join others and carry no structure of
        their own.
    aliases : tuple of str
        Other LDraw numbers of the same part.
    shape : mapping
        Description of the solid shape, as in the catalogue file; `technic.parts.shapes` builds it.
    source : str
        Where the facts come from.
    drawing : Drawing or None
        Of parts that are read from a parts library.
    """

    id: str
    title: str
    family: str
    ports: tuple[Port, ...]
    body: Body
    mass_properties: MassProperties
    fastener: bool = False
    aliases: tuple[str, ...] = ()
    shape: Mapping[str, Any] = field(default_factory=dict)
    source: str = ""
    drawing: Drawing | None = None

    def __post_init__(self) -> None:
        object.__setattr__(self, "ports", tuple(self.ports))
        names: Sequence[str] = [port.name for port in self.ports]
        if len(set(names)) != len(names):
            raise ValueError(f"part {self.id}: two ports have the same name")

    def port(self, name: str) -> Port:
        """Return the port called `name`; KeyError if there is none."""
        for port in self.ports:
            if port.name == name:
                return port
        raise KeyError(name)
