"""Which references of a section are pieces of something flexible: hose, cable, chain, tread, band.

Editors write such things as dozens of short segments, stretched and bent. They are no bodies; a
report names each of them once.
"""

from __future__ import annotations

import re
from typing import Final

from technic.ldraw.syntax import Line, Meta

__all__ = ["SEGMENTS", "WHOLE", "FlexibleState", "content_kind", "segment_kind"]

SEGMENTS: Final[dict[str, str]] = {
    # Titles of the files in the LDraw parts library (2026-02).
    "76": "hose",
    "77": "hose",
    "u9053": "hose",
    "342": "cable",
    "343": "cable",
    "79": "ribbed hose",
    "80": "ribbed hose",
    "71944k01": "ribbed hose",
    "71944k02": "ribbed hose",
    "166": "pneumatic tube",
    "71533k01": "pneumatic tube",
    "71533k02": "pneumatic tube",
    "71533k03": "pneumatic tube",
    "273": "chain",
    "3249": "chain",
    "3711": "chain",
    "3711a": "chain",
    "14696": "chain",
    "53551": "chain",
    "3873": "tread",
    "15379": "tread",
    "57518": "tread",
    "57518c01": "tread",
    "69900": "tread",
    "69910": "tread",
    "88323": "tread",
    "88323c01": "tread",
    "88323c02": "tread",
    "680": "tread",
    "681": "tread",
    "682": "tread",
    "486k01": "tread",
    "486k02": "tread",
    "486k03": "tread",
    "71372k01": "tread",
    "71372k02": "tread",
    "71372k03": "tread",
    "71735k01": "tread",
}
"""Part numbers that are one segment or link of something flexible, and of what."""

WHOLE: Final[dict[str, str]] = {
    "hose": "22296 22461 22463 42688 46305 53475 57274 60778 70688 70978 71175 71177 71192 71194 71505 "
    "71551 71582 76250 76252 76254 76260 76263 76270 76276 76277 76279 76280 76281 76282 76283 76289 "
    "76307 76324 76348 76389 80623",
    "ribbed hose": "22678 22900 23397 33763 43675 57718 57719 71819 71917 71923 71944 71945 71946 71947 "
    "71949 71951 71952 71986 72039 72504 72706 72853",
    "cable": "342c01",
    "tread": "486-f1 498 71372-f1 71735c01 4107488",
}
"""Part numbers that are a whole flexible thing, drawn straight or in one shape (titles of the library)."""

_KINDS: Final = SEGMENTS | {number: kind for kind, row in WHOLE.items() for number in row.split()}

_CONSTRAINT: Final = re.compile(r"ls\d\d")
"""Constraint markers of LSynth: points that a hose runs through, no parts."""

_CONTENT: Final = re.compile(r"\[\s*type\s*=\s*(path|spring)\w*\s*\]", re.IGNORECASE)


def segment_kind(number: str) -> str | None:
    """Return what flexible thing the part is, or is a segment of; None when it is a body.

    Parameters
    ----------
    number : str
        Normalised part number.
    """
    if _CONSTRAINT.fullmatch(number):
        return "LSynth hose"
    return _KINDS.get(number)


def content_kind(lines: tuple[Line, ...]) -> str | None:
    """Return what a whole section is when LDCad generated it, a path (hose, string) or a spring."""
    for line in lines:
        if isinstance(line, Meta) and line.words[:2] == ["!LDCAD", "CONTENT"]:
            match = _CONTENT.search(line.text)
            return None if match is None else f"LDCad {match[1].lower()}"
    return None


class FlexibleState:
    """Where in the generated blocks of a section we are; fed with its meta lines in order.

    Three notations: LSynth's ``SYNTH BEGIN type colour .. SYNTH END`` (with the segments between
    ``SYNTHESIZED BEGIN`` and ``END``), and MLCad's ``SPRING``, ``FLEXHOSE`` or ``RUBBER_BELT``
    followed by ``SKIP_BEGIN .. SKIP_END``.
    """

    def __init__(self) -> None:
        self._synth: str | None = None
        self._synthesized = False
        self._skip: str | None = None
        self._generator = "generated part"

    def feed(self, line: Meta) -> None:
        """Take notice of a meta line."""
        words = line.words
        if len(words) < 2:
            return
        if words[0] == "SYNTH":
            if words[1] == "BEGIN":
                kind = words[2].lower() if len(words) > 2 else "part"
                self._synth = f"LSynth {kind} (line {line.number})"
            elif words[1] == "END":
                self._synth, self._synthesized = None, False
            elif words[1] == "SYNTHESIZED" and len(words) > 2:
                self._synthesized = words[2] == "BEGIN"
        elif words[0] == "MLCAD":
            if words[1] in ("SPRING", "FLEXHOSE", "RUBBER_BELT"):
                self._generator = words[1].lower().replace("_", " ")
            elif words[1] == "SKIP_BEGIN":
                self._skip = f"MLCad {self._generator} (line {line.number})"
            elif words[1] == "SKIP_END":
                self._skip, self._generator = None, "generated part"

    def kind(self, number: str, known: bool) -> str | None:
        """Return the label of the block for a reference here, or None outside of all blocks.

        A band or chain of LSynth lists the wheels that it runs over inside its block: real parts,
        which stay bodies when they are known and no segments.
        """
        if self._skip is not None:
            return self._skip
        if self._synth is None:
            return None
        if known and not self._synthesized and segment_kind(number) is None:
            return None
        return self._synth
