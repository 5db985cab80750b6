"""Frame elements: straight prismatic Timoshenko members in three dimensions.

The stiffness is exact for loads at the nodes; the mass is consistent with the same shape functions and
includes the rotation of the sections, so that ``x^T M x`` is the integral of ``density |u|^2`` over the
material. Shape functions with shear: J. S. Przemieniecki, *Theory of Matrix Structural Analysis*
(1968), sections 5.6 and 11.5.
"""

from __future__ import annotations

from functools import lru_cache
from itertools import pairwise
from typing import Any

import numpy as np
from numpy.typing import NDArray

from technic.errors import InputError
from technic.fem.element import Element
from technic.geometry import Array, cross, shift_twist, turn_twist
from technic.parts.definition import FrameBody, MassProperties, Material, Section

__all__ = ["frame_element", "local_mass", "local_stiffness", "member_matrices", "subdivide"]

SAME_NODE = 0.1
"""Attachments closer than this share of the section's size (root of its area) along a member share a
node: beam theory says nothing about shorter distances, and elements that short drown the rest in
rounding. The attachment keeps its place: a rigid arm leads to it."""


def frame_element(body: FrameBody, properties: MassProperties, attachments: Array) -> Element:
    """Return the element of a frame body with a node at every attachment.

    The density is scaled so that the element's mass is the part's true mass: bores and pockets are
    not in the members. What the members lack in moment of inertia (material beyond the last bore, wide
    flanges) is added to the rotation of the nodes.

    Parameters
    ----------
    body : FrameBody
    properties : MassProperties
    attachments : (m, 3) ndarray
        Points where joints and supports attach, part coordinates (m); a point off the centre lines is
        carried by the nearest point on them as by a rigid arm.

    Returns
    -------
    Element
        With ``6 * nodes`` unknowns: translation and rotation of each node.

    Raises
    ------
    InputError
        A member has no length.
    """
    node_points, pairs, member_of, node_of = subdivide(body, attachments)
    n = len(node_points)
    stiffness = np.zeros((6 * n, 6 * n))
    mass = np.zeros((6 * n, 6 * n))
    ends = np.array(pairs)
    for section in set(member_of):
        chosen = [k for k, m in enumerate(member_of) if m == section]
        blocks = member_matrices(
            node_points[ends[chosen, 0]],
            node_points[ends[chosen, 1]],
            body.normals[section],
            body.sections[section],
            body.material,
        )
        dofs = (6 * ends[chosen][:, :, None] + np.arange(6)).reshape(-1, 12)
        place = (dofs[:, :, None], dofs[:, None, :])
        np.add.at(stiffness, place, blocks[0])
        np.add.at(mass, place, blocks[1])
    rigid = shift_twist(node_points - properties.centroid).reshape(6 * n, 6)
    unscaled = float(rigid[:, 0] @ mass @ rigid[:, 0])
    mass *= properties.mass / unscaled
    _complete_inertia(mass, rigid, properties)
    unit = np.eye(6 * n).reshape(n, 6, 6 * n)
    frames = unit[np.array(node_of, dtype=np.int64)]
    nodes = unit[:, :3].copy()
    return Element(
        stiffness=stiffness,
        mass=mass,
        rigid=rigid,
        frames=frames,
        frame_points=node_points[node_of].reshape(-1, 3),
        nodes=nodes,
        node_points=node_points,
    )


def _complete_inertia(mass: Array, rigid: Array, properties: MassProperties) -> None:
    """Add the missing moment of inertia about the centroid to the rotations of all nodes.

    Only what is missing: where members have more than the part (a bent beam's corner counted twice),
    nothing is taken away, so that the mass stays positive.
    """
    present = rigid[:, 3:].T @ mass @ rigid[:, 3:]
    moments, axes = np.linalg.eigh(properties.inertia - present)
    missing = (axes * np.clip(moments, 0.0, None)) @ axes.T
    nodes = len(mass) // 6
    own = np.arange(nodes)
    mass.reshape(nodes, 6, nodes, 6)[own, 3:, own, 3:] += missing / nodes


