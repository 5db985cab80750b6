"""What the user says parts are made of: another material for a model, a kind of part or one part.

Mass and inertia scale with the density; the stiffness of frame members, plates and meshes is made anew;
that of condensed solid models scales with Young's modulus, which is exact for equal Poisson's ratios.
Where they differ, twisting is off by the ratio of ``1 + nu``, and nothing by more: built anew with 0.39
instead of 0.35 (ratio 3.0 %), no mode of a beam 5 differs by more than 2.1 %. A finding says so.
"""

from __future__ import annotations

from collections import Counter
from collections.abc import Iterable, Mapping
from dataclasses import replace
from typing import Any, Final

from technic.assembly.model import Assembly, Finding, FindingKind, Part
from technic.assembly.select import find_parts
from technic.errors import InputError
from technic.parts.definition import (
    FrameBody,
    MassProperties,
    Material,
    MeshBody,
    PlateBody,
    TrussBody,
)
from technic.parts.materials import MIXED, SOFT, material_of, materials

__all__ = [
    "apply_materials",
    "known_material",
    "material_in",
    "material_rows",
    "parse_materials",
    "plastic_parts",
]

_FIELDS: Final = {"young_gpa", "poisson", "density"}


def material_in(part: Part) -> Material | None:
    """Return what a part is made of; None for a rigid shape of an assembly file."""
    if part.material is not None:
        return part.material
    if isinstance(part.body, FrameBody | TrussBody | PlateBody | MeshBody):
        return part.body.material
    return None if part.definition is None else material_of(part.definition)


def material_rows(assembly: Assembly) -> list[dict[str, str | float | int]]:
    """Return what the model is made of, as reports give it: constants, source, how many parts."""
    counts: Counter[Material] = Counter()
    for part in assembly.parts:
        made_of = material_in(part)
        if made_of is not None:
            counts[made_of] += 1
    return [
        {
            "name": made_of.name,
            "parts": count,
            "young_gpa": made_of.young_pa / 1e9,
            "poisson": made_of.poisson,
            "density_kg_m3": made_of.density,
            "source": made_of.source,
        }
        for made_of, count in sorted(counts.items(), key=lambda item: (-item[1], item[0].name))
    ]


def known_material(value: Any) -> Material:
    """Return a material by its name, or from a table of its constants.

    Parameters
    ----------
    value : str or mapping
        ``"PC"``, or ``{young_gpa = 2.4, poisson = 0.37, density = 1200}``.

    Raises
    ------
    InputError
        No such material, or constants that no material has.
    """
    if isinstance(value, str):
        by_name = {name.lower(): known for name, known in materials().items()}
        found = by_name.get(value.strip().lower())
        if found is None:
            raise InputError(f"no material {value!r}; known: {', '.join(sorted(materials()))}")
        return found
    if not isinstance(value, Mapping) or set(value) != _FIELDS:
        raise InputError("a material is a name, or young_gpa, poisson and density")
    numbers = {key: value[key] for key in sorted(_FIELDS)}
    if any(isinstance(v, bool) or not isinstance(v, int | float) for v in numbers.values()):
        raise InputError("young_gpa, poisson and density are numbers")
    young, poisson, density = (float(value[k]) for k in ("young_gpa", "poisson", "density"))
    if not (0.0 < young < 1e4 and 0.0 <= poisson < 0.5 and 0.0 < density < 1e5):
        raise InputError(
            "no such material: young_gpa and density (kg/m3) are positive, poisson is 0 to below 0.5"
        )
    return Material("own", young * 1e9, poisson, density, source="given by the user")


def parse_materials(assembly: Assembly, texts: Iterable[str]) -> dict[int, Material]:
    """Return what ``NAME`` and ``PART=NAME`` say; what is said of a part wins, then what is said later.

    ``NAME`` is for the whole model but for what is no single hard plastic: rubber, motors, hubs, sensors,
    actuators. ``PART`` is a part's id, the end of it, or a part number: then all parts of that number.

    Raises
    ------
    InputError
        An unknown material.
    UsageError
        An unknown part.
    """
    general: dict[int, Material] = {}
    chosen: dict[int, Material] = {}
    for text in texts:
        who, equals, name = text.rpartition("=")
        made_of = known_material(name)
        if equals:
            chosen.update(dict.fromkeys(find_parts(assembly, who), made_of))
        else:
            general = dict.fromkeys(plastic_parts(assembly), made_of)
    return general | chosen


def plastic_parts(assembly: Assembly) -> list[int]:
    """Return the parts that are of one hard plastic."""
    return [k for k, part in enumerate(assembly.parts) if _plain(part)]


def _plain(part: Part) -> bool:
    made_of = material_in(part)
    if made_of is None or made_of.name in SOFT:
        return False
    return part.definition is None or not part.definition.family.startswith(MIXED)


def apply_materials(assembly: Assembly, chosen: Mapping[int, Material]) -> Assembly:
    """Return the assembly with parts made of other materials; a finding says which.

    Parameters
    ----------
    assembly : Assembly
    chosen : mapping of int to Material
        By index of the part.

    Raises
    ------
    InputError
        A part has no material to begin with: a rigid shape of an assembly file.
    """
    if not chosen:
        return assembly
    parts = list(assembly.parts)
    made: dict[tuple[int, int, str], Part] = {}
    for k, made_of in chosen.items():
        part = parts[k]
        # equal parts go on sharing body and mass, and so their matrices
        kind = (id(part.body), id(part.mass_properties), repr(made_of))
        like = made.setdefault(kind, _made_of(part, made_of))
        parts[k] = replace(
            part, body=like.body, mass_properties=like.mass_properties, material=made_of
        )
    return replace(
        assembly,
        parts=tuple(parts),
        findings=(*assembly.findings, *_findings(assembly, chosen)),
    )


def _made_of(part: Part, made_of: Material) -> Part:
    old = material_in(part)
    if old is None:
        raise InputError(f"{part.id} is a rigid shape: it is made of nothing in particular")
    ratio = made_of.density / old.density
    was = part.mass_properties
    body = part.body
    if isinstance(body, FrameBody | TrussBody | PlateBody | MeshBody):
        body = replace(body, material=made_of)
    return replace(
        part,
        body=body,
        mass_properties=MassProperties(was.mass * ratio, was.centroid, was.inertia * ratio),
        material=made_of,
    )


def _findings(assembly: Assembly, chosen: Mapping[int, Material]) -> list[Finding]:
    groups: dict[tuple[str, str], list[int]] = {}
    for k, made_of in sorted(chosen.items()):
        part = assembly.parts[k]
        old = material_in(part)
        note = ""
        if old is not None and part.definition is not None and old.poisson != made_of.poisson:
            share = abs((1.0 + made_of.poisson) / (1.0 + old.poisson) - 1.0)
            note = (
                f"; solid models keep Poisson's ratio {old.poisson:g} instead of "
                f"{made_of.poisson:g}: their stiffness is up to {100 * share:.1f} % off"
            )
        groups.setdefault((made_of.name, note), []).append(k)
    return [
        Finding(
            FindingKind.MATERIAL,
            f"made of {name} as you said: {len(parts)} part{'' if len(parts) == 1 else 's'}{note}",
            tuple(parts),
        )
        for (name, note), parts in groups.items()
    ]
