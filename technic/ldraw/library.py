r"""Access to an LDraw parts library: a folder or a zip, read as it is.

A library is a set of text files below ``parts``, ``p``, ``models`` and ``unofficial``. Names are
case-insensitive and ``\`` equals ``/``. The list of files is cached in the user's cache folder, so
that the full library of more than forty thousand files opens at once the second time.

Everything read here comes from outside: sizes, nesting and references are bounded, and a reference
that points out of the library is refused.
"""

from __future__ import annotations

import os
import re
import sys
from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Final

import numpy as np

from technic.errors import InputError, MissingDependency
from technic.folders import data_folder
from technic.geometry import Array, readonly
from technic.ldraw.storage import Store, open_store

__all__ = [
    "Library",
    "PartFile",
    "Reference",
    "Resolved",
    "candidate_folders",
    "find_library",
    "reference_key",
]

FOLDERS: Final = ("parts/", "p/", "models/", "unofficial/parts/", "unofficial/p/")
"""Folders of a library in the order in which a reference is looked up."""

MAX_MOVES: Final = 16
"""Longest chain of moved-to stubs that is followed; real ones have at most three links."""

MAX_REFERENCES: Final = 50_000
"""Most type 1 lines of one file; the largest official ones have some thousand."""

_DRIVE = re.compile(r"^[a-z]:")


def reference_key(name: str) -> str:
    r"""Return the form of a referenced name under which a library lists it.

    Parameters
    ----------
    name : str
        As written in the file, e.g. ``"s\\3001s01.DAT"``.

    Returns
    -------
    str
        Lower case, with forward slashes.

    Raises
    ------
    InputError
        An absolute path, or one that climbs out of the library.
    """
    key = name.strip().replace("\\", "/").lower()
    if key.startswith("/") or _DRIVE.match(key) or ".." in key.split("/") or "\0" in key:
        raise InputError(
            f"the reference {name!r} points out of the parts library",
            remedy="Parts are named relative to the library, e.g. 3001.dat or s\\3001s01.dat.",
        )
    return key


@dataclass(frozen=True, slots=True, eq=False)
class Reference:
    """A type 1 line of a part file.

    Parameters
    ----------
    name : str
        Key of the file it refers to.
    matrix : (3, 3) ndarray
    offset : (3,) ndarray
        In LDU: ``x_outer = matrix @ x_inner + offset``.
    inverted : bool
        Preceded by ``0 BFC INVERTNEXT``.
    line : int
        Line in the file, counted from 1.
    """

    name: str
    matrix: Array
    offset: Array
    inverted: bool
    line: int


@dataclass(frozen=True, slots=True, eq=False)
class PartFile:
    """What the ports and the surface of a part need from its file.

    Parameters
    ----------
    key : str
        Path in the library, lower case.
    title : str
        First line, without the leading zero.
    category : str
        Text of the ``!LDRAW_ORG`` line, e.g. ``"Part UPDATE 2025-09"``.
    references : tuple of Reference
    """

    key: str
    title: str
    category: str
    references: tuple[Reference, ...]


@dataclass(frozen=True, slots=True, eq=False)
class Resolved:
    """Where a part number leads, moved-to stubs followed.

    Parameters
    ----------
    key : str
        The file that holds the part.
    matrix, offset : ndarray
        From the coordinates of that file to those of the number asked for (LDU).
    via : tuple of str
        Keys of the stubs passed on the way.
    """

    key: str
    matrix: Array
    offset: Array
    via: tuple[str, ...]


