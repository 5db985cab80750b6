"""LDraw colours: code, name, red, green, blue, opacity.

The table below holds the facts of LDraw's own colours (`LDConfig.ldr` of the parts library, update
2026-01-03, codes below 1000), so that pictures and names work without a library; `parse_config` reads
the file of a library.

Format: LDraw.org "Colour Definition Language Extension" (``0 !COLOUR``).
"""

from __future__ import annotations

import re
from collections.abc import Mapping
from dataclasses import dataclass
from functools import cache
from itertools import pairwise
from pathlib import Path
from types import MappingProxyType
from typing import Final

from technic.errors import InputError
from technic.ldraw.syntax import decode, read_bytes, split_lines

__all__ = ["EDGE", "MAIN", "Color", "builtin_colors", "color_of", "parse_config", "read_config"]

MAIN: Final = 16
"""Takes the colour of the reference above."""

EDGE: Final = 24
"""Takes the edge colour of the reference above."""


@dataclass(frozen=True, slots=True)
class Color:
    """A colour.

    Parameters
    ----------
    code : int
        LDraw colour code.
    name : str
        As builders read it, e.g. ``"Light Bluish Grey"``.
    rgb : (3,) tuple of int
        0 to 255.
    alpha : int
        0 (clear) to 255 (opaque).
    edge : (3,) tuple of int
        Colour of its edges in line drawings.
    finish : str
        ``opaque``, ``chrome``, ``pearlescent``, ``rubber``, ``matte_metallic``, ``metal`` or
        ``material``.
    known : bool
        False when the code is in no table and the colour a stand-in.
    """

    code: int
    name: str
    rgb: tuple[int, int, int]
    alpha: int = 255
    edge: tuple[int, int, int] = (0x33, 0x33, 0x33)
    finish: str = "opaque"
    known: bool = True

    @property
    def rgba(self) -> tuple[float, float, float, float]:
        """Red, green, blue, opacity from 0 to 1."""
        r, g, b = self.rgb
        return r / 255, g / 255, b / 255, self.alpha / 255

    @property
    def hex(self) -> str:
        """Colour as ``#RRGGBB``."""
        return "#{:02X}{:02X}{:02X}".format(*self.rgb)


def _rgb(value: int) -> tuple[int, int, int]:
    return (value >> 16) & 0xFF, (value >> 8) & 0xFF, value & 0xFF


def color_of(code: int, table: Mapping[int, Color] | None = None) -> Color:
    """Return the colour of a code.

    Parameters
    ----------
    code : int
        A code of the table, or a direct colour ``0x2RRGGBB`` (opaque) or ``0x3RRGGBB`` (half
        transparent). `MAIN` with nothing above it is drawn light grey.
    table : mapping of int to Color, optional
        Default: `builtin_colors`.

    Returns
    -------
    Color
        A grey stand-in with ``known=False`` when the code means nothing.
    """
    colors = builtin_colors() if table is None else table
    found = colors.get(code)
    if found is not None:
        return found
    if code >> 24 in (2, 3):
        rgb = _rgb(code)
        alpha = 255 if code >> 24 == 2 else 128
        return Color(code, "#{:02X}{:02X}{:02X}".format(*rgb), rgb, alpha)
    if code == MAIN:
        return Color(code, "main colour", (0xC0, 0xC0, 0xC0))
    if code == EDGE:
        return Color(code, "edge colour", (0x33, 0x33, 0x33))
    return Color(code, f"unknown colour {code}", (0x9C, 0x9C, 0x9C), known=False)


_COLOUR: Final = re.compile(r"\s*0\s+!COLOUR\s+(\S+)\s+(.*)", re.DOTALL)
_FINISHES: Final = ("CHROME", "PEARLESCENT", "RUBBER", "MATTE_METALLIC", "METAL", "MATERIAL")


