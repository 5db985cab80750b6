"""Solid models of library parts in the user's cache folder, found by a hash of what they are made from.

One file a part: the condensed model (an archive as the shipped one), or the reason why there is none.
Files are written under another name and renamed, so that a reader sees a whole file or none and
programs that run at the same time do not disturb each other. When the folder grows beyond its limit,
what was not used for longest is deleted. A cache that cannot be written costs time only.
"""

from __future__ import annotations

import os
import tempfile
from contextlib import suppress
from dataclasses import dataclass
from pathlib import Path
from typing import Final

from technic.errors import InputError, UsageError
from technic.fem.solid.store import read, write
from technic.fem.solid.superelement import SuperElement
from technic.folders import cache_folder

__all__ = ["DEFAULT_LIMIT_MB", "Refusal", "limit", "recall", "remember", "shrink", "solids_folder"]

DEFAULT_LIMIT_MB: Final = 500
"""Size of the cache (MB) unless ``TECHNIC_CACHE_MB`` says otherwise: some two thousand parts."""

_SHRINK_TO: Final = 0.9
"""Share of the limit that is kept, so that not every new file deletes one."""

_LONGEST_REASON: Final = 2000


@dataclass(frozen=True, slots=True)
class Refusal:
    """Why a part has no solid model."""

    reason: str


def solids_folder() -> Path:
    """Return the folder of the cached models."""
    return cache_folder() / "solids"


def limit() -> int:
    """Return how many bytes the cached models may take.

    Raises
    ------
    UsageError
        ``TECHNIC_CACHE_MB`` is no number.
    """
    text = os.environ.get("TECHNIC_CACHE_MB", "")
    try:
        megabytes = float(text) if text.strip() else float(DEFAULT_LIMIT_MB)
    except ValueError:
        raise UsageError(f"TECHNIC_CACHE_MB is a number of megabytes, not {text!r}") from None
    if not 0.0 <= megabytes < 1e9:
        raise UsageError(f"TECHNIC_CACHE_MB is a number of megabytes, not {text!r}")
    return int(megabytes * 2**20)


def recall(key: str, part_id: str) -> SuperElement | Refusal | None:
    """Return what is cached under a key; None when there is nothing, or nothing that can be read.

    Parameters
    ----------
    key : str
        Hash of everything that the model depends on.
    part_id : str
        Name of the part in messages and in the archive.
    """
    folder = solids_folder()
    model, reason = folder / f"{key}.zip", folder / f"{key}.txt"
    if model.is_file():
        with suppress(InputError):
            element = read(model, part_id)
            if element is not None and element.key == key:
                _touch(model)
                return element
    with suppress(OSError, UnicodeDecodeError):
        lines = reason.read_text(encoding="utf-8").split("\n")
        # the last line is a terminator: a file cut short by a full disk lacks it
        if len(lines) == 3 and lines[0] == key and lines[2] == "end":
            _touch(reason)
            return Refusal(lines[1])
    return None


def remember(key: str, part_id: str, outcome: SuperElement | Refusal) -> None:
    """Keep what came of a part under its key."""
    folder = solids_folder()
    temporary = None
    try:
        folder.mkdir(parents=True, exist_ok=True)
        handle, temporary = tempfile.mkstemp(dir=folder, prefix=".solid-")
        os.close(handle)
        if isinstance(outcome, Refusal):
            said = " ".join(outcome.reason.split())[:_LONGEST_REASON]
            Path(temporary).write_text(f"{key}\n{said}\nend", encoding="utf-8")
            os.replace(temporary, folder / f"{key}.txt")
        else:
            write(temporary, {part_id: outcome})
            os.replace(temporary, folder / f"{key}.zip")
    except OSError:
        if temporary is not None:
            with suppress(OSError):
                os.unlink(temporary)
        return
    shrink(folder, limit())


def shrink(folder: Path, most: int) -> None:
    """Delete what was not used for longest until the folder's files take at most `most` bytes."""
    files: list[tuple[int, int, str]] = []
    with suppress(OSError):
        for entry in os.scandir(folder):
            with suppress(OSError):  # another program may have deleted it meanwhile
                if entry.name.endswith((".zip", ".txt")) and entry.is_file(follow_symlinks=False):
                    state = entry.stat(follow_symlinks=False)
                    files.append((state.st_mtime_ns, state.st_size, entry.path))
    total = sum(size for _, size, _ in files)
    if total <= most:
        return
    for _, size, path in sorted(files):
        with suppress(OSError):
            os.unlink(path)
            total -= size
        if total <= _SHRINK_TO * most:
            return


def _touch(path: Path) -> None:
    """Note that a file was used."""
    with suppress(OSError):
        os.utime(path)
