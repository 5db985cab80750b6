"""The part catalogue: from an LDraw number to a `PartDefinition`.

The files are read once, a definition is built when it is first asked for: a model uses a few dozen of
some hundred parts.
"""

from __future__ import annotations

import functools
import json
import re
import tomllib
from collections.abc import Iterator, Mapping
from dataclasses import dataclass
from importlib.resources import files
from typing import Any

import numpy as np

from technic.errors import SchemaError
from technic.geometry import Pose
from technic.parts.definition import (
    Body,
    MassProperties,
    PartDefinition,
    RigidBody,
)
from technic.parts.families import FAMILIES, expand
from technic.parts.materials import ABS, material, sections
from technic.parts.notation import parse_frame, parse_ports, parse_pose

__all__ = ["Catalogue", "catalogue", "read_rows"]

_DECORATED = re.compile(r"^(\d+[a-z]?)(?:p|d)[a-z0-9]+$")
"""A printed (pNN) or stickered (dNN) version of a part has the part's geometry."""

_EMBEDDED = re.compile(r"^[\d-]+ - (?=\d)")
"""Models of the Official Model Repository embed parts as ``<set> - <part>.dat``."""

_IDENTITY = Pose.identity()


@dataclass(frozen=True, slots=True)
class _Name:
    """What a number means: row of the definition, and where its frame stands in the number's."""

    part: str
    pose: str = ""


class Catalogue:
    """Definitions by LDraw number.

    Parameters
    ----------
    rows : mapping
        Part id to ``(table, row)`` of the definition files.
    masses : mapping
        Part id to ``{mass_kg, centroid_m, inertia_kg_m2, ...}``.
    """

    def __init__(
        self,
        rows: Mapping[str, tuple[str, Mapping[str, Any]]],
        masses: Mapping[str, Mapping[str, Any]],
    ) -> None:
        self._rows = dict(rows)
        self._masses = dict(masses)
        self._built: dict[str, PartDefinition] = {}
        self._names: dict[str, _Name] = {}
        for part, (_, row) in self._rows.items():
            self._register(part, _Name(part))
            for alias in row.get("aliases", ()):
                self._register(alias, _Name(part))
            for alias, pose in row.get("moved", {}).items():
                self._register(alias, _Name(part, pose))

    def _register(self, number: str, name: _Name) -> None:
        if number in self._names:
            known = self._names[number].part
            raise SchemaError([f"{number} is given by {known} and by {name.part}"])
        self._names[number] = name

    def __len__(self) -> int:
        return len(self._rows)

    def __iter__(self) -> Iterator[PartDefinition]:
        for part in self._rows:
            yield self._definition(part)

    def __contains__(self, number: str) -> bool:
        return self._find(number) is not None

    def ids(self) -> tuple[str, ...]:
        """Return the ids of all definitions, in the order of the files."""
        return tuple(self._rows)

    def numbers(self) -> tuple[str, ...]:
        """Return every number that resolves without a suffix rule: ids, aliases, moved ids."""
        return tuple(self._names)

    def get(self, number: str) -> PartDefinition | None:
        """Return the definition for an LDraw number, or None.

        Parameters
        ----------
        number : str
            With or without ``.dat``, any case; an id, an alias, a moved id, a decorated version,
            or a part embedded in a model (``"8002 - 33299a"``).
        """
        name = self._find(number)
        return None if name is None else self._definition(name.part)

    def resolve(self, number: str) -> tuple[PartDefinition, Pose] | None:
        """Return the definition and the pose of its frame in the frame of `number`, or None.

        The pose is the identity but for moved ids whose new file lies differently: the pose of the
        part in the model is ``pose_of_the_line @ pose``.
        """
        name = self._find(number)
        if name is None:
            return None
        pose = parse_pose(name.pose, name.part) if name.pose else _IDENTITY
        return self._definition(name.part), pose

    def _find(self, number: str) -> _Name | None:
        key = _EMBEDDED.sub("", number.strip().lower().removesuffix(".dat"))
        found = self._names.get(key)
        if found is None and (match := _DECORATED.match(key)):
            found = self._names.get(match[1])
        return found

    def _definition(self, part: str) -> PartDefinition:
        built = self._built.get(part)
        if built is None:
            built = self._built[part] = self._build(part)
        return built

    def _build(self, part: str) -> PartDefinition:
        table, row = self._rows[part]
        try:
            plain = expand(table, row)
            title, family = str(plain["title"]), str(plain["family"])
        except KeyError as error:
            raise SchemaError([f"{part}: {error} is missing"]) from error
        mass = self._masses.get(part)
        if mass is None:
            raise SchemaError([f"{part} is not in mass.json; scripts/ldraw_mass.py measures it"])
        made_of = material(plain.get("material", ABS))
        body: Body = RigidBody()
        if "frame" in plain:
            body = parse_frame(plain["frame"], part, sections(), made_of)
        return PartDefinition(
            id=part,
            title=title,
            family=family,
            ports=parse_ports(plain.get("ports", ""), part),
            body=body,
            mass_properties=MassProperties(
                mass=float(mass["mass_kg"]),
                centroid=np.array(mass["centroid_m"], dtype=float),
                inertia=np.array(mass["inertia_kg_m2"], dtype=float),
            ),
            fastener=bool(plain.get("fastener", False)),
            aliases=(*plain.get("aliases", ()), *plain.get("moved", {})),
            shape={
                "kind": table,
                "material": made_of.name,
                **{key: row[key] for key in row if key in _SHAPE_KEYS},
            },
            source=str(plain.get("source", _SOURCE)),
        )


_SHAPE_KEYS = frozenset(
    {"holes", "first", "thickness", "y", "stations", "length", "width", "stop", "studs"}
)
_SOURCE = "LDraw parts library 2026-02 (positions and sizes)"


def read_rows() -> dict[str, tuple[str, Mapping[str, Any]]]:
    """Return the rows of the definition files by part id, each with the name of its table.

    Raises
    ------
    SchemaError
        An unknown family, or an id that is defined twice.
    """
    library = files("parts_library")
    rows: dict[str, tuple[str, Mapping[str, Any]]] = {}
    for file in sorted(library.joinpath("definitions").iterdir(), key=lambda f: f.name):
        if not file.name.endswith(".toml"):
            continue
        for table, content in tomllib.loads(file.read_text(encoding="utf-8")).items():
            if table != "part" and table not in FAMILIES:
                raise SchemaError([f"{table}: no such family"], path=file.name)
            for row in content:
                if row["id"] in rows:
                    raise SchemaError([f"{row['id']} is defined twice"], path=file.name)
                rows[row["id"]] = (table, row)
    return rows


@functools.cache
def catalogue() -> Catalogue:
    """Return the shipped catalogue; it is read once."""
    masses = files("parts_library").joinpath("mass.json").read_text(encoding="utf-8")
    return Catalogue(read_rows(), json.loads(masses))
