"""An assembly whose vertices move: its matrices as functions of their positions, vectorised.

The same matrices as `technic.system.assemble` gives for the moved assembly (a test compares them), made
without meshing anew: which node hangs on which stretch, and where, never changes.
"""

from __future__ import annotations

import itertools
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
from scipy import sparse

from technic.assembly.joint_types import JointType
from technic.assembly.model import Assembly, Support
from technic.assembly.shapes import make_shape
from technic.design.optimize.pieces import (
    Index,
    Matrices,
    Members,
    Sides,
    Trusses,
    add_blocks,
    sides_of,
    turn_of,
)
from technic.design.optimize.vertices import Geometry
from technic.errors import UsageError
from technic.fem.frame import local_mass, local_stiffness, subdivide
from technic.geometry import Array, shift_twist, turn_twist
from technic.parts.definition import FrameBody, Material, Section, TrussBody
from technic.system.assemble import System, assemble

__all__ = ["Model", "moved"]


class Model:
    """The parts, nodes and links of an assembly, ready to be evaluated at any positions.

    Parameters
    ----------
    assembly : Assembly
        Bars in world coordinates, as an assembly file gives them.
    geometry : Geometry

    Raises
    ------
    UsageError
        A bar is placed by a pose.
    """

    def __init__(self, assembly: Assembly, geometry: Geometry) -> None:
        self.assembly, self.geometry = assembly, geometry
        self.system: System = assemble(assembly)
        self.size = self.system.size
        joints, supports = assembly.joints, assembly.supports
        self.owners = [j.parts for j in joints] + [(s.part,) for s in supports]
        self._attach()
        self._collect()
        self._constants()
        self._rows()

    # --- structure ----------------------------------------------------------------------------
    def _attach(self) -> None:
        """Number the attachments of each part as `assemble` does."""
        count = len(self.assembly.parts)
        self.points: list[list[Array]] = [[] for _ in range(count)]
        self.slots: list[list[tuple[int, int]]] = []
        base = self.geometry.link_points @ self.geometry.positions
        for k, owner in enumerate(self.owners):
            row = []
            for p in owner:
                local = self.assembly.parts[p].pose.to_local(base[k])
                self.points[p].append(local.round(9) + 0.0)
                row.append((p, len(self.points[p]) - 1))
            self.slots.append(row)

    def _collect(self) -> None:
        plane = self.assembly.dimension == 2
        keep = np.array([0, 1, 5]) if plane else np.arange(6)
        node_dof = np.full(6, -1)
        node_dof[keep] = np.arange(len(keep))
        groups: dict[tuple[Section, Material], list[Any]] = {}
        weights: list[dict[int, float]] = []
        self.node_of: dict[int, tuple[list[int], list[int]]] = {}
        self.truss_of: dict[int, int] = {}
        truss_rows: list[Any] = []
        node_dofs: list[Index] = []
        for p, part in enumerate(self.assembly.parts):
            if p not in self.geometry.corners:
                continue
            if not np.array_equal(part.pose.rotation, np.eye(3)) or part.pose.translation.any():
                raise UsageError(f"bar {part.id} is placed by a pose: save the assembly and reload")
            offset = int(self.system.offsets[p])
            own = self.geometry.corners[p]
            if isinstance(part.body, TrussBody):
                keep7 = np.array([0, 1, -1, 2, 3, -1, -1]) if plane else np.arange(7)
                self.truss_of[p] = len(truss_rows)
                dofs = np.where(keep7 >= 0, keep7 + offset, -1)
                truss_rows.append((own, part.body.area, part.body.material, dofs))
                continue
            body = part.body
            assert isinstance(body, FrameBody)  # corners are of bars only
            points = np.array(self.points[p]).reshape(-1, 3)
            nodes, pairs, member_of, node_of = subdivide(body, points)
            first = len(weights)
            local: list[dict[int, float]] = [{} for _ in nodes]
            for k, v in enumerate(own):
                local[k] = {v: 1.0}
            for (i, j), m in zip(pairs, member_of, strict=True):
                a, b = own[m], own[m + 1]
                start, span = body.points[m], body.points[m + 1] - body.points[m]
                for n in (i, j):
                    if not local[n]:
                        t = float((nodes[n] - start) @ span / (span @ span))
                        local[n] = {a: 1.0 - t, b: t}
                key = (body.sections[m], body.material)
                groups.setdefault(key, []).append((first + i, first + j, body.normals[m]))
            weights += local
            for n in range(len(nodes)):
                base = np.where(node_dof >= 0, node_dof + offset + len(keep) * n, -1)
                node_dofs.append(base)
            self.node_of[p] = ([first + n for n in node_of], list(range(first, first + len(nodes))))
        count = len(self.geometry.names)
        matrix = sparse.lil_array((len(weights), count))
        for k, row in enumerate(weights):
            for v, weight in row.items():
                matrix[k, v] = weight
        self.nodes = sparse.csr_array(matrix)
        self.node_dofs = np.array(node_dofs, dtype=np.int64).reshape(-1, 6)
        self.members = []
        for (section, material), rows in groups.items():
            start_nodes = np.array([r[0] for r in rows], dtype=np.int64)
            end_nodes = np.array([r[1] for r in rows], dtype=np.int64)
            dofs = np.hstack([self.node_dofs[start_nodes], self.node_dofs[end_nodes]])
            normals = np.array([r[2] for r in rows])
            self.members.append(Members(start_nodes, end_nodes, normals, section, material, dofs))
        self.trusses = Trusses(
            np.array([r[0][0] for r in truss_rows], dtype=np.int64),
            np.array([r[0][1] for r in truss_rows], dtype=np.int64),
            np.array([r[1] for r in truss_rows]),
            tuple(r[2] for r in truss_rows),
            np.array([r[3] for r in truss_rows], dtype=np.int64).reshape(-1, 7),
        )

    def _constants(self) -> None:
        """Keep stiffness and mass of the parts that do not change."""
        still = [p for p in range(len(self.assembly.parts)) if p not in self.geometry.corners]
        mask = np.zeros(self.size)
        for p in still:
            mask[self.system.part_slice(p)] = 1.0
        pick = sparse.diags_array(mask)
        self.still_stiffness = sparse.csr_array(pick @ self.system.K)
        self.still_mass = sparse.csr_array(pick @ self.system.mass_matrix)
        self.still_kg = sum(self.assembly.parts[p].mass_properties.mass for p in still)

    def _rows(self) -> None:
        rows = self.system.rows
        self.held_link, self.held_motion = rows.link, rows.motion
        self.elastic = self.system.elastic
        self.springs = np.where(self.elastic, rows.stiffness, 0.0)
        kinds: dict[str, list[Any]] = {"frame": [], "truss": [], "still": []}
        self.maps: list[Array] = []
        self.origins: list[Array] = []
        for k, row in enumerate(self.slots):
            for side, (p, slot) in enumerate(row):
                sign = -1.0 if side else 1.0
                if p in self.node_of:
                    node = self.node_of[p][0][slot]
                    kinds["frame"].append((k, sign, node, 0.0, self.node_dofs[node]))
                elif p in self.truss_of:
                    bar = self.truss_of[p]
                    start, end = self.assembly.parts[p].body.points  # type: ignore[union-attr]
                    span = end - start
                    at = float(np.clip((self.points[p][slot] - start) @ span / (span @ span), 0, 1))
                    kinds["truss"].append((k, sign, bar, at, self.trusses.dofs[bar]))
                else:
                    element = self.system.elements[p]
                    pose = self.assembly.parts[p].pose
                    kinds["still"].append((k, sign, len(self.maps), 0.0, self.system.part_slice(p)))
                    self.maps.append(turn_twist(pose.rotation) @ element.frames[slot])
                    self.origins.append(pose.points(element.frame_points[slot]))
        self.frame_sides = sides_of(kinds["frame"], 6)
        self.truss_sides = sides_of(kinds["truss"], 7)
        self.still_sides = kinds["still"]
        starts = np.searchsorted(rows.link, np.arange(len(self.owners) + 1))
        self.row_range = [(int(a), int(b)) for a, b in itertools.pairwise(starts)]
        self.frame_scatter = self._scatter(self.frame_sides)
        self.truss_scatter = self._scatter(self.truss_sides)

    def _scatter(self, sides: Sides) -> tuple[Index, Index, Index, Index]:
        """Return, for the entries of A from these sides: side, motion, row and column slot."""
        out = []
        for s, link in enumerate(sides.link):
            a, b = self.row_range[int(link)]
            for r in range(a, b):
                motion = int(self.held_motion[r])
                out += [
                    (s, motion, r, c) for c in range(sides.dofs.shape[1]) if sides.dofs[s, c] >= 0
                ]
        table = np.array(out, dtype=np.int64).reshape(-1, 4)
        return table[:, 0], table[:, 1], table[:, 2], table[:, 3]

    # --- evaluation ---------------------------------------------------------------------------
    def axes(self, positions: Array) -> Array:
        """Return every link's own axes in world coordinates, (links, 3, 3)."""
        joints = self.assembly.joints
        out = np.array([j.axes for j in joints] + [np.eye(3)] * len(self.assembly.supports))
        for k, (a, b) in self.geometry.lines.items():
            out[k] = self.followed(k, positions[b] - positions[a])
        return out.reshape(-1, 3, 3)

    def followed(self, joint: int, direction: Array) -> Array:
        """Return a sliding joint's axes for a new direction, which may be complex."""
        d = direction / np.sqrt(np.sum(direction * direction))
        before = self.assembly.joints[joint]
        if before.type is JointType.SLOT:
            normal = before.axes[2]
            first = np.cross(d, normal)
            first = first / np.sqrt(np.sum(first * first))
            return np.array([first, d, np.cross(first, d)])
        # the helper that the axes were made with: the same one, so that they turn without a jump
        helper = np.zeros(3)
        helper[np.argmin(np.abs(before.axes[0]).round(9))] = 1.0
        b = np.cross(d, helper)
        b = b / np.sqrt(np.sum(b * b))
        return np.array([d, b, np.cross(d, b)])

    def truss_turn(self, spans: Array) -> Array:
        """Return what turns [u_p, u_q, spin] of truss bars into rotations, (t, 3, 7)."""
        from technic.design.optimize.gradient import skew_of

        square = np.sum(spans * spans, axis=1)
        lever = skew_of(spans / square[:, None])
        d = spans / np.sqrt(square)[:, None]
        return np.concatenate([-lever, lever, d[:, :, None]], axis=2)

    def joint_rows(self, positions: Array) -> sparse.csr_array:
        """Return ``A``."""
        axes = self.axes(positions)
        turn = np.zeros((len(axes), 6, 6))
        turn[:, :3, :3] = turn[:, 3:, 3:] = axes
        at = self.geometry.link_points @ positions
        data, rows, columns = [], [], []
        s = self.frame_sides
        if len(s.link):
            arms = at[s.link] - self.nodes[s.owner] @ positions
            blocks = s.sign[:, None, None] * (turn[s.link] @ shift_twist(arms))
            side, motion, row, column = self.frame_scatter
            data.append(blocks[side, motion, column])
            rows.append(row)
            columns.append(s.dofs[side, column])
        s = self.truss_sides
        if len(s.link):
            bars = self.trusses
            p, q = positions[bars.first[s.owner]], positions[bars.last[s.owner]]
            w = np.zeros((len(s.link), 6, 7))
            w[:, :3, :3] = (1.0 - s.share)[:, None, None] * np.eye(3)
            w[:, :3, 3:6] = s.share[:, None, None] * np.eye(3)
            w[:, 3:] = self.truss_turn(q - p)
            arms = at[s.link] - (p + s.share[:, None] * (q - p))
            blocks = s.sign[:, None, None] * (turn[s.link] @ shift_twist(arms) @ w)
            side, motion, row, column = self.truss_scatter
            data.append(blocks[side, motion, column])
            rows.append(row)
            columns.append(s.dofs[side, column])
        for link, sign, number, _, own in self.still_sides:
            first, last = self.row_range[link]
            shift = shift_twist(at[link] - self.origins[number])
            block = sign * (turn[link] @ shift @ self.maps[number])
            block = block[self.held_motion[first:last]]
            width = own.stop - own.start
            data.append(block.ravel())
            rows.append(np.repeat(np.arange(first, last), width))
            columns.append(np.tile(np.arange(own.start, own.stop), last - first))
        shape = (len(self.held_link), self.size)
        if not data:
            return sparse.csr_array(shape)
        place = (np.concatenate(rows), np.concatenate(columns))
        return sparse.csr_array((np.concatenate(data), place), shape=shape)

    def matrices(self, positions: Array) -> Matrices:
        """Return the matrices at some positions of the vertices."""
        nodes = self.nodes @ positions
        stiff: list[tuple[Array, Index]] = []
        heavy: list[tuple[Array, Index]] = []
        mass = self.still_kg
        for g in self.members:
            spans = nodes[g.last] - nodes[g.first]
            lengths = np.linalg.norm(spans, axis=1)
            mass += g.material.density * g.section.area * float(lengths.sum())
            turn = np.zeros((len(spans), 12, 12))
            axes = turn_of(spans, g.normals)
            for c in range(4):
                turn[:, 3 * c : 3 * c + 3, 3 * c : 3 * c + 3] = axes
            back = np.swapaxes(turn, 1, 2)
            stiff.append((back @ local_stiffness(lengths, g.section, g.material) @ turn, g.dofs))
            heavy.append((back @ local_mass(lengths, g.section, g.material) @ turn, g.dofs))
        bars = self.trusses
        if len(bars.first):
            spans = positions[bars.last] - positions[bars.first]
            lengths = np.linalg.norm(spans, axis=1)
            young = np.array([m.young_pa for m in bars.materials])
            kg = np.array([m.density for m in bars.materials]) * bars.areas * lengths
            mass += float(kg.sum())
            axial = (young * bars.areas / lengths**3)[:, None, None] * (
                spans[:, :, None] * spans[:, None, :]
            )
            k = np.zeros((len(spans), 7, 7))
            k[:, :3, :3] = k[:, 3:6, 3:6] = axial
            k[:, :3, 3:6] = k[:, 3:6, :3] = -axial
            m = np.zeros((len(spans), 7, 7))
            m[:, :6, :6] = kg[:, None, None] / 6.0 * np.kron([[2.0, 1.0], [1.0, 2.0]], np.eye(3))
            m[:, 6, 6] = kg * bars.areas / (2.0 * np.pi)
            stiff.append((k, bars.dofs))
            heavy.append((m, bars.dofs))
        rows = self.joint_rows(positions)
        soft = rows if self.elastic.all() else rows[self.elastic]
        weighted = soft.copy()
        weighted.data *= np.repeat(self.springs[self.elastic], np.diff(soft.indptr))
        stiffness = add_blocks(stiff, self.size) + soft.T.tocsr() @ weighted
        measure = add_blocks(heavy, self.size)
        if self.still_stiffness.nnz or self.still_mass.nnz:
            stiffness, measure = stiffness + self.still_stiffness, measure + self.still_mass
        measure.data /= mass
        return Matrices(
            stiffness,
            measure,
            rows[~self.elastic],
            rows,
            mass,
        )

    def rigid_motions(self, positions: Array) -> Array:
        """Return the unknowns when every part moves by a twist about the world's origin, (n, 6)."""
        out = np.zeros((self.size, 6))
        nodes = self.nodes @ positions
        blocks = shift_twist(nodes)
        keep = self.node_dofs >= 0
        out[self.node_dofs[keep]] = blocks[keep]
        bars = self.trusses
        if len(bars.first):
            block = np.zeros((len(bars.first), 7, 6))
            block[:, :3] = shift_twist(positions[bars.first])[:, :3]
            block[:, 3:6] = shift_twist(positions[bars.last])[:, :3]
            spans = positions[bars.last] - positions[bars.first]
            block[:, 6, 3:] = spans / np.linalg.norm(spans, axis=1, keepdims=True)
            keep = bars.dofs >= 0
            out[bars.dofs[keep]] = block[keep]
        for p, part in enumerate(self.assembly.parts):
            if p not in self.geometry.corners:
                own = self.system.part_slice(p)
                about = self.system.R[own, 6 * p : 6 * p + 6].toarray()
                out[own] = about @ shift_twist(part.centroid)
        return out


def moved(model: Model, positions: Array) -> Assembly:
    """Return the assembly with its vertices at new positions."""
    assembly, geometry = model.assembly, model.geometry
    parts = list(assembly.parts)
    for p, own in geometry.corners.items():
        body = parts[p].body
        assert isinstance(body, FrameBody | TrussBody)  # corners are of bars only
        points = positions[list(own)]
        shape = {**parts[p].shape, "points": points.tolist()}
        made = make_shape(shape, body.material, assembly.dimension, (), Path())
        new = made.body
        if isinstance(body, FrameBody) and isinstance(new, FrameBody):
            # the width keeps its direction, also where a bar turns past the upright
            new = replace(new, normals=body.normals)
        parts[p] = replace(parts[p], body=new, mass_properties=made.mass_properties, shape=shape)
    at = geometry.link_points @ positions
    axes = model.axes(positions)
    joints = tuple(replace(j, point=at[k], axes=axes[k]) for k, j in enumerate(assembly.joints))
    supports = tuple(
        s if s.point is None else Support(s.part, at[len(joints) + k], s.held)
        for k, s in enumerate(assembly.supports)
    )
    return replace(assembly, parts=tuple(parts), joints=joints, supports=supports, source={})
