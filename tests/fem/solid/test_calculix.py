"""An independent program: CalculiX on a conforming mesh against the finite cells, within 2 %."""

from __future__ import annotations

import logging
import shutil
from functools import lru_cache
from pathlib import Path

import numpy as np
import pytest
from scipy import linalg, sparse

from technic.fem.solid import MeshSettings, SuperElement, build_super_element
from technic.fem.solid.condense import free_modes, solid_of
from technic.fem.solid.superelement import rigid_motions
from technic.geometry import Array, shift_twist
from technic.units import PITCH
from tests.conftest import IN_CI
from tests.fem.solid import calculix
from tests.fem.solid.conforming import Bricks, liftarm_bricks, wall_frame
from tests.fem.solid.liftarm import ABS, end_stiffness, holes, plain_liftarm

LOG = logging.getLogger(__name__)
MODULES = 3
ENDS = (0, MODULES - 1)
SCALE = np.tile([1.0, 1.0, 1.0, 4e-3, 4e-3, 4e-3], 2)

pytestmark = [
    pytest.mark.slow,
    pytest.mark.skipif(
        shutil.which("ccx") is None and not IN_CI, reason="CalculiX (ccx) is not installed"
    ),
]


@lru_cache(maxsize=1)
def ours() -> SuperElement:
    return build_super_element("liftarm3", plain_liftarm(MODULES), holes(MODULES), ABS)


@lru_cache(maxsize=1)
def bricks() -> Bricks:
    return liftarm_bricks(MODULES)


def centre(hole: int) -> Array:
    return np.array([hole * PITCH, 0.0, 0.0])


def three_nodes(points: Array) -> list[str]:
    """Hold a body at three nodes so that nothing is strained: loads on it balance."""
    a = int(np.argmin(points.sum(axis=1)))
    b = int(np.argmax(points @ [1.0, -0.5, -0.5]))
    c = int(np.argmax(points @ [-0.5, 1.0, -0.5]))
    return ["*BOUNDARY", f"{a + 1},1,3", f"{b + 1},2,3", f"{c + 1},3,3"]


def balanced(points: list[Array]) -> Array:
    """Return a basis of the loads on two frames that balance, (12, 6)."""
    motion = np.concatenate([shift_twist(p) for p in points])
    full, _ = np.linalg.qr(motion * SCALE[:, None], mode="complete")
    return full[:, 6:] * SCALE[:, None]


def test_static_stiffness_of_a_liftarm(tmp_path: Path) -> None:
    mesh = bricks()
    frames = np.concatenate([wall_frame(mesh, hole, centre(hole)) for hole in ENDS])
    basis = balanced([centre(hole) for hole in ENDS])
    lines = calculix.model(mesh.points, mesh.elements, ABS) + three_nodes(mesh.points)
    for load in basis.T:
        lines += ["*STEP", "*STATIC", *calculix.forces(frames.T @ load)]
        lines += ["*NODE PRINT, NSET=ALL", "U", "*END STEP"]
    found = calculix.displacements(calculix.run(lines, tmp_path), len(mesh.points))
    assert len(found) == 6
    flexibility = basis.T @ frames @ np.array(found).T
    flexibility = (flexibility + flexibility.T) / 2.0
    stiffness = basis @ np.linalg.inv(flexibility) @ basis.T
    theirs = end_stiffness(stiffness)
    mine = end_stiffness(ours().stiffness)
    LOG.info("ccx %s, finite cells %s", theirs, mine)
    assert mine == pytest.approx(theirs, rel=0.02)


def test_free_frequencies_of_a_liftarm(tmp_path: Path) -> None:
    mesh = bricks()
    lines = calculix.model(mesh.points, mesh.elements, ABS)
    lines += ["*STEP", "*FREQUENCY", "14", "*END STEP"]
    theirs = calculix.frequencies(calculix.run(lines, tmp_path))
    theirs = theirs[theirs > 10.0][:6]
    solid = solid_of(plain_liftarm(MODULES), ABS, MeshSettings())
    mine = np.sqrt(free_modes(solid, smooth_fields(solid.mesh.points), rounds=6)[0][:6])
    mine = mine / (2.0 * np.pi)
    LOG.info("ccx %s, finite cells %s", theirs, mine)
    assert mine == pytest.approx(theirs, rel=0.02)


def smooth_fields(points: Array) -> Array:
    """Return displacement fields that span low modes: polynomials up to degree four."""
    x = (points - points.mean(axis=0)) / (PITCH, PITCH / 2.0, PITCH / 2.0)
    terms = [
        x[:, 0] ** a * x[:, 1] ** b * x[:, 2] ** c
        for a in range(5)
        for b in range(2)
        for c in range(2)
        if a + b + c >= 1
    ]
    out = np.zeros((len(points), 3, 3 * len(terms)))
    for k, term in enumerate(terms):
        for axis in range(3):
            out[:, axis, 3 * k + axis] = term
    return out.reshape(-1, 3 * len(terms))


SPRINGS = np.array([6e4, 6e4, 3e5, 0.3, 0.3, 0.2])
"""Joint of the two beams: x, y, z (N/m), rotations about them (N m/rad)."""


def second_beam() -> tuple[Array, Array]:
    """Return rotation and shift of a beam lying on the first one's last hole, turned by 90 degrees."""
    return np.array([[0.0, -1.0, 0.0], [1.0, 0.0, 0.0], [0.0, 0.0, 1.0]]), np.array(
        [(MODULES - 1) * PITCH, 0.0, PITCH]
    )


