"""Hand a scene to the drawing process and wait for the picture.

VTK kills the interpreter when it finds no way to draw off screen. So it draws in a process of its own:
the analysis survives, and can say what to install.
"""

from __future__ import annotations

import importlib.util
import os
import pickle
import subprocess
import sys
from pathlib import Path
from typing import Literal, get_args

import technic
from technic.errors import MissingDependency
from technic.report.files import write_bytes
from technic.report.scene import Film, Scene

__all__ = ["RENDERERS", "Painter", "Renderer"]

Renderer = Literal["pyvista", "pyrender"]
RENDERERS: tuple[Renderer, ...] = get_args(Renderer)

_WINDOWS = ("vtkEGLRenderWindow", "vtkOSOpenGLRenderWindow")
"""Ways of VTK to draw without a screen on Linux: through EGL, or through Mesa's software renderer."""

_TIMEOUT_S = 300.0


def _start(window: str | None, renderer: Renderer) -> subprocess.Popen[bytes]:
    environment = dict(os.environ)
    if window is not None:
        environment["VTK_DEFAULT_OPENGL_WINDOW"] = window
    # The process must find the same package, however this one found it.
    places = [str(Path(technic.__file__).parents[1]), environment.get("PYTHONPATH", "")]
    environment["PYTHONPATH"] = os.pathsep.join(place for place in places if place)
    return subprocess.Popen(
        [sys.executable, "-m", "technic.report.draw", renderer],
        stdin=subprocess.PIPE,
        stdout=subprocess.PIPE,
        stderr=subprocess.PIPE,
        env=environment,
    )


class Painter:
    """A drawing process, started ahead so that it loads its libraries while others compute.

    Parameters
    ----------
    renderer : {"pyvista", "pyrender"}

    Raises
    ------
    MissingDependency
        When pyrender is wanted and not installed.
    """

    def __init__(self, renderer: Renderer = "pyvista") -> None:
        if renderer == "pyrender" and importlib.util.find_spec("pyrender") is None:
            raise MissingDependency(
                "no picture was drawn: pyrender is not installed\n"
                '  Install the extra: pip install "technic-rigidity[pyrender]"'
            )
        self._renderer = renderer
        chosen = os.environ.get("VTK_DEFAULT_OPENGL_WINDOW")
        if renderer == "pyrender" or chosen is not None or not sys.platform.startswith("linux"):
            self._windows: list[str | None] = [chosen]
        else:
            self._windows = list(_WINDOWS)
        self._process: subprocess.Popen[bytes] | None = _start(self._windows[0], renderer)

    def draw(self, scene: Scene, path: Path) -> None:
        """Draw one scene into a PNG file.

        Raises
        ------
        MissingDependency
            When this machine cannot draw; the message says what to install.
        UsageError
            When the file cannot be written.
        """
        write_bytes(path, self.picture(scene))

    def picture(self, scene: Scene | Film) -> bytes:
        """Return the picture of one scene as PNG, or of a film as GIF or MP4.

        Raises
        ------
        MissingDependency
            When this machine cannot draw; the message says what to install.
        """
        picture, why = None, ""
        for window in self._windows:
            process = self._process or _start(window, self._renderer)
            self._process = None
            picture, why = _ask(process, scene)
            if picture is not None:
                break
        if picture is None:
            raise MissingDependency(
                "no picture was drawn: this machine cannot draw off screen"
                + (f" ({why})" if why else "")
                + "\n  "
                + (
                    "Install the Python packages again: pip install --upgrade technic-rigidity"
                    if "No module named" in why
                    else "On Debian or Ubuntu: apt install libegl1 libgl1-mesa-dri"
                )
            )
        return picture

    def close(self) -> None:
        """End the process if it was never asked to draw."""
        process, self._process = self._process, None
        if process is not None:
            process.kill()
            process.communicate()


def _ask(process: subprocess.Popen[bytes], scene: Scene | Film) -> tuple[bytes | None, str]:
    """Return the picture, or None and the last line of what the process complained about."""
    try:
        picture, complaint = process.communicate(pickle.dumps(scene), timeout=_TIMEOUT_S)
    except subprocess.TimeoutExpired:
        process.kill()
        process.communicate()
        return None, f"no answer within {_TIMEOUT_S:.0f} s"
    if process.returncode == 0 and (
        picture.startswith((b"\x89PNG", b"GIF8")) or picture[4:8] == b"ftyp"
    ):
        return picture, ""
    lines = complaint.decode(errors="replace").strip().splitlines()
    return None, lines[-1].strip() if lines else f"exit code {process.returncode}"
