"""Build an assembly in a few lines of Python; it is the same as reading the assembly file.

>>> linkage = Linkage(dimension=2)
>>> for name, p, q in [("a", (0, 0), (0, 0.1)), ("b", (0, 0.1), (0.1, 0.1)), ("c", (0.1, 0.1), (0.1, 0))]:
...     linkage.bar(name, p, q)
>>> linkage.hinge("a", "b", at=(0, 0.1))
>>> linkage.hinge("b", "c", at=(0.1, 0.1))
>>> linkage.fix("a", at=(0, 0), held="xy")
>>> linkage.fix("c", at=(0.1, 0), held="xy")
>>> [part.id for part in linkage.assembly().parts]
['a', 'b', 'c']
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import ArrayLike

from technic.assembly.file import HELD_NAMES, SCHEMA, build_assembly
from technic.assembly.model import Assembly

__all__ = ["Linkage"]

Stiffness = str | Mapping[str, float | str] | None

_BAR_SIZE = 0.01
"""Side of the square section of a bar that is given none (m)."""


class Linkage:
    """Collects parts, joints and supports; `assembly` checks them and makes the assembly.

    Parameters
    ----------
    dimension : int
        2 or 3.
    name : str

    Notes
    -----
    Lengths are in metres. Arguments mean what the keys of the assembly file mean; mistakes are reported
    together, by `assembly`, with the path that they would have in the file.
    """

    def __init__(self, dimension: int = 3, name: str = "linkage") -> None:
        self._data: dict[str, Any] = {
            "schema": SCHEMA,
            "name": name,
            "dimension": dimension,
            "materials": {},
            "parts": [],
            "joints": [],
            "supports": [],
        }

    # --- parts --------------------------------------------------------------------------------
    def material(self, name: str, young_pa: float, poisson: float, density: float) -> None:
        """Define a material (Pa, kg/m3)."""
        self._data["materials"][name] = {
            "young_pa": young_pa,
            "poisson": poisson,
            "density": density,
        }

    def bar(
        self,
        name: str,
        *points: ArrayLike,
        section: Mapping[str, Any] | float = _BAR_SIZE,
        material: str | None = None,
        **options: Any,
    ) -> None:
        """Add a bar through two or more points; `section` is a mapping as in the file, or the side of a
        square.
        """
        if not isinstance(section, Mapping):
            section = {"kind": "rectangle", "width": section, "height": section}
        shape = {"kind": "bar", "points": _points(points), "section": dict(section), **options}
        self._part(name, shape, material)

    def truss(
        self, name: str, p: ArrayLike, q: ArrayLike, *, area: float, material: str | None = None
    ) -> None:
        """Add a bar that resists stretching only; `area` in m2."""
        self._part(name, {"kind": "truss", "points": _points([p, q]), "area": area}, material)

    def rigid(self, name: str, *points: ArrayLike, mass: float | None = None) -> None:
        """Add a part that does not deform; without points it carries its mass at its joint points."""
        shape: dict[str, Any] = {"kind": "rigid"}
        if points:
            shape["points"] = _points(points)
        if mass is not None:
            shape["mass"] = mass
        self._part(name, shape, None)

    def plate(
        self,
        name: str,
        *points: ArrayLike,
        thickness: float,
        material: str | None = None,
        **options: Any,
    ) -> None:
        """Add a flat plate with a polygon as outline."""
        shape = {"kind": "polygon", "points": _points(points), "thickness": thickness, **options}
        self._part(name, shape, material)

    def mesh(
        self, name: str, file: str | Path, *, material: str | None = None, **options: Any
    ) -> None:
        """Add a part from a mesh file."""
        self._part(name, {"kind": "mesh", "file": str(file), **options}, material)

    def mark_fastener(self, name: str) -> None:
        """Say that a part is a pin or the like: it joins others and carries no structure of its own."""
        for row in self._data["parts"]:
            if row["id"] == name:
                row["fastener"] = True

    def _part(self, name: str, shape: Mapping[str, Any], material: str | None) -> None:
        row: dict[str, Any] = {"id": name, "shape": dict(shape)}
        if material is not None:
            row["material"] = material
        self._data["parts"].append(row)

    # --- joints -------------------------------------------------------------------------------
    def joint(
        self,
        kind: str,
        *parts: str,
        at: ArrayLike,
        axis: ArrayLike | None = None,
        axis2: ArrayLike | None = None,
        stiffness: Stiffness = None,
        jitter: Mapping[str, float] | None = None,
        connection: str | None = None,
        id: str | None = None,  # noqa: A002 - the key's name in the file
    ) -> None:
        """Add a joint of any type between two parts, or pairwise between more."""
        row: dict[str, Any] = {"type": kind, "parts": list(parts), "point": _numbers(at)}
        if axis is not None:
            row["axis"] = _numbers(axis)
        if axis2 is not None:
            row["axis2"] = _numbers(axis2)
        if stiffness is not None:
            row["stiffness"] = stiffness if isinstance(stiffness, str) else dict(stiffness)
        if jitter is not None:
            row["jitter"] = dict(jitter)
        if connection is not None:
            row["connection"] = connection
        if id is not None:
            row["id"] = id
        self._data["joints"].append(row)

    def fixed(self, *parts: str, at: ArrayLike, **options: Any) -> None:
        """Join parts so that nothing can move."""
        self.joint("fixed", *parts, at=at, **options)

    def hinge(self, *parts: str, at: ArrayLike, **options: Any) -> None:
        """Join parts that turn about an axis (z in two dimensions)."""
        self.joint("hinge", *parts, at=at, **options)

    def slider(self, *parts: str, at: ArrayLike, axis: ArrayLike, **options: Any) -> None:
        """Join parts that slide along an axis and do not turn."""
        self.joint("slider", *parts, at=at, axis=axis, **options)

    def cylindrical(self, *parts: str, at: ArrayLike, axis: ArrayLike, **options: Any) -> None:
        """Join parts that slide along an axis and turn about it."""
        self.joint("cylindrical", *parts, at=at, axis=axis, **options)

    def ball(self, *parts: str, at: ArrayLike, **options: Any) -> None:
        """Join parts that turn every way about a point."""
        self.joint("ball", *parts, at=at, **options)

    def universal(
        self, *parts: str, at: ArrayLike, axis: ArrayLike, axis2: ArrayLike, **options: Any
    ) -> None:
        """Join parts by two crossed axes: `axis` fixed in the first part, `axis2` in the second."""
        self.joint("universal", *parts, at=at, axis=axis, axis2=axis2, **options)

    def planar(self, *parts: str, at: ArrayLike, axis: ArrayLike, **options: Any) -> None:
        """Join parts that slide and turn on a plane with the normal `axis`."""
        self.joint("planar", *parts, at=at, axis=axis, **options)

    def slot(self, *parts: str, at: ArrayLike, axis2: ArrayLike, **options: Any) -> None:
        """Join parts by a pin (line `axis`) that slides in a slot (direction `axis2`) and turns in it."""
        self.joint("slot", *parts, at=at, axis2=axis2, **options)

    # --- supports -----------------------------------------------------------------------------
    def fix(
        self, part: str, at: ArrayLike | None = None, held: str | Sequence[str] | None = None
    ) -> None:
        """Hold a part, or a point of it, to the ground.

        Parameters
        ----------
        part : str
        at : array_like, optional
            The point; the part's centroid if left out.
        held : str or sequence of str, optional
            Which motions: names from x, y, z, rx, ry, rz, or letters of translations such as ``"xy"``;
            all of them if left out.
        """
        row: dict[str, Any] = {"part": part}
        if at is not None:
            row["point"] = _numbers(at)
        if held is not None:
            row["held"] = [held] if isinstance(held, str) and held in HELD_NAMES else list(held)
        self._data["supports"].append(row)

    # --- result -------------------------------------------------------------------------------
    def document(self) -> dict[str, Any]:
        """Return the assembly file's JSON object."""
        return {key: value for key, value in self._data.items() if value or key == "parts"}

    def assembly(self) -> Assembly:
        """Return the assembly.

        Raises
        ------
        SchemaError
            With every mistake.
        """
        return build_assembly(self.document())


def _numbers(values: ArrayLike) -> list[float]:
    return [float(v) for v in np.ravel(np.asarray(values, dtype=float))]


def _points(points: Sequence[ArrayLike]) -> list[list[float]]:
    return [_numbers(p) for p in points]
