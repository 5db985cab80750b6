"""A model file as sections: plain LDraw files, multi-part documents (MPD) and Studio archives.

The first ``0 FILE`` of an MPD is the main model; text before it and after ``0 NOFILE`` is no part of
the model, and ``0 !DATA`` blocks (base64) are skipped. A file without ``0 FILE`` is one section.

Format: LDraw.org "MPD and Image Embedding Language Extension".
"""

from __future__ import annotations

import hashlib
import io
import re
import zipfile
import zlib
from collections.abc import Mapping
from dataclasses import dataclass, field
from pathlib import Path
from types import MappingProxyType
from typing import Final

from technic.errors import InputError
from technic.ldraw.syntax import (
    MAX_BYTES,
    PADDING,
    Drawing,
    Line,
    Meta,
    Reference,
    Text,
    Unreadable,
    decode,
    normalise,
    parse_lines,
    read_bytes,
    split_lines,
)

__all__ = ["Document", "Notice", "Section", "document_from_text", "read"]


@dataclass(frozen=True, slots=True)
class Notice:
    """Something about the file that the user should know, with the lines it concerns."""

    message: str
    lines: tuple[int, ...] = ()


@dataclass(frozen=True, slots=True, eq=False)
class Section:
    """One file of a multi-part document, or the only one of a plain file.

    Parameters
    ----------
    name : str
        As written after ``0 FILE``; the file's own name when there is no such line.
    path : Path
        The file on disk that holds it.
    lines : tuple of Line
        Without the ``0 FILE`` line; line numbers are those of the file on disk.
    start : int
        Number of the ``0 FILE`` line (or of the first line).
    end : int
        Number of the last line.
    scope : mapping of str to Section
        Every section of the same file by normalised name, itself included: what the references in
        it can mean.
    """

    name: str
    path: Path
    lines: tuple[Line, ...]
    start: int
    end: int
    scope: Mapping[str, Section] = field(repr=False)

    @property
    def references(self) -> tuple[Reference, ...]:
        """Lines of type 1, in order."""
        return tuple(line for line in self.lines if isinstance(line, Reference))

    @property
    def ldraw_type(self) -> str:
        """First word of the ``!LDRAW_ORG`` header in lower case without ``unofficial_``, or empty."""
        for line in self.lines:
            if isinstance(line, Reference):
                break  # the header ends where the contents begin
            if isinstance(line, Meta):
                words = line.words
                if len(words) > 1 and words[0] in ("!LDRAW_ORG", "LDRAW_ORG"):
                    return words[1].lower().removeprefix("unofficial_")
        return ""

    @property
    def is_part(self) -> bool:
        """A part with its drawing, not a submodel: says its header, or else its name (``.dat``).

        A ``.dat`` whose header says Model is a submodel only when nothing is drawn in it: real
        files hold stickers under such a header.
        """
        kind = self.ldraw_type
        if kind.endswith(("part", "primitive", "shortcut")):
            return True
        if not normalise(self.name).endswith(".dat"):
            return False
        return kind != "model" or any(isinstance(line, Drawing) for line in self.lines)


@dataclass(frozen=True, slots=True, eq=False)
class Document:
    """A model file.

    Parameters
    ----------
    path : Path
    sections : tuple of Section
        The main model first.
    source : Text
        The whole text as it stands in the file.
    sha256 : str
        Of the file on disk.
    notices : tuple of Notice
    """

    path: Path
    sections: tuple[Section, ...]
    source: Text
    sha256: str
    notices: tuple[Notice, ...] = ()

    @property
    def main(self) -> Section:
        """The main model."""
        return self.sections[0]


def read(path: str | Path, *, skip_bad_lines: bool = False) -> Document:
    """Read an LDraw model: ``.ldr``, ``.mpd``, ``.dat``, or a Studio archive ``.io``.

    Parameters
    ----------
    path : path-like
    skip_bad_lines : bool
        Leave lines out that cannot be understood, with a notice. By default they are errors.

    Raises
    ------
    InputError
        With file, line and remedy.
    """
    path = Path(path)
    raw = read_bytes(path)
    digest = hashlib.sha256(raw).hexdigest()
    if raw.startswith(b"PK\x03\x04") or path.suffix.lower() == ".io":
        raw = _model_of_archive(raw, path)
    return document_from_text(decode(raw, path), path, sha256=digest, skip_bad_lines=skip_bad_lines)


