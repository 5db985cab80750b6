"""Where library files lie: folders and zips behind one face, with a cached list of files.

The list is kept as plain text in the user's cache folder, under a name made from the library's path,
and is used only while the library is unchanged (size and time of a zip, times of a folder's
folders). It is written to a temporary file and renamed, so that concurrent runs are safe.
"""

from __future__ import annotations

import hashlib
import os
import re
import stat
import struct
import tempfile
import zipfile
import zlib
from collections.abc import Iterable
from pathlib import Path
from typing import Final, Protocol

from technic.errors import InputError
from technic.folders import cache_folder

__all__ = ["FolderStore", "Store", "ZipStore", "list_size", "open_store"]

MAX_FILE: Final = 32 * 2**20
"""Largest file that is read (bytes); the largest official part has 3 MB."""

MAX_RATIO: Final = 200
"""Largest compression ratio of a file above 1 MB: LDraw text compresses by 5 to 20."""

MAX_FILES: Final = 1_000_000
"""Largest number of files in a library; the full library has 45 thousand."""

MAX_LIST: Final = 32 * 2**20
"""Largest list of files in a zip (bytes); that of the full library has 5 MB."""

_INDEX_VERSION: Final = "technic-library-index 3"
_TOP: Final = ("p", "parts", "models", "unofficial")
_RELEASE = re.compile(rb"!LDRAW_ORG[^\r\n]*UPDATE (\d{4}-\d{2})")


class Store(Protocol):
    """A set of library files with lower-case paths such as ``"parts/s/3001s01.dat"``."""

    path: Path

    def __len__(self) -> int: ...

    def __contains__(self, key: str) -> bool: ...

    def keys(self) -> Iterable[str]:
        """Return the paths of all files."""
        ...

    def read(self, key: str) -> bytes:
        """Return the content of one file."""
        ...

    def release(self) -> str:
        """Return the newest release named by the files, e.g. ``"2026-02"``, or ``""``."""
        ...


def open_store(path: Path) -> Store:
    """Open a folder or a zip as a store.

    Raises
    ------
    InputError
        Missing, unreadable, damaged, or not a parts library.
    """
    try:
        if path.is_dir():
            return FolderStore(path)
        if path.is_file():
            return ZipStore(path)
    except OSError as error:
        raise InputError(
            f"cannot be read ({error.strerror})",
            path=error.filename or path,
            remedy="Check its permissions, or name another parts library with --library.",
        ) from None
    raise InputError("there is no such file or folder", path=path)


def _no_library(path: Path) -> InputError:
    return InputError(
        "this is not an LDraw parts library: it has no parts and no p folder",
        path=path,
        remedy="Name the folder that holds them, or complete.zip from ldraw.org.",
    )


def _index_file(path: Path) -> Path:
    name = hashlib.sha256(str(path.resolve()).encode()).hexdigest()[:24]
    return cache_folder() / "libraries" / f"{name}.txt"


def _load_index(path: Path, stamp: str) -> list[list[str]] | None:
    """Return the rows of the cached index, or None when it is absent, stale or damaged."""
    try:
        text = _index_file(path).read_text(encoding="utf-8")
    except (OSError, UnicodeDecodeError):
        return None
    lines = text.split("\n")
    # the last line is a terminator: a file cut short by a full disk lacks it
    if len(lines) < 3 or lines[0] != _INDEX_VERSION or lines[1] != stamp or lines[-1] != "end":
        return None
    return [line.split("\t") for line in lines[2:-1]]


def _save_index(path: Path, stamp: str, rows: Iterable[str]) -> None:
    """Write the index; a cache that cannot be written costs time only."""
    target = _index_file(path)
    temporary = None
    try:
        target.parent.mkdir(parents=True, exist_ok=True)
        handle, temporary = tempfile.mkstemp(dir=target.parent, prefix=".index-")
        with os.fdopen(handle, "w", encoding="utf-8", newline="\n") as stream:
            stream.write("\n".join([_INDEX_VERSION, stamp, *rows, "end"]))
        os.replace(temporary, target)
    except OSError:
        if temporary is not None and os.path.exists(temporary):
            os.unlink(temporary)


