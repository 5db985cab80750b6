"""A new beam with its pins, condensed to what it is fastened to.

The beam and the new pins have unknowns of their own; statically they follow from the movement of the
holes and pins that hold them. What is left is a stiffness and an inertia felt at those places. All
twists here are in the axes of the beam's face; its holes lie along y.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import lru_cache
from typing import Final

import numpy as np
from scipy import linalg

from technic.design.apply import HIGHLIGHT, new_part
from technic.design.candidates import Attachment, Candidate
from technic.design.faces import faces, holes_of
from technic.errors import UsageError
from technic.fem.element import Element
from technic.geometry import Array, Pose, readonly, shift_twist, turn_twist
from technic.ldraw.write import NewPart
from technic.parts.catalogue import catalogue
from technic.parts.definition import PartDefinition
from technic.system.part_models import FACTORIES, PartModel

__all__ = ["OWN", "Condensed", "Hold", "condensed", "hold_of"]


OWN: Final = 2
"""Swings of the beam by itself: a large part on few holes may well be what swings first."""


@dataclass(frozen=True, slots=True)
class Hold:
    """How one hole of a beam is held, for the mechanics.

    Parameters
    ----------
    hole : int
    bores : tuple of float
        Middles of the holes that a new pin enters, along y from the beam's hole (m); empty when the
        hole is on a pin that is there already, short or long.
    pin : str
        Number of the new pin; empty for none.
    center : float
        Its middle, along y from the beam's hole (m).
    old : str
        Number of the pin that goes; its middle is `old_center`.
    old_center : float
    """

    hole: int
    bores: tuple[float, ...] = ()
    pin: str = ""
    center: float = 0.0
    old: str = ""
    old_center: float = 0.0


@dataclass(frozen=True, slots=True, eq=False)
class Condensed:
    """Stiffness and inertia at the places that hold a beam, six rows each, and the mass it adds (kg).

    How the beam swings when what holds it stands still: `squares` of the lowest angular frequencies
    (1/s2), modes being of unit mass (kg), and `coupling`, the inertia between each mode and the places.
    """

    stiffness: Array
    inertia: Array
    mass: float
    squares: Array
    coupling: Array


def hold_of(candidate: Candidate, attachment: Attachment, old: PartDefinition | None) -> Hold:
    """Return how a hole of a candidate is held; `old` is the pin that is exchanged, if one is."""
    fastening = attachment.fastening
    flip = float(np.sign(candidate.frame[:, 1] @ candidate.axis))
    along = float(np.dot(attachment.line_point, candidate.axis))

    def local(t: float) -> float:
        return round(flip * (t - along), 9) + 0.0

    if fastening.kind == "present":
        return Hold(attachment.hole)
    center = local(fastening.center)
    if fastening.kind == "pin":
        bores = tuple(local(t) for _, t in fastening.bores)
        return Hold(attachment.hole, bores, fastening.pin, center)
    # a 3L pin reaches from the beam through both holes of the 2L pin
    number = "" if old is None else old.id
    return Hold(attachment.hole, (), fastening.pin, center, number, 1.5 * center)


@lru_cache(maxsize=1024)
def _element(
    number: str, face: int, holes: tuple[int, ...], parts: PartModel
) -> tuple[Element, Array]:
    """Return a beam's element, and the frames of some of its pin holes in the axes of a face."""
    beam = new_part(NewPart(number, HIGHLIGHT, Pose(np.eye(3), np.zeros(3))), 1, 1)
    names = tuple(holes_of(number, face)[hole] for hole in holes)
    points = np.array([_definition(number).port(name).position for name in names])
    element = FACTORIES[parts](beam, points, names)
    return element, readonly(turn_twist(faces(number)[face].turn) @ element.frames)


def _definition(number: str) -> PartDefinition:
    definition = catalogue().get(number)
    if definition is None:
        raise UsageError(f"part {number} is not in the catalogue")
    return definition


@lru_cache(maxsize=64)
def _pin_mass(number: str) -> tuple[float, Array]:
    """Return mass (kg) and mass matrix of a pin about its middle, its axis along y."""
    own = _definition(number).mass_properties
    across = (own.inertia[1, 1] + own.inertia[2, 2]) / 2
    inertia = [across, own.inertia[0, 0], across]
    about = np.diag([own.mass] * 3 + inertia)
    reach = shift_twist(np.array([0.0, own.centroid[0], 0.0]))
    return own.mass, readonly(reach.T @ about @ reach)


def _spring(pin: tuple[float, ...], *, spin: bool = False) -> Array:
    """Return the stiffness of a pin in a hole; `spin`: held as well, where it costs nothing."""
    single = np.zeros((6, 6))
    for motion, axis in ((0, 1), (1, 2), (2, 0)):
        single[axis, axis] = pin[motion]
        single[3 + axis, 3 + axis] = pin[3 + motion]
    if spin and single[4, 4] == 0.0:
        single[4, 4] = pin[4]
    return single


