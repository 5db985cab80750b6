"""The drawing process: reads a scene from standard input, writes a PNG (of a film: a GIF) to standard output.

Run as ``python -m technic.report.draw`` by `technic.report.render`. VTK draws the panels; Pillow puts
title, captions, scale bar, markers and legend around them, each in a place of its own.
"""

from __future__ import annotations

import io
import os
import pickle
import sys
from typing import Any

import numpy as np
import pyvista
import pyvista.plotting
from numpy.typing import NDArray
from PIL import Image

from technic.report.layout import Sheet
from technic.report.scene import Film, Lines, Panel, Scene, Surface

__all__ = ["main", "paint"]

_IN_FRONT = -66000.0
"""Depth offset (in units of the depth buffer) that lifts arrows over all parts."""


def _cells(indices: NDArray[np.int64]) -> NDArray[np.int64]:
    """Return indices (n, k) in VTK's cell format: each row preceded by its length."""
    rows, size = indices.shape
    return np.hstack([np.full((rows, 1), size), indices]).ravel()


def _colors(colors: Any) -> NDArray[np.uint8]:
    return np.asarray(np.round(np.clip(colors, 0.0, 1.0) * 255.0), dtype=np.uint8)


def _add_surface(plotter: pyvista.Plotter, surface: Surface) -> None:
    mesh = pyvista.PolyData(surface.points.astype(np.float32), _cells(surface.faces))
    mesh.point_data["rgb"] = _colors(surface.colors)
    actor = plotter.add_mesh(
        mesh,
        scalars="rgb",
        rgb=True,
        opacity=surface.opacity,
        smooth_shading=False,
        ambient=0.5 if surface.on_top else 0.46,
        diffuse=0.7,
        specular=0.0 if surface.on_top else 0.08,
        reset_camera=False,
    )
    if surface.on_top:
        mapper = actor.mapper
        mapper.SetResolveCoincidentTopologyToPolygonOffset()
        mapper.SetRelativeCoincidentTopologyPolygonOffsetParameters(0.0, _IN_FRONT)


def _add_lines(plotter: pyvista.Plotter, lines: Lines) -> None:
    if not len(lines.segments):
        return
    mesh = pyvista.PolyData(lines.points.astype(np.float32), lines=_cells(lines.segments))
    mesh.point_data["rgb"] = _colors(lines.colors)
    actor = plotter.add_mesh(
        mesh,
        scalars="rgb",
        rgb=True,
        opacity=lines.opacity,
        line_width=lines.width,
        lighting=False,
        reset_camera=False,
    )
    mapper = actor.mapper
    mapper.SetResolveCoincidentTopologyToPolygonOffset()
    mapper.SetRelativeCoincidentTopologyLineOffsetParameters(0.0, -4.0)


def _add_lights(plotter: pyvista.Plotter, panel: Panel) -> None:
    """Light from the eye and from above on the left: white, so that colours stay what they are."""
    right, up, toward = panel.camera.axes()
    for direction, intensity in ((toward, 0.6), (1.2 * up - 0.8 * right + 0.4 * toward, 0.6)):
        light = pyvista.Light(
            position=tuple(direction), focal_point=(0.0, 0.0, 0.0), intensity=intensity
        )
        light.positional = False
        plotter.add_light(light)


def paint(panel: Panel, size: tuple[int, int]) -> tuple[NDArray[np.uint8], float]:
    """Return the picture of one panel, (height, width, 3), and its pixels per metre."""
    plotter = pyvista.Plotter(off_screen=True, window_size=list(size), lighting="none")
    plotter.background_color = pyvista.Color("white")
    _add_lights(plotter, panel)
    plotter.enable_anti_aliasing(aa_type="msaa", multi_samples=4)
    for lines in panel.lines:
        _add_lines(plotter, lines)
    for surface in panel.surfaces:
        _add_surface(plotter, surface)
    view = panel.camera
    half = max(view.half_height, view.half_width * size[1] / size[0])
    camera = plotter.camera
    camera.parallel_projection = True
    everything = np.concatenate([s.points for s in panel.surfaces])
    distance = 3.0 * float(np.linalg.norm(np.ptp(everything, axis=0))) + half
    camera.focal_point = tuple(view.center)
    camera.position = tuple(view.center + distance * view.toward)
    camera.up = tuple(view.up)
    camera.parallel_scale = half
    plotter.reset_camera_clipping_range()
    image = plotter.screenshot(None, return_img=True)
    plotter.close()
    return np.asarray(image)[:, :, :3], 0.5 * size[1] / half


def _sheet(scene: Scene) -> Sheet:
    sheet = Sheet(scene)
    for panel, box in zip(scene.panels, sheet.boxes, strict=True):
        width, height = box[2] - box[0], box[3] - box[1]
        pixels, pixels_per_metre = paint(panel, (width, height))
        sheet.place(panel, box, pixels, pixels_per_metre)
    return sheet


def draw(scene: Scene) -> bytes:
    """Return the picture of a scene as PNG."""
    stream = io.BytesIO()
    _sheet(scene).image.save(stream, format="PNG", optimize=False)
    return stream.getvalue()


def draw_film(film: Film) -> bytes:
    """Return the pictures of a film as an animated GIF that never ends."""
    images = [_sheet(scene).image for scene in film.scenes]
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


def _warm_up() -> None:
    """Open a tiny picture: what takes long the first time is done before the scene arrives."""
    plotter = pyvista.Plotter(off_screen=True, window_size=[16, 16])
    plotter.add_mesh(pyvista.PolyData(np.eye(3), _cells(np.array([[0, 1, 2]]))))
    plotter.screenshot(None, return_img=True)
    plotter.close()


def main() -> None:
    """Read a scene or a film, write a picture."""
    # Libraries that print must not spoil the picture: they get standard error.
    output = os.dup(1)
    os.dup2(2, 1)
    _warm_up()
    wanted = pickle.loads(sys.stdin.buffer.read())
    if not isinstance(wanted, Scene | Film):
        raise TypeError("standard input is neither a scene nor a film")
    with os.fdopen(output, "wb") as stream:
        stream.write(draw_film(wanted) if isinstance(wanted, Film) else draw(wanted))


if __name__ == "__main__":
    main()
