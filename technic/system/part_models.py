"""What a part becomes in the system: a solid model (shipped, or made from its drawing), its own body,
a rigid body.
"""

from __future__ import annotations

from collections import Counter
from collections.abc import Callable
from dataclasses import dataclass, replace
from typing import Final, Literal

from technic.assembly.model import Assembly, Part
from technic.fem.build import build_element
from technic.fem.element import Element
from technic.fem.solid.superelement import SuperElement, super_element_to_element
from technic.geometry import Array, shift_twist
from technic.parts.definition import LIBRARY_FAMILY, RigidBody
from technic.parts.materials import material_of
from technic.system.drawn_solids import outcome_of, solid_model
from technic.system.solid_cache import Refusal

__all__ = [
    "FACTORIES",
    "ElementFactory",
    "PartModel",
    "PlainPart",
    "element_from",
    "element_of",
    "framed",
    "model_of",
    "models_of",
    "plain_parts",
    "rigid_element_of",
    "solid_element_of",
]

PartModel = Literal["solid", "frame", "rigid"]
"""What parts are asked to be."""

ElementFactory = Callable[[Part, Array, tuple[str | None, ...]], Element]
"""From a part, its attachment points (part coordinates) and their port names, to its element."""


@dataclass(frozen=True, slots=True)
class PlainPart:
    """A kind of part that has no solid model.

    Parameters
    ----------
    number, name : str
    count : int
        How many of it the model has.
    model : str
        What it is instead: "frame" or "rigid".
    reason : str
    """

    number: str
    name: str
    count: int
    model: str
    reason: str

    def to_dict(self) -> dict[str, str | int]:
        """Return it as the reports' JSON objects give it."""
        return {
            "part_number": self.number,
            "name": self.name,
            "count": self.count,
            "model": self.model,
            "reason": self.reason,
        }


def element_of(part: Part, points: Array, _ports: tuple[str | None, ...]) -> Element:
    """Return the element of a part's own body (frame members, a mesh, a rigid body...)."""
    return build_element(part.body, part.mass_properties, points)


def rigid_element_of(part: Part, points: Array, _ports: tuple[str | None, ...]) -> Element:
    """Return the element of a part that is taken as rigid, whatever its body."""
    return build_element(RigidBody(), part.mass_properties, points)


def solid_element_of(part: Part, points: Array, ports: tuple[str | None, ...]) -> Element:
    """Return the condensed solid model of a part; its own body's element where it has none.

    The mass is scaled to the part's own, so that models of either kind weigh the same.
    """
    condensed = None if part.definition is None else solid_model(part.definition)
    if condensed is None:
        return element_of(part, points, ports)
    return element_from(condensed, part, points, ports)


def element_from(
    condensed: SuperElement, part: Part, points: Array, ports: tuple[str | None, ...]
) -> Element:
    """Return the element of a part that a condensed model stands for; its mass is that of the part."""
    element, _ = super_element_to_element(condensed, framed(condensed, ports), points)
    # the system takes rigid motions about the part's centroid, not that of the solid model
    arm = condensed.centroid - part.mass_properties.centroid
    rigid = element.rigid @ shift_twist(arm)
    present = float(rigid[:, 0] @ element.mass @ rigid[:, 0])
    return replace(
        element,
        stiffness=element.stiffness * _stiffer(part),
        mass=element.mass * (part.mass_properties.mass / present),
        rigid=rigid,
    )


def framed(condensed: SuperElement, ports: tuple[str | None, ...]) -> list[str | None]:
    """Return the ports that have a frame; None for studs, say, which take the nearest one."""
    known = {*condensed.ports, *(name for name, _ in condensed.merged)}
    return [name if name in known else None for name in ports]


def _stiffer(part: Part) -> float:
    """Return how much stiffer the material chosen for a part is than the one of its definition.

    Exact for equal Poisson's ratios; `assembly.materials` says so where they differ.
    """
    if part.material is None or part.definition is None:
        return 1.0
    return part.material.young_pa / material_of(part.definition).young_pa


FACTORIES: Final[dict[str, ElementFactory]] = {
    "solid": solid_element_of,
    "frame": element_of,
    "rigid": rigid_element_of,
}
"""What makes a part's element, by what is asked for."""


def model_of(part: Part, parts: str) -> str:
    """Return what a part is modelled as: "solid", "frame", "rigid", or "paper" (strips of springs).

    Parameters
    ----------
    part : Part
    parts : str
        What was asked for.
    """
    if parts == "paper":
        return parts
    if parts == "solid" and part.definition is not None and solid_model(part.definition):
        return "solid"
    return "rigid" if parts == "rigid" or isinstance(part.body, RigidBody) else "frame"


def models_of(assembly: Assembly, parts: str) -> dict[str, int]:
    """Count the parts by what they are modelled as."""
    counts = Counter(model_of(part, parts) for part in assembly.parts)
    return {kind: counts[kind] for kind in ("solid", "frame", "rigid", "paper") if counts[kind]}


def plain_parts(assembly: Assembly, parts: str) -> tuple[PlainPart, ...]:
    """Return the kinds of part without a solid model, most frequent first; none unless asked for solid.

    Shapes of an assembly file are what the file says and are not listed.
    """
    if parts != "solid":
        return ()
    counts: Counter[tuple[str, str, str, str]] = Counter()
    for part in assembly.parts:
        model = model_of(part, parts)
        if part.definition is not None and model != "solid":
            counts[part.number, part.name, model, _reason(part)] += 1
    return tuple(
        PlainPart(number, name, count, model, reason)
        for (number, name, model, reason), count in sorted(
            counts.items(), key=lambda item: (-item[1], item[0])
        )
    )


def _reason(part: Part) -> str:
    if part.fastener and isinstance(part.body, RigidBody):
        return "a pin or small connector: its give is in the joints"
    if part.fastener:
        return "a bar between its joints, with its true section"
    if part.definition is None or part.definition.family != LIBRARY_FAMILY:
        return "no solid model is shipped"
    if part.definition.drawing is None:
        return "a piece of a part that moves inside"
    made = outcome_of(part.definition)
    assert isinstance(made, Refusal)  # or it would be solid
    return made.reason
