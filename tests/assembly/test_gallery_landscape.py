"""The landscapes of Fig. 7 against the stiffness of bars written down by hand."""

from __future__ import annotations

import numpy as np
import pytest

import technic
from scripts.gallery_landscape import landscape, tip_stiffness
from tests.conftest import REPO

AXIAL = 2.2e9 * 9e-6
"""E A of the gallery's trusses (ABS, 9 mm2), N."""


@pytest.mark.parametrize(
    ("file", "bars"),
    [
        ("fig07a_bar", [(0.0, 0.1)]),
        ("fig07b_triangle", [(0.1, 0.17320508), (0.0, 0.17320508)]),
    ],
)
def test_stiffness_of_the_tip_is_the_sum_of_its_bars(file, bars):
    model = technic.load(REPO / "technic" / "data" / "gallery" / f"{file}.json")
    expected = np.zeros((2, 2))
    for span in np.array(bars):
        length = np.linalg.norm(span)
        expected += AXIAL / length**3 * np.outer(span, span)
    found = tip_stiffness(model, np.zeros(3))
    np.testing.assert_allclose(found, expected, rtol=1e-6, atol=1e-6 * expected.max())
    picture = landscape("tip", found)
    assert picture.startswith("<svg")
    assert "nan" not in picture
