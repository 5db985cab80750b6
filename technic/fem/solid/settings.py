"""How a part is meshed; apart from the mesher, which an analysis never reads."""

from __future__ import annotations

from dataclasses import dataclass

__all__ = ["MeshSettings"]


@dataclass(frozen=True, slots=True)
class MeshSettings:
    """How a part is meshed.

    Parameters
    ----------
    cell : float
        Edge of a cell (m).
    divisions : int
        Sub-cubes along the edge of a cell.
    offset : 3 floats
        Where the corner of the part's bounding box lies in its cell, in cells (0 to 1). The answer
        must not depend on it; tests vary it.
    void : float
        Stiffness of the empty part of a cut cell relative to the material (the finite cell method's
        alpha: keeps nodes that touch little material from floating).
    """

    cell: float = 0.8e-3
    divisions: int = 4
    offset: tuple[float, float, float] = (0.0, 0.0, 0.0)
    void: float = 1e-6

    @property
    def sub(self) -> float:
        """Edge of a sub-cube (m)."""
        return self.cell / self.divisions
