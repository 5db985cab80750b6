"""What the parts that were read from a parts library are modelled as, and why some are rigid bodies."""

from __future__ import annotations

from collections import Counter
from dataclasses import dataclass

from technic.assembly.model import Assembly
from technic.parts.definition import LIBRARY_FAMILY
from technic.system.part_models import PlainPart, model_of, plain_parts

__all__ = ["LibraryModels", "library_models"]


@dataclass(frozen=True, slots=True)
class LibraryModels:
    """How many parts of a parts library are solid models, and the kinds that are rigid bodies.

    Parameters
    ----------
    solid : int
    cell : float
        Edge of the cells that the solid models were to be made of (m); 0 when there is none.
    rigid : tuple of PlainPart
        Each with its reason, the most frequent first.
    """

    solid: int = 0
    cell: float = 0.0
    rigid: tuple[PlainPart, ...] = ()

    @property
    def rigid_count(self) -> int:
        """How many parts are rigid bodies."""
        return sum(kind.count for kind in self.rigid)


def library_models(assembly: Assembly, parts: str) -> LibraryModels:
    """Return what an assembly's library parts are when parts are asked to be `parts`."""
    read = tuple(
        p for p in assembly.parts if p.definition and p.definition.family == LIBRARY_FAMILY
    )
    if parts == "solid":
        solid = [part for part in read if model_of(part, parts) == "solid"]
        cells = [p.definition.drawing.cell for p in solid if p.definition and p.definition.drawing]
        rigid = plain_parts(Assembly(assembly.name, read), parts)
        return LibraryModels(len(solid), max(cells, default=0.0), rigid)
    kinds = Counter((part.number, part.name) for part in read)
    reason = "solid models were not asked for"
    return LibraryModels(
        rigid=tuple(
            PlainPart(number, name, count, "rigid", reason)
            for (number, name), count in sorted(kinds.items(), key=lambda kind: (-kind[1], kind[0]))
        )
    )
