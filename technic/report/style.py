"""Colours of a terminal, and when to use them."""

from __future__ import annotations

import os
import shutil
import textwrap
from dataclasses import dataclass
from typing import TextIO

__all__ = ["Style", "style_for"]

_CODES = {"bold": "1", "dim": "2", "good": "1;32", "bad": "1;31", "warn": "33", "number": "36"}

_WIDEST = 100
"""Longer lines are hard to read, however wide the window."""


@dataclass(frozen=True, slots=True)
class Style:
    """How text is dressed: with or without colour, and how wide.

    A few escape codes need no library; the start of the program stays fast.
    """

    color: bool = False
    width: int = _WIDEST

    def __call__(self, kind: str, text: str) -> str:
        """Return `text` in the colour that `kind` ("good", "bad", "bold", ...) has."""
        return f"\033[{_CODES[kind]}m{text}\033[0m" if self.color else text

    def wrap(self, text: str, first: str = "", rest: str | None = None) -> list[str]:
        """Return `text` as lines, the first indented by `first`, the others by `rest`."""
        return textwrap.wrap(
            text,
            self.width,
            initial_indent=first,
            subsequent_indent=first if rest is None else rest,
            break_long_words=False,
            break_on_hyphens=False,
        ) or [first.rstrip()]


def style_for(stream: TextIO) -> Style:
    """Return the style that fits a stream: colours only on a terminal and without ``NO_COLOR``."""
    terminal = stream.isatty()
    color = terminal and not os.environ.get("NO_COLOR") and os.environ.get("TERM") != "dumb"
    if not terminal:
        return Style()
    return Style(color, max(40, min(_WIDEST, shutil.get_terminal_size().columns)))
