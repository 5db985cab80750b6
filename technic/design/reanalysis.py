"""The exact answer for one candidate in milliseconds: only what a new beam touches is made anew.

A new beam changes the stiffness of the parts that it is pinned to (they get another port in use), adds its
own and its pins', and a few joints. All other blocks and rows stay. So the matrices of the reinforced
model are those of the model with some columns exchanged, and the motions that cost nothing are those of
the model that obey the new joints as well. What comes out is what `analyze` finds for the reinforced
model, to the accuracy of its eigen step (a test compares them); kinds of motions are left to `analyze`.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import Final

import numpy as np
from numpy.typing import NDArray
from scipy import sparse

from technic.assembly.model import Assembly, Joining, Joint, Part
from technic.assembly.stiffness import default_table
from technic.design.apply import Change, new_part
from technic.design.free_motions import all_motions
from technic.design.lowest import lowest_eigenvalue
from technic.design.screen import Forecast
from technic.fem.element import Element
from technic.geometry import Array
from technic.groups import connected_groups
from technic.ldraw.connect import link
from technic.ldraw.placed import collect
from technic.parts.definition import RigidBody
from technic.rigidity.eigen import elastic_modes
from technic.rigidity.kinematics import kinematics
from technic.system.assemble import assemble
from technic.system.inverse import (
    LOCAL,
    SHIFT,
    SHIFT_SHARE,
    bordered_inverse,
    orthonormal,
    single_thread,
)
from technic.system.part_models import FACTORIES, PartModel
from technic.tolerances import MOBILITY_CUT
from technic.units import PITCH

__all__ = ["Reanalysis"]

_DEPENDENT: Final = 1e-8
"""Singular value below which columns of a basis say nothing new."""

_STRUCTURE: Final = 1e-3
"""Share of a motion that parts of structure must take for it to count."""


@dataclass(frozen=True, slots=True, eq=False)
class Triplets:
    """A sparse matrix as rows, columns and values, to be cut and put together again."""

    row: NDArray[np.intp]
    column: NDArray[np.intp]
    value: Array

    @staticmethod
    def of(matrix: sparse.sparray) -> Triplets:
        coo = sparse.coo_array(matrix)
        return Triplets(coo.coords[0], coo.coords[1], coo.data)

    def only(self, kept: NDArray[np.bool_]) -> Triplets:
        """Return some of the entries."""
        return Triplets(self.row[kept], self.column[kept], self.value[kept])

    def moved(self, rows: NDArray[np.intp], columns: NDArray[np.intp]) -> Triplets:
        """Return the entries whose new row and column (-1: gone) are given."""
        row, column = rows[self.row], columns[self.column]
        kept = (row >= 0) & (column >= 0)
        return Triplets(row[kept], column[kept], self.value[kept])


def joined(pieces: Sequence[Triplets], shape: tuple[int, int]) -> sparse.csr_array:
    data = np.concatenate([p.value for p in pieces])
    rows = np.concatenate([p.row for p in pieces])
    columns = np.concatenate([p.column for p in pieces])
    return sparse.csr_array((data, (rows, columns)), shape=shape)


class Reanalysis:
    """A model, ready to be re-analysed with one change after another.

    Parameters
    ----------
    assembly : Assembly
        Read from an LDraw model.
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
        self.joints_of: list[list[int]] = [[] for _ in assembly.parts]
        for k, joint in enumerate(assembly.joints):
            for p in joint.parts:
                self.joints_of[p].append(k)

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
        key = (id(part.body), id(part.mass_properties), part.number, ports, points.tobytes())
        if key not in self._elements:
            self._elements[key] = self._factory(part, points, ports)
        return self._elements[key]

    def exact(self, change: Change) -> Forecast:
        """Return what a change does: motions of structure that go, and the rigidity.

        The rigidity is that of the heaviest piece of the reinforced model (N/m), infinite when it
        has no elastic mode.
        """
        with single_thread():
            made = _Made(self, change)
            removed = made.move()
            return Forecast(removed, made.lowest(made.main_piece()))

    def new_joints(self, new: Sequence[Part], gone: frozenset[int]) -> list[Joint]:
        """Return the joints of new parts; new part k has the index of the k-th after the present ones.

        Only parts within a pitch of them are looked at.
        """
        low, high = _port_boxes(new)
        low, high = low.min(axis=0) - PITCH, high.max(axis=0) + PITCH
        meets = ((self._low <= high) & (self._high >= low)).all(axis=1)
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


