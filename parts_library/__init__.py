"""Facts about parts, as data: ports, shapes, sections, materials. No program code.

SCHEMA.md describes the files, SOURCES.md says where their numbers come from.

>>> files().joinpath("materials.toml").is_file()
True
"""

from __future__ import annotations

from importlib.resources import files as _files
from importlib.resources.abc import Traversable

__all__ = ["files"]


def files() -> Traversable:
    """Return the folder of this package's data, wherever it is installed."""
    return _files(__name__)
