"""Draw a panel with pyrender, the second renderer. Imported by the drawing process only.

It draws through EGL like VTK, with other code from the triangles on: two programs that show the same
picture have hardly the same mistake.
"""

from __future__ import annotations

import os

# pyrender reads this when it is imported; without a screen EGL is what there is.
os.environ.setdefault("PYOPENGL_PLATFORM", "egl")

from collections.abc import Sequence

import numpy as np
import pyrender
from pyrender.constants import GLTF

from technic.geometry import Array
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

_AMBIENT = 0.42
_BRIGHT = 2.4
"""Light that makes a face seen from the front as bright as its colour: measured on white."""

_LIFT = 2e-3
"""Edges lie this share of the scene's depth before their faces."""


def _linear(colors: Array) -> Array:
    """Return colours of a screen as linear light: pyrender turns them back (power 2.2)."""
    return np.asarray(np.clip(colors, 0.0, 1.0) ** 2.2)


def _with_alpha(colors: Array, alpha: float) -> Array:
    return np.column_stack([_linear(colors), np.full(len(colors), alpha)])


def _surface(surface: Surface) -> pyrender.Mesh:
    corners = surface.points[surface.faces]
    normals = np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0])
    normals /= np.maximum(np.linalg.norm(normals, axis=1), 1e-300)[:, None]
    material = pyrender.MetallicRoughnessMaterial(
        baseColorFactor=(1.0, 1.0, 1.0, 1.0),
        metallicFactor=0.0,
        roughnessFactor=0.8,
        alphaMode="BLEND" if surface.opacity < 1.0 else "OPAQUE",
        doubleSided=True,
    )
    colors = _with_alpha(surface.colors[surface.faces].reshape(-1, 3), surface.opacity)
    return pyrender.Mesh(
        [
            pyrender.Primitive(
                positions=corners.reshape(-1, 3).astype(np.float32),
                normals=np.repeat(normals, 3, axis=0).astype(np.float32),
                color_0=colors.astype(np.float32),
                mode=GLTF.TRIANGLES,
                material=material,
            )
        ]
    )


def _lines(lines: Lines, lift: Array) -> pyrender.Mesh:
    """Return line segments that shine by themselves: light does not change a drawn line."""
    ends = lines.segments.ravel()
    material = pyrender.MetallicRoughnessMaterial(
        baseColorFactor=(0.0, 0.0, 0.0, 1.0),
        emissiveFactor=(1.0, 1.0, 1.0),
        metallicFactor=0.0,
        alphaMode="BLEND" if lines.opacity < 1.0 else "OPAQUE",
        doubleSided=True,
    )
    return pyrender.Mesh(
        [
            pyrender.Primitive(
                positions=(lines.points[ends] + lift).astype(np.float32),
                normals=np.tile(lift / np.linalg.norm(lift), (len(ends), 1)).astype(np.float32),
                color_0=_with_alpha(lines.colors[ends], lines.opacity).astype(np.float32),
                mode=GLTF.LINES,
                material=material,
            )
        ]
    )


def _pose(axes: Array, where: Array) -> Array:
    pose = np.eye(4)
    pose[:3, :3], pose[:3, 3] = axes.T, where
    return pose


class _Eye:
    """The camera of a panel: where it stands, and how far it sees."""

    def __init__(self, panel: Panel, size: tuple[int, int]) -> None:
        self.half = half_height(panel, size)
        self.axes = panel.camera.axes()
        self.center = np.asarray(panel.camera.center)
        points = np.concatenate([s.points for s in panel.surfaces])
        self.reach = 2.0 * float(np.linalg.norm(points - self.center, axis=1).max()) + 1e-3
        self.where = self.center + self.reach * panel.camera.toward
        self.near, self.far = 0.02 * self.reach, 2.0 * self.reach
        self.aspect = size[0] / size[1]

    def scene(self, background: float) -> pyrender.Scene:
        """Return an empty scene with light and this camera."""
        scene = pyrender.Scene(
            bg_color=(background, background, background, 0.0), ambient_light=(_AMBIENT,) * 3
        )
        camera = pyrender.OrthographicCamera(
            # pyrender's horizontal magnification is in the unit of the vertical one.
            xmag=self.half * self.aspect,
            ymag=self.half,
            znear=self.near,
            zfar=self.far,
        )
        scene.add(camera, pose=_pose(self.axes, self.where))
        for direction, intensity in LIGHTS:
            toward = np.array(direction) @ self.axes
            toward /= np.linalg.norm(toward)
            side = np.cross(self.axes[1] + 0.1 * self.axes[0], toward)
            side /= np.linalg.norm(side)
            frame = np.array([side, np.cross(toward, side), toward])
            light = pyrender.DirectionalLight(intensity=_BRIGHT * intensity)
            scene.add(light, pose=_pose(frame, self.where))
        return scene

    def distance(self, said: Array) -> Array:
        """Return the distance from the eye (m); not a number where nothing is.

        pyrender undoes the projection of a camera with perspective; ours has none.
        """
        near, far = self.near, self.far
        empty = said == 0.0
        depth = (near + far - 2.0 * near * far / np.where(empty, 1.0, said)) / (far - near)
        return np.where(empty, np.nan, near + 0.5 * (depth + 1.0) * (far - near))


class _Drawn:
    """One way to draw the pieces of a panel: kept so that backgrounds can be changed."""

    def __init__(self, eye: _Eye, renderer: pyrender.OffscreenRenderer) -> None:
        self.eye, self.renderer = eye, renderer

    def __call__(self, meshes: Sequence[pyrender.Mesh], background: float) -> tuple[Pixels, Array]:
        scene = self.eye.scene(background)
        for mesh in meshes:
            scene.add(mesh)
        color, depth = self.renderer.render(scene)
        return np.array(color[:, :, :3]), self.eye.distance(np.asarray(depth, dtype=float))


def paint(
    panel: Panel, size: tuple[int, int], *, transparent: bool = False, depth: float = 0.0
) -> tuple[Pixels, float]:
    """Return the picture of one panel, (height, width, 3 or 4), and its pixels per metre.

    The same as `technic.report.paint_vtk.paint`, with lines one pixel wide.
    """
    eye = _Eye(panel, size)
    lift = _LIFT * eye.reach * eye.axes[2]
    body = [_surface(s) for s in far_first(panel).surfaces if not s.on_top]
    arrows = [_surface(s) for s in panel.surfaces if s.on_top]
    if depth <= 0.0:
        body += [_lines(each, lift) for each in panel.lines if len(each.segments)]
    renderer = pyrender.OffscreenRenderer(*size)
    draw = _Drawn(eye, renderer)

    drawn = np.zeros(size[::-1], dtype=bool)

    def shot(background: float) -> Pixels:
        pixels, behind = draw(body, background)
        drawn[:] = ~np.isnan(behind)
        if depth > 0.0:
            nearest_to_eye = float(eye.where @ eye.axes[2]) - nearest(panel)
            pixels = depth_shades(behind - nearest_to_eye, depth)
        if arrows:
            over, there = draw(arrows, background)
            pixels[~np.isnan(there)] = over[~np.isnan(there)]
            drawn[:] |= ~np.isnan(there)
        return pixels

    try:
        image = shot(1.0)
        if transparent and depth > 0.0:
            image = with_mask(image, drawn)
        elif transparent:
            image = see_through(image, shot(0.0))
    finally:
        renderer.delete()
    return image, 0.5 * size[1] / eye.half


def warm_up() -> None:
    """Open a tiny picture, so that a machine that cannot draw says so at once."""
    pyrender.OffscreenRenderer(16, 16).delete()
