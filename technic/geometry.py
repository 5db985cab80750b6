"""Small geometry: rigid motions of a frame and how they move between points and axes.

A *twist* is a small rigid motion ``(u, theta)``: translation of a point (m) and rotation (rad), six
numbers. A *pose* maps part coordinates to world coordinates, ``x = Q p + t``. ``Q`` is orthogonal; it
may be a reflection (determinant -1), because LDraw files mirror parts.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

__all__ = [
    "Array",
    "Pose",
    "axes_from",
    "cross",
    "nearest_orthogonal",
    "plane_axes",
    "readonly",
    "rotation_matrix",
    "rotation_vector",
    "shift_twist",
    "skew",
    "turn_twist",
]

Array = NDArray[np.float64]


def readonly(values: ArrayLike, dtype: Any = np.float64) -> NDArray[Any]:
    """Return a copy of `values` as an array that refuses to be written."""
    array = np.array(values, dtype=dtype)
    array.setflags(write=False)
    return array


def cross(a: Array, b: Array) -> Array:
    """Return ``a x b`` of vectors, (..., 3); on few vectors ten times as fast as ``numpy.cross``."""
    out = np.empty(np.broadcast_shapes(a.shape, b.shape), np.result_type(a, b))
    for k, m, n in ((0, 1, 2), (1, 2, 0), (2, 0, 1)):
        out[..., k] = a[..., m] * b[..., n] - a[..., n] * b[..., m]
    return out


def skew(r: ArrayLike) -> Array:
    """Return the matrix ``[r]x`` with ``[r]x v = r x v``.

    Parameters
    ----------
    r : (..., 3) array_like

    Returns
    -------
    (..., 3, 3) ndarray
    """
    r = np.asarray(r, dtype=float)
    out = np.zeros((*r.shape[:-1], 3, 3))
    out[..., 0, 1], out[..., 0, 2] = -r[..., 2], r[..., 1]
    out[..., 1, 0], out[..., 1, 2] = r[..., 2], -r[..., 0]
    out[..., 2, 0], out[..., 2, 1] = -r[..., 1], r[..., 0]
    return out


def shift_twist(arm: ArrayLike) -> Array:
    """Return ``X`` that moves the reference point of a twist: the point at ``p + arm`` moves by
    ``u + theta x arm``.

    Parameters
    ----------
    arm : (..., 3) array_like
        Vector from the old to the new reference point (m).

    Returns
    -------
    (..., 6, 6) ndarray
    """
    arm = np.asarray(arm, dtype=float)
    out = np.zeros((*arm.shape[:-1], 6, 6))
    out[..., range(6), range(6)] = 1.0
    out[..., :3, 3:] = -skew(arm)
    return out


def turn_twist(q: ArrayLike) -> Array:
    """Return ``blockdiag(Q, det(Q) Q)``: a twist given in part axes, in world axes.

    Rotations are axial vectors, hence the determinant for a mirrored part.

    Parameters
    ----------
    q : (..., 3, 3) array_like
        Orthogonal.

    Returns
    -------
    (..., 6, 6) ndarray
    """
    q = np.asarray(q, dtype=float)
    out = np.zeros((*q.shape[:-2], 6, 6))
    out[..., :3, :3] = q
    out[..., 3:, 3:] = np.sign(np.linalg.det(q))[..., None, None] * q
    return out


def axes_from(axis: ArrayLike) -> Array:
    """Return a right-handed orthonormal frame whose first row is `axis`.

    The other two rows depend on `axis` alone, so that results are deterministic.

    Parameters
    ----------
    axis : (3,) array_like
        Not zero; need not be a unit vector.

    Returns
    -------
    (3, 3) ndarray
        Rows: axis, first shear direction, second shear direction.
    """
    a = np.asarray(axis, dtype=float)
    a = a / np.linalg.norm(a)
    helper = np.zeros(3)
    helper[np.argmin(np.abs(a).round(9))] = 1.0
    b = np.cross(a, helper)
    b /= np.linalg.norm(b)
    return np.array([a, b, np.cross(a, b)])


def plane_axes(outline: Array) -> Array:
    """Return a right-handed orthonormal frame whose third row is the normal of a polygon in space.

    The first is the direction of its first edge, so that the frame moves along with the polygon.

    Parameters
    ----------
    outline : (n, 3) ndarray
        Corners in order; about a flat polygon's normal they go round to the left.

    Returns
    -------
    (3, 3) ndarray

    Raises
    ------
    ValueError
        The polygon has no area.
    """
    arms = outline - outline.mean(axis=0)
    normal = cross(arms, np.roll(arms, -1, axis=0)).sum(axis=0)
    if np.linalg.norm(normal) <= 1e-12 * float(np.ptp(outline, axis=0).max()) ** 2:
        raise ValueError("the polygon has no area")
    normal = normal / np.linalg.norm(normal)
    edge = outline[1] - outline[0]
    first = edge - (edge @ normal) * normal
    first = first / np.linalg.norm(first)
    return np.array([first, cross(normal, first), normal])


def nearest_orthogonal(matrix: ArrayLike) -> Array:
    """Return the orthogonal matrix nearest to `matrix` (polar decomposition); reflections stay."""
    u, _, vt = np.linalg.svd(np.asarray(matrix, dtype=float))
    return np.asarray(u @ vt)


def rotation_matrix(vector: ArrayLike) -> Array:
    """Return the rotation by ``|v|`` radians about ``v`` (Rodrigues).

    Parameters
    ----------
    vector : (..., 3) array_like

    Returns
    -------
    (..., 3, 3) ndarray
    """
    v = np.asarray(vector, dtype=float)
    angle = np.linalg.norm(v, axis=-1)[..., None, None]
    k = skew(v)
    half = np.sinc(angle / (2 * np.pi))  # sin(a/2) / (a/2), exact at zero
    return np.asarray(np.eye(3) + np.sinc(angle / np.pi) * k + half**2 / 2 * (k @ k))


def rotation_vector(matrix: ArrayLike) -> Array:
    """Return axis times angle of rotations; the inverse of `rotation_matrix` below a half turn.

    Parameters
    ----------
    matrix : (..., 3, 3) array_like

    Returns
    -------
    (..., 3) ndarray
        Through the quaternion (S. W. Shepperd, J. Guidance and Control 1, 1978), which keeps all
        digits at small angles and near a half turn.
    """
    q = np.asarray(matrix, dtype=float)
    trace = np.trace(q, axis1=-2, axis2=-1)
    diagonal = np.einsum("...ii->...i", q)
    square = np.concatenate([trace[..., None], diagonal], axis=-1)
    pick = np.argmax(square, axis=-1)
    anti = np.stack(
        [
            q[..., 2, 1] - q[..., 1, 2],
            q[..., 0, 2] - q[..., 2, 0],
            q[..., 1, 0] - q[..., 0, 1],
        ],
        axis=-1,
    )
    both = q + np.swapaxes(q, -1, -2)
    # four equal quaternions, each exact where its own first entry is the largest
    first = np.concatenate([(1.0 + trace)[..., None], anti], axis=-1)
    options = [first]
    for i in range(3):
        row = both[..., i, :].copy()
        row[..., i] = 1.0 + 2.0 * diagonal[..., i] - trace
        options.append(np.concatenate([anti[..., i : i + 1], row], axis=-1))
    chosen = np.take_along_axis(np.stack(options, axis=-2), pick[..., None, None], axis=-2).squeeze(
        -2
    )
    chosen = chosen / np.linalg.norm(chosen, axis=-1, keepdims=True)
    chosen = np.where(chosen[..., :1] < 0.0, -chosen, chosen)
    size = np.linalg.norm(chosen[..., 1:], axis=-1)
    angle = 2.0 * np.arctan2(size, chosen[..., 0])
    scale = np.where(size > 1e-12, angle / np.maximum(size, 1e-300), 2.0)
    return np.asarray(chosen[..., 1:] * scale[..., None])


@dataclass(frozen=True, slots=True, eq=False)
class Pose:
    """Position and orientation of a part: ``x_world = rotation @ x_part + translation``.

    Parameters
    ----------
    rotation : (3, 3) array_like
        Orthogonal; determinant -1 for a mirrored part.
    translation : (3,) array_like
        In metres.
    """

    rotation: Array
    translation: Array

    def __post_init__(self) -> None:
        object.__setattr__(self, "rotation", readonly(self.rotation))
        object.__setattr__(self, "translation", readonly(self.translation))
        if self.rotation.shape != (3, 3) or self.translation.shape != (3,):
            raise ValueError("a pose needs a (3, 3) rotation and a (3,) translation")

    @classmethod
    def identity(cls) -> Pose:
        """Return the pose that moves nothing."""
        return cls(np.eye(3), np.zeros(3))

    def points(self, local: ArrayLike) -> Array:
        """Return points given in part coordinates, (..., 3), in world coordinates."""
        return np.asarray(local, dtype=float) @ self.rotation.T + self.translation

    def directions(self, local: ArrayLike) -> Array:
        """Return directions given in part axes, (..., 3), in world axes."""
        return np.asarray(local, dtype=float) @ self.rotation.T

    def to_local(self, world: ArrayLike) -> Array:
        """Return points given in world coordinates, (..., 3), in part coordinates."""
        return (np.asarray(world, dtype=float) - self.translation) @ self.rotation

    def __matmul__(self, inner: Pose) -> Pose:
        return Pose(
            self.rotation @ inner.rotation, self.rotation @ inner.translation + self.translation
        )
