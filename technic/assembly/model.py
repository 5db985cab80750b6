"""The assembly: parts in their places, joints between them, supports. Frozen; SI units."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field
from enum import StrEnum
from typing import Any, Literal

import numpy as np

from technic.assembly.joint_types import JointType
from technic.assembly.stiffness import StiffnessTable
from technic.geometry import Array, Pose, readonly
from technic.parts.definition import Body, MassProperties, Material, PartDefinition, Port

__all__ = [
    "Assembly",
    "Finding",
    "FindingKind",
    "ImportSummary",
    "ImportedPart",
    "Joining",
    "Joint",
    "Part",
    "Source",
    "Support",
    "UnknownPart",
]


@dataclass(frozen=True, slots=True)
class Source:
    """Where a part stands in the model file.

    Parameters
    ----------
    submodel : str
        Path of submodel references, e.g. ``"main.ldr/arm.ldr"``.
    line : int
        Line of the part in the file, counted from 1.
    step : int
        Building step within its submodel, counted from 1.
    lines : tuple of int
        Lines of the references that lead to the part, outermost first, its own line last.
    """

    submodel: str
    line: int
    step: int = 1
    lines: tuple[int, ...] = ()


@dataclass(frozen=True, slots=True, eq=False)
class Part:
    """One part in its place.

    Parameters
    ----------
    id : str
        Stable and traceable: ``<submodel path>/<line>:<part number>``, or the id of an assembly file.
    number : str
        Part number as written in the file, without ``.dat``; empty for shapes of an assembly file.
    name : str
        What a person calls it, e.g. ``"Beam 7"``.
    pose : Pose
    ports : tuple of Port
        In part coordinates.
    body : Body
    mass_properties : MassProperties
        In part coordinates.
    fastener : bool
        Pins, axles, bushes: joins others, carries no structure of its own.
    color : int or None
        LDraw colour code.
    source : Source or None
    definition : PartDefinition or None
        None for shapes of an assembly file.
    shape : mapping
        Shape of an assembly file, in part coordinates; empty for parts of a catalogue.
    material : Material or None
        What the user says it is made of; None: what its definition or its body says.
    """

    id: str
    number: str
    name: str
    pose: Pose
    ports: tuple[Port, ...]
    body: Body
    mass_properties: MassProperties
    fastener: bool = False
    color: int | None = None
    source: Source | None = None
    definition: PartDefinition | None = None
    shape: Mapping[str, Any] = field(default_factory=dict)
    material: Material | None = None

    @property
    def centroid(self) -> Array:
        """Centre of mass in world coordinates (m), (3,)."""
        return self.pose.points(self.mass_properties.centroid)


@dataclass(frozen=True, slots=True, eq=False)
class Joint:
    """A joint between two parts.

    Parameters
    ----------
    id : str
    type : JointType
    parts : (int, int)
        Indices into `Assembly.parts`.
    point : (3,) array_like
        World coordinates (m).
    axes : (3, 3) array_like
        Rows: the joint's own axes in world coordinates, right-handed; see `joint_types`.
    held : (6,) array_like of bool
        Held motions in the order [axial, shear, shear, spin, tilt, tilt].
    stiffness : (6,) array_like
        N/m for translations, N m/rad for rotations; of freed motions it is ignored.
        ``inf`` means rigid.
    connection : str
        Which physical connection this is: the key of the stiffness table, e.g. ``"pin/pin_hole"``.
    provenance : str
        Where the stiffness comes from.
    ports : (str, str) or None
        Names of the mating ports, in the order of `parts`.
    offset : float
        How far apart the two features' lines are (m).
    missing_stop : str
        For an axle that can slide in a bore: the side along the joint's axis on which a stop is
        missing, ``"+"``, ``"-"`` or ``"both"``; otherwise empty.
    """

    id: str
    type: JointType
    parts: tuple[int, int]
    point: Array
    axes: Array
    held: Array
    stiffness: Array
    connection: str = ""
    provenance: str = ""
    ports: tuple[str, str] | None = None
    offset: float = 0.0
    missing_stop: str = ""

    def __post_init__(self) -> None:
        object.__setattr__(self, "point", readonly(self.point))
        object.__setattr__(self, "axes", readonly(self.axes))
        object.__setattr__(self, "held", readonly(self.held, dtype=np.bool_))
        object.__setattr__(self, "stiffness", readonly(self.stiffness))
        if self.parts[0] == self.parts[1]:
            raise ValueError(f"joint {self.id!r} joins a part to itself")


@dataclass(frozen=True, slots=True, eq=False)
class Support:
    """What holds a part to the ground.

    Parameters
    ----------
    part : int
        Index into `Assembly.parts`.
    point : (3,) array_like or None
        World coordinates (m); None holds the part as a whole, at its centroid.
    held : (6,) array_like of bool
        Held motions in world axes: x, y, z, rx, ry, rz.
    """

    part: int
    point: Array | None = None
    held: Array = field(default_factory=lambda: readonly(np.ones(6), dtype=np.bool_))


class FindingKind(StrEnum):
    """What the reading of a model can find worth a sentence."""

    OFF_GRID = "off_grid"
    """A joint whose features are further apart than they should be."""
    NEAR_MISS = "near_miss"
    """A pin or axle end that misses the nearest hole."""
    OPEN_PORT = "open_port"
    """A pin or axle end with nothing there."""
    SINGLE_PIN = "single_pin"
    """A part attached by one pin only."""
    ONE_PART_PIN = "one_part_pin"
    """A pin that sits in one part only."""
    NO_PIN = "no_pin"
    """Holes that line up with no pin in them."""
    LOOSE = "loose"
    """A part joined to nothing."""
    FLEXIBLE = "flexible"
    """Hose, chain, string, tyre: not modelled."""
    INNER = "inner"
    """A part that is not one rigid body: motor, actuator, shock absorber, universal joint."""
    OVERRIDE = "override"
    """What the user corrected in a file of his own."""
    MATERIAL = "material"
    """What the user said a part is made of."""
    GEARS = "gears"
    """Two gears in mesh."""
    WARNING = "warning"
    """Anything else about the file."""


@dataclass(frozen=True, slots=True)
class Finding:
    """One thing found while reading, with the parts it concerns (indices) and a sentence."""

    kind: FindingKind
    message: str
    parts: tuple[int, ...] = ()
    distance: float | None = None


@dataclass(frozen=True, slots=True)
class UnknownPart:
    """A part number that nothing is known about: not part of the analysis, never dropped in silence."""

    number: str
    lines: tuple[int, ...]
    reason: str = "no definition"

    @property
    def count(self) -> int:
        """How many of it the model has."""
        return len(self.lines)


@dataclass(frozen=True, slots=True)
class ImportedPart:
    """A kind of part that was read from the parts library, with how many there are of it."""

    number: str
    title: str
    count: int
    source: str


@dataclass(frozen=True, slots=True)
class ImportSummary:
    """Where the parts of a model file came from.

    Parameters
    ----------
    library, release : str
        Place and release of the LDraw parts library that parts were read from; empty when none was
        needed or none was there.
    shadow : str
        Place of the LDCad shadow library, or empty.
    searched : bool
        Whether a library was looked for at all.
    catalogue : int
        Parts with a definition of ours.
    from_library : tuple of ImportedPart
        The most frequent first.
    """

    library: str = ""
    release: str = ""
    shadow: str = ""
    searched: bool = False
    catalogue: int = 0
    from_library: tuple[ImportedPart, ...] = ()


@dataclass(frozen=True, slots=True, eq=False)
class Joining:
    """How the parts of a model file were joined: what it takes to join them in the same way again.

    Parameters
    ----------
    table : StiffnessTable
    axle_slide : {"held", "free"}
        Whether friction keeps a part where it is on an axle that it grips.
    gears : {"off", "on"}
        Whether gears in mesh turn each other.
    corrections : mapping or None
        A user's corrections; see `assembly.overrides`.
    corrected_by : str
        The file they stand in.
    """

    table: StiffnessTable
    axle_slide: Literal["held", "free"] = "held"
    gears: Literal["off", "on"] = "off"
    corrections: Mapping[str, Any] | None = None
    corrected_by: str = ""


@dataclass(frozen=True, slots=True, eq=False)
class Assembly:
    """Parts, joints and supports, with what was found while reading them.

    Parameters
    ----------
    name : str
    parts : tuple of Part
    joints : tuple of Joint
    supports : tuple of Support
    dimension : int
        2 or 3; in two dimensions everything lies and moves in the plane z = 0.
    unknown : tuple of UnknownPart
    findings : tuple of Finding
    source : dict
        ``path``, ``sha256``, ``format`` ("ldraw" or "assembly"); empty when built in Python.
    imported : ImportSummary or None
        None for what is no LDraw model.
    joining : Joining or None
        None where the joints were not found from the parts.
    """

    name: str
    parts: tuple[Part, ...]
    joints: tuple[Joint, ...] = ()
    supports: tuple[Support, ...] = ()
    dimension: int = 3
    unknown: tuple[UnknownPart, ...] = ()
    findings: tuple[Finding, ...] = ()
    source: dict[str, Any] = field(default_factory=dict)
    imported: ImportSummary | None = None
    joining: Joining | None = None

    def index(self, part_id: str) -> int:
        """Return the index of the part with this id; KeyError if there is none."""
        for k, part in enumerate(self.parts):
            if part.id == part_id:
                return k
        raise KeyError(part_id)
