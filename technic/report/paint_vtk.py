"""Draw a panel with VTK, through pyvista. Imported by the drawing process only."""

from __future__ import annotations

from typing import Any

import numpy as np
import pyvista
import pyvista.plotting
from numpy.typing import NDArray

from technic.report.canvas import (
    LIGHTS,
    Pixels,
    depth_shades,
    far_first,
    half_height,
    nearest,
    see_through,
    with_mask,
)
from technic.report.scene import Lines, Panel, Surface

__all__ = ["paint", "warm_up"]

_IN_FRONT = -66000.0
"""Depth offset (in units of the depth buffer) that lifts arrows over all parts."""


def _cells(indices: NDArray[np.int64]) -> NDArray[np.int64]:
    """Return indices (n, k) in VTK's cell format: each row preceded by its length."""
    rows, size = indices.shape
    return np.hstack([np.full((rows, 1), size), indices]).ravel()


def _colors(colors: Any) -> Pixels:
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


def _plotter(panel: Panel, size: tuple[int, int]) -> pyvista.Plotter:
    """Return an empty plotter with light and camera."""
    plotter = pyvista.Plotter(off_screen=True, window_size=list(size), lighting="none")
    plotter.background_color = pyvista.Color("white")
    axes = panel.camera.axes()
    for direction, intensity in LIGHTS:
        where = np.array(direction) @ axes
        light = pyvista.Light(
            position=tuple(where), focal_point=(0.0, 0.0, 0.0), intensity=intensity
        )
        light.positional = False
        plotter.add_light(light)
    view, camera = panel.camera, plotter.camera
    half = half_height(panel, size)
    camera.parallel_projection = True
    everything = np.concatenate([s.points for s in panel.surfaces])
    distance = 3.0 * float(np.linalg.norm(np.ptp(everything, axis=0))) + half
    camera.focal_point = tuple(view.center)
    camera.position = tuple(view.center + distance * view.toward)
    camera.up = tuple(view.up)
    camera.parallel_scale = half
    return plotter


def _shot(plotter: pyvista.Plotter, background: str = "white") -> Pixels:
    plotter.background_color = pyvista.Color(background)
    plotter.render()
    return np.asarray(plotter.screenshot(None, return_img=True))[:, :, :3].copy()


def _depth(panel: Panel, size: tuple[int, int], span: float, *, transparent: bool) -> Pixels:
    """Return the model in shades of its distance, arrows in their colours over it."""
    plotter = _plotter(panel, size)
    for surface in panel.surfaces:
        if not surface.on_top:
            _add_surface(plotter, surface)
    plotter.reset_camera_clipping_range()
    _shot(plotter)
    # VTK gives coordinates along the direction of sight, seen from the eye.
    seen = np.asarray(plotter.get_image_depth(), dtype=float)
    eye = float(np.array(plotter.camera.position) @ panel.camera.toward)
    behind = nearest(panel) - (eye + seen)
    pixels, drawn = depth_shades(behind, span), ~np.isnan(behind)
    arrows = [surface for surface in panel.surfaces if surface.on_top]
    if arrows:
        plotter.clear_actors()
        for surface in arrows:
            _add_surface(plotter, surface)
        plotter.reset_camera_clipping_range()
        over = _shot(plotter)
        there = ~np.isnan(plotter.get_image_depth())
        pixels[there] = over[there]
        drawn |= there
    plotter.close()
    return with_mask(pixels, drawn) if transparent else pixels


def paint(
    panel: Panel, size: tuple[int, int], *, transparent: bool = False, depth: float = 0.0
) -> tuple[Pixels, float]:
    """Return the picture of one panel, (height, width, 3 or 4), and its pixels per metre.

    Parameters
    ----------
    panel : Panel
    size : (int, int)
        Width and height in pixels.
    transparent : bool
        Leave the background out: four channels.
    depth : float
        When it is more than zero: shades of distance up to this (m) instead of colours and light.
    """
    per_metre = 0.5 * size[1] / half_height(panel, size)
    if depth > 0.0:
        return _depth(panel, size, depth, transparent=transparent), per_metre
    plotter = _plotter(panel, size)
    plotter.enable_anti_aliasing(aa_type="msaa", multi_samples=4)
    for lines in panel.lines:
        _add_lines(plotter, lines)
    for surface in far_first(panel).surfaces:
        _add_surface(plotter, surface)
    plotter.reset_camera_clipping_range()
    image = _shot(plotter)
    if transparent:
        image = see_through(image, _shot(plotter, "black"))
    plotter.close()
    return image, per_metre


def warm_up() -> None:
    """Open a tiny picture: what takes long the first time is done before the scene arrives."""
    plotter = pyvista.Plotter(off_screen=True, window_size=[16, 16])
    plotter.add_mesh(pyvista.PolyData(np.eye(3), _cells(np.array([[0, 1, 2]]))))
    plotter.screenshot(None, return_img=True)
    plotter.close()
