"""Write files so that a reader never sees half of one."""

from __future__ import annotations

import os
import tempfile
from collections.abc import Callable
from pathlib import Path

from technic.errors import UsageError

__all__ = ["check_writable", "write_atomic", "write_bytes"]


def check_writable(path: Path) -> None:
    """Refuse, before any work is done, a path that cannot be written.

    Raises
    ------
    UsageError
        When the directory does not exist or the path is a directory.
    """
    if path.is_dir():
        raise UsageError(f"{path} is a directory; name a file in it")
    if not path.parent.is_dir():
        raise UsageError(f"the directory {path.parent} does not exist")
    if not os.access(path.parent, os.W_OK):
        raise UsageError(f"the directory {path.parent} cannot be written")


def write_atomic(path: Path, write: Callable[[Path], None]) -> None:
    """Let `write` fill a temporary file beside `path`, then put it in place.

    Whatever goes wrong, `path` holds the old content or the new, never a part of it.

    Parameters
    ----------
    path : Path
    write : callable
        Gets the temporary file's path (same suffix as `path`).

    Raises
    ------
    UsageError
        When the system refuses to write.
    """
    check_writable(path)
    try:
        handle, name = tempfile.mkstemp(
            prefix=f".{path.stem}-", suffix=path.suffix, dir=path.parent
        )
        os.close(handle)
    except OSError as error:
        raise UsageError(f"{path} cannot be written: {error.strerror}") from error
    temporary = Path(name)
    try:
        write(temporary)
        mask = os.umask(0)
        os.umask(mask)
        temporary.chmod(0o666 & ~mask)
        temporary.replace(path)
    except OSError as error:
        raise UsageError(f"{path} cannot be written: {error.strerror}") from error
    finally:
        temporary.unlink(missing_ok=True)


def write_bytes(path: Path, content: bytes) -> None:
    """Write a file in one move.

    Raises
    ------
    UsageError
        When the system refuses to write.
    """
    write_atomic(path, lambda temporary: _fill(temporary, content))


def _fill(path: Path, content: bytes) -> None:
    path.write_bytes(content)
