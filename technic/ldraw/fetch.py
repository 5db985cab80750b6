"""Download of the LDraw parts library: resumed, checked, and put in place in one step.

The download goes into ``<name>.part`` beside the target, with a note of what the server said about
the file. A second attempt asks for the rest only if the file there is still the same one. Only a
complete, undamaged parts library takes the place of what was there.
"""

from __future__ import annotations

import http.client
import json
import os
import shutil
import urllib.error
import urllib.parse
import urllib.request
import zipfile
from collections.abc import Callable, Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any, Final

from technic.errors import InputError, MissingDependency, UsageError
from technic.folders import data_folder
from technic.ldraw.storage import MAX_FILES, MAX_LIST, MAX_RATIO, list_size

__all__ = ["DEFAULT_URL", "Fetched", "fetch", "library_target", "library_url"]

DEFAULT_URL: Final = "https://library.ldraw.org/library/updates/complete.zip"

MAX_BYTES: Final = 2**30
"""Largest download; the complete library has about 130 MB."""

MAX_UNPACKED: Final = 20 * 2**30
"""Largest sum of unpacked sizes; the complete library has about 1.5 GB."""

_CHUNK: Final = 1 << 16
_TIMEOUT_S: Final = 30.0

Progress = Callable[[int, int | None], None]
"""Called with the bytes that are there and how many there will be, if the server says so."""


@dataclass(frozen=True, slots=True)
class Fetched:
    """A finished download: the file, its size, and how much of it was there before."""

    path: Path
    size: int
    resumed: int


def library_url() -> str:
    """Return where the library is fetched from: ``TECHNIC_LIBRARY_URL`` or ldraw.org."""
    return os.environ.get("TECHNIC_LIBRARY_URL") or DEFAULT_URL


def library_target() -> Path:
    """Return where the fetched library is kept; it is found there without being named."""
    return data_folder() / "ldraw" / "complete.zip"


def fetch(
    url: str, target: Path, *, progress: Progress | None = None, timeout: float = _TIMEOUT_S
) -> Fetched:
    """Download a parts library.

    Parameters
    ----------
    url : str
        ``https`` or ``http``.
    target : Path
        Replaced when the download is complete and is a parts library.
    progress : callable, optional
    timeout : float
        How long the server may be silent (s).

    Raises
    ------
    UsageError
        Not a web address, or the folder cannot be written.
    MissingDependency
        The server does not answer, refuses, or the connection breaks; what came is kept.
    InputError
        What came is no parts library, or absurdly big; it is deleted.
    """
    if urllib.parse.urlsplit(url).scheme not in ("http", "https"):
        raise UsageError(f"{url!r} is not a web address: it must begin with http or https")
    part = target.with_name(target.name + ".part")
    note = target.with_name(target.name + ".part.json")
    try:
        target.parent.mkdir(parents=True, exist_ok=True)
        resumed = _download(url, part, note, progress, timeout)
    except urllib.error.HTTPError as error:
        raise MissingDependency(f"{url}: the server answers {error.code} {error.reason}") from None
    except (
        urllib.error.URLError,
        http.client.HTTPException,
        TimeoutError,
        ConnectionError,
    ) as error:
        reason = getattr(error, "reason", None) or error
        raise MissingDependency(
            f"{url}: the download broke off ({reason})\n  Run it again: it goes on where it stopped."
        ) from None
    except OSError as error:
        raise UsageError(f"{target}: cannot be written ({error.strerror or error})") from None
    size = part.stat().st_size
    try:
        _check(part, url)
    except InputError:
        part.unlink()
        note.unlink(missing_ok=True)
        raise
    os.replace(part, target)
    note.unlink(missing_ok=True)
    return Fetched(target, size, resumed)


