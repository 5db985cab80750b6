"""The paper's own discretisation: springs without units, joints held rigidly on two nodes of each bar.

It answers one question: does the program, given the paper's discretisation, come to the paper's values?
``analyze(assembly, measure="nodal", parts=PaperBars())`` gives Fig. 12 (a1) to (a4), and with
``PaperBars(by_length=True)`` Table 1 of Fig. 10 (b); the other models' units and meshes are not published.
"""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from technic.assembly.model import Assembly, Part
from technic.errors import UsageError
from technic.fem.element import Element
from technic.fem.paper_bar import paper_bar
from technic.geometry import Array
from technic.parts.definition import FrameBody
from technic.system.paper import rigid_displacements
from technic.system.part_models import ElementFactory

__all__ = ["PaperBars", "paper_elements", "paper_joints"]

FEWEST = 2
"""Stations of the shortest bar when stations are shared out by length."""

PLANE = np.array([0, 1, 5])
"""Motions of a twist that stay in the plane z = 0."""


@dataclass(frozen=True, slots=True)
class PaperBars:
    """How the paper divides the bars of its two-dimensional linkages.

    Parameters
    ----------
    unit : float
        Metres per unit of length of the paper's model. Springs have no unit: nor has the rigidity.
    stations : int
        Pairs of nodes per bar.
    thickness : float
        Of the bars, in the paper's units.
    by_length : bool
        True to give longer bars more stations, so that `stations` is the mean (as in Fig. 10 (b)).
    """

    unit: float = 0.01
    stations: int = 5
    thickness: float = 0.3
    by_length: bool = False


def paper_joints(assembly: Assembly) -> Assembly:
    """Return the assembly with every joint held rigidly, as the paper's null spaces hold them."""
    stiffness = np.full(6, np.inf)
    joints = tuple(replace(joint, stiffness=stiffness) for joint in assembly.joints)
    return replace(assembly, joints=joints)


def paper_elements(assembly: Assembly, recipe: PaperBars) -> ElementFactory:
    """Return what makes the elements of a two-dimensional linkage of straight bars.

    A joint takes hold of the two nodes of a bar that are nearest to it: of their rigid motion, not of their
    deformation, as the null space of ``A_allow`` does (`technic.system.paper`). A support takes hold of the
    nearest node.

    Raises
    ------
    UsageError
        The assembly is not two-dimensional, or a part is no straight bar.
    """
    if assembly.dimension != 2:
        raise UsageError("the paper's bars are two-dimensional")
    for part in assembly.parts:
        if not isinstance(part.body, FrameBody) or len(part.shape.get("points", ())) != 2:
            raise UsageError(f"part {part.id!r} is no straight bar")
    lengths = np.array([np.linalg.norm(np.subtract(*_ends(part))) for part in assembly.parts])
    stations = np.full(len(lengths), recipe.stations)
    if recipe.by_length:
        stations = np.maximum(FEWEST, np.rint(lengths / lengths.mean() * recipe.stations)).astype(
            np.int64
        )
    number = {id(part): k for k, part in enumerate(assembly.parts)}
    joints = np.bincount(
        [p for joint in assembly.joints for p in joint.parts], minlength=len(assembly.parts)
    )

    def element(part: Part, points: Array, _ports: tuple[str | None, ...]) -> Element:
        k = number[id(part)]
        return _bar(part, points, int(joints[k]), int(stations[k]), recipe)

    return element


def _ends(part: Part) -> tuple[Array, Array]:
    assert isinstance(part.body, FrameBody)
    return part.body.points[0], part.body.points[-1]


def _bar(part: Part, points: Array, joints: int, stations: int, recipe: PaperBars) -> Element:
    """Return the strip of springs of one bar; attachments are joints first, then supports."""
    p, q = _ends(part)
    strip = paper_bar(p / recipe.unit, q / recipe.unit, stations, recipe.thickness)
    nodes = strip.node_points * recipe.unit
    frames = np.zeros((len(points), 6, strip.size))
    for k, at in enumerate(points):
        # Nodes in pairs lie equally far from most joints. Which of them is taken changes the value by a
        # per mille; rounding decides, as in the paper's computation.
        near = np.argsort(np.linalg.norm(nodes - at, axis=1), kind="stable")
        if k < joints:
            follow = np.linalg.pinv(rigid_displacements(nodes[near[:2]], at, 2)[:, PLANE])
            frames[np.ix_(np.array([k]), PLANE, _unknowns(near[:2]))] = follow
        else:
            frames[np.ix_(np.array([k]), PLANE[:2], _unknowns(near[:1]))] = np.eye(2)
    mass = part.mass_properties
    return replace(
        strip,
        mass=np.eye(strip.size) * (mass.mass / len(nodes)),
        rigid=rigid_displacements(nodes, mass.centroid, 2),
        frames=frames,
        frame_points=points,
        node_points=nodes,
    )


def _unknowns(nodes: NDArray[np.int64]) -> NDArray[np.int64]:
    return (2 * nodes[:, None] + np.arange(2)).ravel()