def subdivide(
    body: FrameBody, attachments: Array
) -> tuple[Array, list[tuple[int, int]], list[int], list[int]]:
    """Place nodes: member ends, attachments projected on the nearest member, equal refinement.

    The result does not depend on the order of the attachments.
    """
    starts = body.points[body.members[:, 0]]
    spans = body.points[body.members[:, 1]] - starts
    lengths = np.linalg.norm(spans, axis=1)
    if not np.all(lengths > 0.0):
        raise InputError(f"frame member {int(np.argmin(lengths))} has no length")
    home, station = _project(starts, spans, lengths, attachments)
    longest = np.broadcast_to(body.max_stretch, lengths.shape)
    nodes: list[Array] = [np.asarray(p) for p in body.points]
    node_of = [0] * len(attachments)
    pairs: list[tuple[int, int]] = []
    member_of: list[int] = []
    for m, (first, last) in enumerate(body.members):
        close = SAME_NODE * np.sqrt(body.sections[m].area) / lengths[m]
        chain = [(0.0, int(first))]
        own = sorted((float(station[k]), k) for k in range(len(attachments)) if home[k] == m)
        for group in _grouped(own, close):
            t = float(np.mean([s for s, _ in group]))
            if min(s for s, _ in group) <= close:
                node = int(first)
            elif max(s for s, _ in group) >= 1.0 - close:
                node = int(last)
            else:
                node = len(nodes)
                nodes.append(starts[m] + t * spans[m])
                chain.append((t, node))
            for _, k in group:
                node_of[k] = node
        chain.append((1.0, int(last)))
        for (s, a), (e, b) in pairwise(chain):
            # attachments are rounded to a nanometre: that must not add a piece
            pieces = max(1, int(np.ceil((e - s) * lengths[m] / longest[m] - 1e-6)))
            inner = list(range(len(nodes), len(nodes) + pieces - 1))
            nodes += [starts[m] + (s + (e - s) * k / pieces) * spans[m] for k in range(1, pieces)]
            pairs += pairwise([a, *inner, b])
            member_of += [m] * pieces
    return np.array(nodes), pairs, member_of, node_of


def _project(
    starts: Array, spans: Array, lengths: Array, points: Array
) -> tuple[NDArray[np.int64], Array]:
    """Return the member nearest to each point and where on it, between 0 and 1."""
    if len(points) == 0:
        return np.zeros(0, dtype=np.int64), np.zeros(0)
    arms = points[:, None, :] - starts
    t = np.clip(np.einsum("pmi,mi->pm", arms, spans) / lengths**2, 0.0, 1.0)
    gaps = np.linalg.norm(arms - t[..., None] * spans, axis=2).round(12)
    home = np.argmin(gaps, axis=1)
    return home, t[np.arange(len(points)), home]


def _grouped(stations: list[tuple[float, int]], close: float) -> list[list[tuple[float, int]]]:
    """Divide sorted stations into groups that are not longer than `close`."""
    groups: list[list[tuple[float, int]]] = []
    for s, k in stations:
        if groups and s - groups[-1][0][0] <= close:
            groups[-1].append((s, k))
        else:
            groups.append([(s, k)])
    return groups


def member_matrices(
    p: Array, q: Array, normal: Array, section: Section, material: Material
) -> tuple[Array, Array]:
    """Return stiffness and consistent mass of elements of one member, in part axes.

    Parameters
    ----------
    p, q : (m, 3) ndarray
        Ends of the elements (m).
    normal : (3,) ndarray
        Direction of the member's own z axis; made orthogonal to the member.
    section : Section
    material : Material

    Returns
    -------
    (m, 12, 12) ndarray, (m, 12, 12) ndarray
        Unknowns: translation and rotation of `p`, then of `q`.

    Raises
    ------
    InputError
        The normal is parallel to the member.
    """
    spans = q - p
    lengths = np.linalg.norm(spans, axis=1)
    x = spans[0] / lengths[0]
    z = normal - (normal @ x) * x
    size = float(np.linalg.norm(z))
    if size < 1e-9 * float(np.linalg.norm(normal)):
        raise InputError("the normal of a frame member is parallel to the member")
    z = z / size
    turn = np.kron(np.eye(2), turn_twist(np.array([x, cross(z, x), z])))
    k, m = _own_axes(tuple(lengths.round(15).tolist()), section, material)
    return turn.T @ k @ turn, turn.T @ m @ turn


@lru_cache(maxsize=256)
def _own_axes(
    lengths: tuple[float, ...], section: Section, material: Material
) -> tuple[Array, Array]:
    """Return stiffness and mass in the members' own axes: the bars of a linkage are often equally long."""
    sizes = np.array(lengths)
    return local_stiffness(sizes, section, material), local_mass(sizes, section, material)


AXIAL: Any = np.ix_([0, 6], [0, 6])
TORSION: Any = np.ix_([3, 9], [3, 9])
BENDING: Any = (
    (np.ix_([1, 5, 7, 11], [1, 5, 7, 11]), 1.0),
    (np.ix_([2, 4, 8, 10], [2, 4, 8, 10]), -1.0),
)
"""Places of the unknowns of bending in the plane of x and y, then of x and z; sign of the rotation."""

_DEFLECTION = (
    np.array(
        [[1.0, 0.0, -3.0, 2.0], [0.0, 1.0, -2.0, 1.0], [0.0, 0.0, 3.0, -2.0], [0.0, 0.0, -1.0, 1.0]]
    ),
    np.array(
        [[1.0, -1.0, 0.0, 0.0], [0.0, 0.5, -0.5, 0.0], [0.0, 1.0, 0.0, 0.0], [0.0, -0.5, 0.5, 0.0]]
    ),
)
"""Deflection along a member for a unit of each unknown, as powers of the place between 0 and 1: of a slender
member, and what the shear ratio adds; both over one plus that ratio. Rows of rotations are per length."""

