"""The shipped demo model: 153 bricks, rigid, soft in twist, and nothing in it that could not be built."""

from __future__ import annotations

import subprocess
import sys
from collections import Counter
from itertools import combinations
from pathlib import Path

import numpy as np
import pytest
from numpy.typing import NDArray

from technic.assembly.model import Assembly
from technic.geometry import Array
from technic.loading import load
from technic.parts.definition import PortKind
from technic.rigidity.analyze import analyze
from technic.rigidity.result import RigidityReport, Verdict
from technic.units import PITCH

BEAMS = 57
"""Straight beams, L-beams and frames; the rest of the 153 bricks are pins."""

OVERLAP_MM3 = 1.0
"""Two solids may share this much: facets of circles in circles."""


@pytest.fixture(scope="module")
def path(repo: Path) -> Path:
    return repo / "technic" / "data" / "rolling_chassis.mpd"


@pytest.fixture(scope="module")
def chassis(path: Path) -> Assembly:
    return load(path)


@pytest.fixture(scope="module")
def report(chassis: Assembly) -> RigidityReport:
    return analyze(chassis)


def test_demo_is_what_the_script_writes(repo: Path, path: Path, tmp_path: Path) -> None:
    fresh = tmp_path / "chassis.mpd"
    subprocess.run([sys.executable, str(repo / "scripts" / "make_demo"), str(fresh)], check=True)
    assert fresh.read_bytes() == path.read_bytes()


def test_demo_has_153_bricks(chassis: Assembly) -> None:
    families = Counter(
        part.definition.family.split("-")[0] for part in chassis.parts if part.definition
    )
    assert chassis.unknown == ()
    assert len(chassis.parts) == 153
    assert families["beam"] + families["frame"] == BEAMS
    assert families["pin"] == 153 - BEAMS


def test_demo_is_rigid_and_in_one_piece(report: RigidityReport) -> None:
    assert report.verdict is Verdict.RIGID
    assert report.mobility.structural == 0
    assert len(report.components) == 1
    assert report.mobility.smallest_kept > 100 * report.mobility.largest_dropped


def test_demo_is_built_without_mistakes(chassis: Assembly) -> None:
    assert [finding.message for finding in chassis.findings] == []


def test_demo_names_submodels_and_steps(chassis: Assembly) -> None:
    sources = [part.source for part in chassis.parts if part.source is not None]
    assert len(sources) == 153
    assert len({source.submodel for source in sources}) == 8
    assert max(source.step for source in sources) > 3


def test_every_pin_end_has_its_own_bore(chassis: Assembly) -> None:
    """Each length of a pin fills a hole of its own, exactly."""
    ends: Counter[tuple[int, ...]] = Counter()
    bores: Counter[tuple[int, ...]] = Counter()
    for part in chassis.parts:
        for port in part.ports:
            place = part.pose.points(port.position) / (PITCH / 2)
            assert np.allclose(place, place.round(), atol=1e-5)
            key = tuple(int(value) for value in place.round())
            if port.kind is PortKind.PIN:
                ends[key] += 1
            elif port.kind is PortKind.PIN_HOLE:
                bores[key] += 1
    assert max(ends.values()) == 1
    assert set(ends) <= set(bores)


def turn(report: RigidityReport, chosen: NDArray[np.bool_], mode: int) -> Array:
    """Return the turn (rad) of the rigid motion that fits the movement of the chosen parts best."""
    parts = [part for part, use in zip(report.assembly.parts, chosen, strict=True) if use]
    weight = np.sqrt([part.mass_properties.mass for part in parts])[:, None]
    places = np.array([part.centroid for part in parts])
    places = places - np.average(places, axis=0, weights=weight[:, 0] ** 2)
    moves = report.modes[mode].twists[chosen][:, :3]
    rows = [np.hstack([np.eye(3), -np.cross(np.eye(3), r).T]) for r in places]
    fit = np.linalg.lstsq(
        np.vstack([w * row for w, row in zip(weight, rows, strict=True)]),
        (weight * moves).ravel(),
        rcond=None,
    )[0]
    return np.asarray(fit[3:])


def test_softest_mode_is_a_twist(report: RigidityReport) -> None:
    """Front and rear turn about the long axis (x), against each other, and hardly about another."""
    x = np.array([part.centroid[0] for part in report.assembly.parts])
    front = turn(report, x > 5 * PITCH, 0)
    rear = turn(report, x < -5 * PITCH, 0)
    assert front[0] * rear[0] < 0
    assert abs(front[0] + rear[0]) < 0.1 * abs(front[0])
    for one in (front, rear):
        assert np.abs(one[1:]).max() < 0.2 * abs(one[0])


def test_twist_is_by_far_the_softest(report: RigidityReport) -> None:
    """There is room to triple the rigidity by braces before another mode becomes the softest."""
    assert report.modes[1].value > 3.5 * report.modes[0].value


@pytest.mark.slow
def test_no_two_bricks_overlap(chassis: Assembly) -> None:
    manifold = pytest.importorskip("manifold3d")
    from technic.parts.shapes import mesh

    solids, lows, highs = [], [], []
    for part in chassis.parts:
        assert part.definition is not None
        surface = mesh(part.definition, "draw")
        corners = part.pose.points(surface.vertices) * 1e3
        assert np.linalg.det(part.pose.rotation) > 0
        solids.append(
            manifold.Manifold(
                manifold.Mesh(
                    vert_properties=np.asarray(corners, dtype=np.float32),
                    tri_verts=np.asarray(surface.faces, dtype=np.uint32),
                )
            )
        )
        lows.append(corners.min(axis=0))
        highs.append(corners.max(axis=0))
    clashes = {}
    for i, j in combinations(range(len(solids)), 2):
        if (lows[i] < highs[j]).all() and (lows[j] < highs[i]).all():
            volume = (solids[i] ^ solids[j]).volume()
            if volume > OVERLAP_MM3:
                clashes[chassis.parts[i].id, chassis.parts[j].id] = volume
    assert clashes == {}
