"""Materials and cross-sections of the catalogue, each with its source."""

from __future__ import annotations

import functools
import tomllib
from importlib.resources import files
from typing import Any

from technic.errors import UsageError
from technic.parts.definition import Material, PartDefinition, Section
from technic.units import MM

__all__ = ["ABS", "MIXED", "SOFT", "material", "material_of", "materials", "sections"]

ABS = "ABS"
"""Name of the material of everything that names none."""


SOFT = ("SEBS",)
"""Rubber: what is made of it is not meant when a model is said to be of another plastic."""

MIXED = (
    "hub-ev3",
    "hub-spike",
    "hub-cplus",
    "linear-actuator",
    "motor",
    "sensor",
    "shock-absorber",
    "tyre",
)
"""Families (by their beginning) of parts that are of several materials: their mass is a weighed one."""


def _table(name: str) -> dict[str, Any]:
    text = files("parts_library").joinpath(name).read_text(encoding="utf-8")
    return tomllib.loads(text)


@functools.cache
def materials() -> dict[str, Material]:
    """Return the materials by name."""
    return {
        name: Material(
            name=name,
            young_pa=float(row["young_gpa"]) * 1e9,
            poisson=float(row["poisson"]),
            density=float(row["density"]),
            source=str(row["source"]),
        )
        for name, row in _table("materials.toml").items()
    }


def material(name: str = ABS) -> Material:
    """Return the material called `name`.

    Raises
    ------
    UsageError
        When there is none of that name; the message lists those that exist.
    """
    try:
        return materials()[name]
    except KeyError:
        known = ", ".join(sorted(materials()))
        raise UsageError(f"no material {name!r}; known: {known}") from None


def material_of(definition: PartDefinition) -> Material:
    """Return what a part is made of, by its catalogue entry; ABS when it says nothing."""
    name = definition.shape.get("material")
    return material(str(name) if name else ABS)


@functools.cache
def sections() -> dict[str, Section]:
    """Return the equivalent cross-sections of frame members by name (files: mm2 and mm4).

    The member's z axis is the axis of the holes, so `inertia_z` is the stiffness in the plane in
    which the holes lie.
    """
    return {
        name: Section(
            area=float(row["area"]) * MM**2,
            inertia_y=float(row["inertia_out"]) * MM**4,
            inertia_z=float(row["inertia_in"]) * MM**4,
            torsion=float(row["torsion"]) * MM**4,
            source=str(row["source"]),
        )
        for name, row in _table("sections.toml").items()
    }
