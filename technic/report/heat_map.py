"""The model file with every part in the colour of its strain energy, for LeoCAD, Studio and others.

Only the colour of part lines changes; everything else stays letter for letter.
"""

from __future__ import annotations

import re
from collections.abc import Mapping
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Final

from technic.assembly.model import Source
from technic.errors import UsageError
from technic.ldraw.sections import Document, read
from technic.ldraw.syntax import Text, normalise
from technic.ldraw.write import save
from technic.report.energy import energy_shares
from technic.report.heat import heat_color
from technic.report.scene import RGB
from technic.rigidity.result import RigidityReport

__all__ = ["HeatMap", "direct_color", "heat_map", "write_heat_map"]

_DIRECT: Final = 0x2000000
"""LDraw: 0x2RRGGBB is the opaque colour RRGGBB itself."""

_PART_LINE: Final = re.compile(r"(\s*1\s+)(\S+)(\s.*)", re.DOTALL)
_LINE: Final = re.compile(r"[^\r\n]*(?:\r\n|\r|\n)|[^\r\n]+")


@dataclass(frozen=True, slots=True)
class HeatMap:
    """The recoloured text, and how much of the model it shows.

    Parameters
    ----------
    text : Text
        Same encoding, byte order mark and line ends as the source.
    most : float
        Share of the strain energy that the darkest colour stands for.
    shared : int
        Lines that stand for several parts (of a submodel used more than once): they have the colour
        of the part with the most energy.
    elsewhere : int
        Parts in other files, which keep their colour.
    """

    text: Text
    most: float
    shared: int
    elsewhere: int


def direct_color(color: RGB) -> str:
    """Return a colour as LDraw writes one that is in no table.

    >>> direct_color((1.0, 0.5, 0.0))
    '0x2FF8000'
    """
    red, green, blue = (round(255 * value) for value in color)
    return f"0x{_DIRECT + (red << 16) + (green << 8) + blue:07X}"


def _recolored(source: Text, colors: Mapping[int, str]) -> Text:
    """Return the text with new colours in some lines (counted from 1)."""
    pieces = _LINE.findall(source.text)
    for line, color in colors.items():
        match = _PART_LINE.fullmatch(pieces[line - 1])
        if match is None:
            raise UsageError(
                f"line {line} of the model is no part line: the file has changed since it was read"
            )
        pieces[line - 1] = f"{match[1]}{color}{match[3]}"
    return replace(source, text="".join(pieces))


def _inside(document: Document, source: Source) -> bool:
    """Return whether a part's line stands in this file: follow the references that lead to it."""
    section = document.main
    for line in source.lines[:-1]:
        named = [ref.name for ref in section.references if ref.number == line]
        found = section.scope.get(normalise(named[0])) if named else None
        if found is None:
            return False
        section = found
    return any(ref.number == source.line for ref in section.references)


def heat_map(report: RigidityReport, document: Document) -> HeatMap:
    """Return the document recoloured by the strain energy of the worst mode.

    Parameters
    ----------
    report : RigidityReport
        Of a model read from `document`.
    document : Document

    Raises
    ------
    UsageError
        When the report has no strain energy, or the document is another one.
    """
    if report.assembly.source.get("sha256") != document.sha256:
        raise UsageError(f"{document.path} is not the file that was analyzed")
    shares = energy_shares(report)
    most = float(shares.max(initial=0.0))
    if most == 0.0:
        raise UsageError("no heat map: the model has nothing elastic that a load could deform")
    energy: dict[int, list[float]] = {}
    elsewhere = 0
    for part, share in zip(report.assembly.parts, shares, strict=True):
        if part.source is None or not _inside(document, part.source):
            elsewhere += 1
            continue
        energy.setdefault(part.source.line, []).append(float(share))
    colors = {line: direct_color(heat_color(max(found) / most)) for line, found in energy.items()}
    text = _recolored(document.source, colors)
    return HeatMap(text, most, sum(len(found) > 1 for found in energy.values()), elsewhere)


def write_heat_map(report: RigidityReport, model: Path, path: Path) -> HeatMap:
    """Read the model file again, recolour it and write it to `path`.

    Raises
    ------
    InputError
        When the model can no longer be read.
    UsageError
        See `heat_map`; or when the file cannot be written.
    """
    found = heat_map(report, read(model))
    save(path, found.text)
    return found
