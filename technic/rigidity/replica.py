"""The paper's numbers, computed the paper's way: springs without units, nodal measure, null spaces.

It answers one question: does the program, given the paper's discretisation, come to the paper's values?
Fig. 12 (a1) to (a4) and Table 1 of Fig. 10 (b) can be checked that way; the other models' units and meshes
are not published.
"""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np
from scipy import linalg

from technic.assembly.model import Assembly
from technic.errors import UsageError
from technic.fem.element import Element
from technic.fem.paper_bar import paper_bar
from technic.geometry import Array
from technic.parts.definition import FrameBody
from technic.rigidity.kinematics import component_motions, kinematics
from technic.system.paper import allowed_motions, held_combinations

__all__ = ["Replica", "replicate"]

FEWEST = 2
"""Stations of the shortest bar when stations are shared out by length."""


@dataclass(frozen=True, slots=True)
class Replica:
    """What the paper's discretisation gives.

    Parameters
    ----------
    value : float
        Smallest eigenvalue, in the paper's units; exactly 0 when the assembly can move.
    nodes : int
    """

    value: float
    nodes: int


def replicate(
    assembly: Assembly,
    *,
    unit: float = 0.01,
    stations: int = 5,
    thickness: float = 0.3,
    by_length: bool = False,
) -> Replica:
    """Return the paper's rigidity of a two-dimensional linkage of straight bars.

    Parameters
    ----------
    assembly : Assembly
        Bars joined in any way, in two dimensions. Supports hold the node nearest to their point.
    unit : float
        Metres per unit of length of the paper's model.
    stations : int
        Pairs of nodes per bar.
    thickness : float
        Of the bars, in the paper's units.
    by_length : bool
        True to give longer bars more stations, so that `stations` is the mean (as in Fig. 10 (b)).

    Raises
    ------
    UsageError
        The assembly is not two-dimensional, or a part is no straight bar.
    """
    ends = _ends(assembly, unit)
    counts = [stations] * len(ends)
    if by_length:
        lengths = np.array([np.linalg.norm(q - p) for p, q in ends])
        share = lengths.sum() / (stations * len(ends))
        counts = [max(FEWEST, int(np.rint(length / share))) for length in lengths]
    bars = [paper_bar(p, q, n, thickness) for (p, q), n in zip(ends, counts, strict=True)]
    offsets = np.concatenate([[0], np.cumsum([bar.size for bar in bars])]).astype(int)
    nodes = int(offsets[-1]) // 2
    kin = kinematics(assembly)
    moves = sum(component_motions(kin, c).internal for c in range(len(kin.components)))
    if moves or len(kin.components) > 1:
        return Replica(0.0, nodes)
    held = [_joint_rows(assembly, k, unit, bars, offsets) for k in range(len(assembly.joints))]
    for support in assembly.supports:
        bar, start = bars[support.part], int(offsets[support.part])
        point = assembly.parts[support.part].centroid if support.point is None else support.point
        node = int(np.argmin(_gaps(bar, np.asarray(point) / unit)))
        rows = np.zeros((2, int(offsets[-1])))
        rows[[0, 1], [start + 2 * node, start + 2 * node + 1]] = 1.0
        held.append(rows[np.asarray(support.held[:2])])
    if not assembly.supports:
        held.append(_rigid_motions(bars))
    space = linalg.null_space(np.vstack(held))
    stiffness = linalg.block_diag(*[bar.stiffness for bar in bars])
    values = np.linalg.eigvalsh(space.T @ stiffness @ space)
    return Replica(float(values[0]), nodes)


def _ends(assembly: Assembly, unit: float) -> list[tuple[Array, Array]]:
    if assembly.dimension != 2:
        raise UsageError("the paper's bars are two-dimensional")
    ends = []
    for part in assembly.parts:
        corners = len(part.shape.get("points", ()))
        if not isinstance(part.body, FrameBody) or corners != 2:
            raise UsageError(f"part {part.id!r} is no straight bar")
        p, q = part.pose.points(part.body.points[[0, -1]])
        ends.append((p / unit, q / unit))
    return ends


def _gaps(bar: Element, at: Array) -> Array:
    # Nodes in pairs lie equally far from most joints. Which of them is taken changes the value by a
    # per mille; rounding decides, as in the paper's computation.
    return np.asarray(np.linalg.norm(bar.node_points - at, axis=1))


def _joint_rows(
    assembly: Assembly, link: int, unit: float, bars: list[Element], offsets: Array
) -> Array:
    """Return the null space of ``A_allow^T`` of the two nearest nodes of both bars."""
    joint = assembly.joints[link]
    at = joint.point / unit
    chosen = [np.argsort(_gaps(bars[p], at), kind="stable")[:2] for p in joint.parts]
    points = [bars[p].node_points[own] for p, own in zip(joint.parts, chosen, strict=True)]
    rows = held_combinations(allowed_motions(replace(joint, point=at), points[0], points[1], 2))
    columns = np.concatenate(
        [
            int(offsets[p]) + (2 * own[:, None] + np.arange(2)).ravel()
            for p, own in zip(joint.parts, chosen, strict=True)
        ]
    )
    out = np.zeros((len(rows), int(offsets[-1])))
    out[:, columns] = rows
    return out


def _rigid_motions(bars: list[Element]) -> Array:
    """Return the motions of the whole in its plane, as rows."""
    points = np.vstack([bar.node_points for bar in bars])
    rows = np.zeros((3, 2 * len(points)))
    rows[0, 0::2] = rows[1, 1::2] = 1.0
    rows[2, 0::2], rows[2, 1::2] = -points[:, 1], points[:, 0]
    return rows
