"""The way of a linkage to its optimum as an animated GIF: plain lines, the vertices' path behind them."""

from __future__ import annotations

import io
from functools import cache

from PIL import Image, ImageColor, ImageDraw, ImageFont

from technic.design.optimize.solve import Optimization, Step
from technic.report.linkage_svg import AFTER, BEFORE, INK, PATH, Sheet, sheet_of
from technic.report.wording import number

__all__ = ["path_gif"]

FRAMES = 40
"""At most; of longer histories frames at even distances, the first and the last among them."""

SMOOTH = 2
"""Drawn this much larger, then reduced: smooth edges."""

SHADES = 10
"""Of every colour, from full to almost white."""

MOVE_MS, REST_MS = 90, 1500


def path_gif(found: Optimization) -> bytes:
    """Return the film: the linkage at every step of the search, the geometry at the start behind it.

    Parameters
    ----------
    found : Optimization

    Returns
    -------
    bytes
        A GIF that repeats; its first and last frame stay for 1.5 s.
    """
    sheet = sheet_of(found)
    last = len(found.history) - 1
    count = min(FRAMES, last + 1)
    chosen = sorted({round(k * last / max(count - 1, 1)) for k in range(count)})
    frames = [_frame(found, sheet, k, found.history[k]) for k in chosen]
    times = [MOVE_MS] * len(frames)
    times[0] = times[-1] = REST_MS
    out = io.BytesIO()
    frames[0].save(
        out, "GIF", save_all=True, append_images=frames[1:], duration=times, loop=0, disposal=1
    )
    return out.getvalue()


def _frame(found: Optimization, sheet: Sheet, k: int, step: Step) -> Image.Image:
    size = (round(sheet.width), round(sheet.height))
    large = Image.new("RGB", (SMOOTH * size[0], SMOOTH * size[1]), "white")
    draw = ImageDraw.Draw(large)
    thick = max(2, round(SMOOTH * sheet.thick))
    places = SMOOTH * sheet.places
    corners = found.geometry.corners.values()
    for which, color, width in ((0, BEFORE, max(2, thick // 3)), (k, AFTER, thick)):
        for own in corners:
            line = [(float(x), float(y)) for x, y in places[which][list(own)]]
            draw.line(line, fill=color, width=width, joint="curve")
    for v in sorted({v for own in corners for v in own}):
        way = [(float(x), float(y)) for x, y in places[: k + 1, v]]
        if len(way) > 1:
            draw.line(way, fill=PATH, width=2 * SMOOTH)
        x, y = way[-1]
        r = 4.0 * SMOOTH
        fill = INK if v in found.geometry.pinned else "white"
        draw.ellipse((x - r, y - r, x + r, y + r), fill=fill, outline=INK, width=SMOOTH)
    factor = step.rigidity / found.start.rigidity
    said = f"{number(step.rigidity)} N/m, {number(factor)} times"
    if k == 0:
        said = f"at the start: {number(step.rigidity)} N/m"
    font = ImageFont.load_default(14 * SMOOTH)
    draw.text((40 * SMOOTH, (sheet.height - 28) * SMOOTH), said, fill=INK, font=font)
    return large.resize(size, Image.Resampling.LANCZOS).quantize(
        palette=_palette(), dither=Image.Dither.NONE
    )


@cache
def _palette() -> Image.Image:
    """Return an image whose palette holds every colour of the picture, faded to white in steps."""
    levels = []
    for color in (AFTER, BEFORE, INK, PATH):
        ink = ImageColor.getrgb(color)[:3]
        for step in range(SHADES):
            levels += [round(c + (255 - c) * step / SHADES) for c in ink]
    out = Image.new("P", (1, 1))
    out.putpalette([255, 255, 255, *levels])
    return out
