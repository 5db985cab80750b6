"""A model with something added: which parts and joints stay, and the matrices of what is made anew."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from typing import TYPE_CHECKING, Final

import numpy as np
from numpy.typing import NDArray
from scipy import sparse

from technic.assembly.model import Joint, Part
from technic.design.lowest import lowest_eigenvalue
from technic.design.triplets import Triplets, joined, renumbered
from technic.geometry import Array
from technic.groups import connected_groups
from technic.rigidity.eigen import elastic_modes
from technic.system.assemble import assemble
from technic.system.inverse import SHIFT, bordered_inverse, orthonormal
from technic.tolerances import MOBILITY_CUT

if TYPE_CHECKING:
    from technic.design.reanalysis import Reanalysis

__all__ = ["Remade"]

_DEPENDENT: Final = 1e-8
"""Singular value below which columns of a basis say nothing new."""

_STRUCTURE: Final = 1e-3
"""Share of a motion that parts of structure must take for it to count."""


class Remade:
    """One reinforced model: which parts and joints stay, and the matrices of what is made anew."""

    def __init__(
        self, base: Reanalysis, new: Sequence[Part], joints: Sequence[Joint], gone: frozenset[int]
    ) -> None:
        self._base = base
        assembly = base.assembly
        count, linked = len(assembly.parts), len(assembly.joints)
        lost = {k for g in gone for k in base.links_of[g]}
        touched = {p for j in joints for p in j.parts if p < count}
        touched |= {p for k in lost if k < linked for p in assembly.joints[k].parts}
        touched -= gone
        kept = sorted({k for p in touched for k in base.links_of[p]} - lost)
        own = [assembly.joints[k] for k in kept if k < linked]
        ends = {p for joint in own for p in joint.parts} - touched
        remade = [*sorted(touched), *range(count, count + len(new))]
        place = {p: n for n, p in enumerate([*remade, *sorted(ends)])}
        every = [*(assembly.parts[p] for p in sorted(touched)), *new]
        every += [base.as_neighbor(p) for p in sorted(ends)]
        local = [replace(j, parts=(place[j.parts[0]], place[j.parts[1]])) for j in [*own, *joints]]
        supports = [assembly.supports[k - linked] for k in kept if k >= linked]
        self._system = assemble(
            replace(
                assembly,
                parts=tuple(every),
                joints=tuple(local),
                supports=tuple(replace(s, part=place[s.part]) for s in supports),
                findings=(),
            ),
            element=base.element,
        )
        link = self._system.rows.link
        self._fresh = (link >= len(own)) & (link < len(local))
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
        own = (6 * np.arange(total - count)[:, None] + base.dofs).ravel()
        forms = np.hstack([c[:, : len(rows)] @ affected[rows], c[:, len(rows) :][:, own]])
        _, sizes, turn = np.linalg.svd(forms)
        free = turn[int(np.sum(sizes > MOBILITY_CUT)) :].T
        after = np.zeros((6 * total, free.shape[1]))
        after[: 6 * count] = affected @ free[: affected.shape[1]]
        after[6 * count + own] = free[affected.shape[1] :]
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
        mine = self._fresh
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
        of_old = renumbered(stays[base.part_of], 0)
        first = int((of_old >= 0).sum())
        anew = np.zeros(len(system.elements), dtype=bool)
        anew[: len(self._remade)] = main[self._remade]
        part_of = np.repeat(np.arange(len(anew)), np.diff(system.offsets))
        of_new = renumbered(anew[part_of], first)
        size = first + int((of_new >= 0).sum())

        def square(a: Triplets, b: sparse.csr_array) -> sparse.csr_array:
            pieces = [a.moved(of_old, of_old), Triplets.of(b).moved(of_new, of_new)]
            return joined(pieces, (size, size))

        rows_old = renumbered(~np.isin(old.rows.link, list(self._lost)), 0)
        last = int((rows_old >= 0).sum())
        again = ~self._fresh
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


def _independent(columns: Array) -> Array:
    """Return an orthonormal basis of what the columns span."""
    left, sizes, _ = np.linalg.svd(columns, full_matrices=False)
    return np.asarray(left[:, sizes > _DEPENDENT * sizes.max(initial=0.0)])


def _rank(motions: Array, structure: NDArray[np.bool_]) -> int:
    """Return in how many of some orthonormal motions structure moves."""
    rows = motions[np.repeat(structure, 6)]
    return int(np.sum(np.linalg.svd(rows, compute_uv=False) > _STRUCTURE))
