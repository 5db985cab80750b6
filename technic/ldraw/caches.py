"""What the program keeps in the user's cache folder, and how to get rid of it.

Only files that the program itself would write are counted and deleted: the folder may have been named
by the user and hold other things.
"""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path
from typing import Final

from technic.folders import cache_folder

__all__ = ["Cache", "caches", "clear"]

_KINDS: Final = {
    "libraries": ("lists of the files in parts libraries", ("*.txt", ".index-*")),
    "solids": ("solid models of library parts", ("*.zip", "*.txt", ".solid-*")),
}
"""Subfolder: what is in it, and the names of its files."""


@dataclass(frozen=True, slots=True)
class Cache:
    """One kind of cached data: its folder, files and their size in bytes."""

    name: str
    title: str
    folder: Path
    files: tuple[Path, ...]
    size: int


def caches() -> tuple[Cache, ...]:
    """Return what is cached, by kind."""
    found = []
    for name, (title, patterns) in _KINDS.items():
        folder = cache_folder() / name
        files = sorted(
            path
            for pattern in patterns
            for path in folder.glob(pattern)
            if path.is_file() and not path.is_symlink()
        )
        found.append(Cache(name, title, folder, tuple(files), sum(map(_size, files))))
    return tuple(found)


def _size(path: Path) -> int:
    try:
        return path.stat().st_size
    except FileNotFoundError:  # another program has deleted it meanwhile
        return 0


def clear() -> tuple[int, int]:
    """Delete what is cached; return how many files and how many bytes that were.

    Raises
    ------
    OSError
        A file cannot be deleted.
    """
    count = size = 0
    for cache in caches():
        for path in cache.files:
            path.unlink(missing_ok=True)
        count += len(cache.files)
        size += cache.size
    return count, size
