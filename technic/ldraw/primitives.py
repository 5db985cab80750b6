"""Ports of any part, from the primitives in its subfile tree.

LDraw parts are built from shared primitives; those of pin holes, axles, pins, studs and balls say what
the shape is for. The table below states, for each, which stretch of which local axis it occupies
(LDraw primitive reference, and the files of the 2022-06 and 2026-02 releases). Scaled primitives
stretch along. Cylinders and spheres of the right radius serve where a hole or shaft is drawn without
its primitive.
"""

from __future__ import annotations

import re
from dataclasses import dataclass
from typing import Final

import numpy as np
from numpy.typing import NDArray

from technic.errors import InputError
from technic.geometry import Array
from technic.ldraw.features import Feature, build_features, to_ports
from technic.ldraw.library import Library
from technic.ldraw.pieces import Piece, PieceKind
from technic.parts.definition import Port

__all__ = [
    "Occurrence",
    "Walker",
    "carries_ports",
    "features_from_primitives",
    "ports_from_primitives",
    "walker_of",
]

K = PieceKind
Rule = tuple[PieceKind, float, float]
"""Kind, and start and end on the local y axis."""

_PIN = (K.PIN, 0.0, -20.0)
_PIN_FRICTION = (K.PIN_FRICTION, 0.0, -20.0)
_HALF_PIN = (K.PIN, 0.0, -10.0)
_UNIT = (0.0, 1.0)

RULES: Final[dict[str, tuple[Rule, ...]]] = {
    **{f"peghole{n}": ((K.MOUTH, 0.0, 2.0),) for n in ("", 2, 3, 4, 5, 6)},
    "connhole": ((K.HOLE, -10.0, 10.0),),
    "connhol2": ((K.HOLE, -10.0, 10.0),),
    "connhol3": ((K.MOUTH, -10.0, -8.0), (K.WALL, -8.0, 8.0)),
    "beamhole": ((K.HOLE, -10.0, 10.0),),
    "beamhol2": ((K.HOLE, -5.0, 5.0),),
    **dict.fromkeys(
        (
            "axlehole",
            "axlehol4",
            "axlehol5",
            "axlehol6",
            "axlehol7",
            "axl2hole",
            "axl2hol8",
            "axl3hole",
            "axl3hol8",
            "axl4hole",
            "axl5hole",
            "axl5hol8",
        ),
        ((K.AXLE_HOLE, *_UNIT),),
    ),
    # the toothed rim of a half bush, in front of its axle hole
    **{f"bushlo{n}": ((K.SOCKET_WALL, 0.0, 2.0),) for n in ("ck", "c2", "c3", "c4")},
    "axle": ((K.AXLE, *_UNIT),),
    "axlehol8": ((K.AXLE_PERIMETER, *_UNIT),),
    "axleho12": ((K.AXLE, *_UNIT),),
    "axleend2": ((K.AXLE, 0.0, 2.5),),
    "axleend20": ((K.AXLE, 0.0, -20.0),),
    "axleend": ((K.AXLE, 0.0, 0.01),),
    **{f"connect{n}": (_PIN,) for n in ("", 2, 5, 6, 7, 8, 10)},
    "connect3": (_HALF_PIN,),
    "connect4": (_HALF_PIN,),
    # the tip of a pin, in halves; y points back into the pin
    **{f"connectcollar{n}": ((K.PIN, 20.0, 0.0),) for n in range(1, 6)},
    # a quarter of the slit middle of a long pin
    **{f"connectslit{n}": ((K.SHANK, -9.0, 9.0),) for n in range(1, 5)},
    **{f"confricrib{n}": ((K.RIB, -1.0, 1.0),) for n in range(1, 5)},
    "fric": ((K.RIB, -1.0, 1.0),),
    **{f"confric{n}": (_PIN_FRICTION,) for n in ("", 2, 4, 5, 6, 8, 9, 10, 11, 12)},
    "confric3": ((K.PIN_FRICTION, 0.0, -40.0),),
    "joint8ball": ((K.BALL, 0.0, -8.0),),
    **{f"joint8socket{n}": ((K.SOCKET, 0.0, -8.0),) for n in (1, 2, 3)},
    **{
        f"stud{n}": ((K.STUD, 0.0, -4.0),)
        for n in ("", "2", "2a", "a", "6", "6a", "10", "13", "15", "17a", "26", "el", "p01")
    },
    **{f"stud{n}": ((K.TUBE, 0.0, -4.0),) for n in ("3", "3a", "xa")},
    **{
        f"stud{n}": ((K.TUBE, 0.0, -4.0), (K.TUBE_WALL, 0.0, -4.0))
        for n in ("4", "4a", "4o", "4od", "4s", "4h", "16")
    },
}
"""Pieces of each primitive, by its name without ``.dat``."""

