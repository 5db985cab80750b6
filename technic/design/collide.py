"""What is in the way: exact shapes against exact shapes, with the play that LEGO parts have.

New parts are shrunk by `PLAY` on every face, so that faces that touch do not count; a pin is never
tested against the parts whose holes it is in, nor a beam against the pins in its holes. The quick test
finds crossing surfaces (FCL); `overlap` finds common volume (manifold), also of one solid inside
another.
"""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from functools import lru_cache
from typing import Any, Final

import fcl
import manifold3d
import numpy as np
import trimesh

from technic.assembly.model import Assembly, Part
from technic.errors import UsageError
from technic.geometry import Array, Pose, axes_from
from technic.parts.catalogue import catalogue
from technic.parts.definition import PartDefinition, PortKind
from technic.parts.shapes import has_shape, mesh
from technic.units import LDU

__all__ = [
    "PLAY",
    "Surroundings",
    "overlap",
    "pin_length",
    "push_side",
    "solid_overlaps",
    "surface_within",
]

PLAY: Final = 0.1e-3
"""New parts are tested this much smaller on every face (m): LEGO beams are 7.8 mm wide in a grid of 8
and 0.05 to 0.1 mm short of their nominal depth."""

_CUT: Final = 1e-10
"""Common volume (m3) of solids that counts as a collision: 0.1 mm3, a hundredth of a pin's collar."""

_SHAFT: Final = 5.0 * LDU
"""Radius of the probe that stands for a pin on its way in: the pin's own 6 less what slots and lips
give."""


@lru_cache(maxsize=256)
def surface_within(definition: PartDefinition, play: float) -> trimesh.Trimesh:
    """Return a part's surface with every face moved inwards by `play`."""
    whole = mesh(definition)
    out = whole.copy()
    corners = whole.faces.ravel()
    normals = np.repeat(whole.face_normals, 3, axis=0)
    count = len(whole.vertices)
    square, total = np.zeros((count, 3, 3)), np.zeros((count, 3))
    np.add.at(square, corners, normals[:, :, None] * normals[:, None, :])
    np.add.at(total, corners, normals)
    # The point that is `play` behind every face that meets here: n . step = -play for each normal n.
    inverse = np.linalg.pinv(square, rcond=1e-4, hermitian=True)
    step = -play * np.einsum("vij,vj->vi", inverse, total)
    size = np.linalg.norm(step, axis=1, keepdims=True)
    moved = whole.vertices + step * np.minimum(1.0, 3.0 * play / np.maximum(size, 1e-12))
    out.vertices = moved
    return out


@lru_cache(maxsize=512)
def _geometry(definition: PartDefinition, play: float) -> Any:
    surface = mesh(definition) if play == 0.0 else surface_within(definition, play)
    model = fcl.BVHModel()
    model.beginModel(len(surface.vertices), len(surface.faces))
    model.addSubModel(surface.vertices, surface.faces)
    model.endModel()
    return model


def _transform(pose: Pose) -> Any:
    rotation = pose.rotation
    return fcl.Transform(rotation, pose.translation)


def _object(definition: PartDefinition, pose: Pose, play: float) -> Any:
    return fcl.CollisionObject(_geometry(definition, play), _transform(pose))


class Surroundings:
    """The parts of a model, ready to be tested against.

    Parameters
    ----------
    parts : sequence of Part
        Parts without a shape are left out and listed in `shapeless`.
    """

    def __init__(self, parts: Sequence[Part]) -> None:
        self._objects: dict[int, Any] = {}
        self.shapeless: list[int] = []
        low, high, index = [], [], []
        for k, part in enumerate(parts):
            if part.definition is None or not has_shape(part.definition):
                self.shapeless.append(k)
                continue
            bounds = _world_bounds(part.definition, part.pose)
            low.append(bounds[0])
            high.append(bounds[1])
            index.append(k)
        self._parts = parts
        self._low, self._high = np.array(low).reshape(-1, 3), np.array(high).reshape(-1, 3)
        self._index = np.array(index, dtype=np.intp)

    def near(self, low: Array, high: Array) -> list[int]:
        """Return the parts whose box meets a box (m)."""
        meets = ((self._low <= high) & (self._high >= low)).all(axis=1)
        return [int(k) for k in self._index[meets]]

    def around(self, part: int) -> list[int]:
        """Return the parts whose box meets that of a part, itself included when it has a shape."""
        own = self._parts[part]
        if own.definition is None or not has_shape(own.definition):
            return []
        return self.near(*_world_bounds(own.definition, own.pose))

    def _object_of(self, part: int) -> Any:
        if part not in self._objects:
            own = self._parts[part]
            assert own.definition is not None
            self._objects[part] = _object(own.definition, own.pose, 0.0)
        return self._objects[part]

    def hits(
        self, definition: PartDefinition, pose: Pose, ignore: Iterable[int], play: float = PLAY
    ) -> list[int]:
        """Return the parts that a new part would cut into."""
        skip = set(ignore)
        low, high = _world_bounds(definition, pose)
        near = [k for k in self.near(low, high) if k not in skip]
        if not near:
            return []
        own = _object(definition, pose, play)
        return [k for k in near if _meet(own, self._object_of(k))]

    def blocks(self, start: Array, end: Array, ignore: Iterable[int]) -> list[int]:
        """Return the parts in the way of a pin that is pushed along a line from `start` to `end`."""
        along = end - start
        length = float(np.linalg.norm(along))
        axis = along / length
        frame = axes_from(axis)[[1, 2, 0]].T  # the cylinder lies along its own z
        probe = fcl.CollisionObject(
            fcl.Cylinder(_SHAFT, length), fcl.Transform(frame, (start + end) / 2.0)
        )
        skip = set(ignore)
        reach = np.abs(frame) @ np.array([_SHAFT, _SHAFT, length / 2])
        middle = (start + end) / 2.0
        near = [k for k in self.near(middle - reach, middle + reach) if k not in skip]
        return [k for k in near if _meet(probe, self._object_of(k))]


