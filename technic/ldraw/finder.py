"""From a part number to its definition: the catalogue first, then the LDraw library.

The library is opened when the first number is met that the catalogue does not have. Parts that a
model draws itself (an MPD with embedded files) are read as if they stood in the library. A part whose
files are broken is no reason to refuse a model: the finder keeps the reason, and the part is listed
as unknown.
"""

from __future__ import annotations

from collections.abc import Callable, Iterable, Mapping
from pathlib import Path
from typing import TYPE_CHECKING

from technic.errors import InputError, UsageError
from technic.geometry import Pose
from technic.ldraw.library import Library, reference_key
from technic.ldraw.sections import Document
from technic.ldraw.shadow import ShadowLibrary
from technic.parts.catalogue import catalogue
from technic.parts.definition import PartDefinition

if TYPE_CHECKING:
    from technic.ldraw.imported import Solids

__all__ = ["EmbeddedStore", "LibrarySource", "PartFinder", "ShadowSource"]

LibrarySource = Library | Callable[[], Library | None] | None
"""A library, a function that opens one when it is needed, or none."""

ShadowSource = ShadowLibrary | Callable[[], ShadowLibrary | None] | None
"""The same for the shadow library."""


class EmbeddedStore:
    """The parts that a model draws itself, as a place of a library.

    Parameters
    ----------
    document : Document
    """

    def __init__(self, document: Document) -> None:
        self.path = Path(document.path)
        self._texts: dict[str, str] = {}
        for section in document.sections:
            if section is document.main or not section.is_part:
                continue
            try:
                key = reference_key(section.name)
            except InputError:
                continue  # a name that no library file can have: nothing refers to it there
            text = "\n".join(line.text for line in section.lines)
            self._texts.setdefault(f"parts/{key}", text)

    def __len__(self) -> int:
        return len(self._texts)

    def __contains__(self, key: str) -> bool:
        return key in self._texts

    def keys(self) -> Iterable[str]:
        """Return the paths of all files."""
        return self._texts.keys()

    def read(self, key: str) -> bytes:
        """Return the content of one file."""
        return self._texts[key].encode("utf-8")

    def release(self) -> str:
        """Return ``""``: a model is no release."""
        return ""


class PartFinder:
    """Finds definitions; each number is looked up once.

    Parameters
    ----------
    library : Library, callable or None
        Where parts come from that the catalogue does not have; a callable is asked at the first one.
    shadow : ShadowLibrary, callable or None
        Connectors of the library's parts.
    document : Document, optional
        The model, for the parts that it draws itself.
    solids : {"draft", "fine", "off"}
        How finely parts of the library are meshed when an analysis wants solid models.

    Raises
    ------
    UsageError
        A shadow library without a library.
    """

    def __init__(
        self,
        library: LibrarySource = None,
        shadow: ShadowSource = None,
        document: Document | None = None,
        *,
        solids: Solids = "draft",
    ) -> None:
        if library is None and shadow is not None:
            raise UsageError("the shadow library adds to an LDraw library: give that too")
        self._source = library
        self._opened: Library | None = None
        self._asked = False
        self._document = document
        self._embedded: EmbeddedStore | None = None
        self._found: dict[str, tuple[PartDefinition, Pose] | None] = {}
        self._refused: dict[str, str] = {}
        self._solids = solids
        self._shadow_source = shadow
        self._shadow: ShadowLibrary | None = None
        self.catalogue = catalogue()

    @property
    def refused(self) -> Mapping[str, str]:
        """Why parts that the library has could not be used, by number."""
        return self._refused

    @property
    def library(self) -> Library | None:
        """The library, when a part was looked for in it."""
        return self._opened

    @property
    def shadow(self) -> ShadowLibrary | None:
        """The shadow library, when a part was looked for in the library."""
        return self._shadow

    def __call__(self, number: str) -> tuple[PartDefinition, Pose] | None:
        """Return the definition and the pose of its frame in the frame of `number`, or None."""
        if number not in self._found:
            entry = self.catalogue.resolve(number)
            if entry is None:
                made = self._from_library(number)
                entry = None if made is None else (made, Pose.identity())
            self._found[number] = entry
        return self._found[number]

    def _open(self) -> Library | None:
        if not self._asked:
            self._asked = True
            source = self._source
            library = source() if callable(source) else source
            if library is not None and self._document is not None:
                self._embedded = EmbeddedStore(self._document)
                if len(self._embedded):
                    # What the author drew is what he built with.
                    library = Library([self._embedded, *library.stores], main=1)
            self._opened = library
            if library is not None:
                shadow = self._shadow_source
                self._shadow = shadow() if callable(shadow) else shadow
        return self._opened

    def _from_library(self, number: str) -> PartDefinition | None:
        if number.lower().endswith((".ldr", ".mpd", ".l3b")):
            return None  # a submodel
        library = self._open()
        if library is None:
            return None
        from technic.ldraw.imported import definition_from_library

        try:
            made = definition_from_library(
                library, number, shadow=self._shadow, solids=self._solids
            )
        except InputError as error:
            said = f"its file in the parts library is unusable: {error.message}"
            if error.path is not None:
                # what is wrong may stand in a subfile
                place = str(error.path).removeprefix(f"{library.path}/")
                said += f" ({place}" + (f", line {error.line})" if error.line else ")")
            self._refused[number] = said
            return None
        key = f"parts/{number.lower().removesuffix('.dat')}.dat"
        if made is not None and not made.ports and self._embedded and key in self._embedded:
            # Stickers, mostly: a body that nothing can hold says nothing about the model.
            self._refused[number] = "drawn in the file, without anything to connect it with"
            return None
        return made
