"""Section constants of plain profiles, from the formulas of strength of materials.

Shear areas: G. R. Cowper, *The shear coefficient in Timoshenko's beam theory*, J. Appl. Mech. 33 (1966).
Torsion of a rectangle: S. Timoshenko and J. N. Goodier, *Theory of Elasticity*, 3rd ed., section 109.
"""

from __future__ import annotations

from math import cosh, pi, sinh

from technic.parts.definition import Section

__all__ = ["circle", "rectangle", "tube"]

_TERMS = 25
"""Terms of the series of the torsion constant; the fifth is already below 1e-4."""


def rectangle(width: float, height: float, poisson: float) -> Section:
    """Return the section of a solid rectangle.

    Parameters
    ----------
    width : float
        Extent along the member's own z axis (m).
    height : float
        Extent along its y axis (m): bending in the plane of x and y is resisted by ``width height^3 / 12``.
    poisson : float

    Examples
    --------
    >>> square = rectangle(0.01, 0.01, 0.3)
    >>> round(square.torsion / 0.01**4, 4)          # Timoshenko and Goodier: 0.1406
    0.1406
    """
    area = width * height
    shear = 10.0 * (1.0 + poisson) / (12.0 + 11.0 * poisson) * area
    return Section(
        area=area,
        inertia_y=height * width**3 / 12.0,
        inertia_z=width * height**3 / 12.0,
        torsion=_torsion(max(width, height), min(width, height)),
        shear_y=shear,
        shear_z=shear,
        source="rectangle",
    )


def circle(diameter: float, poisson: float) -> Section:
    """Return the section of a solid circle."""
    inertia = pi * diameter**4 / 64.0
    area = pi * diameter**2 / 4.0
    shear = 6.0 * (1.0 + poisson) / (7.0 + 6.0 * poisson) * area
    return Section(area, inertia, inertia, 2.0 * inertia, shear, shear, "circle")


def tube(diameter: float, wall: float, poisson: float) -> Section:
    """Return the section of a round tube with an outer diameter and a wall thickness."""
    inner = diameter - 2.0 * wall
    m = inner / diameter
    inertia = pi * (diameter**4 - inner**4) / 64.0
    area = pi * (diameter**2 - inner**2) / 4.0
    bulk = (7.0 + 6.0 * poisson) * (1.0 + m**2) ** 2 + (20.0 + 12.0 * poisson) * m**2
    shear = 6.0 * (1.0 + poisson) * (1.0 + m**2) ** 2 / bulk * area
    return Section(area, inertia, inertia, 2.0 * inertia, shear, shear, "tube")


def _torsion(a: float, b: float) -> float:
    """Return the torsion constant of a rectangle with sides ``a >= b``."""
    series = 0.0
    for n in range(1, 2 * _TERMS, 2):
        x = n * pi * a / (2.0 * b)
        series += (sinh(x) / cosh(x) if x < 20.0 else 1.0) / n**5
    return a * b**3 / 3.0 * (1.0 - 192.0 / pi**5 * (b / a) * series)
