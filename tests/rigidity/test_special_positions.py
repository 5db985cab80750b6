"""Special positions: where counting joints gives the wrong answer, and the literature the right one.

Sources
-------
Bennett 1903, "A new mechanism", Engineering 76. Sarrus 1853, Comptes rendus 36, 1036. Bricard 1897,
"Memoire sur la theorie de l'octaedre articule", J. math. pures appl. 3, 113-148; Bricard 1927, "Lecons de
cinematique" II (six-hinge loops); Baker 1980, Mech. Mach. Theory 15, 267-286 (their closure). Jessen 1967,
"Orthogonal icosahedra", Nordisk Mat. Tidskr. 15, 90-96. Graver, Servatius and Servatius 1993,
"Combinatorial rigidity" (double banana). Cauchy 1813 (convex polyhedra). Dixon 1899, "On certain deformable
frameworks", Messenger of Math. 29, 1-21. Whiteley 1984, "Infinitesimal motions of a bipartite framework",
Pacific J. Math. 110, 233-255 (six points on a conic). Connelly and Whiteley 1996, "Second-order rigidity and
prestress stability for tensegrity frameworks", SIAM J. Discrete Math. 9, 453-491. Pellegrino and Calladine
1986, "Matrix analysis of statically and kinematically indeterminate frameworks", Int. J. Solids Struct. 22,
409-428.
"""

from __future__ import annotations

from itertools import combinations, product

import numpy as np
import pytest

from technic.rigidity.analyze import analyze
from technic.rigidity.result import MotionKind, Verdict
from tests.rigidity import special

FINITE = ("finite", None)
STIFFENS = ("first-order", "stiffens")


def said(model):
    """Return verdict, order and second order of every structural motion."""
    report = analyze(model, modes=1)
    found = [m for m in report.motions if m.kind is MotionKind.STRUCTURAL]
    assert len(found) == report.mobility.structural
    assert (report.verdict is Verdict.FLEXIBLE) == bool(found)
    return sorted(((m.order, m.second_order) for m in found), key=str)


# --- overconstrained loops: joints count to a rigid loop, and it moves -----------------------------


@pytest.mark.parametrize(
    "model",
    [
        special.bennett,
        special.sarrus,
        special.bricard_loop,
        lambda: special.bricard_loop(1.2),
        lambda: special.bricard_loop(1.9),
        special.line_symmetric_octahedron,
        special.double_banana,
    ],
    ids=["Bennett", "Sarrus", "Bricard 90", "Bricard 69", "Bricard 109", "octahedron", "banana"],
)
def test_overconstrained_mechanisms_move(model):
    assert said(model()) == [FINITE]


def test_bennett_needs_its_proportions():
    with pytest.raises(ValueError, match="close"):
        special.bennett(ratio=1.1)


def test_a_skewed_sarrus_linkage_is_rigid():
    assert said(special.sarrus(skewed=0.3)) == []


def test_a_convex_octahedron_is_rigid():
    report = analyze(special.convex_octahedron(), modes=1)
    assert report.verdict is Verdict.RIGID
    assert report.mobility.idle == 12  # every bar turns about itself


# --- shaky, but rigid -------------------------------------------------------------------------------


def test_jessens_icosahedron_shakes_and_stiffens():
    report = analyze(special.jessen(), modes=1)
    assert report.mobility.total == 31  # of which 30 bars that turn about themselves
    assert said(special.jessen()) == [STIFFENS]


def test_a_collinear_triangle():
    points = {"a": (0, 0), "b": (1, 0), "c": (0.3, 0)}
    assert said(special.framework(points, combinations("abc", 2), 2)) == [STIFFENS]
    upright = {**points, "c": (0.3, 0.2)}
    assert said(special.framework(upright, combinations("abc", 2), 2)) == []