class FolderStore:
    """A library in a folder."""

    def __init__(self, path: Path) -> None:
        self.path = path
        self._names: dict[str, str] = {}
        self._release: str | None = None
        cached = _load_index(path, "folder")
        if cached is not None and self._current(cached):
            self._names = {row[1].lower(): row[1] for row in cached if row[0] == "f"}
        else:
            self._scan()
        if not any(key.startswith(("parts/", "p/", "unofficial/")) for key in self._names):
            raise _no_library(path)

    def _current(self, rows: list[list[str]]) -> bool:
        """Tell whether every folder is unchanged: adding or removing a file changes its time."""
        listed = {row[1] for row in rows if row[0] == "d"}
        if any((self.path / top).is_dir() and self._real(top) not in listed for top in _TOP):
            return False
        try:
            return all(
                os.stat(self.path / row[1]).st_mtime_ns == int(row[2])
                for row in rows
                if row[0] == "d"
            )
        except (OSError, ValueError, IndexError):
            return False

    def _real(self, top: str) -> str:
        """Return the true spelling of a top folder (Debian and Windows differ in case)."""
        for name in os.listdir(self.path):
            if name.lower() == top:
                return name
        return top

    def _scan(self) -> None:
        rows: list[str] = []
        # the top folder itself is not stamped: models are saved there all the time
        pending = [
            entry.name
            for entry in sorted(os.scandir(self.path), key=lambda entry: entry.name)
            if entry.name.lower() in _TOP and entry.is_dir()
        ]
        while pending:
            folder = pending.pop()
            rows.append(f"d\t{folder}\t{os.stat(self.path / folder).st_mtime_ns}")
            for entry in os.scandir(self.path / folder):
                name = f"{folder}/{entry.name}"
                # a link to a folder could make the walk endless
                if entry.is_dir(follow_symlinks=False):
                    pending.append(name)
                elif entry.name.lower().endswith((".dat", ".ldr", ".mpd")):
                    self._names[name.lower()] = name
                    rows.append(f"f\t{name}")
            if len(self._names) > MAX_FILES:
                raise InputError(
                    f"more than {MAX_FILES} files: not a parts library", path=self.path
                )
        _save_index(self.path, "folder", rows)

    def __len__(self) -> int:
        return len(self._names)

    def __contains__(self, key: str) -> bool:
        return key in self._names

    def keys(self) -> Iterable[str]:
        """Return the paths of all files."""
        return self._names.keys()

    def read(self, key: str) -> bytes:
        """Return the content of one file."""
        path = self.path / self._names[key]
        try:
            state = path.stat()
            if not stat.S_ISREG(state.st_mode):  # a pipe would never end
                raise InputError("this is no regular file", path=path)
            if state.st_size <= MAX_FILE:
                with open(path, "rb") as stream:
                    data = stream.read(MAX_FILE + 1)
                if len(data) <= MAX_FILE:
                    return data
        except OSError as error:
            raise InputError(f"cannot be read ({error.strerror})", path=path) from None
        raise InputError(f"{state.st_size} bytes: larger than any part ({MAX_FILE})", path=path)

    def release(self) -> str:
        """Return the newest release named by the files, e.g. ``"2026-02"``, or ``""``."""
        if self._release is None:
            self._release = _newest(self)
        return self._release


