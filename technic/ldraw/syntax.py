"""LDraw text: characters, lines and line types. One line in, one frozen object out.

A line is never changed: `Line.text` is what stands in the file, so that a document can be written
back as it was. Only lines of type 1 (references) are taken apart here; lines of type 0 (comments and
meta commands) and 2 to 5 (drawing) are kept as they are.

Format: LDraw.org "LDraw File Format Specification" 1.0.2.
"""

from __future__ import annotations

import codecs
import re
from collections.abc import Iterable
from dataclasses import dataclass
from math import isfinite
from pathlib import Path
from typing import Final

from technic.errors import InputError

__all__ = [
    "MAX_BYTES",
    "MAX_NUMBER",
    "PADDING",
    "Blank",
    "Drawing",
    "Line",
    "Meta",
    "Reference",
    "Text",
    "Unreadable",
    "decode",
    "normalise",
    "number_of",
    "parse_line",
    "parse_lines",
    "read_bytes",
    "split_lines",
]

MAX_BYTES: Final = 64 * 1024 * 1024
"""Largest file read. The biggest public models are about 30 MB, most of it embedded pictures."""

MAX_NUMBER: Final = 1e7
"""Largest coordinate or matrix entry: 1e7 LDU are 4 km, no model. It also keeps products of nested
matrices away from overflow."""

PADDING: Final = " \t\f\x1a\ufeff"
"""What may stand around a line: white space, the DOS end-of-file mark, and the byte order marks that
are left inside when files are joined."""

EXPORT_ADVICE: Final = (
    "Open the model in its editor and save or export it as LDraw (.ldr or .mpd), then try again."
)


# --- lines ------------------------------------------------------------------------------------
@dataclass(frozen=True, slots=True)
class Line:
    """One line of a file.

    Parameters
    ----------
    number : int
        Line number in the file, counted from 1.
    text : str
        The line as it stands, without its line end.
    """

    number: int
    text: str


class Blank(Line):
    """Nothing, or white space only."""

    __slots__ = ()


class Meta(Line):
    """Line type 0: a comment or a meta command."""

    __slots__ = ()

    @property
    def words(self) -> list[str]:
        """Words after the line type."""
        return self.text.split()[1:]


class Drawing(Line):
    """Line types 2 to 5: lines, triangles, quadrilaterals, optional lines. Kept as text."""

    __slots__ = ()


@dataclass(frozen=True, slots=True)
class Reference(Line):
    """Line type 1: a file (part or submodel) in a place.

    Parameters
    ----------
    color : int
        Colour code; 16 inherits.
    position : (3,) tuple of float
        LDU.
    matrix : (9,) tuple of float
        Row by row: ``x_parent = matrix @ x_file + position``.
    name : str
        File name as written: everything after the 14th token.
    """

    color: int
    position: tuple[float, float, float]
    matrix: tuple[float, float, float, float, float, float, float, float, float]
    name: str


@dataclass(frozen=True, slots=True)
class Unreadable(Line):
    """A line that cannot be understood and that the caller chose to skip; `reason` says why."""

    reason: str


# --- files and characters ---------------------------------------------------------------------
@dataclass(frozen=True, slots=True)
class Text:
    """Decoded text that can be encoded back to the same bytes.

    Parameters
    ----------
    text : str
    encoding : str
        ``"utf-8"``, ``"utf-16-le"``, ``"utf-16-be"`` or ``"latin-1"``.
    bom : bytes
        Byte order mark found at the start, or nothing.
    """

    text: str
    encoding: str = "utf-8"
    bom: bytes = b""

    def to_bytes(self) -> bytes:
        """Return the bytes of the file."""
        return self.bom + self.text.encode(self.encoding)


def read_bytes(path: Path) -> bytes:
    """Return the bytes of a regular file of at most `MAX_BYTES`.

    Raises
    ------
    InputError
        Nothing there, a directory, a device, too big, or not readable.
    """
    try:
        if path.is_dir():
            raise InputError(
                "this is a directory, not a model", path=path, remedy="Name the model file in it."
            )
        if not path.exists():
            raise InputError("no such file", path=path, remedy="Check the spelling and the folder.")
        if not path.is_file():
            raise InputError(
                "this is not a regular file", path=path, remedy="Copy the model into a file first."
            )
        if (size := path.stat().st_size) > MAX_BYTES:
            raise InputError(
                f"the file has {size / 2**20:.0f} MB; at most {MAX_BYTES // 2**20} MB are read",
                path=path,
                remedy="Take embedded pictures (0 !DATA) out, or split the model.",
            )
        return path.read_bytes()
    except (OSError, ValueError) as error:  # ValueError: a NUL in the name
        reason = error.strerror if isinstance(error, OSError) else str(error)
        raise InputError(
            f"cannot be read: {reason}", path=path, remedy="Check the permissions of the file."
        ) from error


