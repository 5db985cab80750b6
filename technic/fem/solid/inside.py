"""How much of each cube of a grid a surface encloses: flood fill and signed ray votes.

The surface is a bag of triangles, outward normals by the right-hand rule. It need not be watertight:
LDraw geometry overlaps itself and has cracks. Three bundles of rays along the grid's axes are
intersected with the triangles. Every crossing carries a sign (+1 into the material, -1 out of it):

* Two neighbouring cube centres with no crossing between them are on the same side of the surface, so
  connected components of cubes are found first (flood fill), and each component is inside or outside
  as a whole, by the majority of the rays that pass through it. A crack therefore spoils single rays
  and not the verdict.
* A cube that is cut by the surface gets the share of the length of the rays through it that is
  inside. The three axes are weighted by their number of crossings in the cube, i.e. by the projected
  area of the surface: a face perpendicular to an axis is then located exactly, wherever it lies
  between the planes of the grid. The centroid of the inside of a cube comes from the same lengths.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray
from scipy import sparse
from scipy.sparse.csgraph import connected_components

from technic.errors import InputError
from technic.geometry import Array

__all__ = ["Filling", "fill_fractions"]

RAYS = 3
"""Rays per cube and direction (odd, so that one of them passes through the centre)."""

SPREAD = 1.0 / (1.0 - 1.0 / RAYS**2)
"""Factor on the offsets of rays, so that their first moments are right for a linear profile."""

JITTER = np.array([0.00137, 0.00059, 0.00211])
"""Rays are moved by this share of a cube, so that none runs along an edge of an aligned mesh."""

LEAK_SHARE = 0.005
"""The flood fill counts as leaking when this share of the outside (relative to the inside) lies inside
by the votes of the rays; the votes of single cubes then decide. Slivers of 0.1 % occur at cracks."""

MAX_CANDIDATES = 4_000_000
"""Triangle-ray pairs tested at once (memory: about 100 bytes each)."""

MOST_CANDIDATES = 100_000_000
"""Triangle-ray pairs of one direction (some ten seconds); a 5 x 11 frame in the finest setting has a fifth
of it."""


@dataclass(frozen=True, slots=True, eq=False)
class Filling:
    """Share of each cube that is inside.

    Attributes
    ----------
    fraction : (nx, ny, nz) ndarray
        From 0 (outside) to 1 (inside).
    moment : (nx, ny, nz, 3) ndarray of float32
        First moment of the inside about the cube's middle: `fraction` times the offset of the inside's
        centroid, in edges of a cube.
    open_rays : float
        Share of the rays that hit the surface and do not leave it as often as they enter: 0 when the
        surface is closed.
    leaking : bool
        True when the flood fill entered the part through a hole of the surface.
    """

    fraction: Array
    moment: NDArray[np.float32]
    open_rays: float
    leaking: bool


@dataclass(frozen=True, slots=True, eq=False)
class _Crossings:
    """Crossings of one bundle of rays, and what follows from them (arrays in axes u, v, w = ray)."""

    inside: tuple[Array, Array, Array, Array]
    """(nu, nv, nw) each: mean over the valid rays of a cube of the length inside, and of its first
    moments along u, v, w about the cube's middle."""
    crossings: Array
    """(nu, nv, nw) number of crossings in each cube (valid rays only)."""
    centre_vote: NDArray[np.int8]
    """(nu, nv, nw) +1 inside, -1 outside, 0 no valid ray: the ray through the centre, at the centre."""
    blocked: NDArray[np.bool_]
    """(nu, nv, nw - 1) a crossing lies between the centres of cubes k and k + 1."""
    hit_rays: int
    open_rays: int


def fill_fractions(
    triangles: Array, origin: Array, size: float, shape: tuple[int, int, int]
) -> Filling:
    """Return the share of each cube of a grid that lies inside a surface.

    Parameters
    ----------
    triangles : (m, 3, 3) ndarray
        Corners (m). When the enclosed volume is negative, all triangles are turned over.
    origin : (3,) ndarray
        Corner of the first cube (m). The grid must reach beyond the surface by at least one cube.
    size : float
        Edge of a cube (m).
    shape : 3 ints

    Returns
    -------
    Filling

    Raises
    ------
    InputError
        No triangles, the grid does not enclose them, or they lie in too many layers.
    """
    if len(triangles) == 0:
        raise InputError("a solid needs a surface; there are no triangles")
    corners = (np.asarray(triangles, dtype=float) - origin) / size
    limits = np.array(shape)
    if corners.min() < 1.0 or (corners > limits - 1.0).any():
        raise InputError("the grid must reach beyond the surface by at least one cube")
    middle = corners.mean(axis=(0, 1))
    volume = np.einsum(
        "ij,ij->", corners[:, 0] - middle, np.cross(corners[:, 1] - middle, corners[:, 2] - middle)
    )
    if volume < 0.0:
        corners = corners[:, ::-1]
    bundles = [_cross(corners, axis, shape) for axis in range(3)]
    centre, leaking = _flood(bundles, shape)
    weight = np.zeros(shape)
    share = np.zeros(shape)
    moment = np.zeros((*shape, 3), dtype=np.float32)
    for axis, bundle in enumerate(bundles):
        crossings = _from_ray_axes(bundle.crossings, axis)
        weight += crossings
        share += crossings * _from_ray_axes(bundle.inside[0], axis)
        for k, part in zip(_ray_axes(axis), bundle.inside[1:], strict=True):
            moment[..., k] += crossings * _from_ray_axes(part, axis)
    fraction = np.where(weight > 0.0, share / np.maximum(weight, 1.0), centre)
    moment /= np.maximum(weight, 1.0)[..., None]
    hit = sum(bundle.hit_rays for bundle in bundles)
    opened = sum(bundle.open_rays for bundle in bundles)
    return Filling(np.clip(fraction, 0.0, 1.0), moment, opened / max(hit, 1), leaking)


