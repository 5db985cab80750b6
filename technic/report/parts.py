"""Part definitions as text and as JSON."""

from __future__ import annotations

from collections import Counter
from collections.abc import Sequence
from typing import Any

from technic.geometry import Array
from technic.parts.definition import FrameBody, PartDefinition
from technic.report.wording import count, number
from technic.units import LDU, MM

__all__ = ["definition_dict", "list_text", "show_text"]


def definition_dict(definition: PartDefinition, *, ports: bool = True) -> dict[str, Any]:
    """Return a definition as plain values; lengths of ports in millimetres, part coordinates."""
    content: dict[str, Any] = {
        "id": definition.id,
        "title": definition.title,
        "family": definition.family,
        "fastener": definition.fastener,
        "aliases": list(definition.aliases),
        "mass_g": definition.mass_properties.mass * 1e3,
        "port_counts": dict(Counter(port.kind.value for port in definition.ports)),
        "bends": isinstance(definition.body, FrameBody),
        "source": definition.source,
    }
    if ports:
        content["centroid_mm"] = [float(v) for v in definition.mass_properties.centroid / MM]
        content["ports"] = [
            {
                "name": port.name,
                "kind": port.kind.value,
                "position_mm": [float(v) + 0.0 for v in port.position / MM],
                "axis": [float(v) + 0.0 for v in port.axis],
                "length_mm": port.length / MM,
                "friction": port.friction,
            }
            for port in definition.ports
        ]
    return content


def _port_summary(definition: PartDefinition) -> str:
    kinds = Counter(port.kind.value.replace("_", " ") for port in definition.ports)
    return ", ".join(count(n, kind) for kind, n in kinds.items()) or "no ports"


def list_text(definitions: Sequence[PartDefinition]) -> str:
    """Return a table: number, family, title, ports."""
    wide = [max([0, *(len(getattr(d, key)) for d in definitions)]) for key in ("id", "family")]
    wide.append(max([0, *(len(d.title) for d in definitions)]))
    lines = [
        f"{d.id:{wide[0]}}  {d.family:{wide[1]}}  {d.title:{wide[2]}}  {_port_summary(d)}"
        for d in definitions
    ]
    lines.append(count(len(definitions), "part"))
    return "\n".join(lines) + "\n"


def _triple(values: Array) -> str:
    return "(" + ", ".join(number(float(v) + 0.0, 4) for v in values) + ")"


def show_text(definition: PartDefinition) -> str:
    """Return all facts of one definition; positions in LDU, as in LDraw files."""
    mass = definition.mass_properties
    body = "bends like a frame" if isinstance(definition.body, FrameBody) else "rigid"
    lines = [
        f"{definition.id}  {definition.title}",
        f"family    {definition.family}{', a fastener' if definition.fastener else ''}",
        f"same as   {', '.join(definition.aliases) or '-'}",
        f"mass      {number(mass.mass * 1e3)} g",
        f"centroid  {_triple(mass.centroid / LDU)} LDU",
        f"body      {body}",
        f"source    {definition.source or '-'}",
        f"ports     {len(definition.ports)} (position in LDU, axis, length in LDU)",
    ]
    width = max([0, *(len(port.name) for port in definition.ports)])
    for port in definition.ports:
        friction = "  friction" if port.friction else ""
        lines.append(
            f"  {port.name:{width}}  {port.kind.value:9}  {_triple(port.position / LDU)}  "
            f"{_triple(port.axis)}  {number(port.length / LDU, 4)}{friction}"
        )
    return "\n".join(lines) + "\n"
