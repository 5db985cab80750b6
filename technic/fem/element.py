"""One part as the mechanics sees it: a few unknowns, their stiffness, mass and port frames."""

from __future__ import annotations

from dataclasses import dataclass

from technic.geometry import Array, readonly

__all__ = ["Element"]


@dataclass(frozen=True, slots=True, eq=False)
class Element:
    """A part with ``n`` unknowns, in part axes.

    Parameters
    ----------
    stiffness : (n, n) array_like
        ``K_i`` (N/m and consistent): symmetric, positive semi-definite; its null space is the rigid motions.
    mass : (n, n) array_like
        Consistent mass (kg and consistent): ``x^T mass x`` is the integral of density times ``|u|^2``.
    rigid : (n, 6) array_like
        Unknowns when the part moves rigidly by a twist about its centroid.
    frames : (m, 6, n) array_like
        ``W`` of each attachment: from the unknowns to the twist of the frame at `frame_points`.
    frame_points : (m, 3) array_like
        Reference point of each frame, part coordinates (m).
    nodes : (p, 3, n) array_like
        From the unknowns to the displacement of each node: the paper's unweighted measure and pictures.
    node_points : (p, 3) array_like
        Position of each node, part coordinates (m).
    """

    stiffness: Array
    mass: Array
    rigid: Array
    frames: Array
    frame_points: Array
    nodes: Array
    node_points: Array

    def __post_init__(self) -> None:
        for name in self.__dataclass_fields__:
            object.__setattr__(self, name, readonly(getattr(self, name)))

    @property
    def size(self) -> int:
        """Number of unknowns."""
        return len(self.stiffness)
