"""An LDCad shadow library that the user points to, and the snaps it gives to a part.

The shadow library holds, for many LDraw files, a file of the same name with ``!LDCAD SNAP_...`` lines
that say where parts snap together; a part inherits those of the files that it refers to. The meaning
of the lines is described at melkert.net/LDCad/tech/meta. Its content is share-alike and therefore
never copied into this project: it is read where the user has it.
"""

from __future__ import annotations

import os
import re
from collections.abc import Iterator
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Final

import numpy as np

from technic.errors import InputError, MissingDependency
from technic.geometry import Array, readonly
from technic.ldraw.library import Library, Reference, reference_key
from technic.ldraw.storage import Store, open_store

__all__ = [
    "ShadowLibrary",
    "Snap",
    "find_shadow",
    "snaps_of",
]

MAX_GRID: Final = 4096
"""Most copies that one line may ask for; the largest baseplate has 48 x 48 = 2304."""

MAX_SNAPS: Final = 50_000
"""Most snaps of one part."""

MAX_DEPTH: Final = 64

SCALE_SLACK: Final = 0.02
"""A reference counts as scaled when a column is off unit length by more than this."""

_OPTION = re.compile(r"\[\s*([A-Za-z]+)\s*=\s*([^\]]*)\]")
_SECTION = re.compile(r"(R|A|S|_L|L_)\s+(\S+)\s+(\S+)")


@dataclass(frozen=True, slots=True, eq=False)
class Snap:
    """One snap: a placed shape that others fit.

    Parameters
    ----------
    type : str
        ``"CYL"``, ``"CLP"``, ``"GEN"`` or ``"FGR"``.
    id, group : str
        Lower case; ``""`` when not given. Snaps with a group fit only the same group.
    male : bool
    sections : tuple of (str, float, float)
        Shape (R round, A axle, S square, ``_L`` and ``L_`` flexible), radius and length (LDU), from
        the base on.
    centered, slide : bool
    closed : str
        ``caps``: ``"none"``, ``"one"``, ``"two"``, ``"a"`` or ``"b"``.
    bounding : tuple
        Shape and sizes of a ``GEN`` snap.
    scale, mirror : str
        What becomes of the snap when a reference scales or mirrors it.
    matrix : (3, 3) ndarray
    offset : (3,) ndarray
        Placement (LDU). A cylinder grows from its origin along -y.
    """

    type: str
    id: str
    group: str
    male: bool
    sections: tuple[tuple[str, float, float], ...]
    centered: bool
    slide: bool
    closed: str
    bounding: tuple[str | float, ...]
    scale: str
    mirror: str
    matrix: Array
    offset: Array

    def placed(self, matrix: Array, offset: Array) -> Snap | None:
        """Return the snap seen through a reference; None when its scaling forbids it."""
        total = matrix @ self.matrix
        lengths = np.linalg.norm(total, axis=0)
        rest = np.linalg.norm(self.matrix, axis=0)
        along = abs(lengths[1] / rest[1] - 1.0) <= SCALE_SLACK
        radial = abs(lengths[[0, 2]] / rest[[0, 2]] - 1.0).max() <= SCALE_SLACK
        round_ = abs(lengths[0] / rest[0] - lengths[2] / rest[2]) <= SCALE_SLACK
        allowed = {
            "none": along and radial,
            "yonly": radial,
            "ronly": along and round_,
            "yandr": round_,
        }.get(self.scale, along and radial)
        if not allowed or (self.mirror == "none" and np.linalg.det(matrix) < 0.0):
            return None
        return replace(self, matrix=readonly(total), offset=readonly(matrix @ self.offset + offset))


class ShadowLibrary:
    """A shadow library in a folder or a zip."""

    def __init__(self, store: Store) -> None:
        self.store = store
        self.memo: dict[str, tuple[Snap, ...]] = {}

    @classmethod
    def open(cls, path: str | Path) -> ShadowLibrary:
        """Open a shadow library.

        Raises
        ------
        InputError
            Missing, unreadable, damaged, or no shadow library.
        """
        return cls(open_store(Path(path)))

    def text(self, key: str) -> str | None:
        """Return the shadow of the library file at `key`, or None when it has none."""
        key = key.removeprefix("unofficial/")
        if key not in self.store:
            return None
        data = self.store.read(key)
        try:
            return data.decode("utf-8-sig")
        except UnicodeDecodeError:
            return data.decode("latin-1")

    def has(self, key: str) -> bool:
        """Tell whether there are snap lines for the library file at `key` itself."""
        text = self.text(key)
        return text is not None and "SNAP_" in text.upper()

    def where(self, key: str) -> str:
        """Return how a message names the shadow of the file at `key`."""
        return f"{self.store.path}/{key}"


