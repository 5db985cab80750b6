"""Stiffness of joints: tables with provenance, and how they are measured. Knows no part of `technic`.

>>> files().joinpath("tables", "default.toml").is_file()
True
"""

from __future__ import annotations

from importlib.resources import files as _files
from importlib.resources.abc import Traversable

__all__ = ["files"]


def files() -> Traversable:
    """Return the folder of this package's data, wherever it is installed."""
    return _files(__name__)
