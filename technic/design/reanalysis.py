"""The exact answer for one candidate in milliseconds: only what a new beam touches is made anew.

A new beam changes the stiffness of the parts that it is pinned to (they get another port in use), adds its
own and its pins', and a few joints. All other blocks and rows stay. So the matrices of the reinforced
model are those of the model with some columns exchanged, and the motions that cost nothing are those of
the model that obey the new joints as well. What comes out is what `analyze` finds for the reinforced
model, to the accuracy of its eigen step (a test compares them); kinds of motions are left to `analyze`.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

import numpy as np
from scipy import sparse

from technic.assembly.model import Assembly, Joining, Joint, Part
from technic.assembly.stiffness import default_table
from technic.design.apply import Change, new_part
from technic.design.free_motions import all_motions
from technic.design.remade import Remade
from technic.design.screen import Forecast
from technic.design.triplets import Triplets
from technic.fem.element import Element
from technic.geometry import Array
from technic.ldraw.connect import link
from technic.ldraw.placed import collect
from technic.parts.definition import RigidBody
from technic.rigidity.kinematics import kinematics
from technic.system.assemble import assemble
from technic.system.inverse import (
    LOCAL,
    SHIFT,
    SHIFT_SHARE,
)
from technic.system.part_models import FACTORIES, PartModel
from technic.units import PITCH

__all__ = ["Reanalysis"]


class Reanalysis:
    """A model, ready to be re-analysed with one change after another.

    Parameters
    ----------
    assembly : Assembly
        Of any kind; changes can be given for LDraw models only.
    parts : {"solid", "frame", "rigid"}
        What parts are made of.
    """

    def __init__(
        self,
        assembly: Assembly,
        *,
        parts: PartModel = "solid",
    ) -> None:
        self.assembly = assembly
        self._factory = FACTORIES[parts]
        self._joining = assembly.joining or Joining(default_table())
        self._elements: dict[tuple[object, ...], Element] = {}
        self._neighbors: dict[int, Part] = {}
        self.system = assemble(assembly, element=self.element)
        system = self.system
        kin = kinematics(assembly)
        self.dofs = kin.dofs
        self.length, self.components, self.component_of = (
            kin.length,
            kin.components,
            kin.component_of,
        )
        self.part_of = np.repeat(np.arange(len(assembly.parts)), np.diff(system.offsets))
        self.a, self.k = Triplets.of(system.A), Triplets.of(system.K)
        self.m, self.r = Triplets.of(system.mass_matrix), Triplets.of(system.R)
        self.twists = all_motions(kin)
        twists = sparse.coo_array(self.twists)
        self.twist_part, self.twist_column = twists.coords[0] // 6, twists.coords[1]
        self.masses = np.array([p.mass_properties.mass for p in assembly.parts])
        self.structure = np.array([not p.fastener for p in assembly.parts])
        self._low, self._high = _port_boxes(assembly.parts)
        owners = [joint.parts for joint in assembly.joints]
        self.links_of: list[list[int]] = [[] for _ in assembly.parts]
        for k, owner in enumerate([*owners, *((s.part,) for s in assembly.supports)]):
            for p in owner:
                self.links_of[p].append(k)

        self._lift()

    def _lift(self) -> None:
        """Find the stiffness that lifts each motion of few parts, see `technic.system.inverse`."""
        system = self.system
        scale = np.tile([self.length] * 3 + [1.0] * 3, len(self.masses))
        moving = sparse.csc_array(system.R @ (sparse.diags_array(scale) @ self.twists))
        weighted = sparse.csc_array(system.M @ moving)
        gram = np.asarray(moving.multiply(weighted).sum(axis=0)).ravel()
        stiffness = sparse.csr_array(system.K + system.J)
        energy = np.asarray(moving.multiply(stiffness @ moving).sum(axis=0)).ravel()
        self.biggest = float(abs(stiffness.diagonal()).max(initial=0.0))
        small = energy <= SHIFT_SHARE * SHIFT * self.biggest * gram
        self.local = small & (np.diff(moving.indptr) <= LOCAL)
        rows, columns, values, owner = [], [], [], []
        for k in np.flatnonzero(self.local):
            own = slice(weighted.indptr[k], weighted.indptr[k + 1])
            where, load = weighted.indices[own], weighted.data[own]
            rows.append(np.repeat(where, len(where)))
            columns.append(np.tile(where, len(where)))
            values.append(np.outer(load, load).ravel() * (self.biggest / gram[k]))
            owner.append(np.full(len(where) ** 2, k))
        nothing = np.zeros(0, dtype=np.intp)
        self.lift = Triplets(
            np.concatenate([nothing, *rows]),
            np.concatenate([nothing, *columns]),
            np.concatenate([np.zeros(0), *values]),
        )
        self.lifted = np.concatenate([nothing, *owner])

    def element(self, part: Part, points: Array, ports: tuple[str | None, ...]) -> Element:
        """Return a part's element, made once for all models."""
        order = sorted(range(len(ports)), key=lambda k: (ports[k] or "", points[k].tobytes()))
        names, places = tuple(ports[k] for k in order), points[order]
        key = (id(part.body), id(part.mass_properties), part.number, names, places.tobytes())
        if key not in self._elements:
            self._elements[key] = self._factory(part, places, names)
        element = self._elements[key]
        if order == list(range(len(order))):
            return element
        back = np.argsort(order)
        return replace(
            element, frames=element.frames[back], frame_points=element.frame_points[back]
        )

    def exact(self, change: Change) -> Forecast:
        """Return what a change does: motions of structure that go, and the rigidity.

        Call it within `technic.system.inverse.single_thread`: small matrices, many of them.

        The rigidity is that of the heaviest piece of the reinforced model (N/m), infinite when it
        has no elastic mode.
        """
        names = set(change.removed)
        gone = frozenset(k for k, p in enumerate(self.assembly.parts) if p.id in names)
        new = [new_part(part, k, 1) for k, part in enumerate(change.added, start=1)]
        return self.exact_with(new, self.new_joints(new, gone), gone)

    def exact_with(
        self, new: Sequence[Part], joints: Sequence[Joint], gone: frozenset[int] = frozenset()
    ) -> Forecast:
        """Return what new parts do that these joints hold; some parts may go.

        Parameters
        ----------
        new : sequence of Part
        joints : sequence of Joint
            New part k has the index of the k-th after the present ones.
        gone : frozenset of int
            Each has a new part in its place that holds the same motions.
        """
        made = Remade(self, new, joints, gone)
        removed = made.move()
        return Forecast(removed, made.lowest(made.main_piece()))

    def new_joints(self, new: Sequence[Part], gone: frozenset[int]) -> list[Joint]:
        """Return the joints of new parts; new part k has the index of the k-th after the present ones.

        Only parts with connectors within half a pitch of theirs are looked at.
        """
        low, high = _port_boxes(new)
        room = PITCH / 2.0
        below = (self._low[:, None] <= high + room).all(axis=2)
        above = (self._high[:, None] >= low - room).all(axis=2)
        meets = np.any(below & above, axis=1)
        near = [int(k) for k in np.flatnonzero(meets) if int(k) not in gone]
        present = [self.assembly.parts[k] for k in near]
        how = self._joining
        joints = link([*present, *new], how.table, axle_slide=how.axle_slide).joints
        count = len(self.assembly.parts)
        number = [*near, *range(count, count + len(new))]
        own = [j for j in joints if max(j.parts) >= len(near)]
        return [replace(j, parts=(number[j.parts[0]], number[j.parts[1]])) for j in own]

    def as_neighbor(self, index: int) -> Part:
        """Return a part whose own unknowns are not asked for, as something that is quickly made."""
        if index not in self._neighbors:
            part = self.assembly.parts[index]
            self._neighbors[index] = replace(part, body=RigidBody(), definition=None)
        return self._neighbors[index]


def _port_boxes(parts: Sequence[Part]) -> tuple[Array, Array]:
    """Return the lowest and the highest corner of every part's ports (m), (p, 3) each."""
    placed = collect(parts)
    low, high = np.full((len(parts), 3), np.inf), np.full((len(parts), 3), -np.inf)
    reach = np.abs(placed.axis) * placed.half[:, None]
    np.minimum.at(low, placed.part, placed.position - reach)
    np.maximum.at(high, placed.part, placed.position + reach)
    return low, high
