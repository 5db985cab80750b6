"""Running CalculiX (``ccx``) on meshes of 20-node bricks and reading what it prints."""

from __future__ import annotations

import re
import subprocess
from collections.abc import Sequence
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from technic.fem.solid.cells import OFFSETS
from technic.geometry import Array
from technic.parts.definition import Material

# Corners of the bottom, corners of the top, middles of edges: bottom, top, upright (CalculiX manual,
# "Twenty-node brick element (C3D20)").
_CCX = [
    (0, 0, 0), (2, 0, 0), (2, 2, 0), (0, 2, 0), (0, 0, 2), (2, 0, 2), (2, 2, 2), (0, 2, 2),
    (1, 0, 0), (2, 1, 0), (1, 2, 0), (0, 1, 0), (1, 0, 2), (2, 1, 2), (1, 2, 2), (0, 1, 2),
    (0, 0, 1), (2, 0, 1), (2, 2, 1), (0, 2, 1),
]  # fmt: skip
_ORDER = [OFFSETS.tolist().index(list(offset)) for offset in _CCX]


def model(points: Array, elements: NDArray[np.int64], material: Material) -> list[str]:
    """Return the lines of a model: nodes and elements are numbered from 1."""
    lines = ["*NODE, NSET=ALL"]
    lines += [f"{i},{x:.12e},{y:.12e},{z:.12e}" for i, (x, y, z) in enumerate(points, 1)]
    lines.append("*ELEMENT, TYPE=C3D20, ELSET=BRICKS")
    for i, nodes in enumerate(elements, 1):
        names = [str(n + 1) for n in nodes[_ORDER]]
        lines.append(f"{i}," + ",".join(names[:10]) + ",")
        lines.append(",".join(names[10:]))
    return [
        *lines,
        "*MATERIAL, NAME=M",
        "*ELASTIC",
        f"{material.young_pa:.9e},{material.poisson}",
        "*DENSITY",
        f"{material.density:.9e}",
        "*SOLID SECTION, ELSET=BRICKS, MATERIAL=M",
    ]


def forces(load: Array) -> list[str]:
    """Return the lines of nodal forces, (3 n,) (N)."""
    lines = ["*CLOAD, OP=NEW"]
    for unknown in np.nonzero(load)[0]:
        lines.append(f"{unknown // 3 + 1},{unknown % 3 + 1},{load[unknown]:.12e}")
    return lines


def equation(terms: Sequence[tuple[int, int, float]]) -> list[str]:
    """Return a linear constraint: sum of coefficient times displacement (node, axis from 0) is 0."""
    lines = ["*EQUATION", str(len(terms))]
    lines += [f"{node + 1},{axis + 1},{value:.12e}" for node, axis, value in terms]
    return lines


def run(lines: Sequence[str], folder: Path) -> str:
    """Run CalculiX and return its ``.dat`` file."""
    (folder / "job.inp").write_text("\n".join(lines) + "\n")
    done = subprocess.run(
        ["ccx", "job"], cwd=folder, capture_output=True, text=True, timeout=900, check=False
    )
    text = (folder / "job.dat").read_text() if (folder / "job.dat").exists() else ""
    assert done.returncode == 0, done.stdout[-2000:]
    assert text.strip(), done.stdout[-2000:]
    return text


def displacements(text: str, count: int) -> list[Array]:
    """Return the printed displacements of every step, (3 n,) each (zero where not printed)."""
    out = []
    for block in text.split("displacements")[1:]:
        u = np.zeros((count, 3))
        for line in block.splitlines()[1:]:
            word = line.split()
            if len(word) == 4 and word[0].isdigit():
                u[int(word[0]) - 1] = [float(w) for w in word[1:]]
        out.append(u.ravel())
    return out


def frequencies(text: str) -> Array:
    """Return the frequencies (Hz) of the eigenvalue table."""
    table = text.split("E I G E N V A L U E   O U T P U T")[1].split("P A R T I C I P A T I O N")[0]
    rows = re.findall(r"^\s*\d+\s+\S+\s+\S+\s+(\S+)\s+\S+\s*$", table, flags=re.MULTILINE)
    return np.array([float(value) for value in rows])