_HEADER: Final = re.compile(rf"[{PADDING}]*0[ \t]+(FILE|NOFILE|!DATA)(?:[ \t]+(.*))?")

_STARTS: Final = "0" + PADDING


def document_from_text(
    source: Text, path: str | Path, *, sha256: str = "", skip_bad_lines: bool = False
) -> Document:
    """Return the document that a text is; see `read`."""
    path = Path(path)
    texts = split_lines(source.text)
    marks: list[tuple[int, str, str]] = []  # (index, keyword, name)
    for index, text in enumerate(texts):
        if text[:1] in _STARTS and (match := _HEADER.fullmatch(text)) is not None:
            marks.append((index, match[1], (match[2] or "").strip()))
    notices: list[Notice] = []
    sections: list[Section] = []
    scope: dict[str, Section] = {}
    multipart = any(keyword == "FILE" for _, keyword, _ in marks)
    if not multipart:
        stops = [index for index, keyword, _ in marks if keyword == "!DATA"]
        marks = [(-1, "FILE", path.name), *((index, "!DATA", "") for index in stops)]
    dropped = range(max(marks[0][0], 0))
    for k, (index, keyword, name) in enumerate(marks):
        stop = marks[k + 1][0] if k + 1 < len(marks) else len(texts)
        if keyword == "NOFILE":
            _note_dropped(texts, range(index + 1, stop), "after 0 NOFILE", notices)
        if keyword != "FILE":
            continue
        if not sections:
            _note_dropped(texts, dropped, "before the first 0 FILE", notices)
        section = Section(
            name,
            path,
            parse_lines(texts[index + 1 : stop], index + 2, path, skip_bad_lines=skip_bad_lines),
            max(index + 1, 1),
            stop,
            MappingProxyType(scope),
        )
        sections.append(section)
        first = scope.setdefault(normalise(name), section)
        if first is not section:
            notices.append(
                Notice(
                    f"section {name!r} appears twice; the first one (line {first.start}) counts",
                    (section.start,),
                )
            )
    bad = [line for s in sections for line in s.lines if isinstance(line, Unreadable)]
    for line in bad:
        notices.append(Notice(f"line left out: {line.reason}", (line.number,)))
    return Document(path, tuple(sections), source, sha256, tuple(notices))


def _note_dropped(texts: list[str], indices: range, where: str, notices: list[Notice]) -> None:
    lines = tuple(k + 1 for k in indices if texts[k].lstrip().startswith("1 "))
    if lines:
        notices.append(Notice(f"{len(lines)} lines {where} are no part of the model", lines))


# --- Studio archives --------------------------------------------------------------------------
_STUDIO_ADVICE: Final = (
    "Open it in BrickLink Studio and export it (File > Export As > Export as LDraw)."
)


def _model_of_archive(raw: bytes, path: Path) -> bytes:
    """Return ``model.ldr`` of a Studio archive.

    Raises
    ------
    InputError
        Not an archive, damaged, encrypted, too big, or without a model.
    """
    try:
        with zipfile.ZipFile(io.BytesIO(raw)) as archive:
            found = {info.filename.lower(): info for info in archive.infolist()}
            info = found.get("model.ldr") or found.get("model2.ldr")
            if info is None:
                raise InputError("the archive holds no model.ldr", path=path, remedy=_STUDIO_ADVICE)
            if info.flag_bits & 1:
                raise InputError(
                    "the archive is encrypted, as Studio did until 2023",
                    path=path,
                    remedy="Save it again with a current BrickLink Studio, which uses no "
                    "password, or export it (File > Export As > Export as LDraw).",
                )
            if info.file_size > MAX_BYTES:
                raise InputError(
                    f"{info.filename} in the archive has {info.file_size / 2**20:.0f} MB; at "
                    f"most {MAX_BYTES // 2**20} MB are read",
                    path=path,
                    remedy="Split the model.",
                )
            with archive.open(info) as stream:
                return stream.read()  # zipfile stops at the size checked above
    except (
        zipfile.BadZipFile,
        zlib.error,
        EOFError,
        OSError,
        RuntimeError,  # password, or (NotImplementedError) an unknown compression
    ) as error:
        raise InputError(
            f"this is not a readable Studio archive ({error})", path=path, remedy=_STUDIO_ADVICE
        ) from error
