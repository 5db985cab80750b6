"""Where a new beam can be pinned: places on the lines of a model's pin holes that a hole may take.

All holes of a model that share a line form one `Line`. A *site* is a place on a line, one pitch long,
beside a hole (or around the open end of a pin): a hole of a new beam can lie there, and the site says
what fastens it. Lengths in this module are metres, as everywhere.
"""

from __future__ import annotations

from collections import Counter
from collections.abc import Sequence
from dataclasses import dataclass
from typing import Final

import numpy as np
from numpy.typing import NDArray

from technic.assembly.model import Assembly, Part
from technic.geometry import Array
from technic.groups import connected_groups
from technic.ldraw.placed import PlacedPorts, collect
from technic.parts.definition import PortKind
from technic.units import LDU, PITCH

__all__ = ["LONGER", "NEW", "SHORT_PIN", "Bundle", "Fastening", "Line", "Site", "bundles"]

LONGER: Final = {"pin-friction": "6558", "pin-frictionless": "32556a"}
"""The 3L pin that takes the place of a 2L pin of a family."""

NEW: Final = "new step"
"""Submodel of new parts before they are written."""

NEW_PIN: Final = "2780"
"""The pin put into a free hole."""

SHORT_PIN: Final = "32002"
"""The pin with one end half as long, for thin beams."""

_SAME_LINE: Final = 0.5 * LDU
"""Holes whose axes are this close share a line: a pin goes through both (its play is about 0.25 LDU
on each side)."""

_ON_GRID: Final = 1.0 * LDU
"""A hole is beside a site when its middle is this close to one pitch away."""

_FULL: Final = PITCH - 1.0 * LDU
"""A hole at least this deep holds a pin's segment fully."""

_PARALLEL: Final = 1e-3
"""Sine of the largest angle between parallel lines: 0.06 degrees, 0.1 LDU over a hole's depth times
five."""


@dataclass(frozen=True, slots=True)
class Fastening:
    """What fastens a hole of a new beam at a site.

    Parameters
    ----------
    kind : {"pin", "exchange", "present"}
        A new pin in a free hole; a present pin exchanged for a longer one; the open end of a pin
        that is there already.
    pin : str
        Number of the new pin; empty for "present".
    center : float
        Middle of the new pin along the line (m).
    bores : tuple of (int, float)
        Parts whose holes the new pin enters, and where along the line (m): for a new pin.
    old_pin : int
        The present pin that is exchanged or used; -1 for a new pin.
    parts : tuple of int
        Parts of structure that the beam is tied to.
    sign : int
        Along the line (1) or against it (-1): where the pin's own x points, which matters for pins
        with unlike ends.
    """

    kind: str
    pin: str
    center: float
    bores: tuple[tuple[int, float], ...]
    old_pin: int
    parts: tuple[int, ...]
    sign: int = 1


@dataclass(frozen=True, slots=True)
class Site:
    """A place for a hole: line number, place along the line (m), and what fastens it."""

    line: int
    t: float
    fastening: Fastening


@dataclass(frozen=True, slots=True)
class Line:
    """Holes and shafts on one line.

    Parameters
    ----------
    uv : (2,) ndarray
        Where the line crosses the plane of its bundle (m).
    bores : tuple of (float, float, int)
        Middle along the line, length (m), part.
    shafts : tuple of (float, float, int, str)
        Middle, half length (m), part, port kind.
    """

    uv: Array
    bores: tuple[tuple[float, float, int], ...]
    shafts: tuple[tuple[float, float, int, str], ...]


@dataclass(frozen=True, slots=True, eq=False)
class Bundle:
    """All lines of one direction, and the sites on them.

    Parameters
    ----------
    axes : (3, 3) ndarray
        Rows: direction of the lines, then the two directions of the plane across them.
    lines : tuple of Line
    sites, thin : tuple of Site
        For holes of thick and of thin beams.
    """

    axes: Array
    lines: tuple[Line, ...]
    sites: tuple[Site, ...]
    thin: tuple[Site, ...] = ()

    def point(self, line: int, t: float) -> Array:
        """Return a place on a line in the world (m)."""
        u, v = self.lines[line].uv
        return np.asarray(t * self.axes[0] + u * self.axes[1] + v * self.axes[2])


