"""Fine meshes against condensed ones, in an assembly: within 0.5 % for the first ten modes."""

from __future__ import annotations

import logging

import numpy as np
import pytest
from scipy import linalg

from technic.fem.solid import MeshSettings, super_element_to_element
from technic.fem.solid.condense import condense_and_lift, solid_of
from technic.fem.solid.ports import frame_rows, sample_port
from technic.fem.solid.superelement import rigid_motions
from technic.geometry import Array, shift_twist
from technic.units import PITCH
from tests.fem.solid.liftarm import ABS, holes, plain_liftarm

LOG = logging.getLogger(__name__)

BEAMS, MODULES = 6, 5
SPRINGS = np.diag([6.5e4, 6.5e4, 1e6, 0.2, 0.24, 0.24])


def zigzag(stride: int) -> Array:
    """Return the joint rows of parallel beams, each joined to the next at both ends.

    Beam k lies one module above beam k - 1 and two modules along; frames are every `stride`-th hole.
    """
    count = len(range(0, MODULES, stride))
    size = 6 * count * BEAMS
    total = np.zeros((size, size))
    for k in range(BEAMS - 1):
        for hole in (2, 4):
            rows = np.zeros((6, size))
            lower = 6 * (k * count + hole // stride)
            upper = 6 * ((k + 1) * count + (hole - 2) // stride)
            arm = np.array([0.0, 0.0, PITCH / 2.0])
            rows[:, lower : lower + 6] = shift_twist(arm)
            rows[:, upper : upper + 6] = -shift_twist(-arm)
            total += rows.T @ SPRINGS @ rows
    return total


@pytest.mark.slow
def test_condensed_beams_have_the_modes_of_their_fine_meshes() -> None:
    ports = holes(MODULES)
    solid = solid_of(plain_liftarm(MODULES), ABS, MeshSettings(cell=1.2e-3))
    part, lift = condense_and_lift("liftarm5", solid, ports)
    stiffness = np.kron(np.eye(BEAMS), part.stiffness) + zigzag(1)
    mass = np.kron(np.eye(BEAMS), part.mass)
    wanted = slice(6, 16)
    values, modes = linalg.eigh(stiffness, mass)
    condensed = values[wanted]

    # Inverse iteration on the fine meshes, from the condensed modes. A load on a mesh is answered by
    # the frames moving (`lift`) and by the mesh moving under held frames (`inside`).
    frames = np.vstack(
        [frame_rows(solid.mesh, p, sample_port(solid.mesh, p)).toarray() for p in ports]
    )
    motion = rigid_motions(part.points, np.zeros(3))
    spread = motion @ np.linalg.inv(motion.T @ motion) @ solid.rigid.T
    rigid_all = np.concatenate(
        [
            rigid_motions(part.points + np.array([2 * k * PITCH, 0.0, k * PITCH]), np.zeros(3))
            for k in range(BEAMS)
        ]
    )
    fine = [lift @ block for block in np.split(modes[:, 6:20], BEAMS)]
    rigid = [lift @ block for block in np.split(rigid_all, BEAMS)]
    weighed = [solid.apply_mass(r) for r in rigid]
    gram = sum(r.T @ w for r, w in zip(rigid, weighed, strict=True))
    grounded = stiffness + 1e3 * rigid_all @ rigid_all.T
    for _ in range(4):
        loads = [solid.apply_mass(x) for x in fine]
        moved = np.linalg.solve(grounded, np.concatenate([lift.T @ f for f in loads]))
        answers = []
        for load, twist in zip(loads, np.split(moved, BEAMS), strict=True):
            held = solid.factor.solve(load - frames.T @ (spread @ load))
            answers.append(lift @ twist + held - lift @ (frames @ held))
        drift = np.linalg.solve(gram, sum(w.T @ y for w, y in zip(weighed, answers, strict=True)))
        answers = [y - r @ drift for y, r in zip(answers, rigid, strict=True)]
        energy = sum(y.T @ f for y, f in zip(answers, loads, strict=True))
        inertia = sum(y.T @ solid.apply_mass(y) for y in answers)
        exact, turn = linalg.eigh((energy + energy.T) / 2.0, (inertia + inertia.T) / 2.0)
        fine = [y @ turn for y in answers]
    LOG.info("condensed / fine %s", condensed / exact[:10] - 1.0)
    assert condensed == pytest.approx(exact[:10], rel=5e-3)

    # Every second hole only: what `super_element_to_element` keeps for joints at holes 1, 3, 5.
    element, error = super_element_to_element(part, ["hole1", "hole3", "hole5"])
    assert element.size == 18
    reduced = np.kron(np.eye(BEAMS), element.stiffness) + zigzag(2)
    fewer = linalg.eigh(reduced, np.kron(np.eye(BEAMS), element.mass), eigvals_only=True)
    LOG.info("three of five ports (own error %s): %s", error, fewer[wanted] / exact[:10] - 1.0)
    assert fewer[wanted] == pytest.approx(exact[:10], rel=5e-3)
