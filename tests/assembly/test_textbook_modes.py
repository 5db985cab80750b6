"""Frequencies that stand in published benchmarks, through the assembly file.

Lambda of a mode is the model's mass times the square of its circular frequency, so modal benchmarks test
the stiffness, the mass, the joints and the eigenvalue step together.
"""

from __future__ import annotations

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from technic import analyze
from technic.assembly.builder import Linkage

STEEL = ("steel", 200e9, 0.3, 8000.0)
INCH = 0.0254
POUND = 4.4482216152605 / INCH  # lbf s2/in in kilograms


def frequencies(linkage, count):
    report = analyze(linkage.assembly(), modes=count)
    return np.sqrt([m.value / report.mass for m in report.modes]) / (2 * np.pi)


def test_pin_ended_cross():
    # NAFEMS, Selected Benchmarks for Natural Frequency Analysis (R0015, 1987), test 1
    cross = Linkage(2)
    cross.material(*STEEL)
    for k, end in enumerate([(5, 0), (0, 5), (-5, 0), (0, -5)]):
        cross.bar(f"arm{k}", (0, 0), end, section=0.125, material="steel")
        cross.fix(f"arm{k}", at=end, held="xy")
    for k in range(3):
        cross.fixed(f"arm{k}", f"arm{k + 1}", at=(0, 0), stiffness="rigid")
    expected = [11.336, 17.709, 17.709, 17.709, 45.345, 57.390, 57.390, 57.390]
    np.testing.assert_allclose(frequencies(cross, 8), expected, rtol=0.01)


def test_deep_simply_supported_beam():
    # NAFEMS R0015, test 5. Its torsional frequencies (77.542, 233.10 Hz) take the polar moment for the
    # torsion constant; a square section has 0.844 of it, so torsion is compared with that correction.
    beam = Linkage(3)
    beam.material(*STEEL)
    beam.bar("beam", (0, 0, 0), (10, 0, 0), section=2.0, material="steel", elements=16)
    beam.fix("beam", at=(0, 0, 0), held=["x", "y", "z", "rx"])
    beam.fix("beam", at=(10, 0, 0), held="yz")
    torsion = 77.542 * np.sqrt(0.1406 * 6)
    expected = [42.649, 42.649, torsion, 125.00, 148.31, 148.31, 3 * torsion, 284.55, 284.55]
    np.testing.assert_allclose(frequencies(beam, 9), expected, rtol=0.01)


def test_free_circular_ring():
    # NAFEMS R0015, test 6: out of plane and in the plane by turns; thin-ring theory, which leaves out
    # shear and the rotation of the sections, so that it is 2 % high from the fifth pair on.
    turns = np.linspace(0.0, 2.0 * np.pi, 65)
    points = np.column_stack([np.cos(turns), np.sin(turns), 0.0 * turns])
    ring = Linkage(3)
    ring.material(*STEEL)
    section = {"kind": "circle", "diameter": 0.1}
    ring.bar("east", *points[:33], section=section, material="steel", elements=1)
    ring.bar("west", *points[32:], section=section, material="steel", elements=1)
    for at in (points[0], points[32]):
        ring.fixed("east", "west", at=at, stiffness="rigid")
    expected = np.repeat([51.849, 53.382, 148.77, 150.99], 2)
    np.testing.assert_allclose(frequencies(ring, 8), expected, rtol=0.01)