def find_shadow(explicit: str | Path | None = None) -> ShadowLibrary | None:
    """Return the shadow library to use: `explicit`, else ``TECHNIC_SHADOW``, else None.

    It is never looked for elsewhere: whose ports are used is the user's choice.

    Raises
    ------
    MissingDependency
        The place does not exist.
    InputError
        It exists, but is no shadow library.
    """
    place = explicit or os.environ.get("TECHNIC_SHADOW")
    if not place:
        return None
    if not Path(place).exists():
        raise MissingDependency(f"there is no LDCad shadow library at {place}")
    return ShadowLibrary.open(place)


def _numbers(text: str, count: int, what: str) -> Array:
    values = np.array([float(word) for word in text.split()])
    if len(values) != count or not np.isfinite(values).all():
        raise ValueError(f"{what} needs {count} finite numbers")
    return values


def _grid(text: str) -> Array:
    """Return the offsets of a grid, (n, 3): ``[C] nx [C] nz dx dz`` or with a third direction.

    ``C`` centres the grid in that direction.
    """
    words = text.split()
    counts: list[tuple[int, bool]] = []
    bare = [word for word in words if word.upper() != "C"]
    directions = len(bare) // 2
    if len(bare) % 2 or directions not in (2, 3):
        raise ValueError(f"grid {text!r} needs two or three counts and as many steps")
    index = 0
    for _ in range(directions):
        centered = words[index].upper() == "C"
        index += centered
        counts.append((int(words[index]), centered))
        index += 1
    steps = [float(word) for word in words[index:]]
    total = 1
    for count, _ in counts:
        total *= count
        if count < 1 or total > MAX_GRID:
            raise ValueError(f"grid {text!r} asks for no or too many copies")
    if len(steps) != directions or not np.isfinite(steps).all():
        raise ValueError(f"grid {text!r} has a faulty step")
    axes = (0, 2) if directions == 2 else (0, 1, 2)
    out = np.zeros((total, 3))
    for row, place in enumerate(np.ndindex(*(count for count, _ in counts))):
        for axis, position, (count, centered), step in zip(axes, place, counts, steps, strict=True):
            out[row, axis] = (position - (count - 1) / 2.0 * centered) * step
    return out


def _boolean(options: dict[str, str], name: str) -> bool:
    return options.get(name, "false").strip().lower() == "true"


def _placements(options: dict[str, str]) -> Iterator[tuple[Array, Array]]:
    """Yield matrix and offset of each copy that a line asks for; the grid lies in its own axes."""
    matrix = np.eye(3)
    if "ori" in options:
        matrix = _numbers(options["ori"], 9, "ori").reshape(3, 3)
        if abs(np.linalg.det(matrix)) < 1e-9:
            raise ValueError("ori is singular")
    offset = _numbers(options["pos"], 3, "pos") if "pos" in options else np.zeros(3)
    cells = _grid(options["grid"]) if "grid" in options else np.zeros((1, 3))
    for cell in cells:
        yield matrix, offset + matrix @ cell


def _snap(kind: str, options: dict[str, str], matrix: Array, offset: Array) -> Snap:
    sections: tuple[tuple[str, float, float], ...] = ()
    bounding: tuple[str | float, ...] = ()
    if kind == "CYL":
        sections = tuple(
            (shape, float(radius), float(length))
            for shape, radius, length in _SECTION.findall(options.get("secs", ""))
        )
        if not sections or not np.isfinite([row[1:] for row in sections]).all():
            raise ValueError("secs has no section")
    elif kind == "CLP":
        sections = (("C", float(options.get("radius", "4")), float(options.get("length", "8"))),)
    elif kind == "GEN":
        words = options.get("bounding", "pnt").split()
        bounding = (words[0].lower(), *(float(word) for word in words[1:]))
    gender = options.get("genderofs" if kind == "FGR" else "gender", "M")
    return Snap(
        kind,
        options.get("id", "").strip().lower(),
        options.get("group", "").strip().lower(),
        gender.strip().upper() != "F",
        sections,
        _boolean(options, "center"),
        _boolean(options, "slide"),
        options.get("caps", "one").strip().lower(),
        bounding,
        options.get("scale", "none").strip().lower(),
        options.get("mirror", "cor").strip().lower(),
        readonly(matrix),
        readonly(offset),
    )


