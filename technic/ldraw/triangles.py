"""The surface of a part: triangles from its own polygons and those of all its subfiles.

Windings follow the back-face culling rules of LDraw (``0 BFC``): ``INVERTNEXT`` and mirroring
references each turn a subfile's polygons over. With them honoured, normals point out of the material.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any, Final

import numpy as np
from numpy.typing import NDArray

from technic.errors import InputError
from technic.geometry import Array, readonly
from technic.ldraw.library import Library
from technic.units import LDU

__all__ = ["Surface", "SurfaceIntegrals", "surface_of"]

MAX_TRIANGLES: Final = 500_000
"""Most triangles of one part; the largest official ones have about 200 thousand."""

MAX_SIZE: Final = 10.0
"""Largest extent of a part (m); a track of 48 studs has 0.4."""

MAX_DEPTH: Final = 64

_FINE: Final = "48/"
"""Folder of the 48-sided variants of round primitives."""


@dataclass(frozen=True, slots=True)
class SurfaceIntegrals:
    """What the surface encloses, if it is closed.

    Parameters
    ----------
    volume : float
        (m3) by the divergence theorem; negative when the surface is inside out.
    centroid : ndarray
        (3,) (m)
    second_moments : ndarray
        (3, 3) integral of ``x x^T`` over the volume (m5), about the origin.
    gap : float
        Length of the sum of the area vectors over the total area: 0 for a closed surface.
    """

    volume: float
    centroid: Array
    second_moments: Array
    gap: float


@dataclass(frozen=True, slots=True, eq=False)
class Surface:
    """Triangles of a part.

    Parameters
    ----------
    triangles : (n, 3, 3) ndarray
        Corners in part coordinates (m); counter-clockwise seen from outside.
    certified : (n,) ndarray of bool
        False where the file does not vouch for its windings.
    missing : tuple of str
        Names of subfiles that the library lacks.
    """

    triangles: Array
    certified: NDArray[Any]
    missing: tuple[str, ...] = ()

    @property
    def bounds(self) -> Array:
        """Lowest and highest coordinates, (2, 3) (m); zeros when there is no triangle."""
        if not len(self.triangles):
            return np.zeros((2, 3))
        corners = self.triangles.reshape(-1, 3)
        return np.array([corners.min(axis=0), corners.max(axis=0)])

    def integrals(self) -> SurfaceIntegrals:
        """Integrate over the enclosed volume (divergence theorem, one tetrahedron a triangle)."""
        # about the middle of the box: what a gap in the surface adds is then smallest
        middle = self.bounds.mean(axis=0)
        a, b, c = np.moveaxis(self.triangles - middle, 1, 0)
        normals = np.cross(b - a, c - a) / 2.0
        areas = np.linalg.norm(normals, axis=1)
        volumes = np.einsum("ij,ij->i", a, np.cross(b, c)) / 6.0
        volume = float(volumes.sum())
        corner_sum = a + b + c
        first = (volumes[:, None] * corner_sum).sum(axis=0) / 4.0
        # integral of x x^T over a tetrahedron with one corner at the origin
        second = np.einsum("n,ni,nj->ij", volumes, corner_sum, corner_sum)
        for corner in (a, b, c):
            second += np.einsum("n,ni,nj->ij", volumes, corner, corner)
        second /= 20.0
        offset = first / volume if volume else np.zeros(3)
        second = (
            second
            + np.outer(first, middle)
            + np.outer(middle, first)
            + volume * np.outer(middle, middle)
        )
        total = float(areas.sum())
        gap = float(np.linalg.norm(normals.sum(axis=0)) / total) if total else 1.0
        return SurfaceIntegrals(volume, offset + middle, second, gap)


@dataclass(frozen=True, slots=True, eq=False)
class _Flat:
    """All triangles below a file, in its own coordinates (LDU)."""

    triangles: Array
    certified: NDArray[Any]
    missing: tuple[str, ...]


def surface_of(library: Library, number: str, *, fine: bool = True) -> Surface | None:
    """Return the surface of a part, or None when the library does not have it.

    Parameters
    ----------
    library : Library
    number : str
        LDraw number, with or without ``.dat``.
    fine : bool
        Use the 48-sided variants of round primitives where the library has them: the volume is then
        right within 1 %.

    Raises
    ------
    InputError
        Broken files, a file that includes itself, more than `MAX_TRIANGLES`, or a part larger than
        `MAX_SIZE`.
    """
    resolved = library.resolve(number)
    if resolved is None:
        return None
    with np.errstate(over="ignore", invalid="ignore"):  # looked for below
        flat = _flatten(library, resolved.key, fine, ())
        triangles = flat.triangles @ resolved.matrix.T + resolved.offset
        if np.linalg.det(resolved.matrix) < 0.0:
            triangles = triangles[:, ::-1]
        triangles = triangles * LDU
        if not (np.abs(triangles) <= MAX_SIZE).all():
            raise InputError(
                f"it reaches further than {MAX_SIZE:g} m: no part does",
                path=library.where(resolved.key),
            )
    return Surface(readonly(triangles), readonly(flat.certified, dtype=np.bool_), flat.missing)


def _flatten(library: Library, key: str, fine: bool, trail: tuple[str, ...]) -> _Flat:
    """Return all triangles below the file at `key`; primitives and subparts are kept for reuse."""
    memo_key = f"surface:{fine}:{key}"
    known = library.memo.get(memo_key)
    if isinstance(known, _Flat):
        return known
    if key in trail:
        raise InputError(
            "this library file includes itself: " + " -> ".join([*trail, key]),
            path=library.where(key),
        )
    if len(trail) > MAX_DEPTH:
        raise InputError(f"subfiles nest deeper than {MAX_DEPTH}", path=library.where(key))
    triangles, certified = _own_triangles(library.text(key), library.where(key))
    parts, flags = [triangles], [np.full(len(triangles), certified)]
    missing: list[str] = []
    count = len(triangles)
    for reference in library.file(key).references:
        target = None
        if fine and "/" not in reference.name:
            target = library.find(_FINE + reference.name)
        target = target or library.find(reference.name)
        if target is None:
            missing.append(reference.name)
            continue
        below = _flatten(library, target, fine, (*trail, key))
        count += len(below.triangles)
        if count > MAX_TRIANGLES:
            raise InputError(f"more than {MAX_TRIANGLES} triangles", path=library.where(key))
        moved = below.triangles @ reference.matrix.T + reference.offset
        if reference.inverted != bool(np.linalg.det(reference.matrix) < 0.0):
            moved = moved[:, ::-1]
        parts.append(moved)
        flags.append(below.certified)
        missing += below.missing
    flat = _Flat(np.concatenate(parts), np.concatenate(flags), tuple(dict.fromkeys(missing)))
    # Only what others refer to: of a part itself the definition is kept. Without this a chain of files
    # that name the next one twice would be walked 2^n times.
    if trail or key.startswith(("p/", "parts/s/", "unofficial/p/", "unofficial/parts/s/")):
        library.memo[memo_key] = flat
    return flat


def _own_triangles(text: str, where: str) -> tuple[Array, bool]:
    """Return the polygons of one file as triangles, counter-clockwise, and whether it is certified."""
    rows: list[list[float]] = []
    turned: list[bool] = []
    certified, clockwise = False, False
    for number, line in enumerate(text.splitlines(), start=1):
        tokens = line.split()
        if not tokens:
            continue
        if tokens[0] == "0":
            if len(tokens) > 2 and tokens[1] == "BFC":
                certified = certified or "CERTIFY" in tokens
                if "CW" in tokens:
                    clockwise = True
                elif "CCW" in tokens or tokens[2] == "CERTIFY":
                    clockwise = False
            continue
        if tokens[0] not in ("3", "4"):
            continue
        corners = int(tokens[0])
        try:
            values = [float(token) for token in tokens[2 : 2 + 3 * corners]]
        except ValueError:
            values = []
        if len(values) != 3 * corners:
            raise InputError(
                f"a type {corners} line needs {3 * corners} numbers", path=where, line=number
            )
        rows.append(values[:9])
        turned.append(clockwise)
        if corners == 4:
            rows.append(values[:3] + values[6:])
            turned.append(clockwise)
        if len(rows) > MAX_TRIANGLES:
            raise InputError(f"more than {MAX_TRIANGLES} triangles", path=where)
    triangles = np.array(rows, dtype=float).reshape(-1, 3, 3)
    if not np.isfinite(triangles).all():
        raise InputError("a polygon has a corner that is not finite", path=where)
    over = np.array(turned, dtype=bool)
    triangles[over] = triangles[over][:, ::-1]
    return triangles, certified
