"""Small documents for the tests: lines in, parts out. Known are 3001 and 32524, and nothing else."""

from __future__ import annotations

from technic.ldraw.document import Document, Placements, document_from_text, placements
from technic.ldraw.syntax import Text

EYE = "1 0 0 0 1 0 0 0 1"
KNOWN = {"3001", "32524"}


def document(*lines: str, skip_bad_lines: bool = False) -> Document:
    text = Text("\n".join(lines) + "\n")
    return document_from_text(text, "m.mpd", skip_bad_lines=skip_bad_lines)


def parts(*lines: str, **options: int) -> Placements:
    return placements(document(*lines), KNOWN.__contains__, **options)


def ref(name: str, color: int = 4, at: str = "0 0 0", matrix: str = EYE) -> str:
    return f"1 {color} {at} {matrix} {name}"
