"""Definitions of parts that the catalogue does not have, made from an LDraw library.

A definition so made has ports and a drawing, from which an analysis can make a solid model; by itself
it is a rigid body. Where its ports and its mass come from is said in `PartDefinition.source`.
"""

from __future__ import annotations

import re
from collections.abc import Sequence
from functools import partial
from typing import Final, Literal

import numpy as np

from technic.errors import InputError
from technic.geometry import Array
from technic.ldraw.library import Library
from technic.ldraw.primitives import ports_from_primitives
from technic.ldraw.shadow import ShadowLibrary
from technic.ldraw.shadow_ports import ports_from_shadow
from technic.ldraw.triangles import Surface, surface_of
from technic.ldraw.undersides import stud_places
from technic.ldraw.weight import mass_of
from technic.parts.definition import (
    LIBRARY_FAMILY,
    Drawing,
    PartDefinition,
    Port,
    PortKind,
    RigidBody,
)
from technic.parts.inner import inner_parts
from technic.units import MM, PITCH

__all__ = ["CELLS", "Solids", "definition_from_library", "is_fastener"]

Solids = Literal["draft", "fine", "off"]

CELLS: Final[dict[str, float]] = {"draft": 1.6 * MM, "fine": 0.8 * MM}
"""Edge of the cells that a part of the library is meshed with, by setting (m); fine is the setting of
the models that are shipped."""

BUSH_SIZE: Final = 1.2 * PITCH
"""Largest size of a bush: 1L and its flanges."""


def definition_from_library(
    library: Library,
    number: str,
    shadow: ShadowLibrary | None = None,
    *,
    solids: Solids = "draft",
) -> PartDefinition | None:
    """Return a definition of a part from its library files.

    Parameters
    ----------
    library : Library
    number : str
        LDraw number, with or without ``.dat``. Moved-to stubs are followed; the definition is in the
        coordinates of the number asked for.
    shadow : ShadowLibrary, optional
        Its ports win over those from primitives, where it describes the part.
    solids : {"draft", "fine", "off"}
        How finely the part is meshed when an analysis wants its solid model; off: never. Parts that
        move inside are never meshed: they are no single solid.

    Returns
    -------
    PartDefinition or None
        None when the library does not have the part.

    Raises
    ------
    InputError
        The part's files are broken, absurdly big, or draw no surface: such a part has no mass.
    """
    resolved = library.resolve(number)
    surface = surface_of(library, number, fine=False)
    if resolved is None or surface is None:
        return None
    if not len(surface.triangles):
        raise InputError("it draws no surface", path=library.where(resolved.key))
    ports = None if shadow is None else ports_from_shadow(library, shadow, number)
    origin = "ports from the LDCad shadow library"
    if ports is None:
        ports = ports_from_primitives(library, number) or ()
        origin = "ports from LDraw primitives"
        if not any(port.kind in (PortKind.TUBE, PortKind.PIN, PortKind.AXLE) for port in ports):
            places = stud_places(surface)
            if places:
                ports = (*ports, *places)
                origin += ", places for studs from its open underside"
    title = _title(library.file(resolved.key).title)
    mass, measured = mass_of(surface)
    return PartDefinition(
        id=number.lower().removesuffix(".dat"),
        title=title,
        family=LIBRARY_FAMILY,
        ports=ports,
        body=RigidBody(),
        mass_properties=mass,
        fastener=is_fastener(ports, title, surface),
        source=f"LDraw library {resolved.key}; {origin}; {measured}",
        drawing=_drawing(library, number, solids),
    )


def _drawing(library: Library, number: str, solids: Solids) -> Drawing:
    whole = number.lower().removesuffix(".dat") not in inner_parts()
    cell = CELLS[solids] if solids != "off" and whole else 0.0
    return Drawing(partial(_triangles, library, number, fine=solids == "fine"), cell)


def _triangles(library: Library, number: str, *, fine: bool) -> Array:
    surface = surface_of(library, number, fine=fine)
    assert surface is not None  # the definition was made from it
    return surface.triangles


def _title(text: str) -> str:
    """Return the title of a part without marks of the library (``~ = _ |``) and double spaces."""
    return re.sub(r"\s+", " ", text.lstrip("~=_|")).strip()


def is_fastener(ports: Sequence[Port], title: str, surface: Surface) -> bool:
    """Tell whether a part joins others and carries no structure of its own: pins, axles, bushes.

    Its pins and axles lie on one line and there is nothing else but what sits on that line, or it is
    a bush: a small part with one axle hole.
    """
    male = [port for port in ports if port.kind in (PortKind.PIN, PortKind.AXLE)]
    if male:
        first = male[0]
        for port in ports:
            across = np.cross(port.position - first.position, first.axis)
            if np.linalg.norm(across) > PITCH / 8 or port.kind is PortKind.PIN_HOLE:
                return False
            aligned = abs(float(port.axis @ first.axis)) > 0.99
            if not aligned and port.kind is not PortKind.BALL:
                return False
        return True
    if ports and all(port.kind is PortKind.AXLE_HOLE for port in ports):
        size = np.ptp(surface.bounds, axis=0)
        return "bush" in title.lower() and float(size.max()) <= BUSH_SIZE
    return False
