"""From a body and the points where joints attach to it, to its element."""

from __future__ import annotations

from functools import lru_cache

import numpy as np
from numpy.typing import NDArray

from technic.fem.element import Element
from technic.fem.frame import frame_element
from technic.fem.rigid import rigid_element
from technic.fem.truss import truss_element
from technic.geometry import Array
from technic.parts.definition import (
    Body,
    FrameBody,
    MassProperties,
    MeshBody,
    PlateBody,
    TrussBody,
)

__all__ = ["build_element"]


def build_element(body: Body, properties: MassProperties, attachments: Array) -> Element:
    """Return the element of a body, in part axes.

    Parameters
    ----------
    body : Body
    properties : MassProperties
    attachments : (m, 3) array_like
        Points where joints and supports attach, part coordinates (m).

    Raises
    ------
    InputError
        The body cannot be divided into elements.
    """
    points = np.asarray(attachments, dtype=float).reshape(-1, 3)
    if isinstance(body, FrameBody):
        return frame_element(body, properties, points)
    if isinstance(body, TrussBody):
        return truss_element(body, properties, points)
    if isinstance(body, PlateBody | MeshBody):
        # read only when needed: models of LEGO parts have no meshes
        from technic.fem.simplex import mesh_element

        if isinstance(body, PlateBody):
            corners, cells = _divided(body)
            quadratic = True
        else:
            corners, cells, quadratic = body.points, body.cells, body.quadratic
        return mesh_element(
            corners, cells, body.thickness, body.material, properties, points, quadratic=quadratic
        )
    return rigid_element(properties, points)


@lru_cache(maxsize=64)
def _divided(body: PlateBody) -> tuple[Array, NDArray[np.int64]]:
    from technic.fem.plate import divide, slab

    if body.spatial:
        return slab(body.outline, body.thickness, body.size)
    return divide(body.outline, body.size)