_ROTATION = (
    np.array([[0.0, -6.0, 6.0], [1.0, -4.0, 3.0], [0.0, 6.0, -6.0], [0.0, -2.0, 3.0]]),
    np.array([[0.0, 0.0, 0.0], [1.0, -1.0, 0.0], [0.0, 0.0, 0.0], [0.0, 1.0, 0.0]]),
)
"""The same of the rotation of the section; rows of deflections are over the length."""


def _products(shapes: tuple[Array, Array]) -> Array:
    """Return the integrals of products of shape functions, (3, 4, 4): factors of powers of the ratio."""
    powers = np.arange(shapes[0].shape[1])
    weights = 1.0 / (powers[:, None] + powers + 1.0)
    one, two = shapes
    return np.array(
        [
            one @ weights @ one.T,
            one @ weights @ two.T + two @ weights @ one.T,
            two @ weights @ two.T,
        ]
    )


_DEFLECTION_PRODUCTS, _ROTATION_PRODUCTS = _products(_DEFLECTION), _products(_ROTATION)

_BENT = np.array([[12, 6, -12, 6], [6, 4, -6, 2], [-12, -6, 12, -6], [6, 2, -6, 4]], dtype=float)
_SHEARED = np.zeros((4, 4))
_SHEARED[1::2, 1::2] = [[1.0, -1.0], [-1.0, 1.0]]
"""Stiffness in bending of a member of unit length: slender, and what the shear ratio adds."""

_PAIR = np.array([[1.0, -1.0], [-1.0, 1.0]])


def _bending(section: Section) -> tuple[tuple[float, float], tuple[float, float]]:
    """Return second moment and shear area of bending in the plane of x and y, then of x and z."""
    return (section.inertia_z, section.shear_y), (section.inertia_y, section.shear_z)


def _shear_ratio(lengths: Array, inertia: float, shear: float, material: Material) -> Array:
    """Return ``12 E I / (G A_s L^2)``."""
    return 12.0 * material.young_pa * inertia / (material.shear_pa * shear * lengths**2)


def local_stiffness(lengths: Array, section: Section, material: Material) -> Array:
    """Return the stiffness of members in their own axes, (m, 12, 12); lengths may be complex."""
    e, g = material.young_pa, material.shear_pa
    k = np.zeros((len(lengths), 12, 12), dtype=lengths.dtype)
    k[:, *AXIAL] = (e * section.area / lengths)[:, None, None] * _PAIR
    k[:, *TORSION] = (g * section.torsion / lengths)[:, None, None] * _PAIR
    for (place, sign), (inertia, shear) in zip(BENDING, _bending(section), strict=True):
        phi = _shear_ratio(lengths, inertia, shear, material)[:, None, None]
        arms = _arms(sign * lengths)
        scale = e * inertia / (lengths[:, None, None] ** 3 * (1.0 + phi))
        k[:, *place] = scale * (_BENT + phi * _SHEARED) * arms
    return k


def _arms(lengths: Array) -> Array:
    """Return what turns unknowns per unit length into deflections, for products: (m, 4, 4)."""
    arms = np.ones((len(lengths), 4), dtype=lengths.dtype)
    arms[:, 1::2] = lengths[:, None]
    return np.asarray(arms[:, :, None] * arms[:, None, :])


def local_mass(lengths: Array, section: Section, material: Material) -> Array:
    """Return the consistent mass of members in their own axes, (m, 12, 12); lengths may be complex."""
    rho = material.density
    m = np.zeros((len(lengths), 12, 12), dtype=lengths.dtype)
    linear = lengths[:, None, None] / 6.0 * np.array([[2.0, 1.0], [1.0, 2.0]])
    m[:, *AXIAL] = rho * section.area * linear
    m[:, *TORSION] = rho * (section.inertia_y + section.inertia_z) * linear
    for (place, sign), (inertia, shear) in zip(BENDING, _bending(section), strict=True):
        phi = _shear_ratio(lengths, inertia, shear, material)[:, None, None]
        ratios = np.stack([np.ones_like(phi), phi, phi**2], axis=1) / (1.0 + phi[:, None]) ** 2
        size = lengths[:, None, None]
        arms = _arms(sign * lengths)
        m[:, *place] = (
            rho * section.area * size * arms * (ratios * _DEFLECTION_PRODUCTS).sum(axis=1)
        )
        m[:, *place] += rho * inertia / size * arms * (ratios * _ROTATION_PRODUCTS).sum(axis=1)
    return m