_FOREIGN: Final = {
    b"\x89PNG": "a PNG picture",
    b"\xff\xd8\xff": "a JPEG picture",
    b"GIF8": "a GIF picture",
    b"%PDF": "a PDF document",
    b"PK\x03\x04": "a zip archive",
    b"\x1f\x8b": "a gzip archive",
    b"Rar!": "a RAR archive",
    b"7z\xbc\xaf": "a 7z archive",
}

_CONTROL: Final = re.compile(r"[\x00-\x08\x0b\x0e-\x19\x1b-\x1f\x7f]")


def decode(raw: bytes, path: Path) -> Text:
    """Return the text of a file: UTF-8, UTF-16 (with or without byte order mark), else Latin-1.

    Raises
    ------
    InputError
        The file is empty, or it is not text.
    """
    for magic, kind in _FOREIGN.items():
        if raw.startswith(magic):
            raise InputError(f"this is {kind}, not LDraw text", path=path, remedy=EXPORT_ADVICE)
    try:
        result = _decode(raw)
    except UnicodeDecodeError as error:
        raise InputError(
            f"broken UTF-16 text at byte {error.start}", path=path, remedy=EXPORT_ADVICE
        ) from error
    if not result.text.strip(" \t\r\n\f\x1a\0"):
        raise InputError("the file is empty", path=path, remedy="Save the model again.")
    # Text has no control characters but tab, line ends, form feed and the DOS end-of-file mark;
    # a stray one may sit in a comment, random bytes have one in eight.
    controls = sum(1 for _ in _CONTROL.finditer(result.text))
    if "\0" in result.text or controls > 0.01 * len(result.text):
        raise InputError("this is a binary file, not text", path=path, remedy=EXPORT_ADVICE)
    return result


def _decode(raw: bytes) -> Text:
    for bom, encoding in (
        (codecs.BOM_UTF8, "utf-8"),
        (codecs.BOM_UTF16_LE, "utf-16-le"),
        (codecs.BOM_UTF16_BE, "utf-16-be"),
    ):
        if raw.startswith(bom) and not raw.startswith(codecs.BOM_UTF32_LE):
            try:
                return Text(raw[len(bom) :].decode(encoding), encoding, bom)
            except UnicodeDecodeError:
                if encoding != "utf-8":
                    raise
                return Text(raw[len(bom) :].decode("latin-1"), "latin-1", bom)
    # UTF-16 without a mark: nearly every second byte of LDraw text is then zero.
    head = raw[:2000]
    if len(head) >= 4 and len(raw) % 2 == 0:
        even, odd = head[0::2].count(0), head[1::2].count(0)
        many, few = 0.45 * len(head), 0.05 * len(head)
        if odd > many and even < few:
            return Text(raw.decode("utf-16-le"), "utf-16-le")
        if even > many and odd < few:
            return Text(raw.decode("utf-16-be"), "utf-16-be")
    try:
        return Text(raw.decode("utf-8"), "utf-8")
    except UnicodeDecodeError:
        return Text(raw.decode("latin-1"), "latin-1")


_LINE_END: Final = re.compile(r"\r\n|\n|\r")


def split_lines(text: str) -> list[str]:
    """Return the lines of a text without their ends (LF, CRLF or bare CR, and no other character)."""
    lines = _LINE_END.split(text)
    if lines and not lines[-1]:
        lines.pop()
    return lines


# --- names ------------------------------------------------------------------------------------
def normalise(name: str) -> str:
    r"""Return a file name for comparison: lower case, ``/`` for ``\``, no white space around it."""
    return name.strip().replace("\\", "/").lower()


def number_of(name: str) -> str:
    """Return the part number that a file name stands for: normalised, without ``.dat``."""
    return normalise(name).removesuffix(".dat")