def parse_config(text: str, path: str | Path = "LDConfig.ldr") -> Mapping[int, Color]:
    """Return the colours that a text defines (``0 !COLOUR`` lines), by code.

    Raises
    ------
    InputError
        A definition without a code or a value, with its line.
    """
    path = Path(path)
    colors: dict[int, Color] = {}
    edges: dict[int, int] = {}
    for number, line in enumerate(split_lines(text), 1):
        match = _COLOUR.fullmatch(line)
        if match is None:
            continue
        words = match[2].split()
        # What follows MATERIAL describes its grains, with values of their own.
        head = words[: words.index("MATERIAL")] if "MATERIAL" in words else words
        fields = dict(pairwise(head))
        try:
            code = int(fields["CODE"])
            rgb = _hex(fields["VALUE"])
            alpha = int(fields.get("ALPHA", "255"))
            edge_text = fields.get("EDGE", "#333333")
            if edge_text.startswith(("#", "0x")):
                edge = _hex(edge_text)
            else:  # the code of another colour, which may be defined further down
                edges[code] = int(edge_text)
                edge = (0x33, 0x33, 0x33)
            if not 0 <= alpha <= 255:
                raise ValueError(f"ALPHA {alpha}")
        except (KeyError, ValueError) as error:
            raise InputError(
                f"colour {match[1]!r}: {error} is missing or no number",
                path=path,
                line=number,
                remedy="Take LDConfig.ldr of a current LDraw library.",
            ) from error
        finish = next((f.lower() for f in _FINISHES if f in words), "opaque")
        colors[code] = Color(code, match[1].replace("_", " "), rgb, alpha, edge, finish)
    for code, other in edges.items():
        if other in colors:
            c = colors[code]
            colors[code] = Color(c.code, c.name, c.rgb, c.alpha, colors[other].rgb, c.finish)
    return MappingProxyType(colors)


def read_config(path: str | Path) -> Mapping[int, Color]:
    """Return the colours that a file (``LDConfig.ldr``) defines; see `parse_config`."""
    path = Path(path)
    return parse_config(decode(read_bytes(path), path).text, path)


def _hex(text: str) -> tuple[int, int, int]:
    digits = text.removeprefix("#").removeprefix("0x")
    if len(digits) != 6:
        raise ValueError(f"value {text!r}")
    return _rgb(int(digits, 16))


@cache
def builtin_colors() -> Mapping[int, Color]:
    """Return LDraw's own colours by code, without any library."""
    colors = {}
    for row in _TABLE.strip().splitlines():
        code, value, edge, alpha, finish, name = row.split(None, 5)
        colors[int(code)] = Color(int(code), name, _hex(value), int(alpha), _hex(edge), finish)
    return MappingProxyType(colors)


