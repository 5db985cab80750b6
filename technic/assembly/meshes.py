"""Mesh files, read through meshio (VTK, Gmsh, Abaqus, MED, STL and many more)."""

from __future__ import annotations

import contextlib
import io
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from technic.errors import InputError
from technic.geometry import Array

__all__ = ["read_mesh"]

CELLS = {2: "triangle", 3: "tetra"}


def read_mesh(path: Path, dimension: int) -> tuple[Array, NDArray[np.int64]]:
    """Return points (n, 3) and the triangles (m, 3) or tetrahedra (m, 4) of a mesh file.

    Points that no cell uses are left out. Edge nodes of quadratic cells are left out, too: the element
    makes its own.

    Raises
    ------
    InputError
        The file is missing or unreadable, has no such cells, or leaves the plane in two dimensions.
    """
    if not path.is_file():
        raise InputError("no such mesh file", path=path)
    import meshio

    kind = CELLS[dimension]
    try:
        # meshio prints what it does not understand; the message of the error says it again
        with contextlib.redirect_stdout(io.StringIO()):
            mesh = meshio.read(path)
    # readers of many formats raise whatever they stumble on, and some leave the interpreter
    except (Exception, SystemExit) as error:
        raise InputError(f"cannot be read as a mesh: {error}", path=path) from error
    width = dimension + 1
    names = (kind, "triangle6" if dimension == 2 else "tetra10")
    found = [block.data[:, :width] for block in mesh.cells if block.type in names]
    if not found:
        has = ", ".join(sorted({block.type for block in mesh.cells})) or "nothing"
        raise InputError(f"has no cells of type {kind} (it has {has})", path=path)
    used, cells = np.unique(np.vstack(found), return_inverse=True)
    points = np.zeros((len(used), 3))
    points[:, : mesh.points.shape[1]] = mesh.points[used]
    if dimension == 2 and np.abs(points[:, 2]).max() > 1e-9 * np.abs(points).max():
        raise InputError("leaves the plane z = 0 of a two-dimensional assembly", path=path)
    return points, cells.reshape(-1, width).astype(np.int64)