def _world_bounds(definition: PartDefinition, pose: Pose) -> tuple[Array, Array]:
    low, high = _bounds(definition)
    middle = pose.points((low + high) / 2.0)
    reach = np.abs(pose.rotation) @ ((high - low) / 2.0)
    return middle - reach, middle + reach


@lru_cache(maxsize=512)
def _bounds(definition: PartDefinition) -> tuple[Array, Array]:
    low, high = mesh(definition).bounds
    return np.asarray(low), np.asarray(high)


def _meet(a: Any, b: Any) -> bool:
    return bool(fcl.collide(a, b, fcl.CollisionRequest(), fcl.CollisionResult()) > 0)


def push_side(
    surroundings: Surroundings,
    point: Array,
    axis: Array,
    length: float,
    ignore: Iterable[int],
    *,
    ways: Sequence[int] = (1, -1),
) -> int:
    """Return the side (+1 or -1 along `axis`) from which a pin can be pushed in, 0 when from neither.

    Parameters
    ----------
    surroundings : Surroundings
    point : (3,) ndarray
        Middle of the pin (m).
    axis : (3,) ndarray
    length : float
        Of the pin (m). As much room is needed outside.
    ignore : iterable of int
        Parts that are not in the way, e.g. the pin that it replaces.
    ways : sequence of int
        Sides to try, in this order.
    """
    skip = set(ignore)
    gap = 1.0 * LDU
    for side in ways:
        start = point + side * (length / 2 + gap) * axis
        if not surroundings.blocks(start, start + side * (length - gap) * axis, skip):
            return side
    return 0


@lru_cache(maxsize=256)
def _solid(definition: PartDefinition, play: float) -> Any:
    surface = mesh(definition) if play == 0.0 else surface_within(definition, play)
    return manifold3d.Manifold(
        manifold3d.Mesh64(
            vert_properties=np.asarray(surface.vertices) / LDU,
            tri_verts=np.asarray(surface.faces, dtype=np.uint64),
        )
    )


def overlap(a: Part, b: Part, play: float = PLAY) -> float:
    """Return the common volume (m3) of a part, shrunk by `play`, and another.

    Raises
    ------
    ValueError
        One of them has no shape.
    """
    if a.definition is None or b.definition is None:
        raise ValueError("only parts of the catalogue have a shape")
    first = _solid(a.definition, play).transform(_matrix(a.pose))
    second = _solid(b.definition, 0.0).transform(_matrix(b.pose))
    return float((first ^ second).volume()) * LDU**3


def _matrix(pose: Pose) -> Array:
    return np.column_stack([pose.rotation, pose.translation / LDU])


def pin_length(number: str) -> float:
    """Return the length of a pin (m)."""
    definition = catalogue().get(number)
    if definition is None:
        raise UsageError(f"part {number} is not in the catalogue")
    return sum(p.length for p in definition.ports if p.kind is PortKind.PIN)


def solid_overlaps(
    assembly: Assembly, new: Iterable[int], play: float = PLAY
) -> list[tuple[str, str, float]]:
    """Return which new parts share volume (m3) with other parts that they are not joined to.

    A pin in a hole, and a beam on a pin, are joined, not colliding.

    Parameters
    ----------
    assembly : Assembly
    new : iterable of int
        Indices of the parts to test; parts without a shape are left out.
    play : float
        How much smaller the new parts are taken on every face (m).
    """
    joined = {frozenset(j.parts) for j in assembly.joints}
    surroundings = Surroundings(assembly.parts)
    found = []
    done: set[int] = set()
    for k in sorted(new):
        for other in surroundings.around(k):
            if other == k or other in done or frozenset((k, other)) in joined:
                continue
            volume = overlap(assembly.parts[k], assembly.parts[other], play)
            if volume > _CUT:
                found.append((assembly.parts[k].id, assembly.parts[other].id, volume))
        done.add(k)
    return found