def test_a_flat_tetrahedron_in_space():
    points = {"a": (0, 0, 0), "b": (1, 0.1, 0), "c": (0.4, 0.9, 0), "d": (0.5, 0.3, 0)}
    assert said(special.framework(points, combinations("abcd", 2))) == [STIFFENS]
    assert said(special.framework({**points, "d": (0.5, 0.3, 0.2)}, combinations("abcd", 2))) == []


def test_a_flat_tripod():
    # a bar hinged to the ground by a ball turns about itself: three motions that matter to nobody
    flat, upright = said(special.flat_tripod(0.0)), said(special.flat_tripod(0.5))
    assert flat.count(STIFFENS) == 1
    assert STIFFENS not in upright
    assert len(flat) == len(upright) + 1


@pytest.mark.parametrize("unequal", [0.0, 0.3])
def test_two_triangles_joined_by_three_parallel_bars(unequal):
    # equal: they shift along a circle; unequal: the bars are parallel for a moment only (Desargues)
    first = {"a": (0, 0), "b": (1, 0), "c": (0.5, 0.8)}
    grown = {"a": 1.0, "b": 1.0 + unequal, "c": 1.0 - unequal / 2}
    second = {k.upper(): np.add(p, (0.2 * grown[k], grown[k])) for k, p in first.items()}
    edges = [*combinations("abc", 2), *combinations("ABC", 2), *zip("abc", "ABC", strict=True)]
    model = special.framework({**first, **second}, edges, 2)
    assert said(model) == [FINITE if unequal == 0.0 else STIFFENS]


def bipartite(left, right):
    points = {f"l{k}": p for k, p in enumerate(left)} | {f"r{k}": p for k, p in enumerate(right)}
    edges = product([f"l{k}" for k in range(len(left))], [f"r{k}" for k in range(len(right))])
    return special.framework(points, edges, 2)


def test_dixons_mechanism_moves():
    assert said(bipartite([(0.5, 0), (0.9, 0), (-1.1, 0)], [(0, 0.6), (0, -0.8), (0, 1.3)])) == [
        FINITE
    ]


def test_six_points_on_a_conic_shake():
    angles = np.array([0.1, 1.3, 2.0, 2.9, 4.0, 5.3])
    circle = np.column_stack([1.4 * np.cos(angles), np.sin(angles)])
    assert said(bipartite(circle[::2], circle[1::2])) == [STIFFENS]
    off = circle.copy()
    off[0] *= 1.15
    assert said(bipartite(off[::2], off[1::2])) == []


# --- parallelograms ----------------------------------------------------------------------------------


def cranks(*arms):
    """A beam on two or three cranks, one metre apart."""
    feet = {f"f{k}": (k, 0.0) for k in range(len(arms))}
    tips = {f"t{k}": np.add((k, 0.0), arm) for k, arm in enumerate(arms)}
    edges = list(zip(feet, tips, strict=True))
    if len(arms) == 2:
        return special.framework({**feet, **tips}, [*edges, ("t0", "t1")], 2, grounded=feet)
    beam = [("t0", "t1"), ("t0", "t2"), *((tip, "top") for tip in tips)]
    points = {**feet, **tips, "top": (1.0, 2.0)}
    return special.framework(points, [*edges, *beam], 2, grounded=feet)


def test_a_third_parallel_crank_changes_nothing():
    arm = (0.3, 0.8)
    assert said(cranks(arm, arm)) == [FINITE]
    assert said(cranks(arm, arm, arm)) == [FINITE]


def test_a_third_crank_that_is_not_parallel_locks_them():
    assert said(cranks((0.3, 0.8), (0.3, 0.8), (-0.1, 0.8))) == []


def test_a_folded_parallelogram_has_two_ways_out():
    points = {"a": (0, 0), "b": (1, 0), "c": (0.4, 0), "d": (1.4, 0)}
    model = special.framework(points, [("a", "c"), ("c", "d"), ("d", "b")], 2, grounded=("a", "b"))
    found = said(model)
    assert len(found) == 2
    assert FINITE in found
