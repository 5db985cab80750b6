"""LDraw colours by code, as names for text and as red, green, blue for pictures."""

from __future__ import annotations

from technic.ldraw.colors import color_of
from technic.report.scene import RGB

__all__ = ["NEUTRAL", "color_alpha", "color_name", "color_rgb"]

NEUTRAL: RGB = (0.62, 0.64, 0.66)
"""For parts without a colour."""


def color_name(code: int | None) -> str:
    """Return the name of an LDraw colour in lower case; "" for none.

    >>> color_name(4), color_name(None), color_name(0x2FF8000)
    ('red', '', '#ff8000')
    """
    return "" if code is None else color_of(code).name.lower()


def color_alpha(code: int | None) -> float:
    """Return how opaque a colour is: 1, less for glass-like ones.

    >>> color_alpha(4), color_alpha(47) < 0.6
    (1.0, True)
    """
    return 1.0 if code is None else color_of(code).rgba[3]


def color_rgb(code: int | None) -> RGB:
    """Return red, green, blue from 0 to 1."""
    if code is None:
        return NEUTRAL
    red, green, blue, _ = color_of(code).rgba
    return red, green, blue