class ZipStore:
    """A library in a zip, with or without a folder around it (``ldraw/`` in the official one)."""

    def __init__(self, path: Path) -> None:
        self.path = path
        self._entries: dict[str, tuple[int, int, int, int, int]] = {}
        self._release: str | None = None
        state = path.stat()
        stamp = f"zip {state.st_size} {state.st_mtime_ns}"
        cached = _load_index(path, stamp)
        try:
            if cached is not None:
                self._entries = {
                    row[0]: (int(row[1]), int(row[2]), int(row[3]), int(row[4]), int(row[5]))
                    for row in cached
                }
        except (ValueError, IndexError):
            self._entries = {}
        if not self._entries:
            self._scan()
            rows = ("\t".join([key, *map(str, row)]) for key, row in self._entries.items())
            _save_index(path, stamp, rows)

    def _scan(self) -> None:
        try:
            listed = list_size(self.path)
            if listed > MAX_LIST:
                raise InputError(
                    f"its list of files has {listed} bytes: not a parts library", path=self.path
                )
            with zipfile.ZipFile(self.path) as archive:
                infos = archive.infolist()
        except (zipfile.BadZipFile, struct.error, EOFError, NotImplementedError) as error:
            raise InputError(
                f"this zip is damaged ({error})", path=self.path, remedy="Download it again."
            ) from None
        if len(infos) > MAX_FILES:
            raise InputError(f"more than {MAX_FILES} files: not a parts library", path=self.path)
        names = [info.filename.replace("\\", "/").lower() for info in infos]
        # the official zip has everything below "ldraw/", downloads from GitHub below a name of theirs
        tops = {name.split("/", 1)[0] for name in names if "/" in name}
        wrapper = f"{tops.pop()}/" if len(tops) == 1 and not tops & {*_TOP} else "ldraw/"
        for info, name in zip(infos, names, strict=True):
            key = name.removeprefix(wrapper)
            if key.split("/", 1)[0] not in _TOP or ".." in key.split("/"):
                continue
            if not key.endswith((".dat", ".ldr", ".mpd")):
                continue
            if info.flag_bits & 1:
                raise InputError("this zip is encrypted", path=self.path)
            self._entries[key] = (
                info.header_offset,
                info.compress_size,
                info.file_size,
                info.compress_type,
                info.CRC,
            )
        if not self._entries:
            raise _no_library(self.path)

    def __len__(self) -> int:
        return len(self._entries)

    def __contains__(self, key: str) -> bool:
        return key in self._entries

    def keys(self) -> Iterable[str]:
        """Return the paths of all files."""
        return self._entries.keys()

    def read(self, key: str) -> bytes:
        """Return the content of one file."""
        offset, packed, size, method, checksum = self._entries[key]
        where = f"{self.path}/{key}"
        if size > MAX_FILE or (size > 2**20 and size > MAX_RATIO * max(packed, 1)):
            raise InputError(f"{size} bytes packed into {packed}: larger than any part", path=where)
        try:
            with open(self.path, "rb") as stream:
                stream.seek(offset)
                header = stream.read(30)
                if len(header) < 30 or header[:4] != b"PK\x03\x04":
                    raise ValueError("no entry where the list says")
                names, extra = struct.unpack_from("<HH", header, 26)
                stream.seek(names + extra, os.SEEK_CUR)
                data = stream.read(packed)
            if method == zipfile.ZIP_DEFLATED:
                # never unpack more than was announced, whatever the data says
                data = zlib.decompressobj(-15).decompress(data, size + 1)
            elif method != zipfile.ZIP_STORED:
                raise ValueError(f"compression method {method}")
            if len(data) != size or zlib.crc32(data) != checksum:
                raise ValueError("the content does not match its checksum")
        except (OSError, ValueError, zlib.error) as error:
            raise InputError(
                f"this entry of the zip is damaged ({error})",
                path=where,
                remedy="Download the library again.",
            ) from None
        return data

    def release(self) -> str:
        """Return the newest release named by the files, e.g. ``"2026-02"``, or ``""``."""
        if self._release is None:
            self._release = _newest(self)
        return self._release


def list_size(path: Path) -> int:
    """Return the size of a zip's list of files (bytes), as its end states it; 0 when there is none.

    `zipfile` reads the whole list into memory before it can be asked how long it is.
    """
    with open(path, "rb") as stream:
        stream.seek(0, os.SEEK_END)
        begin = max(0, stream.tell() - 2**16 - 128)  # the end record may have a comment behind it
        stream.seek(begin)
        tail = stream.read()
        at = tail.rfind(b"PK\x05\x06")
        if at < 0 or len(tail) < at + 22:
            return 0
        (size,) = struct.unpack_from("<L", tail, at + 12)
        if size == 0xFFFFFFFF and at >= 20 and tail[at - 20 : at - 16] == b"PK\x06\x07":
            (where,) = struct.unpack_from("<Q", tail, at - 12)
            stream.seek(where)
            record = stream.read(56)
            if len(record) == 56:
                (size,) = struct.unpack_from("<Q", record, 40)
    return int(size)


def _newest(store: Store, sample: int = 400) -> str:
    """Return the newest release among an even sample of the files.

    Every release touches thousands of files, so a few hundred suffice to meet it.
    """
    keys = sorted(store.keys())
    newest = b""
    for key in keys[:: max(1, len(keys) // sample)]:
        try:
            head = store.read(key)[:2000]
        except InputError:
            continue  # said when a model needs the file
        for match in _RELEASE.finditer(head):
            newest = max(newest, match.group(1))
    return newest.decode()
