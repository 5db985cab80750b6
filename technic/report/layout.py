"""Title, captions, markers, scale bar and legend around the panels, none over another."""

from __future__ import annotations

import importlib.util
from pathlib import Path

import numpy as np
from numpy.typing import NDArray
from PIL import Image, ImageDraw, ImageFont

from technic.report.labels import place_labels
from technic.report.scene import RGB, LegendItem, Panel, Scene
from technic.units import PITCH

__all__ = ["Sheet"]

Box = tuple[int, int, int, int]
Font = ImageFont.FreeTypeFont | ImageFont.ImageFont

_INK = (32, 36, 42)
_GREY = (105, 112, 120)
_RULE = (214, 218, 222)
_MARK = (204, 18, 46)
_MARGIN = 36
_DISC = 13.0
"""Half the height of a disc with a number or a word."""

_SCALE_STRIP = 34
"""Height below the panels that belongs to the scale bars."""


def _font(size: int, *, bold: bool = False) -> Font:
    """Return a font; the one that comes with matplotlib (which pyvista needs) knows most letters."""
    spec = importlib.util.find_spec("matplotlib")
    if spec is not None and spec.origin is not None:
        name = "DejaVuSans-Bold.ttf" if bold else "DejaVuSans.ttf"
        path = Path(spec.origin).parent / "mpl-data" / "fonts" / "ttf" / name
        if path.is_file():
            return ImageFont.truetype(str(path), size)
    return ImageFont.load_default(size)


def _pixel(color: RGB) -> tuple[int, int, int]:
    red, green, blue = (round(255 * v) for v in color)
    return red, green, blue


