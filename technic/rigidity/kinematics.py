"""Which joints hold what, on rigid parts: the matrix whose null space is the set of motions.

Twists are taken about each part's centroid in world axes, translations divided by one length of the
model, so that all entries are of order one and one tolerance serves (design, section 2.3).
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property

import numpy as np
from numpy.typing import NDArray
from scipy import sparse

from technic.assembly.joint_types import JointType
from technic.assembly.model import Assembly
from technic.geometry import Array, shift_twist
from technic.groups import connected_groups
from technic.rigidity.nullspace import Block, NullSpace, null_space
from technic.system.rows import transfer
from technic.tolerances import MOBILITY_CUT, MOBILITY_LENGTH

__all__ = [
    "ComponentMotions",
    "Kinematics",
    "component_motions",
    "kinematics",
    "merge_fixed",
    "needed_links",
]

PLANE = np.array([0, 1, 5])
"""Unknowns of a twist that stay in the plane z = 0."""


@dataclass(frozen=True, eq=False)
class Kinematics:
    """Scaled joint rows on rigid parts.

    Parameters
    ----------
    assembly : Assembly
    length : float
        What translations are divided by (m).
    origins : (p, 3) ndarray
        Reference points: the parts' centroids (m).
    sides : (links, 2, 6, 6) ndarray
        Relative motion in the joint's axes per scaled twist of either part; links are the joints,
        then the supports.
    held : (links, 6) ndarray of bool
    owners : tuple of tuple of int
        Parts of each link: two for a joint, one for a support.
    components : tuple of tuple of int
        Parts that hang together, each sorted; heaviest component first.
    """

    assembly: Assembly
    length: float
    origins: Array
    sides: Array
    held: NDArray[np.bool_]
    owners: tuple[tuple[int, ...], ...]
    components: tuple[tuple[int, ...], ...]

    @property
    def dofs(self) -> NDArray[np.int64]:
        """Unknowns of a twist that count: all six in space, three in the plane."""
        return PLANE if self.assembly.dimension == 2 else np.arange(6)

    @cached_property
    def component_of(self) -> NDArray[np.int64]:
        """Component of every part."""
        out = np.zeros(len(self.assembly.parts), dtype=np.int64)
        for c, parts in enumerate(self.components):
            out[list(parts)] = c
        return out

    @cached_property
    def touching(self) -> tuple[tuple[int, ...], ...]:
        """Joints and supports of every part."""
        out: list[list[int]] = [[] for _ in self.assembly.parts]
        for k, owner in enumerate(self.owners):
            for p in owner:
                out[p].append(k)
        return tuple(tuple(links) for links in out)

    @cached_property
    def meshes(self) -> frozenset[int]:
        """Links that are gears in mesh: they tie motions of bodies that other joints leave free."""
        joints = self.assembly.joints
        return frozenset(k for k, joint in enumerate(joints) if joint.type is JointType.MESH)

    @cached_property
    def pairs(self) -> NDArray[np.int64]:
        """Parts on both sides of every joint and support, (links, 2); -1 for the ground."""
        both = [(*owner, -1) if len(owner) == 1 else owner for owner in self.owners]
        return np.array(both, dtype=np.int64).reshape(-1, 2)

    @cached_property
    def link_component(self) -> NDArray[np.int64]:
        """Component of every joint and support."""
        return self.component_of[self.pairs[:, 0]]

    @cached_property
    def _links(self) -> tuple[tuple[int, ...], ...]:
        """Joints and supports of every component."""
        out: list[list[int]] = [[] for _ in self.components]
        for k, component in enumerate(self.link_component.tolist()):
            out[component].append(k)
        return tuple(tuple(links) for links in out)

    def links_of(self, component: int, *, meshes: bool = True) -> list[int]:
        """Return the joints and supports of a component, with or without the gears in mesh."""
        return [k for k in self._links[component] if meshes or k not in self.meshes]

    @property
    def units(self) -> Array:
        """What turns a scaled twist into metres and radians, (6,)."""
        return np.array([self.length] * 3 + [1.0] * 3)


@dataclass(frozen=True, slots=True, eq=False)
class ComponentMotions:
    """All motions of one component, its rigid motions included.

    Parameters
    ----------
    parts : tuple of int
    twists : (6 * len(parts), k) sparse
        Basis of the null space as scaled twists, world axes; columns of unit length, most of which
        move few parts.
    rigid : int
        How many of them are motions of the component as a whole: 6 in space, 3 in the plane, 0 when
        it has a support.
    smallest_kept, largest_dropped : float
        Singular values on either side of the cut.
    """

    parts: tuple[int, ...]
    twists: sparse.csc_array
    rigid: int
    smallest_kept: float
    largest_dropped: float

    @property
    def internal(self) -> int:
        """Number of internal motions."""
        return int(self.twists.shape[1]) - self.rigid


def kinematics(assembly: Assembly) -> Kinematics:
    """Return the scaled joint rows of an assembly on rigid parts."""
    origins = np.array([p.centroid for p in assembly.parts]).reshape(-1, 3)
    owners = tuple(j.parts for j in assembly.joints) + tuple((s.part,) for s in assembly.supports)
    reference = np.array([[origins[o[0]], origins[o[-1]]] for o in owners]).reshape(-1, 2, 3)
    side_a, side_b = transfer(assembly, reference, world=True)
    length = _length(assembly, reference)
    shrink = np.array([1 / length] * 3 + [1.0] * 3)
    sides = np.stack([side_a, side_b], axis=1) * shrink[:, None] / shrink
    held = np.array(
        [j.held for j in assembly.joints] + [s.held for s in assembly.supports], dtype=bool
    )
    return Kinematics(
        assembly=assembly,
        length=length,
        origins=origins,
        sides=sides,
        held=held.reshape(-1, 6),
        owners=owners,
        components=_components(assembly),
    )


def _length(assembly: Assembly, reference: Array) -> float:
    """Return the scaling length: fixed for LEGO parts, RMS arm of the joints for anything else."""
    if all(p.definition is not None for p in assembly.parts) or not assembly.joints:
        return MOBILITY_LENGTH
    points = np.array([j.point for j in assembly.joints])
    arms = points[:, None, :] - reference[: len(points)]
    rms = float(np.sqrt(np.mean(np.sum(arms**2, axis=-1))))
    return rms if rms > 0.0 else MOBILITY_LENGTH


def _components(assembly: Assembly) -> tuple[tuple[int, ...], ...]:
    mass = [p.mass_properties.mass for p in assembly.parts]
    found = connected_groups(range(len(assembly.parts)), (j.parts for j in assembly.joints))
    return tuple(sorted(found, key=lambda c: (-sum(mass[k] for k in c), c)))


def component_motions(
    kin: Kinematics, component: int, cut: float = MOBILITY_CUT, *, meshes: bool = True
) -> ComponentMotions:
    """Return the null space of one component: every motion in which each joint is respected.

    Singular values below `cut` count as motions. Without `meshes`, gears slip through each other.
    """
    parts = kin.components[component]
    links = kin.links_of(component, meshes=meshes)
    dofs = kin.dofs
    width = len(dofs)
    grounded = any(len(kin.owners[k]) == 1 for k in links)
    bodies = merge_fixed(kin, parts, links)
    heads = sorted(set(bodies.values()))
    number = {h: k for k, h in enumerate(heads)}
    body = np.array([number[bodies[p]] for p in parts])
    arms = (kin.origins[list(parts)] - kin.origins[np.array(heads)[body]]) / kin.length
    # twist of the body's head -> twist of the part
    carry = shift_twist(arms)[:, dofs[:, None], dofs]
    blocks = _rows(kin, links, {p: k for k, p in enumerate(parts)}, body, carry)
    space: NullSpace = null_space(blocks, len(heads), width, cut)
    rows = (6 * np.arange(len(parts))[:, None] + dofs)[:, :, None]
    columns = (width * body[:, None] + np.arange(width))[:, None, :]
    coordinates = tuple(a.ravel() for a in np.broadcast_arrays(rows, columns))
    expand = sparse.csr_array(
        (carry.ravel(), coordinates), shape=(6 * len(parts), width * len(heads))
    )
    expand.eliminate_zeros()
    twists = sparse.csc_array(expand @ space.basis)
    lengths = np.sqrt(np.asarray(twists.multiply(twists).sum(axis=0)).ravel())
    return ComponentMotions(
        parts=parts,
        twists=sparse.csc_array(twists @ sparse.diags_array(1.0 / lengths)),
        rigid=0 if grounded else (3 if width == 3 else 6),
        smallest_kept=space.smallest_kept,
        largest_dropped=space.largest_dropped,
    )


def _rows(
    kin: Kinematics,
    links: list[int],
    place: dict[int, int],
    body: NDArray[np.int64],
    carry: Array,
) -> list[Block]:
    """Return the rows of a component's links on its bodies.

    Parameters
    ----------
    kin : Kinematics
    links : list of int
    place : dict of int to int
        Number of a part within the component.
    body : (n,) ndarray of int
        Body of each of its parts.
    carry : (n, width, width) ndarray
        Twist of the body's head -> twist of the part.
    """
    blocks: list[Block] = []
    needed = needed_links(kin, links)
    for count in (2, 1):
        chosen = [k for k in needed if len(kin.owners[k]) == count]
        if not chosen:
            continue
        owners = np.array([[place[p] for p in kin.owners[k]] for k in chosen])
        sides = kin.sides[chosen, :count][..., kin.dofs] @ carry[owners]
        turned = np.concatenate(list(np.moveaxis(sides, 1, 0)), axis=2)
        for own, block, held in zip(body[owners].tolist(), turned, kin.held[chosen], strict=True):
            if len(set(own)) == count:
                blocks.append((tuple(own), block[held]))
    return blocks


def needed_links(kin: Kinematics, links: list[int]) -> list[int]:
    """Leave out joints that follow from others: of parts joined pairwise at one place in the same way, a
    chain is enough.
    """
    joints = kin.assembly.joints
    heads: dict[tuple[bytes, int], int] = {}
    own = [k for k in links if k < len(joints)]
    supports = [k for k in links if k >= len(joints)]
    if not own:
        return supports
    out = []
    held = kin.held[own]
    axes = np.array([joints[k].axes.ravel() for k in own])
    # a ball joint has no axes to agree on
    axes[held[:, :3].all(axis=1) & ~held[:, 3:].any(axis=1)] = 0.0
    points = np.array([joints[k].point for k in own])
    keys = np.hstack([np.round(points, 9) + 0.0, np.round(axes, 9) + 0.0, held])
    for k, row in zip(own, keys, strict=True):
        key = row.tobytes()
        a, b = (_head(heads, key, p) for p in kin.owners[k])
        if a != b:
            heads[key, a] = b
            out.append(k)
    return out + supports


def _head(heads: dict[tuple[bytes, int], int], key: bytes, part: int) -> int:
    """Return the part that stands for all those chained to `part` at a place."""
    while (key, part) in heads:
        part = heads[key, part]
    return part


def merge_fixed(kin: Kinematics, parts: tuple[int, ...], links: list[int]) -> dict[int, int]:
    """Return, for each part, the head of the body it belongs to: fixed joints make one body of two.

    The head is the part nearest to the body's middle, so that arms stay short.
    """
    chosen = np.array(links, dtype=np.int64)
    chosen = chosen[kin.held[chosen].all(axis=1) & (kin.pairs[chosen, 1] >= 0)]
    heads: dict[int, int] = {}
    for group in connected_groups(parts, ((int(a), int(b)) for a, b in kin.pairs[chosen])):
        head = group[0]
        if len(group) > 1:
            members = list(group)
            middle = kin.origins[members].mean(axis=0)
            near = np.linalg.norm(kin.origins[members] - middle, axis=1).round(9)
            head = members[int(np.argmin(near))]
        heads.update(dict.fromkeys(group, head))
    return heads