# code, value, edge, alpha, finish, name
_TABLE: Final = """
    0 1B2A34 808080 255 opaque Black
    1 1E5AA8 333333 255 opaque Blue
    2 00852B 333333 255 opaque Green
    3 069D9F 333333 255 opaque Dark Turquoise
    4 B40000 333333 255 opaque Red
    5 D3359D 333333 255 opaque Dark Pink
    6 543324 1E1E1E 255 opaque Brown
    7 8A928D 333333 255 opaque Light Grey
    8 545955 333333 255 opaque Dark Grey
    9 97CBD9 333333 255 opaque Light Blue
    10 58AB41 333333 255 opaque Bright Green
    11 00AAA4 333333 255 opaque Light Turquoise
    12 F06D61 333333 255 opaque Salmon
    13 F6A9BB 333333 255 opaque Pink
    14 FAC80A 333333 255 opaque Yellow
    15 F4F4F4 333333 255 opaque White
    17 ADD9A8 333333 255 opaque Light Green
    18 FFD67F 333333 255 opaque Light Yellow
    19 D7BA8C 333333 255 opaque Tan
    20 AFBED6 333333 255 opaque Light Violet
    21 E0FFB0 B8FF4D 240 opaque Glow In Dark Opaque
    22 671F81 333333 255 opaque Purple
    23 0E3E9A 333333 255 opaque Dark Blue Violet
    25 D67923 333333 255 opaque Orange
    26 901F76 333333 255 opaque Magenta
    27 A5CA18 333333 255 opaque Lime
    28 897D62 333333 255 opaque Dark Tan
    29 FF9ECD 333333 255 opaque Bright Pink
    30 A06EB9 333333 255 opaque Medium Lavender
    31 CDA4DE 333333 255 opaque Lavender
    32 000000 333333 210 opaque Trans Black IR Lens
    33 0020A0 000B38 128 opaque Trans Dark Blue
    34 237841 174F2B 128 opaque Trans Green
    35 56E646 27AF18 128 opaque Trans Bright Green
    36 C91A09 660D05 128 opaque Trans Red
    37 DF6695 B9275F 128 opaque Trans Dark Pink
    38 FF800D A85100 128 opaque Trans Neon Orange
    39 C1DFF0 6FB4DC 128 opaque Trans Very Light Blue
    40 635F52 2A2823 128 opaque Trans Brown
    41 559AB7 326276 128 opaque Trans Medium Blue
    42 C0FF00 739900 128 opaque Trans Neon Green
    43 AEE9EF 59D1DE 128 opaque Trans Light Blue
    44 96709F 5F4365 128 opaque Trans Bright Reddish Lilac
    45 FC97AC F9345B 128 opaque Trans Pink
    46 F5CD2F B49208 128 opaque Trans Yellow
    47 FCFCFC C9C9C9 128 opaque Trans Clear
    52 A5A5CB 6464A6 128 opaque Trans Purple
    54 DAB000 755E00 128 opaque Trans Neon Yellow
    57 F08F1C 9E5C0A 128 opaque Trans Orange
    60 645A4C 665B4D 255 chrome Chrome Antique Brass
    61 6C96BF 3D638A 255 chrome Chrome Blue
    62 3CB371 226741 255 chrome Chrome Green
    63 AA4D8E 632C52 255 chrome Chrome Pink
    64 1B2A34 3D5F76 255 chrome Chrome Black
    65 FAC80A 333333 255 rubber Rubber Yellow
    66 F5CD2F B49208 128 rubber Rubber Trans Yellow
    67 FCFCFC C9C9C9 128 rubber Rubber Trans Clear
    68 FDC383 333333 255 opaque Very Light Orange
    69 8A12A8 333333 255 opaque Bright Reddish Lilac
    70 5F3109 808080 255 opaque Reddish Brown
    71 969696 333333 255 opaque Light Bluish Grey
    72 646464 333333 255 opaque Dark Bluish Grey
    73 7396C8 333333 255 opaque Medium Blue
    74 7FC475 333333 255 opaque Medium Green
    75 000000 AB6038 255 material Speckle Black Copper
    76 635F61 898788 255 material Speckle Dark Bluish Grey Silver
    77 FECCCF 333333 255 opaque Light Pink
    78 FFC995 333333 255 opaque Light Nougat
    79 EEEEEE BABABA 240 opaque Milky White
    80 767676 333333 255 metal Metallic Silver
    81 C2C06F 333333 255 metal Metallic Green
    82 DBAC34 333333 255 metal Metallic Gold
    83 0A1327 333333 255 pearlescent Pearl Black
    84 AA7D55 333333 255 opaque Medium Nougat
    85 441A91 333333 255 opaque Medium Lilac
    86 7B5D41 333333 255 opaque Light Brown
    87 3E3C39 333333 255 metal Metallic Dark Grey
    89 1C58A7 333333 255 opaque Blue Violet
    92 BB805A 333333 255 opaque Nougat
    100 F9B7A5 333333 255 opaque Light Salmon
    110 26469A 333333 255 opaque Violet
    112 4861AC 333333 255 opaque Medium Violet
    114 DF6695 B9275F 128 material Glitter Trans Dark Pink
    115 B7D425 333333 255 opaque Medium Lime
    117 EEEEEE BABABA 128 material Glitter Trans Clear
    118 9CD6CC 333333 255 opaque Aqua
    120 DEEA92 333333 255 opaque Light Lime
    121 F89A39 333333 255 opaque Light Orange
    123 EE5434 333333 255 opaque Dark Salmon
    125 F9A777 333333 255 opaque Spud Orange
    128 AD6140 333333 255 opaque Dark Nougat
    129 640061 000000 128 material Glitter Trans Purple
    132 000000 898788 255 material Speckle Black Silver
    133 000000 DBAC34 255 material Speckle Black Gold
    134 764D3B 333333 255 pearlescent Copper
    135 A0A0A0 333333 255 pearlescent Pearl Light Grey
    137 5B7590 333333 255 pearlescent Metallic Blue
    142 DEAC66 333333 255 pearlescent Pearl Light Gold
    147 83724F 333333 255 pearlescent Pearl Dark Gold
    148 484D48 333333 255 pearlescent Pearl Dark Grey
    150 989B99 333333 255 pearlescent Pearl Very Light Grey
    151 C8C8C8 333333 255 opaque Very Light Bluish Grey
    158 F18EBB E63384 128 opaque Trans Neon Red
    176 945148 333333 255 pearlescent Pearl Red
    178 AB673A 333333 255 pearlescent Pearl Yellow
    179 898788 333333 255 pearlescent Pearl Silver
    180 DD982E 333333 255 opaque Dark Yellow
    183 F6F2DF 333333 255 pearlescent Pearl White
    184 D60026 333333 255 pearlescent Metallic Bright Red
    185 0059A3 333333 255 pearlescent Metallic Bright Blue
    186 008E3C 333333 255 pearlescent Metallic Dark Green
    187 57392C 333333 255 pearlescent Pearl Brown
    189 AC8247 333333 255 pearlescent Reddish Gold
    191 FCAC00 333333 255 opaque Bright Light Orange
    200 708224 333333 255 pearlescent Lemon Metallic
    212 9DC3F7 333333 255 opaque Bright Light Blue
    213 476FB6 333333 255 opaque Medium Blue Violet
    216 872B17 333333 255 opaque Rust
    218 8E5597 333333 255 opaque Reddish Lilac
    219 564E9D 333333 255 opaque Lilac
    220 9195CA 333333 255 opaque Light Lilac
    225 FAA964 333333 255 opaque Warm Yellowish Orange
    226 FFEC6C 333333 255 opaque Bright Light Yellow
    227 B5D96C 86B22E 128 opaque Trans Bright Light Green
    231 FCB76D FA860A 128 opaque Trans Bright Light Orange
    232 77C9D8 333333 255 opaque Sky Blue
    234 FBE890 F7D22B 128 opaque Trans Fire Yellow
    256 1B2A34 808080 255 rubber Rubber Black
    272 19325A 333333 255 opaque Dark Blue
    273 1E5AA8 333333 255 rubber Rubber Blue
    284 C281A5 944771 128 opaque Trans Reddish Lilac
    285 7DC291 46955D 128 opaque Trans Light Green
    288 00451A 808080 255 opaque Dark Green
    293 6BABE4 247BC6 128 opaque Trans Light Blue Violet
    294 BDC6AD 8D9D72 240 opaque Glow In Dark Trans
    295 FF94C2 333333 255 opaque Flamingo Pink
    296 ADADAD 333333 255 pearlescent Cool Silver
    297 AA7F2E 333333 255 pearlescent Pearl Gold
    300 C27F53 333333 255 metal Metallic Copper
    302 AEE9EF 59D1DE 128 material Glitter Trans Light Blue
    308 352100 808080 255 opaque Dark Brown
    313 ABD9FF 333333 255 opaque Maersk Blue
    315 8C8C8C 333333 255 pearlescent Flat Silver
    316 3E3C39 333333 255 pearlescent Titanium Metallic
    320 720012 333333 255 opaque Dark Red
    321 469BC3 333333 255 opaque Dark Azure
    322 68C3E2 333333 255 opaque Medium Azure
    323 D3F2EA 333333 255 opaque Light Aqua
    324 B40000 333333 255 rubber Rubber Red
    326 E2F99A 333333 255 opaque Yellowish Green
    329 F5F3D7 E0DA85 240 opaque Glow In Dark White
    330 77774E 333333 255 opaque Olive Green
    332 D06D4F 333333 255 opaque Fluorescent Red Ink
    333 DBEA7A 333333 255 opaque Fluorescent Green Ink
    334 DFC176 C2982E 255 chrome Chrome Gold
    335 88605E 333333 255 opaque Sand Red
    339 C0FF00 739900 128 material Glitter Trans Neon Green
    341 F08F1C 9E5C0A 128 material Glitter Trans Orange
    342 3E3C39 333333 255 pearlescent Conductive Black
    346 803D07 333333 255 pearlescent Reddish Copper
    350 D67923 333333 255 rubber Rubber Orange
    351 F785B1 333333 255 opaque Medium Dark Pink
    353 FF6D77 333333 255 opaque Coral
    360 FCFCFC C9C9C9 240 material Opal Trans Clear
    362 AEE9EF 59D1DE 200 material Opal Trans Light Blue
    363 635F52 2A2823 200 material Opal Trans Black
    364 DF6695 B9275F 200 material Opal Trans Dark Pink
    365 671F81 441456 200 material Opal Trans Purple
    366 D86D2C 333333 255 opaque Earth Orange
    367 237841 174F2B 200 material Opal Trans Green
    368 EDFF21 333333 255 opaque Neon Yellow
    370 755945 333333 255 opaque Medium Brown
    371 CCA373 333333 255 opaque Medium Tan
    373 75657D 333333 255 opaque Sand Purple
    375 8A928D 333333 255 rubber Rubber Light Grey
    376 F5CD2F B49208 200 material Opal Trans Yellow
    378 708E7C 333333 255 opaque Sand Green
    379 70819A 333333 255 opaque Sand Blue
    383 CECECE 9C9C9C 255 chrome Chrome Silver
    402 CA4C0B 333333 255 opaque Reddish Orange
    406 19325A 333333 255 rubber Rubber Dark Blue
    422 915C3C 333333 255 opaque Sienna Brown
    423 543F33 333333 255 opaque Umber Brown
    424 DD9E47 333333 255 opaque Ochre Yellow
    430 F79B9B 333333 255 opaque Warm Pink
    431 665EA7 333333 255 opaque Bright Blue Violet
    449 671F81 333333 255 rubber Rubber Purple
    450 D27744 333333 255 opaque Fabuland Brown
    462 F58624 333333 255 opaque Medium Orange
    484 91501C 333333 255 opaque Dark Orange
    490 A5CA18 333333 255 rubber Rubber Lime
    493 656761 333333 255 metal Magnet
    494 D0D0D0 333333 255 metal Electric Contact Alloy
    495 AE7A59 333333 255 metal Electric Contact Copper
    496 969696 333333 255 rubber Rubber Light Bluish Grey
    503 BCB4A5 333333 255 opaque Very Light Grey
    504 898788 333333 255 rubber Rubber Flat Silver
    507 FA9C1C 333333 255 opaque Obsolete Light Orange Brown
    508 C65127 333333 255 opaque Fabuland Red
    509 CF8A47 333333 255 opaque Fabuland Orange
    510 ACE35A 333333 255 opaque Fabuland Lime
    511 F4F4F4 333333 255 rubber Rubber White
"""