def _ray_axes(axis: int) -> list[int]:
    """Return the grid axes in the order (u, v, w) with w along the ray, right-handed."""
    return [(axis + 1) % 3, (axis + 2) % 3, axis]


def _from_ray_axes(values: NDArray[np.generic], axis: int) -> Array:
    """Return an array over (u, v, w) as one over (x, y, z)."""
    return np.moveaxis(values, [0, 1, 2], _ray_axes(axis)).astype(float)


def _cross(corners: Array, axis: int, shape: tuple[int, int, int]) -> _Crossings:
    """Intersect the rays along `axis` with triangles given in units of a cube."""
    order = _ray_axes(axis)
    nu, nv, nw = (shape[k] for k in order)
    moved = corners[:, :, order]
    shift = JITTER[order]
    # Ray i lies at ((i + 0.5) / RAYS + shift): in units of the ray spacing, integer + 0.5.
    plane = (moved[:, :, :2] - shift[:2]) * RAYS - 0.5
    columns, rows = nu * RAYS, nv * RAYS
    ray_parts = [np.zeros(0, dtype=np.int64)]
    depth_parts = [np.zeros(0)]
    sign_parts = [np.zeros(0, dtype=np.int64)]
    for ray, depth, sign in _intersect(plane, moved[:, :, 2], rows):
        ray_parts.append(ray)
        depth_parts.append(depth)
        sign_parts.append(sign)
    ray = np.concatenate(ray_parts)
    depth = np.concatenate(depth_parts)
    sign = np.concatenate(sign_parts)
    total = np.zeros(columns * rows, dtype=np.int64)
    np.add.at(total, ray, sign)
    hit = np.zeros(columns * rows, dtype=bool)
    hit[ray] = True
    valid = total == 0
    blocked = _blocked(ray, depth - shift[2], (nu, nv, nw))
    open_rays = int((~valid).sum())
    keep = valid[ray]
    ray, depth, sign = ray[keep], depth[keep], sign[keep]

    sequence = np.lexsort((depth, ray))
    ray, depth, sign = ray[sequence], depth[sequence], sign[sequence]
    # The winding number of a ray starts and ends at 0, so one running sum serves all rays.
    after = np.cumsum(sign)
    step = (after > 0).astype(np.int64) - ((after - sign) > 0)
    cube = np.clip(depth.astype(np.int64), 0, nw - 1)
    column, row = ray // rows // RAYS, ray % rows // RAYS
    flat = (column * nv + row) * nw + cube
    count = nu * nv * nw
    good = np.maximum(valid.reshape(nu, RAYS, nv, RAYS).sum(axis=(1, 3))[:, :, None], 1)

    def collect(weights: NDArray[Any]) -> Array:
        sums = np.bincount(flat, weights=weights.astype(float), minlength=count)
        return sums.astype(float).reshape(nu, nv, nw)

    def integrate(weights: Array) -> Array:
        # A step adds what is left of its own cube, and all of the cubes behind it.
        whole = collect(weights * step)
        rest = collect(weights * step * (cube + 1 - depth))
        return np.asarray((rest + np.cumsum(whole, axis=2) - whole) / good)

    across = [ray // rows % RAYS, ray % rows % RAYS]
    offsets = [((k + 0.5) / RAYS - 0.5) * SPREAD for k in across]
    inside = (
        integrate(np.ones(len(ray))),
        integrate(offsets[0]),
        integrate(offsets[1]),
        collect(step * (0.25 - (depth - cube - 0.5) ** 2) / 2.0) / good,
    )
    crossings = collect(np.abs(step))
    middle = (ray // rows % RAYS == RAYS // 2) & (ray % rows % RAYS == RAYS // 2)
    at = np.clip(np.ceil(depth[middle] - 0.5 - shift[2]).astype(np.int64), 0, nw - 1)
    steps = np.bincount((flat - cube)[middle] + at, weights=step[middle], minlength=count)
    state = np.cumsum(steps.reshape(nu, nv, nw).round().astype(np.int8), axis=2, dtype=np.int8)
    vote = np.where(state > 0, 1, -1).astype(np.int8)
    centre_valid = valid.reshape(nu, RAYS, nv, RAYS)[:, RAYS // 2, :, RAYS // 2]
    vote[~centre_valid] = 0
    return _Crossings(inside, crossings, vote, blocked, int(hit.sum()), open_rays)


def _blocked(
    ray: NDArray[np.int64], depth: Array, shape: tuple[int, int, int]
) -> NDArray[np.bool_]:
    """Return where a crossing of a centre ray lies between the centres of two neighbouring cubes."""
    nu, nv, nw = shape
    rows = nv * RAYS
    column, row = ray // rows, ray % rows
    middle = (column % RAYS == RAYS // 2) & (row % RAYS == RAYS // 2)
    at = np.clip(np.floor(depth[middle] - 0.5).astype(np.int64), 0, nw - 2)
    out = np.zeros((nu, nv, nw - 1), dtype=bool)
    out[column[middle] // RAYS, row[middle] // RAYS, at] = True
    return out


def _intersect(
    plane: Array, depth: Array, rows: int
) -> Iterator[tuple[NDArray[np.int64], Array, NDArray[np.int64]]]:
    """Yield (ray, depth, sign) of the crossings, a bounded number of candidates at a time.

    Parameters
    ----------
    plane : (m, 3, 2) ndarray
        Corners in the plane across the rays; rays pass through integer points.
    depth : (m, 3) ndarray
        Corners along the rays.
    rows : int
        Rays along the second axis; ray (i, j) has the number ``i * rows + j``.
    """
    edge1, edge2 = plane[:, 1] - plane[:, 0], plane[:, 2] - plane[:, 0]
    area = edge1[:, 0] * edge2[:, 1] - edge1[:, 1] * edge2[:, 0]
    low = np.ceil(plane.min(axis=1)).astype(np.int64)
    span = np.floor(plane.max(axis=1)).astype(np.int64) - low + 1
    counts = np.where(area == 0.0, 0, np.prod(np.maximum(span, 0), axis=1))
    if float(counts.sum(dtype=float)) > MOST_CANDIDATES:
        raise InputError("the surface is too large and too dense to be filled")
    start = 0
    while start < len(plane):
        running = np.cumsum(counts[start:])
        stop = start + max(1, int(np.searchsorted(running, MAX_CANDIDATES, side="right")))
        part = np.arange(start, stop)
        start = stop
        owner = np.repeat(part, counts[part])
        if len(owner) == 0:
            continue
        first = np.cumsum(counts[part]) - counts[part]
        local = np.arange(len(owner)) - np.repeat(first, counts[part])
        i = low[owner, 0] + local // span[owner, 1]
        j = low[owner, 1] + local % span[owner, 1]
        du, dv = i - plane[owner, 0, 0], j - plane[owner, 0, 1]
        b = (du * edge2[owner, 1] - dv * edge2[owner, 0]) / area[owner]
        c = (dv * edge1[owner, 0] - du * edge1[owner, 1]) / area[owner]
        hit = (b >= 0.0) & (c >= 0.0) & (b + c <= 1.0)
        owner, b, c = owner[hit], b[hit], c[hit]
        at = depth[owner, 0] * (1.0 - b - c) + depth[owner, 1] * b + depth[owner, 2] * c
        # The outward normal points along the ray when the area is positive: the ray then leaves.
        sign = np.where(area[owner] > 0.0, -1, 1)
        yield i[hit] * rows + j[hit], at, sign


def _flood(bundles: list[_Crossings], shape: tuple[int, int, int]) -> tuple[Array, bool]:
    """Return (1 inside, 0 outside) of each cube's centre, and whether the surface leaks."""
    number = np.arange(int(np.prod(shape))).reshape(shape)
    heads, tails = [], []
    votes = np.zeros(shape)
    for axis, bundle in enumerate(bundles):
        free = ~_from_ray_axes(bundle.blocked, axis).astype(bool)
        heads.append(np.delete(number, -1, axis=axis)[free])
        tails.append(np.delete(number, 0, axis=axis)[free])
        votes += _from_ray_axes(bundle.centre_vote, axis)
    head, tail = np.concatenate(heads), np.concatenate(tails)
    graph = sparse.coo_array((np.ones(len(head), dtype=np.int8), (head, tail)), (number.size,) * 2)
    count, label = connected_components(graph, directed=False)
    flat = votes.ravel()
    inside = np.bincount(label, weights=flat, minlength=count) > 0.0
    outside = label[0]
    inside[outside] = False
    state = inside[label]
    doubtful = (label == outside) & (flat > 0.0)
    leaking = bool(doubtful.sum() > LEAK_SHARE * max((flat > 0.0).sum(), 1))
    if leaking:
        state = np.where(label == outside, flat > 0.0, state)
    return state.reshape(shape).astype(float), leaking