def bundles(
    assembly: Assembly, *, exclude: frozenset[int] = frozenset(), thin: bool = False
) -> tuple[Bundle, ...]:
    """Return all places where a hole of a new beam can be fastened.

    Parameters
    ----------
    assembly : Assembly
    exclude : frozenset of int
        Parts that nothing may be tied to.
    thin : bool
        Find places for thin beams as well.
    """
    placed = collect(assembly.parts)
    bores = placed.of_kind(PortKind.PIN_HOLE)
    shafts = placed.of_kind(PortKind.PIN, PortKind.AXLE)
    shared = _placed_more_than_once(assembly.parts)
    found = []
    for direction, own in _directions(placed.axis[bores]):
        axes = _plane_axes(direction)
        near = np.linalg.norm(np.cross(placed.axis[shafts], direction), axis=1) < _PARALLEL
        lines = _lines(placed, bores[own], shafts[near], axes)
        sites = tuple(
            Site(k, t, fastening)
            for k, line in enumerate(lines)
            for t, fastening in _sites(assembly.parts, line, shared, exclude)
        )
        flat = tuple(
            Site(k, t, fastening)
            for k, line in enumerate(lines)
            for t, fastening in (_thin_sites(line, exclude) if thin else ())
        )
        found.append(Bundle(axes, lines, sites, flat))
    return tuple(found)


def _placed_more_than_once(parts: Sequence[Part]) -> frozenset[int]:
    """Return the parts that cannot be exchanged alone: their line in the file places other parts as
    well (a submodel used twice), or they are new themselves.
    """
    count = Counter(part.source.line for part in parts if part.source is not None)
    return frozenset(
        k
        for k, p in enumerate(parts)
        if p.source is None or count[p.source.line] > 1 or p.source.submodel == NEW
    )


def _directions(axes: Array) -> list[tuple[Array, NDArray[np.intp]]]:
    """Return the distinct directions of lines, and which rows of `axes` have each."""
    if not len(axes):
        return []
    rounded = np.where(np.abs(axes) < 1e-9, 0.0, axes)
    first = np.argmax(np.abs(rounded) > 0.5 / np.sqrt(3.0), axis=1)
    signs = np.sign(rounded[np.arange(len(axes)), first])
    upright = axes * signs[:, None]
    left = np.ones(len(axes), dtype=bool)
    found = []
    for k in range(len(axes)):
        if not left[k]:
            continue
        own = left & (np.linalg.norm(np.cross(upright, upright[k]), axis=1) < _PARALLEL)
        left &= ~own
        found.append((_tidy(upright[k]), np.flatnonzero(own)))
    return found


def _tidy(direction: Array) -> Array:
    """Return a unit vector; one along a model axis exactly so."""
    axis = int(np.argmax(np.abs(direction)))
    exact = np.zeros(3)
    exact[axis] = np.sign(direction[axis])
    return exact if np.linalg.norm(direction - exact) < 1e-6 else direction


def _plane_axes(direction: Array) -> Array:
    """Return a right-handed frame with `direction` first, along the model's axes where it can be."""
    helper = np.zeros(3)
    helper[int(np.argmin(np.abs(direction).round(9)))] = 1.0
    across = np.cross(direction, helper)
    across /= np.linalg.norm(across)
    return np.array([direction, across, np.cross(direction, across)]) + 0.0


def _lines(
    placed: PlacedPorts, bores: NDArray[np.intp], shafts: NDArray[np.intp], axes: Array
) -> tuple[Line, ...]:
    from scipy.spatial import cKDTree

    place = placed.position[bores] @ axes.T
    tree = cKDTree(place[:, 1:])
    pairs = tree.query_pairs(_SAME_LINE)
    groups = connected_groups(range(len(bores)), pairs)
    middles = np.array([place[list(g), 1:].mean(axis=0) for g in groups])
    entering: list[list[int]] = [[] for _ in groups]
    shaft_place = placed.position[shafts] @ axes.T
    if len(shafts):
        distance, nearest = cKDTree(middles).query(shaft_place[:, 1:])
        for k in np.flatnonzero(distance < 2.0 * LDU):
            entering[int(nearest[k])].append(int(k))
    return tuple(
        Line(
            middle,
            tuple(
                (float(place[k, 0]), 2.0 * float(placed.half[bores[k]]), int(placed.part[bores[k]]))
                for k in group
            ),
            tuple(
                (
                    float(shaft_place[k, 0]),
                    float(placed.half[shafts[k]]),
                    int(placed.part[shafts[k]]),
                    str(placed.kind[shafts[k]]),
                )
                for k in inside
            ),
        )
        for group, middle, inside in zip(groups, middles, entering, strict=True)
    )


