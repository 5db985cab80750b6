"""Solid models of parts: finite cells, port frames, condensation, storage.

The names are loaded when first used: an analysis reads stored matrices and never needs the mesher.
"""

from __future__ import annotations

from importlib import import_module
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from technic.fem.solid.condense import build_super_element
    from technic.fem.solid.settings import MeshSettings
    from technic.fem.solid.superelement import SuperElement, super_element_to_element

__all__ = ["MeshSettings", "SuperElement", "build_super_element", "super_element_to_element"]

_HOMES = {
    "MeshSettings": "settings",
    "SuperElement": "superelement",
    "build_super_element": "condense",
    "super_element_to_element": "superelement",
}
"""The module of this package in which each name lives."""


def __getattr__(name: str) -> Any:
    """Load a name when it is first asked for (PEP 562)."""
    if name not in _HOMES:
        raise AttributeError(f"module {__name__!r} has no attribute {name!r}")
    return getattr(import_module(f"{__name__}.{_HOMES[name]}"), name)
