"""Rank modulo a prime: against floating point on matrices where that is safe, and on real models."""

from __future__ import annotations

from dataclasses import replace
from fractions import Fraction

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from technic.geometry import Pose
from technic.ldraw.reader import load_ldraw
from technic.rigidity.analyze import analyze
from technic.rigidity.exact import PRIME, modular_rank


def rational_rank(matrix):
    """Rank by elimination in fractions: slow, and beyond doubt."""
    rows = [[Fraction(int(x)) for x in row] for row in matrix]
    rank = 0
    for column in range(len(rows[0]) if rows else 0):
        pivot = next((r for r in range(rank, len(rows)) if rows[r][column]), None)
        if pivot is None:
            continue
        rows[rank], rows[pivot] = rows[pivot], rows[rank]
        for r in range(rank + 1, len(rows)):
            factor = rows[r][column] / rows[rank][column]
            rows[r] = [a - factor * b for a, b in zip(rows[r], rows[rank], strict=True)]
        rank += 1
    return rank


@settings(max_examples=40)
@given(seed=st.integers(0, 2**32 - 1), bodies=st.integers(2, 6))
def test_rank_of_whole_matrices(seed, bodies):
    rng = np.random.default_rng(seed)
    blocks, dense = [], []
    for _ in range(int(rng.integers(1, 2 * bodies))):
        pair = tuple(int(b) for b in rng.choice(bodies, 2, replace=False))
        block = rng.integers(-3, 4, (int(rng.integers(1, 7)), 12))
        block[rng.random(block.shape) < 0.5] = 0
        blocks.append((pair, block % PRIME))
        rows = np.zeros((len(block), 6 * bodies), dtype=int)
        for k, b in enumerate(pair):
            rows[:, 6 * b : 6 * b + 6] = block[:, 6 * k : 6 * k + 6]
        dense.append(rows)
    assert modular_rank(blocks) == rational_rank(np.vstack(dense))


@pytest.mark.parametrize("name", ["triangle.ldr", "square.ldr", "cube7.ldr", "fll_robot.mpd"])
def test_models_on_the_lattice_are_proved(model, name):
    report = analyze(load_ldraw(model(name)))
    assert report.mobility.proof == "exact"


def test_a_model_off_the_lattice_is_not(model):
    assembly = load_ldraw(model("triangle.ldr"))
    turn = np.array([[np.cos(0.3), -np.sin(0.3), 0], [np.sin(0.3), np.cos(0.3), 0], [0, 0, 1]])
    pose = Pose(turn, np.zeros(3))
    joints = tuple(
        replace(j, point=pose.points(j.point), axes=pose.directions(j.axes))
        for j in assembly.joints
    )
    parts = tuple(replace(p, pose=pose @ p.pose) for p in assembly.parts)
    report = analyze(replace(assembly, parts=parts, joints=joints))
    assert report.mobility.proof == "numerical"
    assert report.mobility.total == 3