# --- parsing ----------------------------------------------------------------------------------
_NUMBER: Final = r"[+-]?(?:\d+(?:\.\d*)?|\.\d+)(?:[eE][+-]?\d+)?"
_COLOR: Final = r"\d{1,10}|0[xX][0-9a-fA-F]{1,8}"
_REFERENCE: Final = re.compile(
    rf"1[ \t]+({_COLOR})[ \t]+({_NUMBER}(?:[ \t]+{_NUMBER}){{11}})[ \t]+(\S.*)",
    re.ASCII | re.DOTALL,
)
_WHITE: Final = re.compile(r"[ \t]+")
_FIELDS: Final = ("colour", "x", "y", "z", "a", "b", "c", "d", "e", "f", "g", "h", "i")


def parse_line(text: str, number: int, path: Path) -> Line:
    """Return one line as an object.

    Raises
    ------
    InputError
        With file and line: truncated reference, token that is no number, not finite or out of
        range, unknown line type.
    """
    stripped = text.strip(PADDING)
    if not stripped:
        return Blank(number, text)
    kind = stripped[0]
    if len(stripped) > 1 and stripped[1] not in " \t":
        kind = ""
    if kind == "0":
        return Meta(number, text)
    if kind == "1":
        match = _REFERENCE.fullmatch(stripped)
        if match is not None:
            color, numbers, name = match.groups()
            values = [*map(float, numbers.split())]
            if min(values) >= -MAX_NUMBER and max(values) <= MAX_NUMBER:
                return Reference(
                    number,
                    text,
                    int(color, 16) if color[:2] in ("0x", "0X") else int(color),
                    (values[0], values[1], values[2]),
                    tuple(values[3:]),  # type: ignore[arg-type]  # the pattern has 12 numbers
                    name,
                )
        raise _reference_error(stripped, number, path)
    if kind in ("2", "3", "4", "5"):
        return Drawing(number, text)
    raise InputError(
        f"line type {_short(_WHITE.split(stripped)[0])} is unknown; LDraw lines begin with 0 to 5",
        path=path,
        line=number,
        remedy="Is this an LDraw file? If so, delete the line or make it a comment (0 // ...).",
    )


def parse_lines(
    texts: Iterable[str], first: int, path: Path, *, skip_bad_lines: bool = False
) -> tuple[Line, ...]:
    """Return consecutive lines as objects; the first one has the number `first`.

    With `skip_bad_lines` a line that cannot be understood becomes `Unreadable`; else it raises
    `InputError`.
    """
    if not skip_bad_lines:
        return tuple(parse_line(text, first + k, path) for k, text in enumerate(texts))
    lines: list[Line] = []
    for number, text in enumerate(texts, first):
        try:
            lines.append(parse_line(text, number, path))
        except InputError as error:
            lines.append(Unreadable(number, text, error.message))
    return tuple(lines)


def _short(token: str) -> str:
    return repr(token if len(token) <= 24 else token[:21] + "...")


def _reference_error(text: str, number: int, path: Path) -> InputError:
    """Say what is wrong with a line of type 1."""
    tokens = _WHITE.split(text)
    remedy = "Correct the line in a text editor, or save the model again in its editor."
    for field, token in zip(_FIELDS, tokens[1:14], strict=False):
        if field == "colour":
            if not re.fullmatch(_COLOR, token, re.ASCII):
                return InputError(
                    f"colour {_short(token)} is not a colour code",
                    path=path,
                    line=number,
                    remedy=remedy,
                )
            continue
        value = float(token) if re.fullmatch(_NUMBER, token, re.ASCII) else None
        if value is not None and isfinite(value) and abs(value) <= MAX_NUMBER:
            continue
        if token is tokens[-1] and not re.match(
            r"[+-]?\.?\d[.,\d]*$|[+-]?(nan|inf)", token, re.IGNORECASE
        ):
            break  # the file name, with numbers missing before it
        if value is not None:
            message = f"{field} = {_short(token)} is beyond {MAX_NUMBER:g} LDU (4 km)"
        elif re.fullmatch(r"[+-]?(nan|inf(inity)?)(\(.*\))?", token, re.IGNORECASE):
            message = f"{field} = {_short(token)} is not a finite number"
        elif "," in token:
            message = f"{field} = {_short(token)} is not a number"
            remedy = "LDraw numbers use a decimal point: export again with English number format."
        else:
            message = f"{field} = {_short(token)} is not a number"
        return InputError(message, path=path, line=number, remedy=remedy)
    return InputError(
        f"this part line is cut off: {len(tokens)} of 15 fields "
        "(1 colour x y z a b c d e f g h i file)",
        path=path,
        line=number,
        remedy=remedy,
    )