@dataclass(frozen=True, slots=True, eq=False)
class _Matrices:
    """A beam and its new pins before condensation.

    Parameters
    ----------
    own, inertia : (n, n) ndarray
        Stiffness, springs at the places included, and inertia of their own unknowns.
    cross : (n, 6 places) ndarray
        Stiffness between their unknowns and the places.
    outer, heavy : (6 places, 6 places) ndarray
        Stiffness and inertia at the places alone.
    mass : float
        (kg)
    rigid : (n, 6) ndarray
        Unknowns when the beam moves as a rigid body, its pins left where they are.
    """

    own: Array
    inertia: Array
    cross: Array
    outer: Array
    heavy: Array
    mass: float
    rigid: Array


@lru_cache(maxsize=4096)
def condensed(
    number: str, face: int, holds: tuple[Hold, ...], pin: tuple[float, ...], parts: PartModel
) -> Condensed:
    """Return a beam and its new pins, condensed.

    Parameters
    ----------
    number : str
        Of the beam.
    face : int
        By which of its faces it is pinned.
    holds : tuple of Hold
    pin : tuple of float
        Stiffness of a pin in a hole [axial, shear, shear, spin, tilt, tilt].
    parts : {"solid", "frame", "rigid"}
        What the beam is made of; pins do not give way.

    Returns
    -------
    Condensed
        Places in the order of `holds`: each hole that a new pin enters, or the hole of the beam for
        the movement of a pin that is there already.
    """
    m = _matrices(number, face, holds, pin, parts)
    factor = linalg.cho_factor(m.own)
    follow = -linalg.cho_solve(factor, m.cross)
    stiffness = m.outer + m.cross.T @ follow
    inertia = m.heavy + follow.T @ m.inertia @ follow
    # how the beam sags under its own weight, in six ways, is close to how it swings (Rayleigh)
    sag = linalg.cho_solve(factor, m.inertia @ m.rigid)
    sag = sag / np.sqrt(np.einsum("nk,nk->k", sag, m.inertia @ sag))
    squares, mix = linalg.eigh(
        sag.T @ m.own @ sag, sag.T @ m.inertia @ sag, subset_by_index=[0, OWN - 1]
    )
    coupling = (sag @ mix).T @ m.inertia @ follow
    stiffness, inertia = (stiffness + stiffness.T) / 2, (inertia + inertia.T) / 2
    return Condensed(stiffness, inertia, m.mass, squares, coupling)


def _matrices(
    number: str, face: int, holds: tuple[Hold, ...], pin: tuple[float, ...], parts: PartModel
) -> _Matrices:
    element, frames = _element(number, face, tuple(hold.hole for hold in holds), parts)
    n = element.stiffness.shape[0]
    new_pins = sum(bool(hold.bores) for hold in holds)
    places = sum(max(1, len(hold.bores)) for hold in holds)
    own = np.zeros((n + 6 * new_pins, n + 6 * new_pins))
    inertia = np.zeros_like(own)
    own[:n, :n], inertia[:n, :n] = element.stiffness, element.mass
    cross = np.zeros((len(own), 6 * places))
    outer = np.zeros((6 * places, 6 * places))
    heavy = np.zeros((6 * places, 6 * places))
    mass = _definition(number).mass_properties.mass
    place, body = 0, n
    for hold, frame in zip(holds, frames, strict=True):
        if not hold.bores:
            here = slice(6 * place, 6 * place + 6)
            spring = _spring(pin)
            own[:n, :n] += frame.T @ spring @ frame
            cross[:n, here] -= frame.T @ spring
            outer[here, here] += spring
            for name, middle, sign in ((hold.pin, hold.center, 1), (hold.old, hold.old_center, -1)):
                if name:
                    weight, matrix = _pin_mass(name)
                    reach = shift_twist(np.array([0.0, middle, 0.0]))
                    heavy[here, here] += sign * reach.T @ matrix @ reach
                    mass += sign * weight
            place += 1
            continue
        weight, matrix = _pin_mass(hold.pin)
        mass += weight
        mine = slice(body, body + 6)
        inertia[mine, mine] += matrix
        # nothing turns the pin but the beam: then it turns with it
        spring = _spring(pin, spin=True)
        reach = shift_twist(np.array([0.0, -hold.center, 0.0]))
        own[:n, :n] += frame.T @ spring @ frame
        own[:n, mine] -= frame.T @ spring @ reach
        own[mine, :n] -= reach.T @ spring @ frame
        own[mine, mine] += reach.T @ spring @ reach
        spring = _spring(pin)
        for bore in hold.bores:
            here = slice(6 * place, 6 * place + 6)
            reach = shift_twist(np.array([0.0, bore - hold.center, 0.0]))
            own[mine, mine] += reach.T @ spring @ reach
            cross[mine, here] -= reach.T @ spring
            outer[here, here] += spring
            place += 1
        body += 6
    rigid = np.vstack([element.rigid, np.zeros((6 * new_pins, 6))])
    return _Matrices((own + own.T) / 2, inertia, cross, outer, heavy, mass, rigid)