_CYLINDER = re.compile(r"^(?:48/|8/)?(\d+)-(\d+)cyl[ioc]2?\.dat$")
_SPHERE = re.compile(r"^(?:48/|8/)?(\d+)-8sphe\.dat$")

PIN_RADIUS: Final = 6.0
BALL_RADII: Final = (8.0, 12.8)
"""Tow balls, and the balls of suspension parts (LDU)."""
COLLAR_RADII: Final = (7.0, 9.5)
LATCH_RADIUS: Final = 6.5
"""The lip at a pin's tip (LDU)."""

SOCKET_RADII: Final = (8.0, 10.0)
"""Inside and outside of a tow ball's socket (LDU)."""

RADIUS_SLACK: Final = 0.25

MAX_DEPTH: Final = 64
"""Deepest nesting of subfiles; real parts reach 7."""

MAX_OCCURRENCES: Final = 10_000
"""Most primitives of interest in one part; the largest baseplates have 2,304 studs."""


@dataclass(frozen=True, slots=True, eq=False)
class Occurrence:
    """Primitives of one name below a file: stacked placements.

    Parameters
    ----------
    matrices : (n, 3, 3) ndarray
    offsets : (n, 3) ndarray
        In LDU, in the coordinates of the file.
    inverted : (n,) ndarray of bool
        Seen from inside: an odd number of ``INVERTNEXT``.
    """

    matrices: Array
    offsets: Array
    inverted: NDArray[np.bool_]


class Walker:
    """Finds the primitives of interest below any file of a library; every file is walked once."""

    def __init__(self, library: Library) -> None:
        self.library = library
        self._known: dict[str, dict[str, Occurrence]] = {}

    def occurrences(self, key: str, trail: tuple[str, ...] = ()) -> dict[str, Occurrence]:
        """Return the primitives of interest below the file at `key`, by name.

        Raises
        ------
        InputError
            The file includes itself, nests too deep or holds too many primitives.
        """
        known = self._known.get(key)
        if known is not None:
            return known
        if key in trail:
            raise InputError(
                "this library file includes itself: " + " -> ".join([*trail, key]),
                path=self.library.where(key),
            )
        if len(trail) > MAX_DEPTH:
            raise InputError(f"subfiles nest deeper than {MAX_DEPTH}", path=self.library.where(key))
        gathered: dict[str, list[Occurrence]] = {}
        count = 0
        for reference in self.library.file(key).references:
            matrix, offset = reference.matrix, reference.offset
            # a mirrored cylinder still shows its outside: only INVERTNEXT turns it inside out
            flip = reference.inverted
            if _interesting(reference.name):
                found = {
                    reference.name: Occurrence(
                        matrix[None], offset[None], np.array([flip], dtype=bool)
                    )
                }
            else:
                target = self.library.find(reference.name)
                if target is None:
                    continue
                found = {
                    name: Occurrence(
                        matrix @ below.matrices,
                        below.offsets @ matrix.T + offset,
                        below.inverted ^ flip,
                    )
                    for name, below in self.occurrences(target, (*trail, key)).items()
                }
            for name, occurrence in found.items():
                gathered.setdefault(name, []).append(occurrence)
                count += len(occurrence.offsets)
            if count > MAX_OCCURRENCES:
                raise InputError(
                    f"more than {MAX_OCCURRENCES} primitives in one part",
                    path=self.library.where(key),
                )
        out = {
            name: Occurrence(
                np.concatenate([o.matrices for o in group]),
                np.concatenate([o.offsets for o in group]),
                np.concatenate([o.inverted for o in group]),
            )
            for name, group in gathered.items()
        }
        self._known[key] = out
        return out


def _interesting(name: str) -> bool:
    return (
        name.removesuffix(".dat") in RULES
        or _CYLINDER.match(name) is not None
        or _SPHERE.match(name) is not None
    )


