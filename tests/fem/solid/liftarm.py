"""The plain liftarm of DESIGN section 7 as triangles, and the figures to compare with."""

from __future__ import annotations

import numpy as np

from technic.geometry import Array
from technic.parts.definition import Material, Port, PortKind
from technic.units import MM, PITCH

ABS = Material("ABS", 2.2e9, 0.35, 1050.0, "DESIGN section 2.6")

REFERENCE = {
    7: np.array([990.2e3, 8.294e3, 5.561e3, 2.360]),
    15: np.array([424.1e3, 0.7586e3, 0.4497e3, 0.987]),
}
"""Length in modules: axial, in-plane, out-of-plane (N/m) and torsion (N m/rad): first hole held, load
at the last (quadratic tetrahedra of 0.4 mm, extrapolated; DESIGN section 7)."""


def plain_liftarm(modules: int, sides: int = 96) -> Array:
    """Return the triangles of a liftarm without pockets, its first hole at the origin, bores along z.

    Circles are polygons of the same area.
    """
    import trimesh
    from trimesh.creation import box, cylinder

    def rod(radius: float, height: float, x: float, z: float = 0.0) -> trimesh.Trimesh:
        angle = 2.0 * np.pi / sides
        mesh = cylinder(
            radius=radius * np.sqrt(angle / np.sin(angle)), height=height, sections=sides
        )
        mesh.apply_translation((x, 0.0, z))
        return mesh

    width, depth, length = 7.2 * MM, PITCH, (modules - 1) * PITCH
    middle = box((length, width, depth))
    middle.apply_translation((length / 2.0, 0.0, 0.0))
    ends = [rod(width / 2.0, depth, x) for x in (0.0, length)]
    body = trimesh.boolean.union([middle, *ends], engine="manifold")
    cuts = []
    for x in PITCH * np.arange(modules):
        cuts.append(rod(2.4 * MM, 2.0 * depth, x))
        cuts += [rod(3.2 * MM, 1.6 * MM, x, side * depth / 2.0) for side in (-1.0, 1.0)]
    return np.asarray(trimesh.boolean.difference([body, *cuts], engine="manifold").triangles)


def holes(modules: int) -> list[Port]:
    """Return the pin holes of `plain_liftarm`."""
    return [
        Port(f"hole{i + 1}", PortKind.PIN_HOLE, np.array([i * PITCH, 0.0, 0.0]), [0, 0, 1], PITCH)
        for i in range(modules)
    ]


def end_stiffness(stiffness: Array) -> Array:
    """Return axial, in-plane, out-of-plane and torsional stiffness: first port held, last one loaded."""
    compliance = np.linalg.inv(stiffness[6:, 6:])[-6:, -6:]
    return 1.0 / np.diag(compliance)[:4]