class _Made:
    """One reinforced model: which parts and joints stay, and the matrices of what is made anew."""

    def __init__(self, base: Reanalysis, change: Change) -> None:
        self._base = base
        assembly = base.assembly
        count = len(assembly.parts)
        names = set(change.removed)
        gone = frozenset(k for k, p in enumerate(assembly.parts) if p.id in names)
        new = [new_part(part, k, 1) for k, part in enumerate(change.added, start=1)]
        joints = base.new_joints(new, gone)
        lost = {k for g in gone for k in base.joints_of[g]}
        touched = {p for j in joints for p in j.parts if p < count}
        touched |= {p for k in lost for p in assembly.joints[k].parts}
        touched -= gone
        kept = sorted({k for p in touched for k in base.joints_of[p]} - lost)
        ends = {p for k in kept for p in assembly.joints[k].parts} - touched
        remade = [*sorted(touched), *range(count, count + len(new))]
        order = [*remade, *sorted(ends)]
        place = {p: n for n, p in enumerate(order)}
        every = [*(assembly.parts[p] for p in sorted(touched)), *new]
        every += [base.as_neighbor(p) for p in sorted(ends)]
        linked = [*(assembly.joints[k] for k in kept), *joints]
        local = [replace(j, parts=(place[j.parts[0]], place[j.parts[1]])) for j in linked]
        self._system = assemble(
            replace(assembly, parts=tuple(every), joints=tuple(local), supports=(), findings=()),
            element=base.element,
        )
        self._gone, self._new, self._joints = gone, new, joints
        self._remade, self._kept, self._lost = np.array(remade, dtype=np.intp), kept, lost
        self._masses = np.append(base.masses, [p.mass_properties.mass for p in new])
        self._masses[list(gone)] = 0.0
        self._structure = np.append(base.structure, [not p.fastener for p in new])
        self._structure[list(gone)] = False

    def move(self) -> int:
        """Find what costs nothing, and return how many motions of structure went."""
        base = self._base
        count, total = len(base.structure), len(self._structure)
        touched = self._remade[self._remade < count]
        twists = base.twists
        seen = np.zeros(count, dtype=bool)
        seen[touched] = True
        seen[list(self._gone)] = True
        hit = np.zeros(twists.shape[1], dtype=bool)
        hit[base.twist_column[seen[base.twist_part]]] = True
        affected = twists[:, hit].toarray()
        affected /= np.maximum(np.abs(affected).max(axis=0), 1e-300)
        rows = self._unknowns_of(touched)
        c = self._new_rows()
        forms = np.hstack([c[:, : len(rows)] @ affected[rows], c[:, len(rows) :]])
        _, sizes, turn = np.linalg.svd(forms)
        free = turn[int(np.sum(sizes > MOBILITY_CUT)) :].T
        after = np.zeros((6 * total, free.shape[1]))
        after[: 6 * count] = affected @ free[: affected.shape[1]]
        after[6 * count :] = free[affected.shape[1] :]
        after[self._unknowns_of(np.array(sorted(self._gone), dtype=np.intp))] = 0.0
        after = _independent(after)
        removed = _rank(_independent(affected), base.structure) - _rank(after, self._structure)
        rest = twists[:, ~hit & ~base.local].toarray()
        rest = np.vstack([rest, np.zeros((6 * (total - count), rest.shape[1]))])
        self._twists = np.hstack([rest, after])
        self._lifted = base.local & ~hit
        return removed

    @staticmethod
    def _unknowns_of(parts: NDArray[np.intp]) -> NDArray[np.intp]:
        return np.asarray((6 * parts[:, None] + np.arange(6)).ravel())

    def _new_rows(self) -> Array:
        """Return the new joints' held motions on rigid parts, scaled, for all parts made anew."""
        system, length = self._system, self._base.length
        mine = system.rows.link >= len(self._kept)
        rows = (system.A[mine] @ system.R)[:, : 6 * len(self._remade)].toarray()
        rows *= np.tile([length] * 3 + [1.0] * 3, len(self._remade))
        return np.asarray(rows / np.where(system.rows.motion[mine] < 3, length, 1.0)[:, None])

    def main_piece(self) -> NDArray[np.bool_]:
        """Return which parts belong to the heaviest connected piece."""
        base = self._base
        groups = connected_groups(
            range(len(base.components) + len(self._new)),
            ((self._piece_of(j.parts[0]), self._piece_of(j.parts[1])) for j in self._joints),
        )
        own = np.array([self._piece_of(p) for p in range(len(self._masses))])
        best = max(groups, key=lambda g: float(self._masses[np.isin(own, list(g))].sum()))
        inside = np.isin(own, list(best))
        inside[list(self._gone)] = False
        return inside

    def _piece_of(self, part: int) -> int:
        base = self._base
        count = len(base.structure)
        if part < count:
            return int(base.component_of[part])
        return len(base.components) + part - count

    def lowest(self, main: NDArray[np.bool_]) -> float:
        """Return the lowest elastic eigenvalue of the main piece (N/m)."""
        base, system = self._base, self._system
        old = base.system
        stays = main[: len(base.structure)].copy()
        stays[self._remade[self._remade < len(stays)]] = False
        of_old = _renumbered(stays[base.part_of], 0)
        first = int((of_old >= 0).sum())
        anew = np.zeros(len(system.elements), dtype=bool)
        anew[: len(self._remade)] = main[self._remade]
        part_of = np.repeat(np.arange(len(anew)), np.diff(system.offsets))
        of_new = _renumbered(anew[part_of], first)
        size = first + int((of_new >= 0).sum())

        def square(a: Triplets, b: sparse.csr_array) -> sparse.csr_array:
            pieces = [a.moved(of_old, of_old), Triplets.of(b).moved(of_new, of_new)]
            return joined(pieces, (size, size))

        rows_old = _renumbered(~np.isin(old.rows.link, list(self._lost)), 0)
        last = int((rows_old >= 0).sum())
        again = system.rows.link < len(self._kept)
        rows_new = np.empty(len(again), dtype=np.intp)
        rows_new[again] = rows_old[np.isin(old.rows.link, self._kept)]
        rows_new[~again] = last + np.arange(int((~again).sum()))
        values = np.concatenate([old.rows.stiffness[rows_old >= 0], system.rows.stiffness[~again]])
        a = joined(
            [base.a.moved(rows_old, of_old), Triplets.of(system.A).moved(rows_new, of_new)],
            (len(values), size),
        )
        elastic = np.isfinite(values)
        held = np.diff(a.indptr) > 0  # rows of other pieces are empty
        soft = a[elastic & held]
        joints = soft.T @ sparse.diags_array(values[elastic & held]) @ soft
        stiffness = sparse.csr_array(square(base.k, system.K) + joints)
        mass = float(self._masses[main].sum())
        measure = sparse.csr_array(square(base.m, system.mass_matrix) / mass)
        count, total = len(stays), len(main)
        of_old_twist = np.arange(6 * count)
        spread = np.full(6 * len(anew), -1)
        spread[: 6 * len(self._remade)] = self._unknowns_of(self._remade)
        rigid = joined(
            [
                base.r.moved(of_old, of_old_twist),
                Triplets.of(system.R).moved(of_new, spread),
            ],
            (size, 6 * total),
        )
        scale = np.tile([base.length] * 3 + [1.0] * 3, total)
        moving = rigid @ (scale[:, None] * self._twists)
        moving = moving[:, np.abs(moving).max(axis=0) > 0.0]
        constraints = a[~elastic & held]
        lift = base.lift.only(self._lifted[base.lifted]).moved(of_old, of_old)
        matrix = stiffness + joined([lift], (size, size)) + SHIFT * base.biggest * measure
        border = measure @ orthonormal(measure, moving)
        inverse = bordered_inverse(sparse.csc_array(matrix), constraints, border, base.biggest)
        start = np.cos(1.2345 * np.arange(size) + 0.5)
        found = lowest_eigenvalue(inverse, stiffness, measure, start)
        if found is not None:
            return found
        # far below the shift, or many alike: the solver of the analysis takes its time
        lifted = base.twists[:, self._lifted]
        lifted.resize((6 * total, lifted.shape[1]))
        small = rigid @ (sparse.diags_array(scale) @ lifted)
        motions = sparse.csc_array(sparse.hstack([small, sparse.csc_array(moving)]))
        motions = sparse.csc_array(motions[:, np.diff(motions.indptr) > 0])
        pairs = elastic_modes(stiffness, measure, constraints, motions, 1)
        return float(pairs.values[0]) if len(pairs.values) else float("inf")