def test_two_beams_and_a_joint_of_springs(tmp_path: Path) -> None:
    # Coarser: every node of a wall is coupled with every other, and CalculiX pays for it.
    mesh = liftarm_bricks(MODULES, around=2, deep=3)
    rotation, shift = second_beam()
    count = len(mesh.points)
    other = mesh.points @ rotation.T + shift
    joint = centre(MODULES - 1) + np.array([0.0, 0.0, PITCH / 2.0])
    points = np.concatenate([mesh.points, other])
    turned = Bricks(other, mesh.elements, mesh.walls)
    first = np.hstack([wall_frame(mesh, MODULES - 1, joint), np.zeros((6, 3 * count))])
    second = np.hstack([np.zeros((6, 3 * count)), wall_frame(turned, 0, joint)])
    far = [centre(0), rotation @ centre(MODULES - 1) + shift]
    loaded = np.concatenate(
        [
            np.hstack([wall_frame(mesh, 0, far[0]), np.zeros((6, 3 * count))]),
            np.hstack([np.zeros((6, 3 * count)), wall_frame(turned, MODULES - 1, far[1])]),
        ]
    )
    # Four extra nodes carry translation and rotation of the two frames; springs join them.
    extra = len(points)
    nodes = np.concatenate([points, np.tile(joint, (4, 1)) + np.arange(4)[:, None] * 1e-3])
    elements = np.concatenate([mesh.elements, mesh.elements + count])
    lines = calculix.model(nodes, elements, ABS)
    for side, frame in enumerate((first, second)):
        for row in range(6):
            terms = [(extra + 2 * side + row // 3, row % 3, -1.0)]
            used = np.nonzero(np.abs(frame[row]) > 1e-9 * np.abs(frame[row]).max())[0]
            terms += [(int(u) // 3, int(u) % 3, float(frame[row, u])) for u in used]
            lines += calculix.equation(terms)
    for row, value in enumerate(SPRINGS):
        axis, kind = row % 3 + 1, row // 3
        lines += [f"*ELEMENT, TYPE=SPRING2, ELSET=S{row}"]
        lines += [f"{len(elements) + 1 + row},{extra + 1 + kind},{extra + 3 + kind}"]
        lines += [f"*SPRING, ELSET=S{row}", f"{axis},{axis}", f"{value:.9e}"]
    basis = balanced(far)
    static = lines + three_nodes(points)
    for load in basis.T:
        static += ["*STEP", "*STATIC", *calculix.forces(loaded.T @ load)]
        static += ["*NODE PRINT, NSET=ALL", "U", "*END STEP"]
    found = calculix.displacements(calculix.run(static, tmp_path), len(nodes))
    theirs = basis.T @ loaded @ np.array(found)[:, : 3 * extra].T

    stiffness, mass = two_super_elements(joint)
    size = len(stiffness)
    load = np.zeros((size, 6))
    load[:6] = basis[:6]
    # The second beam's unknowns are in its own axes.
    turn = np.kron(np.eye(2), rotation)
    load[-6:] = turn.T @ basis[6:]
    motion = np.concatenate(
        [rigid_motions(ours().points, np.zeros(3)), second_rigid(rotation, shift)]
    )
    spring = 1e3 * motion @ np.diag([1, 1, 1, 1e-5, 1e-5, 1e-5]) @ motion.T
    mine = load.T @ np.linalg.solve(stiffness + spring, load)
    # Compared in the directions of the loads: stretch, bend and twist of the pair.
    LOG.info("ccx %s, super-elements %s", np.diag(theirs), np.diag(mine))
    assert np.diag(mine) == pytest.approx(np.diag(theirs), rel=0.02)
    assert np.linalg.eigvalsh(mine) == pytest.approx(
        np.linalg.eigvalsh((theirs + theirs.T) / 2.0), rel=0.02
    )

    modal = [*lines, "*STEP", "*FREQUENCY", "12", "*END STEP"]
    folder = tmp_path / "modal"
    folder.mkdir()
    expected = calculix.frequencies(calculix.run(modal, folder))
    expected = expected[expected > 10.0][:4]
    values = linalg.eigh(stiffness, mass, eigvals_only=True)[6:10]
    condensed = np.sqrt(values) / (2.0 * np.pi)
    LOG.info("ccx %s, super-elements %s", expected, condensed)
    assert condensed == pytest.approx(expected, rel=0.02)


def second_rigid(rotation: Array, shift: Array) -> Array:
    """Return the second beam's unknowns (its own axes) in rigid motions about the origin."""
    points = ours().points @ rotation.T + shift
    world = shift_twist(points)
    return np.concatenate([np.kron(np.eye(2), rotation.T) @ w for w in world])


def two_super_elements(joint: Array) -> tuple[Array, Array]:
    """Return stiffness and mass of two liftarms joined by the springs."""
    element = ours()
    rotation, shift = second_beam()
    size = len(element.stiffness)
    twist = np.zeros((6, 2 * size))
    last = element.points[-1]
    twist[:, size - 6 : size] = shift_twist(joint - last)
    start = rotation @ element.points[0] + shift
    twist[:, size : size + 6] = -shift_twist(joint - start) @ np.kron(np.eye(2), rotation)
    stiffness = sparse.block_diag([element.stiffness] * 2).toarray()
    stiffness += twist.T @ np.diag(SPRINGS) @ twist
    return stiffness, sparse.block_diag([element.mass] * 2).toarray()