def test_three_dimensional_frame():
    # I. S. Tuba and W. B. Wright, ASME Pressure Vessel and Piping, 1972 Computer Programs Verification,
    # I-24, problem 1: pipes with masses at 14 points; frequencies as printed in the MIDAS/Civil
    # verification manual, example 3 (NISA II, where shear of the pipe is counted).
    frame = Linkage(3)
    frame.material("pipe", 27.9e6 * 6894.757293168, 0.3, 1e-3)  # the masses below are all there is
    section = {"kind": "tube", "diameter": 2.375 * INCH, "wall": (1.1875 - 1.0335) * INCH}
    size = np.array([27.25, 17.25, 18.625]) * INCH
    corners = np.array([[0, 0], [1, 0], [1, 1], [0, 1]])

    def mass(name, at, kilograms, part):
        frame.rigid(name, at, mass=kilograms)
        frame.fixed(name, part, at=at, stiffness="rigid")

    tops = np.column_stack([corners, np.ones(4)]) * size
    for k, top in enumerate(tops):
        foot, middle = top * [1, 1, 0], [top[0], top[1], 10 * INCH]
        frame.bar(f"column{k}", foot, middle, top, section=section, material="pipe", elements=1)
        frame.fix(f"column{k}", at=foot)
        mass(f"middle{k}", middle, 8.94223e-3 * POUND, f"column{k}")
        mass(f"top{k}", top, 0.0253816 * POUND, f"column{k}")
    for k in range(4):
        p, q = tops[k], tops[(k + 1) % 4]
        along = (q - p) / np.linalg.norm(q - p) * 8.625 * INCH
        inner = [p + along] if k % 2 else [p + along, q - along]
        frame.bar(f"beam{k}", p, *inner, q, section=section, material="pipe", elements=1)
        frame.fixed(f"beam{k}", f"column{k}", at=p, stiffness="rigid")
        frame.fixed(f"beam{k}", f"column{(k + 1) % 4}", at=q, stiffness="rigid")
        for n, at in enumerate(inner):
            mass(f"inner{k}{n}", at, 8.94223e-3 * POUND, f"beam{k}")
    expected = [111.46, 116.10, 137.50, 216.20, 405.00]
    np.testing.assert_allclose(frequencies(frame, 5), expected, rtol=0.01)


def test_a_plate_of_triangles_bends_as_a_beam():
    # free in the plane: nothing but the elements; the bar is tested against textbooks elsewhere
    length, height = 0.1, 0.01
    corners = [(0, 0), (length, 0), (length, height), (0, height)]
    plate, bar = Linkage(2), Linkage(2)
    plate.material(*STEEL)
    bar.material(*STEEL)
    plate.plate("plate", *corners, thickness=0.003, material="steel", size=0.004)
    section = {"kind": "rectangle", "width": 0.003, "height": height}
    bar.bar("bar", (0, 0), (length, 0), section=section, material="steel", elements=16)
    np.testing.assert_allclose(frequencies(plate, 3), frequencies(bar, 3), rtol=0.01)


def test_a_plate_in_space_bends_and_twists_as_the_textbook_says():
    # Thin square plate, free all round, Poisson's ratio 0.3: Leissa 1973, "The free vibration of rectangular
    # plates", J. Sound Vib. 31, 257-293: upper bounds by Ritz's method, about 1 % high
    side, thickness = 0.1, 0.001
    turn = Rotation.from_rotvec([0.4, -0.7, 0.2]).as_matrix()
    corners = [turn @ [x, y, 0.03] for x, y in [(0, 0), (side, 0), (side, side), (0, side)]]
    model = Linkage(3)
    model.material(*STEEL)
    model.plate("plate", *corners, thickness=thickness, material="steel", size=side / 9)
    _, young, poisson, density = STEEL
    bending = young * thickness**3 / (12 * (1 - 0.3**2))
    unit = np.sqrt(bending / (density * thickness)) / side**2 / (2 * np.pi)
    assert poisson == 0.3
    found = np.array(frequencies(model, 3)) / unit
    np.testing.assert_allclose(found, [13.489, 19.789, 24.432], rtol=0.02)


@pytest.mark.parametrize("order", [1, 2])
def test_a_mesh_of_tetrahedra_stretches_as_a_rod(tmp_path, order):
    # longitudinal vibration of a free rod, f = c / (2 L); Poisson's ratio 0 makes it exact
    import itertools

    import meshio

    cells, counts, spacing = [], (17, 2, 2), 0.01
    number = {p: k for k, p in enumerate(itertools.product(*map(range, counts)))}
    for x in range(counts[0] - 1):
        corner = [number[x + i, j, k] for i in (0, 1) for j in (0, 1) for k in (0, 1)]
        walks = [(0, 1, 3, 7), (0, 1, 5, 7), (0, 2, 3, 7), (0, 2, 6, 7), (0, 4, 5, 7), (0, 4, 6, 7)]
        cells += [[corner[c] for c in walk] for walk in walks]
    points = np.array(list(number), float)
    path = tmp_path / "rod.vtk"
    meshio.write_points_cells(path, points, [("tetra", np.array(cells))])
    rod = Linkage(3)
    rod.material("cork", 1e9, 0.0, 1000.0)
    rod.mesh("rod", path, scale=spacing, material="cork", order=order)
    length = 16 * spacing
    expected = 1000.0 / (2 * length)
    found = frequencies(rod, 12)
    assert np.abs(found / expected - 1).min() < 0.003
