"""The plain liftarm against the reference stiffness of DESIGN section 7."""

from __future__ import annotations

import numpy as np
import pytest

from technic.fem.solid import MeshSettings, build_super_element
from technic.fem.solid.superelement import rigid_motions
from tests.fem.solid.liftarm import ABS, REFERENCE, end_stiffness, holes, plain_liftarm


@pytest.mark.slow
def test_a_plain_liftarm_meets_the_reference_stiffness() -> None:
    part = build_super_element("liftarm7", plain_liftarm(7), holes(7), ABS, MeshSettings())
    assert end_stiffness(part.stiffness) == pytest.approx(REFERENCE[7], rel=0.02)
    rigid = rigid_motions(part.points, part.centroid)
    assert np.abs(part.stiffness @ rigid).max() < 1e-12 * np.abs(part.stiffness).max()
