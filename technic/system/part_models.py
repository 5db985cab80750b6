"""What a part becomes in the system: a solid model where one is shipped, frame members, a rigid body."""

from __future__ import annotations

from collections import Counter
from dataclasses import replace

from technic.assembly.model import Assembly, Part
from technic.fem.element import Element
from technic.fem.solid.store import load
from technic.fem.solid.superelement import super_element_to_element
from technic.geometry import Array, shift_twist
from technic.parts.definition import RigidBody
from technic.system.assemble import element_of

__all__ = ["model_of", "models_of", "solid_element_of"]


def solid_element_of(part: Part, points: Array, ports: tuple[str | None, ...]) -> Element:
    """Return the condensed solid model of a part; its own body's element where none is shipped.

    The mass is scaled to the part's own, so that models of either kind weigh the same.
    """
    condensed = None if part.definition is None else load(part.definition)
    if condensed is None or not len(points):
        return element_of(part, points, ports)
    known = {*condensed.ports, *(name for name, _ in condensed.merged)}
    framed = [name if name in known else None for name in ports]  # studs have no frame of their own
    element, _ = super_element_to_element(condensed, framed, points)
    # the system takes rigid motions about the part's centroid, not that of the solid model
    arm = condensed.centroid - part.mass_properties.centroid
    rigid = element.rigid @ shift_twist(arm)
    present = float(rigid[:, 0] @ element.mass @ rigid[:, 0])
    return replace(element, mass=element.mass * (part.mass_properties.mass / present), rigid=rigid)


def model_of(part: Part, parts: str) -> str:
    """Return what a part is modelled as: "solid", "frame" or "rigid".

    Parameters
    ----------
    part : Part
    parts : str
        What was asked for.
    """
    if parts == "rigid" or (part.fastener and isinstance(part.body, RigidBody)):
        return "rigid"
    if parts == "solid" and part.definition is not None and load(part.definition) is not None:
        return "solid"
    return "rigid" if isinstance(part.body, RigidBody) else "frame"


def models_of(assembly: Assembly, parts: str) -> dict[str, int]:
    """Count the parts by what they are modelled as."""
    counts = Counter(model_of(part, parts) for part in assembly.parts)
    return {kind: counts[kind] for kind in ("solid", "frame", "rigid") if counts[kind]}
