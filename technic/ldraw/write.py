"""Write LDraw: a document as it was read, with new parts in a new step, or a fresh document.

What is read is written back letter for letter: encoding, byte order mark, line ends, editors' own
lines. New parts follow the last line of the main model. Files are replaced in one move, so that a
failure never leaves half a model behind.
"""

from __future__ import annotations

import os
import re
import tempfile
from collections.abc import Sequence
from dataclasses import dataclass
from math import isfinite
from pathlib import Path
from typing import Final

from technic.errors import UsageError
from technic.geometry import Pose
from technic.ldraw.sections import Document
from technic.ldraw.syntax import PADDING, Meta, Text, normalise
from technic.units import LDU

__all__ = [
    "NewPart",
    "append_parts",
    "format_number",
    "new_document",
    "reference_line",
    "save",
]

DECIMALS: Final = 6
"""Decimals written. LDraw editors write at most six; a rotation is then exact to 1e-6."""


@dataclass(frozen=True, slots=True, eq=False)
class NewPart:
    """A part to write.

    Parameters
    ----------
    number : str
        Part number, with or without ``.dat``.
    color : int
    pose : Pose
        In the axes of the main model, SI.
    """

    number: str
    color: int
    pose: Pose


def format_number(value: float) -> str:
    """Return a number with at most six decimals, trailing zeros trimmed, and no negative zero.

    >>> format_number(-0.70710678), format_number(20.0), format_number(-1e-9)
    ('-0.707107', '20', '0')

    Raises
    ------
    ValueError
        Not finite.
    """
    if not isfinite(value):
        raise ValueError(f"{value!r} cannot be written as a coordinate")
    text = f"{value:.{DECIMALS}f}".rstrip("0").rstrip(".")
    return "0" if text == "-0" else text


def reference_line(part: NewPart) -> str:
    """Return the line (type 1) of a part, without a line end."""
    name = part.number.strip()
    if not name or re.search(r"[\r\n]", name):
        raise ValueError(f"{part.number!r} is no part number")
    if not normalise(name).endswith((".dat", ".ldr", ".mpd")):
        name += ".dat"
    numbers = [*(part.pose.translation / LDU), *part.pose.rotation.ravel()]
    color = str(part.color) if part.color < 0x2000000 else f"0x{part.color:07X}"
    return " ".join(["1", color, *(format_number(float(v)) for v in numbers), name])


def append_parts(document: Document, parts: Sequence[NewPart]) -> Text:
    """Return the document's text with new parts in a new step at the end of the main model.

    Every line of the source stays as it is. Without parts the text is the source.

    Parameters
    ----------
    document : Document
    parts : sequence of NewPart

    Returns
    -------
    Text
        Same encoding, byte order mark and line ends as the source.
    """
    source = document.source
    if not parts:
        return source
    pieces = _LINE.findall(source.text)
    newline = _newline(pieces)
    lines = [line for line in document.main.lines if line.text.strip(PADDING) not in ("", "0")]
    # Behind the last line that says anything; line numbers count from 1. A main model without any
    # line has its 0 FILE line at least.
    at = lines[-1].number if lines else min(document.main.start, len(pieces))
    last = lines[-1] if lines else None
    in_new_step = isinstance(last, Meta) and last.words[:1] in (["STEP"], ["ROTSTEP"])
    new = [] if in_new_step or last is None else ["0 STEP"]
    new += [reference_line(part) for part in parts]
    head, tail = pieces[:at], pieces[at:]
    if head and not head[-1].endswith(("\n", "\r")):
        head[-1] += newline
    text = "".join(head) + "".join(line + newline for line in new) + "".join(tail)
    return Text(text, source.encoding, source.bom)


_LINE: Final = re.compile(r"[^\r\n]*(?:\r\n|\r|\n)|[^\r\n]+")


def _newline(pieces: Sequence[str]) -> str:
    """Return the line end that most lines have; CRLF, as LDraw wants it, when none has one."""
    counts = {"\r\n": 0, "\n": 0, "\r": 0}
    for piece in pieces:
        for end in counts:
            if piece.endswith(end):
                counts[end] += 1
                break
    best = max(counts, key=lambda end: counts[end])
    return best if counts[best] else "\r\n"


def new_document(
    name: str,
    steps: Sequence[Sequence[NewPart]],
    *,
    title: str = "",
    author: str = "",
) -> Text:
    """Return a fresh model.

    Parameters
    ----------
    name : str
        File name of the main model, e.g. ``"frame.ldr"``.
    steps : sequence of sequences of NewPart
        Parts per building step.
    title, author : str
        For the header; the title defaults to the name without its ending.
    """
    for text in (name, title, author):
        if re.search(r"[\r\n]", text):
            raise ValueError(f"{text!r} has a line break; a header line has none")
    lines = [
        f"0 FILE {name}",
        f"0 {title or Path(name).stem}",
        f"0 Name: {name}",
        f"0 Author: {author}".rstrip(),
        "0 !LDRAW_ORG Model",
        "",
    ]
    for k, step in enumerate(steps):
        if k:
            lines.append("0 STEP")
        lines += [reference_line(part) for part in step]
    return Text("".join(line + "\r\n" for line in lines))


def save(path: str | Path, text: Text) -> None:
    """Write a file: into a temporary file beside it, then in one move into place.

    Raises
    ------
    UsageError
        The folder does not exist or cannot be written to, or the encoding of the file has no sign
        for a new character. An existing file is then as it was.
    """
    path = Path(path)
    temporary = None
    try:
        raw = text.to_bytes()
        # A link stays a link: its target is replaced.
        target = path.resolve()
        if target.is_dir():
            raise UsageError(f"cannot write {path}: it is a directory; name a file in it")
        handle, temporary = tempfile.mkstemp(prefix=f".{target.name}.", dir=target.parent)
        with os.fdopen(handle, "wb") as stream:
            stream.write(raw)
            stream.flush()
            os.fsync(stream.fileno())
        os.chmod(temporary, _mode(target))
        os.replace(temporary, target)
        temporary = None
    except UnicodeEncodeError as error:
        raise UsageError(
            f"cannot write {path}: {error.object[error.start : error.end]!r} does not exist in its "
            f"encoding {text.encoding}; save the model as UTF-8 first"
        ) from error
    except OSError as error:
        raise UsageError(
            f"cannot write {path}: {error.strerror or error}; check the folder and its permissions"
        ) from error
    finally:
        if temporary is not None:
            Path(temporary).unlink(missing_ok=True)


def _mode(target: Path) -> int:
    """Return the permissions that the file has, or that a new file would get."""
    try:
        return target.stat().st_mode & 0o777
    except FileNotFoundError:
        mask = os.umask(0)
        os.umask(mask)
        return 0o666 & ~mask