class Library:
    """A parts library in one or more places; the first place that has a file wins.

    Parameters
    ----------
    stores : sequence of Store
    main : int
        Which of them is the library itself; others come before it (parts that a model draws) or
        after it (unofficial parts).
    """

    def __init__(self, stores: Sequence[Store], main: int = 0) -> None:
        self.stores = tuple(stores)
        self._main = main
        self._files: dict[str, PartFile] = {}
        self.memo: dict[str, object] = {}
        """For modules that derive something from the library and want to keep it as long."""

    @classmethod
    def open(cls, *paths: str | Path) -> Library:
        """Open a library in a folder or a zip, with optional further ones (unofficial parts).

        Raises
        ------
        InputError
            Missing, unreadable, damaged, or no library at all.
        """
        stores = [open_store(Path(path)) for path in paths]
        if not stores:
            raise InputError("no parts library was named")
        return cls(stores)

    @property
    def path(self) -> Path:
        """The main place of the library."""
        return self.stores[self._main].path

    def __len__(self) -> int:
        """Return the number of files."""
        return sum(len(store) for store in self.stores)

    def part_numbers(self) -> Iterator[str]:
        """Yield the numbers of all parts (files directly below ``parts``), sorted."""
        seen = set()
        for store in self.stores:
            for key in store.keys():  # noqa: SIM118 (a store is no mapping)
                for folder in ("parts/", "unofficial/parts/"):
                    tail = key.removeprefix(folder)
                    if tail != key and "/" not in tail and tail.endswith(".dat"):
                        seen.add(tail.removesuffix(".dat"))
        yield from sorted(seen)

    def find(self, name: str) -> str | None:
        """Return the path in the library of a referenced name, or None.

        Raises
        ------
        InputError
            The reference points out of the library.
        """
        key = reference_key(name)
        for store in self.stores:
            for folder in FOLDERS:
                if folder + key in store:
                    return folder + key
            if key in store:
                return key
        return None

    def key_of(self, number: str) -> str | None:
        """Return the path of the file of a part number, with or without ``.dat``, or None."""
        name = number.strip().lower()
        return self.find(name if name.endswith((".dat", ".ldr", ".mpd")) else f"{name}.dat")

    def text(self, key: str) -> str:
        """Return the text of the file at `key` (as returned by `find`).

        Raises
        ------
        InputError
            Not there, too big, or damaged.
        """
        for store in self.stores:
            if key in store:
                data = store.read(key)
                try:
                    return data.decode("utf-8-sig")
                except UnicodeDecodeError:
                    return data.decode("latin-1")
        raise InputError(f"the parts library has no file {key}", path=self.path)

    def file(self, key: str) -> PartFile:
        """Return the parsed file at `key`; parsed once."""
        found = self._files.get(key)
        if found is None:
            found = self._files[key] = _parse(key, self.text(key), self.where(key))
        return found

    def where(self, key: str) -> str:
        """Return how a message names the file at `key`."""
        for store in self.stores:
            if key in store:
                return f"{store.path}/{key}"
        return key

    def resolve(self, number: str) -> Resolved | None:
        """Return where a part number leads, or None when the library does not have it.

        Moved-to stubs are followed through the type 1 line inside them, with its transform: some
        parts turned when they moved. Aliases are ordinary files that refer to the part.

        Parameters
        ----------
        number : str
            With or without ``.dat``.
        """
        key = self.key_of(number)
        if key is None:
            return None
        matrix, offset, via = np.eye(3), np.zeros(3), [key]
        while True:
            file = self.file(key)
            if not file.title.lower().startswith("~moved to") or not file.references:
                return Resolved(key, readonly(matrix), readonly(offset), tuple(via[:-1]))
            reference = file.references[0]
            target = self.find(reference.name)
            if target is None:
                return None
            if target in via or len(via) > MAX_MOVES:
                chain = " -> ".join([*via, target])
                raise InputError(f"moved-to stubs go in a circle: {chain}", path=self.where(key))
            offset = matrix @ reference.offset + offset
            matrix = matrix @ reference.matrix
            key = target
            via.append(key)

    def release(self) -> str:
        """Return the newest release that a sample of the files names, e.g. ``"2026-02"``.

        ``""`` when no file names one. A full library states its release in ``!LDRAW_ORG`` lines.
        """
        newest = ""
        for store in self.stores:
            stated = store.release()
            newest = max(newest, stated)
        return newest