def _renumbered(stays: NDArray[np.bool_], first: int) -> NDArray[np.intp]:
    """Return new numbers, counted from `first`, for what stays; -1 for the rest."""
    return np.where(stays, first + np.cumsum(stays) - 1, -1)


def _independent(columns: Array) -> Array:
    """Return an orthonormal basis of what the columns span."""
    left, sizes, _ = np.linalg.svd(columns, full_matrices=False)
    return np.asarray(left[:, sizes > _DEPENDENT * sizes.max(initial=0.0)])


def _rank(motions: Array, structure: NDArray[np.bool_]) -> int:
    """Return in how many of some orthonormal motions structure moves."""
    rows = motions[np.repeat(structure, 6)]
    return int(np.sum(np.linalg.svd(rows, compute_uv=False) > _STRUCTURE))


def _port_boxes(parts: Sequence[Part]) -> tuple[Array, Array]:
    """Return the lowest and the highest corner of every part's ports (m), (p, 3) each."""
    placed = collect(parts)
    low, high = np.full((len(parts), 3), np.inf), np.full((len(parts), 3), -np.inf)
    reach = np.abs(placed.axis) * placed.half[:, None]
    np.minimum.at(low, placed.part, placed.position - reach)
    np.maximum.at(high, placed.part, placed.position + reach)
    return low, high