class Sheet:
    """The page: knows where everything goes before anything is drawn.

    Parameters
    ----------
    scene : Scene
    """

    def __init__(self, scene: Scene) -> None:
        paper = (255, 255, 255, 0 if scene.transparent else 255)
        self.image = Image.new("RGBA", scene.size, paper)
        self._ink = ImageDraw.Draw(self.image)
        self._words = _font(21)
        self._small = _font(18)
        self._caption = _font(23, bold=True)
        width, height = scene.size
        top = self._title(scene)
        rows = self._flow(scene.legend, width - 2 * _MARGIN)
        legend = height - 20 - len(rows) * 34
        if rows:
            self._ink.line([(_MARGIN, legend - 12), (width - _MARGIN, legend - 12)], fill=_RULE)
        for k, row in enumerate(rows):
            for x, item, text in row:
                self._item(_MARGIN + x, legend + 34 * k, item, text)
        bottom = legend - 24 - _SCALE_STRIP
        captioned = any(panel.caption for panel in scene.panels)
        self._caption_top = top
        upper = top + (44 if captioned else 0)
        share = (width - 2 * _MARGIN) // len(scene.panels)
        self.boxes: list[Box] = [
            (_MARGIN + k * share, upper, _MARGIN + (k + 1) * share, bottom)
            for k in range(len(scene.panels))
        ]

    def _width(self, text: str, font: Font) -> int:
        return round(self._ink.textlength(text, font=font))

    def _shorten(self, text: str, font: Font, room: int) -> str:
        if self._width(text, font) <= room:
            return text
        while text and self._width(text + "...", font) > room:
            text = text[:-1]
        return text.rstrip() + "..."

    def _title(self, scene: Scene) -> int:
        """Write title and subtitle; return where the panels may begin."""
        room = scene.size[0] - 2 * _MARGIN
        size = 40
        while size > 24 and self._width(scene.title, _font(size, bold=True)) > room:
            size -= 2
        font = _font(size, bold=True)
        title = self._shorten(scene.title, font, room)
        self._ink.text((_MARGIN, 24), title, font=font, fill=_INK)
        subtitle = self._shorten(scene.subtitle, self._words, room)
        self._ink.text((_MARGIN, 24 + size + 12), subtitle, font=self._words, fill=_GREY)
        return 24 + size + 12 + 42

    def _flow(
        self, items: tuple[LegendItem, ...], room: int
    ) -> list[list[tuple[int, LegendItem, str]]]:
        """Return the legend in rows: each item with its place, as many to a row as fit."""
        rows: list[list[tuple[int, LegendItem, str]]] = []
        x = room + 1
        for item in items:
            swatch = 0 if item.swatch == "none" else 58
            text = self._shorten(item.text, self._words, room - swatch)
            needed = swatch + self._width(text, self._words)
            if x + needed > room:
                rows.append([])
                x = 0
            rows[-1].append((x, item, text))
            x += needed + 44
        return rows

    def _item(self, x: int, y: int, item: LegendItem, text: str) -> None:
        color = _pixel(item.color)
        middle = y + 14
        if item.swatch == "patch":
            box = (x, middle - 9, x + 44, middle + 9)
            self._ink.rectangle(box, fill=color, outline=_RULE)
        elif item.swatch == "line":
            self._ink.line([(x, middle), (x + 44, middle)], fill=color, width=2)
        elif item.swatch == "arrow":
            self._ink.line([(x, middle), (x + 32, middle)], fill=color, width=6)
            head = [(x + 28, middle - 10), (x + 46, middle), (x + 28, middle + 10)]
            self._ink.polygon(head, fill=color)
        elif item.swatch.startswith("disc"):
            self._disc(x + 22, middle, item.swatch.removeprefix("disc"), color)
        if item.swatch != "none":
            x += 58
        self._ink.text((x, middle), text, font=self._words, fill=_INK, anchor="lm")

    def _half(self, text: str) -> float:
        """Return half the width of a disc with a word in it."""
        return max(_DISC, 0.5 * self._width(text, self._small) + 7)

    def _disc(self, x: float, y: float, text: str, color: tuple[int, int, int]) -> None:
        half = self._half(text)
        disc = (x - half, y - _DISC, x + half, y + _DISC)
        self._ink.rounded_rectangle(disc, radius=_DISC, fill=color, outline="white", width=2)
        self._ink.text((x, y), text, font=self._small, fill="white", anchor="mm")

    def place(
        self, panel: Panel, box: Box, pixels: NDArray[np.uint8], pixels_per_metre: float
    ) -> None:
        """Put a drawn panel into its box, with caption, scale bar and markers."""
        left, top, right, bottom = box
        self.image.paste(Image.fromarray(pixels).convert("RGBA"), (left, top))
        if panel.caption:
            caption = self._shorten(panel.caption, self._caption, right - left)
            self._ink.text((left, self._caption_top), caption, font=self._caption, fill=_INK)
        self._scale_bar(left, bottom, pixels_per_metre)
        self._markers(panel, box, pixels_per_metre)

    def _scale_bar(self, left: int, bottom: int, pixels_per_metre: float) -> None:
        modules = max(
            (n for n in (1, 2, 5, 10, 20, 50) if n * PITCH * pixels_per_metre <= 220), default=1
        )
        length = round(modules * PITCH * pixels_per_metre)
        y = bottom + _SCALE_STRIP // 2
        self._ink.line([(left, y), (left + length, y)], fill=_GREY, width=3)
        for x in (left, left + length):
            self._ink.line([(x, y - 6), (x, y + 6)], fill=_GREY, width=3)
        words = f"{modules}L = {modules * PITCH * 1e3:.0f} mm"
        self._ink.text((left + length + 12, y), words, font=self._small, fill=_GREY, anchor="lm")

    def _markers(self, panel: Panel, box: Box, pixels_per_metre: float) -> None:
        axes = panel.camera.axes()
        middle = (0.5 * (box[0] + box[2]), 0.5 * (box[1] + box[3]))
        points = []
        for marker in panel.markers:
            right, up, _ = axes @ (marker.point - panel.camera.center) * pixels_per_metre
            points.append((middle[0] + right, middle[1] - up))
        sizes = [(2.0 * self._half(marker.text), 2.0 * _DISC) for marker in panel.markers]
        placed = place_labels(points, sizes, box)
        for (x, y), spot in zip(points, placed, strict=True):
            if spot is not None and np.hypot(spot[0] - x, spot[1] - y) > _DISC:
                self._ink.line([(x, y), spot], fill=_MARK, width=2)
                self._ink.ellipse((x - 4, y - 4, x + 4, y + 4), fill=_MARK, outline="white")
        for marker, spot in zip(panel.markers, placed, strict=True):
            if spot is not None:
                self._disc(*spot, marker.text, _MARK)