def _sites(
    parts: Sequence[Part], line: Line, shared: frozenset[int], exclude: frozenset[int]
) -> list[tuple[float, Fastening]]:
    """Return the sites of a line: each place once, with the simplest way to fasten a hole there."""
    wanted = [
        t + side * PITCH for t, length, _ in line.bores if length >= _FULL for side in (-1, 1)
    ]
    wanted += [t for t, half, _, kind in line.shafts if kind == PortKind.PIN and 2 * half >= _FULL]
    out: list[tuple[float, Fastening]] = []
    for t in sorted(wanted):
        if out and t - out[-1][0] < _ON_GRID:
            continue
        if any(abs(t - b) < (PITCH + length) / 2 - _ON_GRID for b, length, _ in line.bores):
            continue  # a hole is there already, and material around it
        fastening = _fasten(parts, line, t, shared, exclude)
        if fastening is not None and not exclude.intersection(fastening.parts):
            out.append((t, fastening))
    return out


def _thin_sites(line: Line, exclude: frozenset[int]) -> list[tuple[float, Fastening]]:
    """Return the places on a line for a hole of a thin beam: half a pitch of room beside an empty hole,
    for a pin with one short end.
    """
    out = []
    for t, length, part in line.bores:
        if length < _FULL or part in exclude:
            continue
        if any(abs(s - t) < half + length / 2 - _ON_GRID for s, half, _, _ in line.shafts):
            continue
        for side in (-1, 1):
            face = t + side * length / 2
            place = face + side * PITCH / 4
            if any(abs(place - b) < PITCH / 4 + n / 2 - _ON_GRID for b, n, _ in line.bores):
                continue
            if any(abs(place - s) < PITCH / 4 + n - _ON_GRID for s, n, _, _ in line.shafts):
                continue
            fastening = Fastening("pin", SHORT_PIN, face, ((part, t),), -1, (part,), side)
            out.append((place, fastening))
    return out


def _fasten(
    parts: Sequence[Part], line: Line, t: float, shared: frozenset[int], exclude: frozenset[int]
) -> Fastening | None:
    here = [s for s in line.shafts if abs(s[0] - t) < s[1] + PITCH / 2 - _ON_GRID]
    if here:
        fits = len(here) == 1 and here[0][3] == PortKind.PIN and abs(here[0][0] - t) < _ON_GRID
        if not fits:
            return None
        return Fastening("present", "", t, (), here[0][2], _held_by(line, here[0][2]))
    exchange: Fastening | None = None
    for side in (-1.0, 1.0):
        step = side * PITCH
        bore = _bore_at(line, t + step)
        if bore is None or bore in exclude:
            continue
        inside = [s for s in line.shafts if abs(s[0] - t - step) < s[1] + PITCH / 2 - _ON_GRID]
        if not inside:
            return Fastening("pin", NEW_PIN, t + step / 2, ((bore, t + step),), -1, (bore,))
        if exchange is None:
            exchange = _exchange(parts, line, t, step, inside, shared)
    return exchange


def _exchange(
    parts: Sequence[Part],
    line: Line,
    t: float,
    step: float,
    inside: list[tuple[float, float, int, str]],
    shared: frozenset[int],
) -> Fastening | None:
    """A 2L pin in the next hole and the one behind it gives way to a 3L pin."""
    old = inside[0][2]
    definition = parts[old].definition
    if len(inside) != 1 or definition is None or definition.family not in LONGER or old in shared:
        return None
    stretch = sorted(s[0] for s in line.shafts if s[2] == old)
    if len(stretch) != 2:
        return None
    places = sorted([t + step, t + 2 * step])
    if max(abs(a - b) for a, b in zip(stretch, places, strict=True)) > _ON_GRID:
        return None
    held = _held_by(line, old)
    return Fastening("exchange", LONGER[definition.family], t + step, (), old, held)


def _bore_at(line: Line, t: float) -> int | None:
    for place, length, part in line.bores:
        if abs(place - t) < _ON_GRID and length >= _FULL:
            return part
    return None


def _held_by(line: Line, pin: int) -> tuple[int, ...]:
    """Return the parts whose holes a pin of the line is in."""
    own = [s for s in line.shafts if s[2] == pin]
    return tuple(
        sorted({b[2] for b in line.bores for s in own if abs(b[0] - s[0]) < b[1] / 2 + s[1] - LDU})
    )
