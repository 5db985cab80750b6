"""The null space by elimination against brute force."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from technic.geometry import axes_from, shift_twist
from technic.rigidity.nullspace import CORE, null_space
from technic.tolerances import MOBILITY_CUT

HELD = {"hinge": [0, 1, 2, 4, 5], "ball": [0, 1, 2], "slider": [1, 2, 3, 4, 5], "fixed": range(6)}


def random_rows(rng, bodies, lattice):
    """Rows of random joints between bodies that are near each other in number."""
    blocks = []
    for b in range(1, bodies):
        for _ in range(rng.integers(1, 4)):
            a = int(rng.integers(max(0, b - 4), b))
            kind = rng.choice(list(HELD))
            if lattice:
                axis = np.eye(3)[rng.integers(3)]
                arms = rng.integers(-3, 4, (2, 3)) / 2
            else:
                axis = rng.normal(size=3)
                arms = rng.normal(size=(2, 3))
            turn = np.kron(np.eye(2), axes_from(axis))
            both = np.hstack([turn @ shift_twist(arms[0]), -turn @ shift_twist(arms[1])])
            blocks.append(((a, b), both[list(HELD[kind])]))
    return blocks


def dense(blocks, bodies):
    out = np.zeros((sum(len(m) for _, m in blocks), 6 * bodies))
    row = 0
    for members, block in blocks:
        for k, b in enumerate(members):
            out[row : row + len(block), 6 * b : 6 * b + 6] += block[:, 6 * k : 6 * k + 6]
        row += len(block)
    return out


@settings(max_examples=40)
@given(seed=st.integers(0, 2**32 - 1), bodies=st.integers(2, 3 * CORE), lattice=st.booleans())
def test_same_nullity_as_brute_force(seed, bodies, lattice):
    rng = np.random.default_rng(seed)
    blocks = random_rows(rng, bodies, lattice)
    matrix = dense(blocks, bodies)
    values = np.linalg.svd(matrix, compute_uv=False)
    values = np.concatenate([values, np.zeros(6 * bodies - len(values))])
    found = null_space(blocks, bodies, 6)
    # random geometry can have singular values anywhere; then neither count is right or wrong
    if np.any((values > 1e-9) & (values < 5 * MOBILITY_CUT)):
        return
    assert found.basis.shape[1] == int(np.sum(values < MOBILITY_CUT))
    assert np.abs(matrix @ found.basis).max(initial=0.0) < 1e-9
    assert np.linalg.matrix_rank(found.basis.toarray()) == found.basis.shape[1]


@pytest.mark.parametrize("length", [10, 100, 400])
def test_a_long_chain_of_fixed_links_stays_rigid(length):
    # the smallest singular value of the whole matrix falls with the square of the length
    turn = np.eye(6)
    link = np.hstack([turn @ shift_twist([0.5, 0, 0]), -turn @ shift_twist([-0.5, 0, 0])])
    found = null_space([((k, k + 1), link) for k in range(length)], length + 1, 6)
    assert found.basis.shape[1] == 6
    assert found.smallest_kept > 10 * MOBILITY_CUT
    assert found.largest_dropped < 1e-12


def test_no_rows_leave_everything_free():
    assert null_space([], 2, 6).basis.shape == (12, 12)
    assert null_space([], CORE + 5, 3).basis.shape == (3 * (CORE + 5), 3 * (CORE + 5))
