"""Solid shapes of parts: closed triangle meshes built from a definition's ports and its shape table.

`mesh` is the only door. A part's details that carry stiffness are in its shape: pockets, counterbores,
thin walls. Facts behind the shapes: LDraw parts library 2026-02; what differs from it is listed in
``docs/shape_differences.md``.
"""

from __future__ import annotations

import functools

import numpy as np
import trimesh

from technic.errors import SchemaError, UsageError
from technic.parts.definition import PartDefinition
from technic.parts.shapes import (  # noqa: F401 (they register their features)
    axles,
    beams,
    bricks,
    connectors,
    gears,
    pins,
    primitives,
)
from technic.parts.shapes.bench import Bench
from technic.parts.shapes.tables import build, shape_table
from technic.units import LDU

__all__ = ["SEGMENTS", "has_shape", "is_approximate", "mesh"]

SEGMENTS = {"draw": 16, "solid": 48}
"""Sides of a full circle for each level of detail."""


def has_shape(definition: PartDefinition) -> bool:
    """Return whether there is a shape table for the part or its family."""
    return shape_table(definition) is not None


def is_approximate(definition: PartDefinition) -> bool:
    """Return whether the shape has the part's volume but not its details.

    Such a shape serves pictures; a stiffness or an inertia computed from it means nothing.
    """
    table = shape_table(definition)
    return table is not None and bool(table.get("approximate", False))


@functools.lru_cache(maxsize=512)
def mesh(definition: PartDefinition, detail: str = "draw") -> trimesh.Trimesh:
    """Return the closed surface of a part.

    Parameters
    ----------
    definition : PartDefinition
    detail : {"draw", "solid"}
        Circles of 16 sides for pictures, of 48 sides for volumes and solid models.

    Returns
    -------
    trimesh.Trimesh
        In metres and part coordinates; watertight, with outward normals. Shared between callers:
        copy it before changing it.

    Raises
    ------
    UsageError
        When there is no such detail.
    SchemaError
        When the part has no shape, or its shape table does not make a solid.
    """
    if detail not in SEGMENTS:
        raise UsageError(f"no such detail: {detail!r}; there are {', '.join(SEGMENTS)}")
    table = shape_table(definition)
    if table is None:
        raise SchemaError([f"part {definition.id} ({definition.family}) has no shape"])
    solid = build(Bench.of(definition, SEGMENTS[detail]), table)
    if solid.is_empty():
        raise SchemaError([f"the shape of part {definition.id} is empty"])
    surface = solid.to_mesh64()
    return trimesh.Trimesh(
        vertices=np.asarray(surface.vert_properties)[:, :3] * LDU,
        faces=np.asarray(surface.tri_verts),
        process=False,
        validate=False,
    )
