"""A part condensed onto its port frames, and its form as an element of an assembly."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray
from scipy import linalg

from technic.errors import UsageError
from technic.fem.element import Element
from technic.geometry import Array, readonly, shift_twist

__all__ = [
    "SuperElement",
    "elastic_eigenvalues",
    "frames_in_use",
    "rigid_motions",
    "super_element_to_element",
]

MASS_ERROR = 1e-2
"""Ports are kept for the mass until the lowest `KEPT_MODES` eigenvalues of the free part are met within
this share. A part's own modes lie far above those of the assembly it sits in: three ports of a 5L beam
err by 0.6 % in these, and by 0.13 % in the first ten modes of a chain of six such beams."""

KEPT_MODES = 2
"""Bending in both planes: the modes that come first in anything long."""

CHECKED_MODES = 3
"""Elastic modes of the free part that are compared: bending in both planes and torsion or stretch."""


@dataclass(frozen=True, slots=True, eq=False)
class SuperElement:
    """Stiffness and mass of a part at its port frames, in part axes.

    The unknowns are the twists (translation, rotation) of the frames, six per port, at `points`.

    Parameters
    ----------
    id : str
        Part number.
    ports : tuple of str
        Names of the ports, in the order of the unknowns.
    points : (p, 3) array_like
        Reference point of each frame (m).
    stiffness : (6 p, 6 p) array_like
        ``K``, exactly symmetric; its null space is the rigid motions (N/m and consistent).
    mass : (6 p, 6 p) array_like
        ``M``, exactly symmetric, condensed with the same transformation (kg and consistent).
    centroid : (3,) array_like
        Centre of mass (m).
    merged : tuple of (str, str)
        Ports left out because their surface is that of another port, and that port: their frames move
        together.
    condensation_error : float
        Largest relative error of the part's own lowest elastic eigenvalues caused by condensing the
        mass onto the ports (0 when it was not measured).
    fineness : float
        Smallest eigenvalue of the port flexibility relative to the largest (lengths scaled): how far
        the frames are from dependent.
    cell : float
        Edge of the cells it was meshed with (m).
    key : str
        Hash of definition, settings and material.
    """

    id: str
    ports: tuple[str, ...]
    points: Array
    stiffness: Array
    mass: Array
    centroid: Array
    merged: tuple[tuple[str, str], ...] = ()
    condensation_error: float = 0.0
    fineness: float = 0.0
    cell: float = 0.0
    key: str = ""

    def __post_init__(self) -> None:
        for name in ("points", "stiffness", "mass", "centroid"):
            object.__setattr__(self, name, readonly(getattr(self, name)))
        size = 6 * len(self.ports)
        if self.stiffness.shape != (size, size) or self.mass.shape != (size, size):
            raise ValueError(
                f"super-element {self.id}: {len(self.ports)} ports need {size} unknowns"
            )

    def scaled(self, stiffness: float, mass: float) -> SuperElement:
        """Return the part made of another material of the same Poisson's ratio.

        Parameters
        ----------
        stiffness, mass : float
            Ratio of Young's moduli and of densities. Exact when Poisson's ratio is the same; the
            catalogue's materials (0.35 to 0.39) differ by less than 1 % in effect.
        """
        return replace(self, stiffness=self.stiffness * stiffness, mass=self.mass * mass, key="")

    def index(self, port: str) -> int:
        """Return the position of a port (or of the one it is merged with); KeyError if unknown."""
        name = dict(self.merged).get(port, port)
        try:
            return self.ports.index(name)
        except ValueError:
            raise KeyError(port) from None


def rigid_motions(points: Array, reference: Array) -> Array:
    """Return the twists of frames when the body turns and moves about a reference point.

    Parameters
    ----------
    points : (p, 3) ndarray
    reference : (3,) ndarray

    Returns
    -------
    (6 p, 6) ndarray
    """
    return shift_twist(np.asarray(points) - reference).reshape(-1, 6)


def elastic_eigenvalues(stiffness: Array, mass: Array, count: int) -> Array:
    """Return the lowest eigenvalues (rad2/s2) above the six rigid motions, at most `count`."""
    size = len(stiffness)
    last = min(6 + count, size) - 1
    if last < 6:
        return np.zeros(0)
    values = linalg.eigh(stiffness, mass, eigvals_only=True, subset_by_index=(6, last))
    return np.asarray(values)


def _condense(element: SuperElement, kept: Sequence[int]) -> tuple[Array, Array]:
    """Condense the other ports out (Guyan 1965), rigid motions kept exactly."""
    kept_rows = _unknowns(kept)
    rest = np.setdiff1d(np.arange(len(element.stiffness)), kept_rows)
    if len(rest) == 0:
        return element.stiffness, element.mass
    k = element.stiffness
    follow = -np.linalg.solve(k[np.ix_(rest, rest)], k[np.ix_(rest, kept_rows)])
    transform = np.zeros((len(k), len(kept_rows)))
    transform[kept_rows, range(len(kept_rows))] = 1.0
    transform[rest] = follow
    stiffness = k[np.ix_(kept_rows, kept_rows)] + k[np.ix_(kept_rows, rest)] @ follow
    mass = transform.T @ element.mass @ transform
    rigid = rigid_motions(element.points[list(kept)], element.centroid)
    return project_rigid(stiffness, rigid), (mass + mass.T) / 2.0


def project_rigid(stiffness: Array, rigid: Array) -> Array:
    """Return the symmetric matrix nearest to `stiffness` that annihilates the rigid motions.

    Removes round-off: what it takes away is checked by the caller's tests to be of that order.
    """
    length = np.sqrt((rigid[:, 3:] ** 2).sum() / (rigid[:, :3] ** 2).sum())
    basis, _ = np.linalg.qr(rigid / np.array([1.0, 1.0, 1.0, length, length, length]))
    half = stiffness - basis @ (basis.T @ stiffness)
    whole = half - (half @ basis) @ basis.T
    return np.asarray((whole + whole.T) / 2.0)


def _unknowns(ports: Sequence[int]) -> NDArray[np.int64]:
    return (6 * np.asarray(ports, dtype=np.int64)[:, None] + np.arange(6)).ravel()


def _keep_for_mass(element: SuperElement, used: list[int]) -> tuple[list[int], float]:
    """Add ports to those in use until the mass is represented; return them and the error left."""
    kept = sorted(set(used))
    everything = range(len(element.ports))
    exact = elastic_eigenvalues(element.stiffness, element.mass, KEPT_MODES)
    while True:
        error = np.inf
        if len(exact) == 0:
            error = 0.0
        elif len(kept) > 1:
            stiffness, mass = _condense(element, kept)
            values = elastic_eigenvalues(stiffness, mass, KEPT_MODES)
            error = float(np.abs(values / exact[: len(values)] - 1.0).max())
        if error <= MASS_ERROR or len(kept) == len(element.ports):
            return kept, error
        gaps = [
            np.linalg.norm(element.points[i] - element.points[kept], axis=1).min()
            if i not in kept
            else -1.0
            for i in everything
        ]
        kept = sorted([*kept, int(np.argmax(gaps))])


def super_element_to_element(
    element: SuperElement, used: Sequence[str | None], attachments: Array | None = None
) -> tuple[Element, float]:
    """Return a part as an element of an assembly, with as few unknowns as its mass allows.

    Ports that are not in use are condensed out, except those that the mass needs.

    Parameters
    ----------
    element : SuperElement
    used : sequence of str or None
        Ports that carry a joint, a load or a support; one frame each, in this order (repeats allowed).
        None: the port nearest to the attachment, for places without a frame of their own (studs).
    attachments : (m, 3) ndarray, optional
        Reference point of each frame (m); by default that of its port. A frame moves rigidly with its
        port.

    Returns
    -------
    element : Element
    error : float
        Largest relative error of the part's own lowest two eigenvalues due to leaving ports out.

    Raises
    ------
    UsageError
        A port is unknown, or None stands without an attachment.
    """
    at, kept, error = frames_in_use(element, used, attachments)
    stiffness, mass = _condense(element, kept)
    points = element.points[kept]
    size = 6 * len(kept)
    identity = np.eye(size).reshape(len(kept), 6, size)
    position = {port: i for i, port in enumerate(kept)}
    chosen = [position[i] for i in at]
    targets = points[chosen] if attachments is None else np.asarray(attachments, dtype=float)
    arms = targets.reshape(len(at), 3) - points[chosen].reshape(len(at), 3)
    return (
        Element(
            stiffness=stiffness,
            mass=mass,
            rigid=rigid_motions(points, element.centroid),
            frames=shift_twist(arms) @ identity[chosen].reshape(len(at), 6, size),
            frame_points=targets.reshape(len(at), 3),
            nodes=identity[:, :3],
            node_points=points,
        ),
        error,
    )


def frames_in_use(
    element: SuperElement, used: Sequence[str | None], attachments: Array | None = None
) -> tuple[list[int], list[int], float]:
    """Return the port of each attachment, all ports that are kept, and the error of leaving out the rest.

    Parameters are those of `super_element_to_element`.
    """
    at = [_port_of(element, name, i, attachments) for i, name in enumerate(used)]
    middle = int(np.argmin(np.linalg.norm(element.points - element.centroid, axis=1)))
    kept, error = _keep_for_mass(element, at or [middle])
    return at, kept, error


def _port_of(
    element: SuperElement, name: str | None, number: int, attachments: Array | None
) -> int:
    """Return the port that carries an attachment."""
    if name is not None:
        try:
            return element.index(name)
        except KeyError:
            raise UsageError(f"part {element.id} has no port {name!r}") from None
    if attachments is None:
        raise UsageError(f"part {element.id}: attachment {number} names no port and has no point")
    gaps = np.linalg.norm(element.points - np.asarray(attachments)[number], axis=1)
    return int(np.argmin(gaps))
