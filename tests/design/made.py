"""Small models for the tests of suggestions, from lines of LDraw."""

from __future__ import annotations

from technic.assembly.model import Assembly
from technic.assembly.stiffness import default_table
from technic.ldraw.connect import connect
from technic.ldraw.reader import lookup, read_parts
from technic.ldraw.sections import document_from_text
from technic.ldraw.syntax import Text

ALONG_Z = "1 0 0 0 1 0 0 0 1"
ALONG_X = "0 0 1 0 1 0 1 0 0"
PIN_Y = "0 1 0 1 0 0 0 0 1"

SQUARE = [
    f"-40 0 0 {ALONG_Z} 32316",
    f"40 0 0 {ALONG_Z} 32316",
    f"0 -20 40 {ALONG_X} 32316",
    f"0 -20 -40 {ALONG_X} 32316",
    *(f"{x} -10 {z} {PIN_Y} 2780" for x in (-40, 40) for z in (-40, 40)),
]
"""Four beams and four pins: flexible."""


def text_of(*lines: str, end: str = "\r\n") -> str:
    """A model file from lines ``"x y z matrix number"``."""
    return "".join(f"1 7 {line}.dat{end}" for line in lines)


def build(*lines: str) -> Assembly:
    """An assembly from lines ``"x y z matrix number"``."""
    return from_text(text_of(*lines))


def from_text(text: str, name: str = "made.mpd") -> Assembly:
    """An assembly from the text of a model file."""
    parts = read_parts(document_from_text(Text(text), name), lookup()).parts
    joints, findings = connect(parts, default_table())
    source = {"path": name, "sha256": "", "format": "ldraw"}
    return Assembly("made", parts, joints, findings=findings, source=source)
