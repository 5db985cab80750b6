"""The answer of an analysis: frozen records, SI units, parts and joints by index into the assembly."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field
from enum import StrEnum
from importlib import import_module
from pathlib import Path
from typing import Any

from technic.assembly.model import Assembly
from technic.assembly.stiffness import StiffnessTable
from technic.geometry import Array, readonly
from technic.system.library_models import LibraryModels
from technic.system.part_models import PlainPart

__all__ = [
    "Component",
    "Mobility",
    "Mode",
    "Motion",
    "MotionKind",
    "MotionType",
    "Rigidity",
    "RigidityReport",
    "SpotRange",
    "Stability",
    "Verdict",
    "WeakSpot",
]


class Verdict(StrEnum):
    """Is it rigid?"""

    RIGID = "rigid"
    FLEXIBLE = "flexible"
    DISCONNECTED = "disconnected"
    UNDETERMINED = "undetermined"


class MotionKind(StrEnum):
    """What a motion means to a builder."""

    STRUCTURAL = "structural"
    SPINNING = "spinning"
    SLIDING = "sliding"
    IDLE = "idle"


class MotionType(StrEnum):
    """What a motion is geometrically, seen from the parts that stay."""

    ROTATION = "rotation"
    TRANSLATION = "translation"
    SCREW = "screw"
    GENERAL = "general"


@dataclass(frozen=True, slots=True)
class Mobility:
    """Internal motions at first order, by kind; `total` is their sum.

    Parameters
    ----------
    structural, spinning, sliding, idle : int
    proof : str
        "exact" (rank over the integers modulo a prime) or "numerical" (singular values).
    smallest_kept, largest_dropped : float
        Singular values of the mobility matrix on either side of the cut; `smallest_kept` is infinite
        when no joint holds anything.
    """

    structural: int
    spinning: int
    sliding: int
    idle: int
    proof: str
    smallest_kept: float
    largest_dropped: float

    @property
    def total(self) -> int:
        """Nullity less the rigid motions of each component."""
        return self.structural + self.spinning + self.sliding + self.idle


@dataclass(frozen=True, slots=True, eq=False)
class Motion:
    """One internal motion.

    Parameters
    ----------
    kind : MotionKind
    type : MotionType
    parts : tuple of int
        Parts that move, the main body of the component standing still.
    freed_by : tuple of int
        Joints with a freed relative motion in it.
    twists : (len(parts), 6) array_like
        Twist of each moving part about its centroid, world axes; scaled so that the part that goes
        furthest moves 1 (m for translations, or m at the model's own size for rotations).
    axis_point, axis_direction : (3,) array_like or None
        Axis of a rotation or screw, direction of a translation (point None).
    pitch : float
        Advance of a screw per radian (m).
    order : str or None
        "finite", "first-order", or None when not examined.
    second_order : str or None
        Of a first-order motion: "stiffens" when forces in the joints that balance each other resist it,
        "undecided" when none do, None when not examined.
    component : int
    sentence : str
        The motion in the builders' words.
    """

    kind: MotionKind
    type: MotionType
    parts: tuple[int, ...]
    freed_by: tuple[int, ...]
    twists: Array
    axis_point: Array | None = None
    axis_direction: Array | None = None
    pitch: float = 0.0
    order: str | None = None
    second_order: str | None = None
    component: int = 0
    sentence: str = ""

    def __post_init__(self) -> None:
        for name in ("twists", "axis_point", "axis_direction"):
            value = getattr(self, name)
            if value is not None:
                object.__setattr__(self, name, readonly(value))


@dataclass(frozen=True, slots=True)
class Rigidity:
    """Worst-case rigidity of a component.

    Parameters
    ----------
    value : float
        Smallest positive eigenvalue (N/m; dimensionless stiffness of the nodal measure otherwise).
    frequency_hz : float or None
        Lowest natural frequency, ``sqrt(value / mass) / (2 pi)``; None for the nodal measure.
    measure : str
        "mean_square" or "nodal".
    residual : float
        Relative residual of the eigenpair.
    interval_95 : (float, float) or None
        From the covariance of calibrated stiffnesses; None when nothing is calibrated.
    log_slopes : tuple of float
        ``d log value / d log s`` of every measured stiffness of the table; empty when none is.
    rigid_walls : float or None
        The same number (N/m) with bores that keep their shape: the truth lies between `value` and it;
        None when it was not asked for.
    """

    value: float
    frequency_hz: float | None
    measure: str
    residual: float
    interval_95: tuple[float, float] | None = None
    rigid_walls: float | None = None
    log_slopes: tuple[float, ...] = ()

    @property
    def compliance_mm_per_n(self) -> float:
        """RMS displacement per newton of the worst load pattern (mm/N)."""
        return 1e3 / self.value


@dataclass(frozen=True, slots=True, eq=False)
class Mode:
    """One elastic mode of a component.

    Parameters
    ----------
    value : float
        Eigenvalue (N/m).
    unknowns : (n,) array_like
        The eigenvector over all unknowns of the system, ``x^T M x = 1``.
    twists : (p, 6) array_like
        Rigid part of every part's movement about its centroid, world axes (m, rad), for an RMS
        displacement of 1 m; zero for parts of other components.
    forces : (p, 6) array_like
        Force (N) and moment about the centroid (N m) on every part of the load that causes it, for
        the same displacement: ``value * M x``.
    displacements : mapping of int to (m, 3) arrays
        Per part: the displacement of its nodes, which ``RigidityReport.node_points`` places (m, for an
        RMS of 1 m).
    """

    value: float
    unknowns: Array
    twists: Array
    forces: Array
    displacements: Mapping[int, Array] = field(default_factory=dict)

    def __post_init__(self) -> None:
        for name in ("unknowns", "twists", "forces"):
            object.__setattr__(self, name, readonly(getattr(self, name)))


@dataclass(frozen=True, slots=True)
class WeakSpot:
    """A joint or a part that takes up a share of the worst mode's strain energy."""

    rank: int
    kind: str
    index: int
    energy_share: float
    parts: tuple[int, ...]


@dataclass(frozen=True, slots=True)
class SpotRange:
    """Where a weak spot may stand, and its share in the energy, with 95 % confidence."""

    ranks: tuple[int, int]
    energy_shares: tuple[float, float]


@dataclass(frozen=True, slots=True)
class Stability:
    """What measured stiffnesses leave open; the verdict does not rest on stiffness.

    Parameters
    ----------
    draws : int
        How often stiffnesses were drawn.
    spots : tuple of SpotRange
        Of the first weak spots, in their order.
    """

    draws: int
    spots: tuple[SpotRange, ...]

    @property
    def first_open(self) -> int | None:
        """Rank of the first weak spot that may stand elsewhere; None when all of them stay."""
        for rank, spot in enumerate(self.spots, start=1):
            if spot.ranks != (rank, rank):
                return rank
        return None


@dataclass(frozen=True, slots=True, eq=False)
class Component:
    """Parts that hang together through joints."""

    parts: tuple[int, ...]
    mass: float
    verdict: Verdict
    mobility: Mobility
    rigidity: Rigidity | None


@dataclass(frozen=True, slots=True, eq=False)
class RigidityReport:
    """Everything the analysis found; `to_dict` gives the JSON contract ``technic-report/1``.

    Parameters
    ----------
    assembly : Assembly
    verdict : Verdict
    reason : str
        One sentence that says why.
    mobility : Mobility
        Sum over the components.
    motions : tuple of Motion
        Structural first, then spinning, sliding, idle; within a kind the largest first.
    rigidity : Rigidity or None
        Of the heaviest component; None when it has no elastic mode (a single rigid part).
    modes : tuple of Mode
        Lowest elastic modes of the heaviest component; the first is the worst case.
    weak_spots : tuple of WeakSpot
        Of the worst mode, largest share first; all of them, shares sum to 1.
    components : tuple of Component
        Heaviest first.
    unknowns : int
        Number of unknowns of the system.
    mass : float
        Of the whole model (kg).
    part_models : mapping of str to int
        How many parts are solid models, frame members, rigid bodies.
    plain_parts : tuple of PlainPart
        The kinds of part without a solid model, when solid models were asked for.
    library_models : LibraryModels
        What the parts from a parts library are.
    qualifier : str
        "", "at least" or "at most": how the count of motions is to be read.
    not_modelled : tuple of str
    timings : mapping
        Seconds per stage.
    table : StiffnessTable or None
        Stiffness table in force; None when it is the shipped one.
    stability : Stability or None
        None when no stiffness was measured.
    node_points, node_displacements : mapping of int to (m, 3) arrays
        Per part: nodes in world coordinates (m) and their displacement in the worst mode (m, for an RMS
        of 1 m).
    """

    assembly: Assembly
    verdict: Verdict
    reason: str
    mobility: Mobility
    motions: tuple[Motion, ...]
    rigidity: Rigidity | None
    modes: tuple[Mode, ...]
    weak_spots: tuple[WeakSpot, ...]
    components: tuple[Component, ...]
    unknowns: int
    mass: float
    part_models: Mapping[str, int] = field(default_factory=dict)
    plain_parts: tuple[PlainPart, ...] = ()
    library_models: LibraryModels = field(default_factory=LibraryModels)
    qualifier: str = ""
    not_modelled: tuple[str, ...] = ()
    timings: Mapping[str, float] = field(default_factory=dict)
    table: StiffnessTable | None = None
    stability: Stability | None = None
    node_points: Mapping[int, Array] = field(default_factory=dict)
    node_displacements: Mapping[int, Array] = field(default_factory=dict)

    def to_dict(self) -> dict[str, Any]:
        """Return the JSON object of the contract ``technic-report/1``."""
        from technic.rigidity.serialize import to_dict

        return to_dict(self)

    # Reports stand above the mechanics, which do not know them: the two below are found by name when
    # somebody asks to see something, and nothing here depends on them.

    def _repr_html_(self) -> str:
        """Return a short summary, as notebooks show the value of a cell."""
        return str(import_module("technic.report.html.notebook").summary(self))

    def show(self, path: Path | None = None) -> Path | None:
        """Show the whole page in the notebook or the browser; see `technic.report.html.notebook`.

        Parameters
        ----------
        path : Path, optional
            Where to write the page; a temporary file when left out.
        """
        shown: Path | None = import_module("technic.report.html.notebook").show(self, path)
        return shown