def _opener() -> urllib.request.OpenerDirector:
    """Return an opener for the web only: a redirection must not lead to a file or elsewhere."""
    opener = urllib.request.OpenerDirector()
    for handler in (
        urllib.request.ProxyHandler(),
        urllib.request.HTTPHandler(),
        urllib.request.HTTPSHandler(),
        urllib.request.HTTPDefaultErrorHandler(),
        urllib.request.HTTPRedirectHandler(),
        urllib.request.HTTPErrorProcessor(),
        urllib.request.UnknownHandler(),
    ):
        opener.add_handler(handler)
    return opener


def _download(url: str, part: Path, note: Path, progress: Progress | None, timeout: float) -> int:
    """Bring `part` to its full size; return how much of it was there before."""
    have = part.stat().st_size if part.exists() else 0
    said = _said(note)
    headers = {"User-Agent": "technic-rigidity", "Accept-Encoding": "identity"}
    if have and said.get("url") == url and said.get("total") == have:
        return have  # complete, only the check was interrupted
    if have and said.get("url") == url and said.get("validator"):
        headers |= {"Range": f"bytes={have}-", "If-Range": said["validator"]}
    else:
        have = 0
    with _opener().open(urllib.request.Request(url, headers=headers), timeout=timeout) as answer:
        going_on = answer.status == 206 and _starts_at(answer.headers.get("Content-Range")) == have
        if answer.status == 206 and not going_on:
            raise http.client.HTTPException("the server sent another piece than the one asked for")
        if not going_on:
            have = 0
        length = answer.headers.get("Content-Length")
        total = have + int(length) if length and length.isdigit() else None
        if (total or 0) > MAX_BYTES:
            raise InputError(f"{total} bytes: larger than any parts library", path=url)
        if total and shutil.disk_usage(part.parent).free < total - have:
            raise OSError(f"it needs {total / 2**20:.0f} MB and the disk has less")
        # A weak validator (W/"...") does not promise equal bytes.
        etag = answer.headers.get("ETag") or ""
        validator = etag if etag.startswith('"') else answer.headers.get("Last-Modified")
        note.write_text(
            json.dumps({"url": url, "validator": validator, "total": total}), encoding="utf-8"
        )
        done = have
        with open(part, "ab" if going_on else "wb") as stream:
            while chunk := answer.read(_CHUNK):
                done += len(chunk)
                if done > MAX_BYTES:
                    raise InputError("larger than any parts library", path=url)
                stream.write(chunk)
                if progress is not None:
                    progress(done, total)
    if total is not None and done != total:
        raise http.client.IncompleteRead(b"", total - done)
    return have


def _said(note: Path) -> Mapping[str, Any]:
    """Return what was noted about an unfinished download; nothing when the note is damaged."""
    try:
        content = json.loads(note.read_text(encoding="utf-8"))
    except (OSError, ValueError):
        return {}
    return content if isinstance(content, dict) else {}


def _starts_at(content_range: str | None) -> int | None:
    words = (content_range or "").replace("-", " ").split()
    return int(words[1]) if len(words) > 1 and words[1].isdigit() else None


def _check(path: Path, url: str) -> None:
    """Refuse what is no parts library, before it takes the place of one."""
    remedy = "Check the address, or download complete.zip from ldraw.org by hand."
    try:
        listed = list_size(path)
        if listed > MAX_LIST:
            raise InputError(f"its list of files has {listed} bytes: no parts library", path=url)
        with zipfile.ZipFile(path) as archive:
            infos = archive.infolist()
    except (zipfile.BadZipFile, EOFError, ValueError, NotImplementedError, OSError) as error:
        raise InputError(f"what came is no zip ({error})", path=url, remedy=remedy) from None
    names = [info.filename.lower().removeprefix("ldraw/") for info in infos]
    if not all(any(name.startswith(top) for name in names) for top in ("parts/", "p/")):
        raise InputError("what came is no LDraw parts library", path=url, remedy=remedy)
    unpacked = sum(info.file_size for info in infos)
    packed = sum(info.compress_size for info in infos)
    if len(infos) > MAX_FILES or unpacked > min(MAX_UNPACKED, MAX_RATIO * max(packed, 2**20)):
        raise InputError(f"it unpacks to {unpacked} bytes: no parts library", path=url)