def _parse(key: str, text: str, where: str) -> PartFile:
    """Read header and type 1 lines of one file."""
    title, category = "", ""
    references: list[Reference] = []
    inverted = False
    for number, line in enumerate(text.splitlines(), start=1):
        line = line.strip()
        if not line:
            continue
        if line[0] == "0":
            words = line.split()
            if number == 1:
                title = line[1:].strip()
            elif len(words) > 2 and words[1] == "!LDRAW_ORG" and not category:
                category = " ".join(words[2:])
            elif len(words) > 2 and words[1] == "BFC" and "INVERTNEXT" in words[2:]:
                inverted = True
            continue
        if line[0] == "1" and line[1:2].isspace():
            tokens = line.split(None, 14)
            if len(tokens) < 15:
                raise InputError(
                    "a type 1 line needs 14 tokens and a name", path=where, line=number
                )
            try:
                values = np.array([float(token) for token in tokens[2:14]])
            except ValueError:
                raise InputError(
                    "a type 1 line holds something that is not a number", path=where, line=number
                ) from None
            if not np.isfinite(values).all():
                raise InputError(
                    "a type 1 line holds a number that is not finite", path=where, line=number
                )
            try:
                name = reference_key(tokens[14])
            except InputError as error:
                raise InputError(
                    error.message, path=where, line=number, remedy=error.remedy
                ) from None
            if len(references) == MAX_REFERENCES:
                raise InputError(f"more than {MAX_REFERENCES} references", path=where, line=number)
            references.append(
                Reference(
                    name, readonly(values[3:].reshape(3, 3)), readonly(values[:3]), inverted, number
                )
            )
        inverted = False
    return PartFile(key, title, category, tuple(references))


def candidate_folders() -> tuple[Path, ...]:
    """Return the places where a library is looked for when none is named, in order."""
    home = Path.home()
    places = []
    if os.environ.get("LDRAWDIR"):
        places.append(Path(os.environ["LDRAWDIR"]))
    places.append(data_folder() / "ldraw")
    places += [home / "ldraw", home / ".ldraw", home / "LDraw", Path("/usr/share/ldraw")]
    if sys.platform == "darwin":
        places += [
            Path("/Applications/Studio 2.0/ldraw"),
            Path("/Library/LDRAW"),
            home / "Library/ldraw",
        ]
    elif sys.platform == "win32":
        places += [
            Path("C:/Program Files/Studio 2.0/ldraw"),
            Path("C:/LDraw"),
            Path("C:/Users/Public/Documents/LDraw"),
        ]
    else:
        # Studio runs under Wine here, in the default prefix
        places.append(home / ".wine/drive_c/Program Files/Studio 2.0/ldraw")
    return tuple(dict.fromkeys(places))


def find_library(explicit: str | Path | None = None) -> Library | None:
    """Return the parts library to use, or None when there is none.

    The order is: `explicit`, the environment variable ``LDRAWDIR``, what
    `technic parts fetch` brought, ``~/ldraw``, ``~/.ldraw``,
    ``/usr/share/ldraw``, Studio's folder. What is named explicitly or by ``LDRAWDIR`` must work.

    Raises
    ------
    MissingDependency
        `explicit` or ``LDRAWDIR`` names a place that does not exist.
    InputError
        It exists, but is no library.
    """
    if explicit is None and os.environ.get("LDRAWDIR"):
        explicit = os.environ["LDRAWDIR"]
    if explicit is not None:
        if not Path(explicit).exists():
            raise MissingDependency(f"there is no LDraw parts library at {explicit}")
        return Library.open(explicit)
    for place in candidate_folders():
        if (place / "parts").is_dir():
            return Library.open(place)
        for archive in ("complete.zip", "ldraw.zip"):
            if (place / archive).is_file():
                return Library.open(place / archive)
    return None
