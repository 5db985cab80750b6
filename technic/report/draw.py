"""The drawing process: a scene from standard input becomes a PNG on standard output, a film GIF or MP4.

Run as ``python -m technic.report.draw RENDERER`` by `technic.report.render`. A renderer draws the panels;
Pillow puts title, captions, scale bar, markers and legend around them, each in a place of its own.
"""

from __future__ import annotations

import io
import os
import pickle
import sys
from importlib import import_module
from types import ModuleType

import numpy as np
from PIL import Image

from technic.report.canvas import depth_span
from technic.report.layout import Sheet
from technic.report.scene import Film, Scene
from technic.report.video import mp4

__all__ = ["draw", "draw_film", "main", "renderer"]

_MODULES = {
    "pyvista": "technic.report.paint_vtk",
    "pyrender": "technic.report.paint_pyrender",
}

_ROUNDS = 3
"""Of an MP4: a player that does not begin again shows the movement long enough."""


def renderer(name: str) -> ModuleType:
    """Return the module that paints with "pyvista" or "pyrender"."""
    return import_module(_MODULES[name])


def _sheet(scene: Scene, painter: ModuleType) -> Sheet:
    sheet = Sheet(scene)
    depth = depth_span(scene.panels) if scene.depth else 0.0
    for panel, box in zip(scene.panels, sheet.boxes, strict=True):
        size = (box[2] - box[0], box[3] - box[1])
        pixels, per_metre = painter.paint(panel, size, transparent=scene.transparent, depth=depth)
        sheet.place(panel, box, pixels, per_metre)
    return sheet


def draw(scene: Scene, painter: ModuleType) -> bytes:
    """Return the picture of a scene as PNG."""
    stream = io.BytesIO()
    image = _sheet(scene, painter).image
    if not scene.transparent:
        image = image.convert("RGB")
    image.save(stream, format="PNG", optimize=False)
    return stream.getvalue()


def draw_film(film: Film, painter: ModuleType) -> bytes:
    """Return the pictures of a film as an animated GIF that never ends, or as MP4."""
    images = [_sheet(scene, painter).image.convert("RGB") for scene in film.scenes]
    if film.kind == "mp4":
        pixels = [np.asarray(image) for image in images]
        return mp4([pixels[k] for k in film.order], film.seconds, _ROUNDS)
    # One table of colours for all, or the still parts of the picture would flicker.
    table = images[0].quantize(255, dither=Image.Dither.NONE)
    drawn = [image.quantize(palette=table, dither=Image.Dither.NONE) for image in images]
    frames = [drawn[k] for k in film.order]
    stream = io.BytesIO()
    # GIF counts in hundredths of a second.
    each = 10 * max(2, round(100.0 * film.seconds / len(frames)))
    frames[0].save(
        stream, format="GIF", save_all=True, append_images=frames[1:], duration=each, loop=0
    )
    return stream.getvalue()


def main() -> None:
    """Read a scene or a film, write a picture."""
    # Libraries that print must not spoil the picture: they get standard error.
    output = os.dup(1)
    os.dup2(2, 1)
    painter = renderer(sys.argv[1])
    painter.warm_up()
    wanted = pickle.loads(sys.stdin.buffer.read())
    if not isinstance(wanted, Scene | Film):
        raise TypeError("standard input is neither a scene nor a film")
    with os.fdopen(output, "wb") as stream:
        if isinstance(wanted, Film):
            stream.write(draw_film(wanted, painter))
        else:
            stream.write(draw(wanted, painter))


if __name__ == "__main__":
    main()
