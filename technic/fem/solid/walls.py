"""Rigid port walls: the upper bound on a part's stiffness.

A pin that fits tightly stops its bore from changing shape; the default frames (a mean over the bore)
let it. Here every sample of a port's surface is tied to the port's frame by a stiff spring. Ports that
carry nothing must stay out: with rigid walls in every bore a liftarm comes out four times too stiff. Where
the mass needs the frame of such a port, it is a mean over the bore as ever (`free`): with
``u = L q + X r``, L = the mesh's answer to the tied frames q and ``X = K^-1 C^T`` that to the forces r on
the free ones, ``C u = p`` gives ``r = F^-1 (p - C L q)``, ``F = C X``; the two kinds of answer do no work on
each other, so the energies add up.
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray
from scipy import sparse

from technic.errors import InputError
from technic.fem.solid.cells import CELL_NODES, shape_functions
from technic.fem.solid.condense import element_stiffness, mass_and_centroid, mass_matrix
from technic.fem.solid.grid import Mesh, mesh_part
from technic.fem.solid.ports import Samples, frame_rows, sample_port, wall_rows
from technic.fem.solid.settings import MeshSettings
from technic.fem.solid.solver import factorize
from technic.fem.solid.superelement import SuperElement, project_rigid, rigid_motions
from technic.geometry import Array
from technic.parts.definition import Material, Port

__all__ = ["build_with_rigid_walls"]

PENALTY = 1e3
"""Stiffness of the ties (N/m3) in units of Young's modulus over the cell's edge: raising it tenfold
changes a liftarm's stiffness by less than 0.1 %."""


def build_with_rigid_walls(
    part_id: str,
    triangles: Array,
    used: Sequence[Port],
    material: Material,
    settings: MeshSettings | None = None,
    *,
    free: Sequence[Port] = (),
    key: str = "",
) -> SuperElement:
    """Condense a part onto ports whose surfaces keep their shape.

    Parameters
    ----------
    part_id : str
    triangles : (m, 3, 3) array_like
        (m)
    used : sequence of Port
        The ports that carry a joint, and only these.
    material : Material
    settings : MeshSettings, optional
    free : sequence of Port
        Ports that get a frame but no rigid wall; they come after the used ones.
    key : str

    Returns
    -------
    SuperElement

    Raises
    ------
    InputError
        As `technic.fem.solid.condense.build_super_element`.
    """
    if not used:
        raise InputError(f"part {part_id}: rigid walls need at least one port")
    mesh = mesh_part(triangles, settings or MeshSettings())
    samples = [sample_port(mesh, port) for port in used]
    tie = PENALTY * material.young_pa / mesh.settings.cell
    ties = _element_ties(mesh, samples, tie)

    def matrices(elements: NDArray[np.int64]) -> Array:
        out = element_stiffness(mesh, material, elements)
        for matrix, element in zip(out, elements.tolist(), strict=True):
            if element in ties:
                # The tie acts alike in the three directions.
                for axis in range(3):
                    matrix[axis::3, axis::3] += ties[element]
        return out

    size = 3 * len(mesh.points)
    factor = factorize(mesh.cells, mesh.nodes, matrices, np.zeros(size))
    count = len(used)
    coupling = np.zeros((size, 6 * count))
    own = np.zeros((6 * count, 6 * count))
    for i, (port, found) in enumerate(zip(used, samples, strict=True)):
        displacement, rigid, weights = wall_rows(mesh, port, found)
        at = slice(6 * i, 6 * i + 6)
        scaled = tie * weights[:, None] * rigid
        coupling[:, at] = displacement.T @ scaled
        own[at, at] = rigid.T @ scaled
    lift = factor.solve(coupling)
    stiffness = own - coupling.T @ lift
    if free:
        rows = sparse.vstack([frame_rows(mesh, port, sample_port(mesh, port)) for port in free])
        answers = factor.solve(rows.T.toarray())
        flexibility = rows @ answers
        inverse = np.linalg.inv((flexibility + flexibility.T) / 2.0)
        moved = rows @ lift
        held = inverse @ moved
        stiffness = np.block([[stiffness + moved.T @ held, -held.T], [-held, inverse]])
        lift = np.hstack([lift - answers @ held, answers @ inverse])
    ports = [*used, *free]
    points = np.array([port.position for port in ports])
    mass = mass_matrix(mesh, material.density)
    carried = np.asarray(mass @ lift.reshape(len(mesh.points), -1)).reshape(lift.shape)
    condensed = lift.T @ carried
    _, centroid = mass_and_centroid(mesh, mass)
    return SuperElement(
        id=part_id,
        ports=tuple(port.name for port in ports),
        points=points,
        stiffness=project_rigid((stiffness + stiffness.T) / 2.0, rigid_motions(points, centroid)),
        mass=(condensed + condensed.T) / 2.0,
        centroid=centroid,
        cell=mesh.settings.cell,
        key=key,
    )


def _element_ties(mesh: Mesh, samples: Sequence[Samples], tie: float) -> dict[int, Array]:
    """Return the matrix (20, 20) that the ties add to each element they touch (N/m)."""
    out: dict[int, Array] = {}
    for found in samples:
        values, _ = shape_functions(mesh.reference(found.points, found.elements))
        for element in np.unique(found.elements).tolist():
            here = found.elements == element
            n = values[here]
            part = tie * (n.T * found.weights[here]) @ n
            out[element] = out.get(element, np.zeros((CELL_NODES, CELL_NODES))) + part
    return out
