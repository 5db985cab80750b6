"""The mesh of a part: cells of a regular grid, cut by the surface, split where a gap runs through.

A cell that holds two walls with a gap between them would glue the walls together (a pocketed liftarm
then comes out 45 % too stiff in torsion). Such a cell is therefore used once for every connected
piece of material in it, each copy with its own nodes; copies in neighbouring cells share the nodes of
their common face only when their pieces touch across that face.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from scipy import ndimage, sparse
from scipy.sparse.csgraph import connected_components

from technic.errors import InputError
from technic.fem.solid.cells import CELL_NODES, OFFSETS
from technic.fem.solid.inside import fill_fractions
from technic.fem.solid.settings import MeshSettings
from technic.geometry import Array

__all__ = ["Mesh", "MeshSettings", "mesh_part"]

SOLID_FILL = 0.25
"""A sub-cube filled at least this much counts as material when pieces are told apart."""

THIN_FILL = 0.01
"""Where a cell has no such sub-cube (the surface just enters it), this fill counts."""

LOOSE_SHARE = 0.02
"""A surface that falls into pieces is refused when more than this share of the volume is loose."""


@dataclass(frozen=True, slots=True, eq=False)
class Mesh:
    """Cells and nodes of one part.

    Attributes
    ----------
    settings : MeshSettings
    origin : (3,) ndarray
        Corner of cell (0, 0, 0) (m).
    cells : (e, 3) ndarray of int
        Position of each element's cell in the grid.
    fill : (e, divisions**3) ndarray
        Share of each sub-cube that belongs to the element.
    moment : (e, divisions**3, 3) ndarray of float32
        First moments, see `technic.fem.solid.inside.Filling`.
    nodes : (e, 20) ndarray of int
        Node numbers of each element.
    points : (n, 3) ndarray
        Node positions (m).
    owner : (nx, ny, nz) ndarray of int
        Element that each sub-cube of the grid belongs to; -1 where there is none.
    core : (nx, ny, nz) ndarray of bool
        Sub-cubes that are at least half full.
    loose : float
        Share of the volume left out because it is not connected to the rest.
    leaking : bool
    open_rays : float
        See `technic.fem.solid.inside.Filling`.
    """

    settings: MeshSettings
    origin: Array
    cells: NDArray[np.int64]
    fill: Array
    moment: NDArray[np.float32]
    nodes: NDArray[np.int64]
    points: Array
    owner: NDArray[np.int64]
    core: NDArray[np.bool_]
    loose: float
    leaking: bool
    open_rays: float

    @property
    def volume(self) -> float:
        """Volume of the material (m3)."""
        return float(self.fill.sum()) * self.settings.sub**3

    def element_at(self, points: Array) -> NDArray[np.int64]:
        """Return the element that owns the sub-cube around each point.

        -1 where there is none, or where the sub-cube is less than half full: on average over places of
        the grid the material then ends where the surface is.
        """
        index = np.floor((points - self.origin) / self.settings.sub).astype(np.int64)
        valid = np.asarray((index >= 0) & (index < np.array(self.owner.shape))).all(axis=-1)
        index = np.where(np.asarray(valid)[..., None], index, 0)
        at = (index[..., 0], index[..., 1], index[..., 2])
        return np.where(valid & self.core[at], self.owner[at], -1)

    def reference(self, points: Array, elements: NDArray[np.int64]) -> Array:
        """Return points in the reference coordinates (-1 to 1) of the given elements."""
        corner = self.origin + self.cells[elements] * self.settings.cell
        return (points - corner) * (2.0 / self.settings.cell) - 1.0


def mesh_part(triangles: Array, settings: MeshSettings) -> Mesh:
    """Mesh the solid enclosed by triangles.

    Parameters
    ----------
    triangles : (m, 3, 3) ndarray
        Surface (m); see `technic.fem.solid.inside`.
    settings : MeshSettings

    Returns
    -------
    Mesh

    Raises
    ------
    InputError
        The surface encloses nothing, or falls into separate pieces.
    """
    triangles = np.asarray(triangles, dtype=float)
    if triangles.ndim != 3 or triangles.shape[1:] != (3, 3) or len(triangles) == 0:
        raise InputError("a solid needs triangles, an array of shape (m, 3, 3)")
    low, high = triangles.min(axis=(0, 1)), triangles.max(axis=(0, 1))
    cell, n = settings.cell, settings.divisions
    # One empty layer of cells all round: the flood fill starts there.
    origin = low - (1.0 + np.asarray(settings.offset)) * cell
    counts = np.ceil((high - origin) / cell - 1e-6).astype(int) + 1
    shape = (int(counts[0]) * n, int(counts[1]) * n, int(counts[2]) * n)
    filling = fill_fractions(triangles, origin, settings.sub, shape)
    fraction = np.where(filling.fraction < THIN_FILL, 0.0, filling.fraction)
    if not fraction.any():
        raise InputError("the surface encloses no material")

    piece, piece_cell, solid = _pieces(fraction, counts, n)
    nodes, face_pairs = _connect(np.where(solid, piece, -1), piece_cell, n)
    keep, loose = _largest(piece, fraction, len(piece_cell), face_pairs)
    if loose > LOOSE_SHARE:
        raise InputError(
            f"the surface falls into separate pieces: {loose:.1%} of the volume is not connected",
            remedy="check the shape, or use smaller cells",
        )
    renumber = np.full(len(piece_cell) + 1, -1)
    renumber[:-1][keep] = np.arange(keep.sum())
    owner = renumber[piece]  # piece -1 reads the last entry
    cells = piece_cell[keep]
    used, numbered = np.unique(nodes[keep], return_inverse=True)
    numbered = numbered.reshape(-1, CELL_NODES)
    points = np.empty((len(used), 3))
    points[numbered] = origin + (cells[:, None, :] + OFFSETS / 2.0) * cell

    place = np.nonzero(owner >= 0)
    fill = np.zeros((len(cells), n**3))
    local = ((place[0] % n) * n + place[1] % n) * n + place[2] % n
    fill[owner[place], local] = fraction[place]
    moment = np.zeros((len(cells), n**3, 3), dtype=np.float32)
    moment[owner[place], local] = filling.moment[place]
    return Mesh(
        settings=settings,
        origin=origin,
        cells=cells,
        fill=fill,
        moment=moment,
        nodes=numbered,
        points=points,
        owner=owner,
        core=fraction >= 0.5,
        loose=loose,
        leaking=filling.leaking,
        open_rays=filling.open_rays,
    )


def _pieces(
    fraction: Array, counts: NDArray[np.int64], n: int
) -> tuple[NDArray[np.int64], NDArray[np.int64], NDArray[np.bool_]]:
    """Tell the connected pieces of every cell apart.

    Returns
    -------
    piece : (nx, ny, nz) ndarray of int
        Piece of each sub-cube, -1 where it is empty.
    cell : (pieces, 3) ndarray of int
    solid : (nx, ny, nz) ndarray of bool
        Sub-cubes through which pieces are connected; emptier ones are skin.
    """
    blocks = fraction.reshape(counts[0], n, counts[1], n, counts[2], n)
    most = blocks.max(axis=(1, 3, 5))
    threshold = np.where(most >= SOLID_FILL, SOLID_FILL, THIN_FILL)
    threshold = threshold.repeat(n, 0).repeat(n, 1).repeat(n, 2)
    solid = fraction >= threshold
    # One empty plane between cells keeps pieces of different cells apart in a single labelling.
    spread = [np.arange(length) + np.arange(length) // n for length in fraction.shape]
    apart = np.zeros([int(s[-1]) + 1 for s in spread], dtype=bool)
    apart[np.ix_(*spread)] = solid
    label, count = ndimage.label(apart)
    piece = label[np.ix_(*spread)].astype(np.int64) - 1
    cell = np.zeros((count, 3), dtype=np.int64)
    place = np.stack(np.nonzero(solid), axis=1)
    cell[piece[solid]] = place // n
    # What is filled less goes to the nearest piece of its own cell.
    rest = np.stack(np.nonzero((fraction > 0.0) & ~solid), axis=1)
    if len(rest):
        best = np.full(len(rest), np.inf)
        for shift in np.stack(np.meshgrid(*[np.arange(n)] * 3, indexing="ij"), -1).reshape(-1, 3):
            other = rest // n * n + shift
            there = piece[tuple(other.T)]
            distance = ((other - rest) ** 2).sum(axis=1).astype(float)
            closer = solid[tuple(other.T)] & (distance < best)
            best[closer] = distance[closer]
            chosen = tuple(rest[closer].T)
            piece[chosen] = there[closer]
    return piece, cell, solid


def _connect(
    piece: NDArray[np.int64], cell: NDArray[np.int64], n: int
) -> tuple[NDArray[np.int64], NDArray[np.int64]]:
    """Number the nodes so that pieces touching across a face share the nodes of that face.

    Returns
    -------
    nodes : (pieces, 20) ndarray of int
    pairs : (k, 2) ndarray of int
        Pieces that touch.
    """
    heads, tails, all_pairs = [], [], []
    for axis in range(3):
        length = piece.shape[axis]
        last = np.arange(n - 1, length - 1, n)
        a = np.take(piece, last, axis=axis)
        b = np.take(piece, last + 1, axis=axis)
        touching = (a >= 0) & (b >= 0)
        pairs = np.unique(np.stack([a[touching], b[touching]], axis=1), axis=0)
        all_pairs.append(pairs)
        far = np.nonzero(OFFSETS[:, axis] == 2)[0]
        moved = OFFSETS[far].copy()
        moved[:, axis] = 0
        near = np.array([int(np.nonzero((m == OFFSETS).all(axis=1))[0][0]) for m in moved])
        heads.append((pairs[:, :1] * CELL_NODES + far).ravel())
        tails.append((pairs[:, 1:] * CELL_NODES + near).ravel())
    head, tail = np.concatenate(heads), np.concatenate(tails)
    total = len(cell) * CELL_NODES
    graph = sparse.coo_array((np.ones(len(head), dtype=np.int8), (head, tail)), (total, total))
    _, label = connected_components(graph, directed=False)
    return label.reshape(-1, CELL_NODES).astype(np.int64), np.concatenate(all_pairs)


def _largest(
    piece: NDArray[np.int64], fraction: Array, count: int, pairs: NDArray[np.int64]
) -> tuple[NDArray[np.bool_], float]:
    """Return which pieces belong to the largest connected body, and the share of volume that is not."""
    graph = sparse.coo_array(
        (np.ones(len(pairs), dtype=np.int8), (pairs[:, 0], pairs[:, 1])), (count, count)
    )
    bodies, label = connected_components(graph, directed=False)
    there = piece >= 0
    volume = np.bincount(label[piece[there]], weights=fraction[there], minlength=bodies)
    return label == np.argmax(volume), float(1.0 - volume.max() / volume.sum())
