"""Solid models of parts: finite cells, port frames, condensation, storage."""

from technic.fem.solid.condense import build_super_element
from technic.fem.solid.grid import MeshSettings
from technic.fem.solid.superelement import SuperElement, super_element_to_element

__all__ = ["MeshSettings", "SuperElement", "build_super_element", "super_element_to_element"]
