"""Cross-section constants against closed forms."""

from __future__ import annotations

import numpy as np
import pytest

from technic.errors import InputError
from technic.fem.sections import cross_outline, section_of


def circle(radius: float, sides: int = 720) -> np.ndarray:
    angle = np.arange(sides) * 2.0 * np.pi / sides
    return radius * np.stack([np.cos(angle), np.sin(angle)], axis=1)


def test_rectangle() -> None:
    section = section_of([np.array([[0, 0], [2, 0], [2, 1], [0, 1]]) * 1e-3])
    assert section.area == pytest.approx(2e-6)
    assert section.inertia_z == pytest.approx(8e-12 / 12, rel=1e-4)
    assert section.inertia_y == pytest.approx(2e-12 / 12, rel=1e-4)
    # Timoshenko, Goodier, section 109: 0.229 a b^3 for a / b = 2.
    assert section.torsion == pytest.approx(0.2287e-12 * 2, rel=2e-3)


def test_circle_and_tube() -> None:
    solid = section_of([circle(1e-3)])
    assert solid.area == pytest.approx(np.pi * 1e-6, rel=1e-3)
    assert solid.torsion == pytest.approx(np.pi / 2 * 1e-12, rel=5e-3)
    tube = section_of([circle(1e-3), circle(0.8e-3)])
    assert tube.inertia_y == pytest.approx(np.pi / 4 * (1 - 0.8**4) * 1e-12, rel=2e-3)
    assert tube.torsion == pytest.approx(np.pi / 2 * (1 - 0.8**4) * 1e-12, rel=1e-2)


def test_ellipse_warps() -> None:
    outline = circle(1e-3) * [2.0, 1.0]
    # Timoshenko, Goodier, section 104: pi a^3 b^3 / (a^2 + b^2).
    assert section_of([outline]).torsion == pytest.approx(np.pi * 8 / 5 * 1e-12, rel=5e-3)


def test_axle_cross_matches_the_measured_section_and_converges() -> None:
    fine = section_of(cross_outline(), elements=320)
    coarse = section_of(cross_outline(), elements=160)
    assert fine.torsion == pytest.approx(coarse.torsion, rel=5e-3)
    # DESIGN section 7: A 13.6 mm2, I 16.8 mm4, J 16.8 mm4.
    assert fine.area * 1e6 == pytest.approx(13.6, rel=0.02)
    assert fine.inertia_y * 1e12 == pytest.approx(16.8, rel=0.03)
    assert fine.torsion * 1e12 == pytest.approx(16.8, rel=0.05)


def test_a_section_needs_an_area() -> None:
    with pytest.raises(InputError):
        section_of([np.zeros((4, 2))])
    with pytest.raises(InputError):
        section_of([np.zeros((2, 2))])
