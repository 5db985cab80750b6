"""Pictures as an MP4 film that every browser, telephone and slide show plays (H.264, yuv420p).

The encoder is the program ffmpeg, in a process of its own: the one that the extra ``mp4``
(imageio-ffmpeg) brings, or one that the system has.
"""

from __future__ import annotations

import shutil
import subprocess
import tempfile
from collections.abc import Sequence
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from technic.errors import MissingDependency

__all__ = ["find_ffmpeg", "mp4"]


def find_ffmpeg() -> str:
    """Return the path of ffmpeg.

    Raises
    ------
    MissingDependency
        Neither the extra nor the system has it; the message says what to install.
    """
    try:
        import imageio_ffmpeg
    except ImportError:
        found = shutil.which("ffmpeg")
    else:
        found = imageio_ffmpeg.get_ffmpeg_exe()
    if found is None:
        raise MissingDependency(
            "no MP4 was made: ffmpeg is missing\n"
            '  Install the extra: pip install "technic-rigidity[mp4]"\n'
            "  or, on Debian or Ubuntu: apt install ffmpeg\n"
            "  An animation whose name ends in .gif needs neither."
        )
    return found


def mp4(frames: Sequence[NDArray[np.uint8]], seconds: float, rounds: int = 1) -> bytes:
    """Return an MP4 film.

    Parameters
    ----------
    frames : sequence of (height, width, 3) ndarray of uint8
        All of one size, even in both directions (H.264 halves the colours).
    seconds : float
        That one round takes.
    rounds : int
        How often the frames are shown.

    Raises
    ------
    MissingDependency
        When ffmpeg is missing or cannot encode H.264.
    """
    height, width = frames[0].shape[:2]
    program = find_ffmpeg()
    rate = f"{len(frames) / seconds:.6g}"
    with tempfile.TemporaryDirectory(prefix="technic-") as folder:
        target = Path(folder) / "film.mp4"
        command = [program, "-v", "error", "-y", "-f", "rawvideo", "-pixel_format", "rgb24"]
        command += ["-video_size", f"{width}x{height}", "-framerate", rate, "-i", "-"]
        command += ["-c:v", "libx264", "-crf", "24", "-pix_fmt", "yuv420p", "-threads", "1"]
        # The table of contents first: plays while it loads; the same film gives the same file.
        command += ["-movflags", "+faststart", "-bitexact", str(target)]
        data = b"".join(np.ascontiguousarray(frame).tobytes() for frame in frames) * rounds
        done = subprocess.run(command, input=data, capture_output=True, check=False)
        if done.returncode != 0:
            said = done.stderr.decode(errors="replace").strip().splitlines()
            raise MissingDependency(
                f"no MP4 was made: {program} failed ({said[-1] if said else done.returncode})\n"
                '  Install the extra: pip install --upgrade "technic-rigidity[mp4]"'
            )
        return target.read_bytes()
