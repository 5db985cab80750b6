"""LDraw colours by code, as names for text and as red, green, blue for pictures."""

from __future__ import annotations

__all__ = ["NEUTRAL", "RGB", "color_name", "color_rgb"]

RGB = tuple[float, float, float]

NEUTRAL: RGB = (0.62, 0.64, 0.66)
"""For parts without a colour, and for codes that the table does not know."""

_DIRECT = 0x2000000
"""Codes from here on carry their own red, green and blue: 0x2RRGGBB."""

_TABLE: dict[int, tuple[str, str]] = {
    0: ("black", "1B2A34"),
    1: ("blue", "1E5AA8"),
    2: ("green", "00852B"),
    3: ("dark turquoise", "069D9F"),
    4: ("red", "B40000"),
    5: ("dark pink", "D3359D"),
    6: ("brown", "543324"),
    7: ("light grey", "8A928D"),
    8: ("dark grey", "545955"),
    9: ("light blue", "97CBD9"),
    10: ("bright green", "58AB41"),
    14: ("yellow", "FAC80A"),
    15: ("white", "F4F4F4"),
    19: ("tan", "D7BA8C"),
    22: ("purple", "81007B"),
    25: ("orange", "D67923"),
    27: ("lime", "A5CA18"),
    28: ("dark tan", "897D62"),
    36: ("transparent red", "C91A09"),
    40: ("transparent black", "635F52"),
    46: ("transparent yellow", "F5CD2F"),
    47: ("transparent clear", "FCFCFC"),
    70: ("reddish brown", "5F3109"),
    71: ("light bluish grey", "969696"),
    72: ("dark bluish grey", "646464"),
    73: ("medium blue", "7396C8"),
    179: ("flat silver", "898788"),
    256: ("rubber black", "1B2A34"),
    272: ("dark blue", "19325A"),
    288: ("dark green", "00451A"),
    320: ("dark red", "720012"),
    321: ("dark azure", "469BC3"),
    322: ("medium azure", "68C3E2"),
    484: ("dark orange", "91501C"),
}
"""Names and values: the colours of Technic parts in LDraw.org's LDConfig.ldr."""


def _rgb(hexadecimal: str) -> RGB:
    red, green, blue = (int(hexadecimal[k : k + 2], 16) / 255.0 for k in (0, 2, 4))
    return red, green, blue


def color_name(code: int | None) -> str:
    """Return the name of an LDraw colour in lower case; "" for none.

    >>> color_name(4), color_name(None), color_name(999), color_name(0x2FF8000)
    ('red', '', 'color 999', '#FF8000')
    """
    if code is None:
        return ""
    if code >= _DIRECT:
        return f"#{code & 0xFFFFFF:06X}"
    return _TABLE[code][0] if code in _TABLE else f"color {code}"


def color_rgb(code: int | None) -> RGB:
    """Return red, green, blue from 0 to 1."""
    if code is None:
        return NEUTRAL
    if code >= _DIRECT:
        return _rgb(f"{code & 0xFFFFFF:06X}")
    return _rgb(_TABLE[code][1]) if code in _TABLE else NEUTRAL