def _metas(text: str) -> Iterator[tuple[int, str, dict[str, str]]]:
    """Yield line, name and options of each snap line."""
    for number, line in enumerate(text.splitlines(), start=1):
        words = line.split(None, 3)
        if len(words) >= 3 and words[0] == "0" and words[1] == "!LDCAD":
            name = words[2].upper()
            if name.startswith("SNAP_"):
                options = {key.lower(): value for key, value in _OPTION.findall(line)}
                yield number, name[5:], options


def _own(
    shadow: ShadowLibrary, library: Library, key: str, inherited: list[Snap], depth: int = 0
) -> list[Snap]:
    """Return `inherited` changed by the snap lines for the file at `key`."""
    text = shadow.text(key)
    if text is None:
        return inherited
    snaps = list(inherited)
    for number, name, options in _metas(text):
        try:
            if name == "CLEAR":
                wanted = options.get("id", "").strip().lower()
                snaps = [snap for snap in snaps if wanted and snap.id != wanted]
            elif name == "INCL":
                snaps += _included(shadow, library, options, depth)
            elif name in ("CYL", "CLP", "GEN", "FGR"):
                snaps += [_snap(name, options, m, t) for m, t in _placements(options)]
            if len(snaps) > MAX_SNAPS:
                raise ValueError(f"more than {MAX_SNAPS} snaps")
        except (ValueError, IndexError) as error:
            raise InputError(
                f"broken SNAP_{name} line: {error}", path=shadow.where(key), line=number
            ) from None
    return snaps


def _included(
    shadow: ShadowLibrary, library: Library, options: dict[str, str], depth: int
) -> Iterator[Snap]:
    """Yield the snaps that an include line brings: those of one shadow file, placed."""
    if depth > MAX_DEPTH:
        raise ValueError("includes nest too deep")
    try:
        name = reference_key(options.get("ref", ""))
    except InputError as error:
        raise ValueError(error.message) from None
    if not name:
        raise ValueError("ref names no file")
    target = library.find(name)
    keys = [target] if target else [folder + name for folder in ("parts/", "p/")]
    inner: list[Snap] = []
    for key in keys:
        inner = _own(shadow, library, key, inner, depth + 1)
    scale = np.diag(_numbers(options["scale"], 3, "scale")) if "scale" in options else np.eye(3)
    label = options.get("id", "").strip().lower()
    for matrix, offset in _placements(options):
        for snap in inner:
            placed = snap.placed(matrix @ scale, offset)
            if placed is not None:
                yield replace(placed, id=label) if label else placed


def snaps_of(
    shadow: ShadowLibrary, library: Library, key: str, trail: tuple[str, ...] = ()
) -> tuple[Snap, ...]:
    """Return all snaps of the library file at `key`: inherited through its references, and its own.

    Raises
    ------
    InputError
        A broken snap line (with file and line), or a library file that includes itself.
    """
    known = shadow.memo.get(key)
    if known is not None:
        return known
    if key in trail or len(trail) > MAX_DEPTH:
        raise InputError(
            "this library file includes itself: " + " -> ".join([*trail, key]),
            path=library.where(key),
        )
    inherited: list[Snap] = []
    for reference in library.file(key).references:
        inherited += _through(shadow, library, reference, (*trail, key))
        if len(inherited) > MAX_SNAPS:
            raise InputError(f"more than {MAX_SNAPS} snaps in one part", path=library.where(key))
    out = tuple(_own(shadow, library, key, inherited))
    shadow.memo[key] = out
    return out


def _through(
    shadow: ShadowLibrary, library: Library, reference: Reference, trail: tuple[str, ...]
) -> list[Snap]:
    target = library.find(reference.name)
    if target is None:
        return []
    out = []
    for snap in snaps_of(shadow, library, target, trail):
        placed = snap.placed(reference.matrix, reference.offset)
        if placed is not None:
            out.append(placed)
    return out
