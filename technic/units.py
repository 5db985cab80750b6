"""Units: SI everywhere inside; LDraw units only where LDraw text and part data are read."""

from __future__ import annotations

from typing import Final

__all__ = ["LDU", "MM", "PITCH"]

MM: Final = 1e-3
"""One millimetre in metres."""

LDU: Final = 0.4e-3
"""One LDraw unit in metres (LDraw.org file format: 1 LDU = 0.4 mm)."""

PITCH: Final = 20 * LDU
"""One module (1L, a "stud"): the distance between neighbouring holes, 8 mm."""