def _pieces(occurrences: dict[str, Occurrence], matrix: Array, offset: Array) -> list[Piece]:
    """Return the pieces that the primitives stand for."""
    out: list[Piece] = []
    for name, group in occurrences.items():
        group = Occurrence(
            matrix @ group.matrices, group.offsets @ matrix.T + offset, group.inverted
        )
        cylinder = _CYLINDER.match(name)
        if cylinder:
            out += _cylinders(group, int(cylinder.group(1)) / int(cylinder.group(2)))
            continue
        sphere = _SPHERE.match(name) is not None
        share = 0.25 if name.startswith("connectslit") else 1.0
        for m, t, inverted in zip(group.matrices, group.offsets, group.inverted, strict=True):
            if sphere:
                out += _sphere(m, t, bool(inverted))
                continue
            axis = m[:, 1]
            for kind, low, high in RULES[name.removesuffix(".dat")]:
                out.append(Piece(kind, t + low * axis, t + high * axis, share, bool(inverted)))
    return out


def _cylinders(group: Occurrence, share: float) -> list[Piece]:
    """Return what pieces of round cylinders say about their lines, if anything."""
    x, axis, z = group.matrices[:, :, 0], group.matrices[:, :, 1], group.matrices[:, :, 2]
    first, second = np.linalg.norm(x, axis=1), np.linalg.norm(z, axis=1)
    radii = (first + second) / 2.0
    round_ = (abs(first - second) <= RADIUS_SLACK) & (abs((x * z).sum(axis=1)) <= 1.0)
    inside = group.inverted

    def near(radius: float) -> NDArray[np.bool_]:
        close: NDArray[np.bool_] = round_ & (abs(radii - radius) < RADIUS_SLACK)
        return close

    kinds = (
        (K.WALL, near(PIN_RADIUS) & inside),
        (K.SHANK, near(PIN_RADIUS) & ~inside),
        (K.LATCH, near(LATCH_RADIUS) & ~inside),
        (K.SOCKET_WALL, near(SOCKET_RADII[0]) & inside),
        (K.SOCKET_RIM, near(SOCKET_RADII[1]) & ~inside),
        (K.COLLAR, round_ & (COLLAR_RADII[0] <= radii) & (radii <= COLLAR_RADII[1]) & ~inside),
    )
    out = []
    for kind, chosen in kinds:
        for k in np.flatnonzero(chosen):
            start = group.offsets[k]
            out.append(Piece(kind, start, start + axis[k], share, bool(inside[k])))
    return out


def _sphere(m: Array, t: Array, inverted: bool) -> list[Piece]:
    """Return a ball or a socket for a sphere of a ball joint's radius."""
    radii = np.linalg.norm(m, axis=0)
    if not any(np.abs(radii - known).max() <= RADIUS_SLACK for known in BALL_RADII):
        return []
    return [Piece(K.SOCKET if inverted else K.BALL, t + m[:, 1], t - m[:, 1])]


def features_from_primitives(walker: Walker, number: str) -> tuple[Feature, ...] | None:
    """Return the whole features of a part (LDU), or None when the library does not have it."""
    resolved = walker.library.resolve(number)
    if resolved is None:
        return None
    found = walker.occurrences(resolved.key)
    return build_features(_pieces(found, resolved.matrix, resolved.offset))


def ports_from_primitives(library: Library, number: str) -> tuple[Port, ...] | None:
    """Return the ports of a part, from its primitives.

    Parameters
    ----------
    library : Library
    number : str
        LDraw number, with or without ``.dat``.

    Returns
    -------
    tuple of Port or None
        In part coordinates (m); None when the library does not have the part.

    Raises
    ------
    InputError
        The part's files are broken.
    """
    features = features_from_primitives(walker_of(library), number)
    return None if features is None else to_ports(features)


def carries_ports(library: Library, key: str) -> bool:
    """Tell whether the file at `key` is, or holds, a primitive that stands for a port."""
    name = key.rsplit("/", 1)[-1].removesuffix(".dat")
    if name in RULES:
        return True
    below = walker_of(library).occurrences(key)
    return any(primitive.removesuffix(".dat") in RULES for primitive in below)


def walker_of(library: Library) -> Walker:
    """Return the library's walker; made once, so that shared subfiles are walked once."""
    walker = library.memo.get("walker")
    if not isinstance(walker, Walker):
        walker = library.memo["walker"] = Walker(library)
    return walker
