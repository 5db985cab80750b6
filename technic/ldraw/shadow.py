"""Ports from an LDCad shadow library that the user points to.

The shadow library holds, for many LDraw files, a file of the same name with ``!LDCAD SNAP_...`` lines
that say where parts snap together; a part inherits those of the files that it refers to. The meaning
of the lines is described at melkert.net/LDCad/tech/meta. Its content is share-alike and therefore
never copied into this project: it is read where the user has it.
"""

from __future__ import annotations

import re
from collections.abc import Iterator
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Final

import numpy as np

from technic.errors import InputError
from technic.geometry import Array, readonly
from technic.ldraw.features import Feature, Piece, PieceKind, build_features, to_ports
from technic.ldraw.library import Library, Reference, reference_key
from technic.ldraw.storage import Store, open_store
from technic.parts.definition import Port

__all__ = [
    "ShadowLibrary",
    "Snap",
    "features_from_shadow",
    "ports_from_shadow",
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

    def where(self, key: str) -> str:
        """Return how a message names the shadow of the file at `key`."""
        return f"{self.store.path}/{key}"


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
    name = reference_key(options.get("ref", ""))
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


PIN_RADIUS: Final = 6.0

COUNTERBORE: Final = 2.0
"""Depth of a counterbore, height of half a collar, length of a latch (LDU)."""

SHORT_SHAFT: Final = 5.5
"""A round section shorter than this beside a pin is a stud (LDU)."""


_Span = tuple[str, float, float, float]


def _cylinder_pieces(snap: Snap) -> list[Piece]:
    """Return what a cylinder snap means for LEGO parts."""
    total = sum(length for _, _, length in snap.sections)
    # sections grow from the base along -y
    position = total / 2.0 if snap.centered else 0.0
    spans: list[_Span] = []
    for shape, radius, length in snap.sections:
        spans.append((shape, radius, position, position - length))
        position -= length
    found = _male(snap, spans, total) if snap.male else _female(snap, spans, total)
    axis = snap.matrix[:, 1]
    return [Piece(kind, snap.offset + a * axis, snap.offset + b * axis) for kind, a, b in found]


def _is_pin(span: _Span) -> bool:
    return span[0] == "R" and abs(span[1] - PIN_RADIUS) < 0.6


def _is_counterbore(span: _Span) -> bool:
    return span[0] == "R" and span[1] > 7.0 and abs(span[3] - span[2]) <= 2.0 * COUNTERBORE + 1e-6


def _short_and_closed(snap: Snap, total: float) -> bool:
    """Tell a stud or what takes one from a pin or its hole."""
    return len(snap.sections) == 1 and total <= 5.5 and not snap.slide and snap.closed != "none"


def _female(snap: Snap, spans: list[_Span], total: float) -> list[tuple[PieceKind, float, float]]:
    if all(span[0] == "S" for span in spans):
        square = abs(spans[0][1] - PIN_RADIUS) < 0.6
        return [(PieceKind.TUBE, spans[0][2], spans[-1][3])] if square else []
    if _is_pin(spans[0]) and _short_and_closed(snap, total):
        return [(PieceKind.TUBE, spans[0][2], spans[0][3])]
    out = []
    for index, span in enumerate(spans):
        shape, _, start, end = span
        if shape == "A":
            out.append((PieceKind.AXLE_HOLE, start, end))
        elif _is_pin(span):
            out.append((PieceKind.WALL, start, end))
            if index and _is_counterbore(spans[index - 1]):
                out.append(_mouth(spans, index - 1, start, index > 1 and _is_pin(spans[index - 2])))
            if index + 1 < len(spans) and _is_counterbore(spans[index + 1]):
                shared = index + 2 < len(spans) and _is_pin(spans[index + 2])
                out.append(_mouth(spans, index + 1, end, shared))
    return out


def _mouth(
    spans: list[_Span], index: int, inner: float, shared: bool
) -> tuple[PieceKind, float, float]:
    """Return a counterbore as a mouth; between two holes, half of it."""
    _, _, start, end = spans[index]
    outer = start if abs(end - inner) < abs(start - inner) else end
    length = abs(outer - inner) / (2.0 if shared else 1.0)
    # a longer recess is a clearance in front of the mouth
    length = min(length, COUNTERBORE)
    return PieceKind.MOUTH, inner + np.sign(outer - inner) * length, inner


def _male(snap: Snap, spans: list[_Span], total: float) -> list[tuple[PieceKind, float, float]]:
    out: list[tuple[PieceKind, float, float]] = []
    if _is_pin(spans[0]) and _short_and_closed(snap, total):
        return [(PieceKind.STUD, spans[0][2], spans[0][3])]
    cross = [index for index, span in enumerate(spans) if span[0] == "A"]
    if cross:
        # round stops and sleeves between cross-shaped stretches belong to one axle
        out.append((PieceKind.AXLE, spans[cross[0]][2], spans[cross[-1]][3]))
        for _, radius, start, end in (span for span in spans if span[0] == "R"):
            if 7.0 < radius < 9.5:
                out.append((PieceKind.COLLAR, start, end))
    round_ = [
        index
        for index, span in enumerate(spans)
        if _is_pin(span) and not (cross and cross[0] < index < cross[-1])
    ]
    # the latch of a pin is a flexible section; a shaft without one is no pin
    if not any(span[0] in ("_L", "L_") for span in spans):
        return out
    for index in round_:
        _, _, start, end = spans[index]
        if abs(end - start) < SHORT_SHAFT:
            # the stud end of a half pin
            out.append((PieceKind.STUD, start, end))
            continue
        if index > 0:
            start += _margin(spans[index - 1], index > 1 and _is_pin(spans[index - 2]))
        if index + 1 < len(spans):
            shared = index + 2 < len(spans) and _is_pin(spans[index + 2])
            end -= _margin(spans[index + 1], shared)
        if index > 0 and spans[index - 1][0] in ("_L", "L_"):
            start, end = end, start
        out.append((PieceKind.PIN, start, end))
    return out


def _margin(span: _Span, shared: bool) -> float:
    """Return how far a pin reaches into the section beside it: its latch or half its collar."""
    length = abs(span[3] - span[2])
    if span[0] in ("_L", "L_") or _is_counterbore(span):
        return min(length / 2.0 if shared else length, COUNTERBORE)
    return 0.0


def _general_pieces(snap: Snap) -> list[Piece]:
    """Return a ball or socket for a spherical general snap."""
    if not snap.bounding or snap.bounding[0] != "sph" or len(snap.bounding) != 2:
        return []
    radius = float(snap.bounding[1])
    # tow balls have 8, the balls of suspension parts 12.7 LDU
    if not any(abs(radius - known) < 0.5 for known in (8.0, 12.8)):
        return []
    axis = snap.matrix[:, 1] / np.linalg.norm(snap.matrix[:, 1])
    kind = PieceKind.BALL if snap.male else PieceKind.SOCKET
    return [Piece(kind, snap.offset + radius * axis, snap.offset - radius * axis)]


def features_from_shadow(
    library: Library, shadow: ShadowLibrary, number: str
) -> tuple[Feature, ...] | None:
    """Return the whole features of a part (LDU); None when nothing is known about it."""
    key = library.find(number if "." in number else f"{number}.dat")
    if key is None:
        return None
    snaps = snaps_of(shadow, library, key)
    if not snaps:
        return None
    pieces: list[Piece] = []
    for snap in snaps:
        if snap.type == "CYL" and not snap.group:
            pieces += _cylinder_pieces(snap)
        elif snap.type == "GEN":
            pieces += _general_pieces(snap)
    return build_features(pieces)


def ports_from_shadow(
    library: Library, shadow: ShadowLibrary, number: str
) -> tuple[Port, ...] | None:
    """Return the ports of a part from a shadow library.

    The shadow library does not tell pins with friction ridges from those without; this comes from
    the part's primitives, else from its title.

    Parameters
    ----------
    library : Library
        The LDraw library whose files the shadows belong to.
    shadow : ShadowLibrary
    number : str
        LDraw number, with or without ``.dat``.

    Returns
    -------
    tuple of Port or None
        In part coordinates (m); None when the shadow library says nothing about the part.

    Raises
    ------
    InputError
        A broken snap line, or broken part files.
    """
    features = features_from_shadow(library, shadow, number)
    if features is None:
        return None
    resolved = library.resolve(number)
    title = library.file(resolved.key).title.lower() if resolved else ""
    # "pin with friction", but not "without friction"
    rough = "friction" in title and "without friction" not in title
    return to_ports(
        replace(feature, friction=rough) if feature.kind == "pin" else feature
        for feature in features
    )
