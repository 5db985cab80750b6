"""Ports of a part from an LDCad shadow library."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from technic.ldraw.features import Feature, build_features, to_ports
from technic.ldraw.library import Library
from technic.ldraw.pieces import SAME_LINE, Piece
from technic.ldraw.primitives import carries_ports, features_from_primitives, walker_of
from technic.ldraw.shadow import ShadowLibrary, snaps_of
from technic.ldraw.snap_shapes import pieces_of
from technic.parts.definition import Port, PortKind

__all__ = ["describes", "features_from_shadow", "ports_from_shadow"]


def describes(library: Library, shadow: ShadowLibrary, key: str) -> bool:
    """Tell whether a shadow library describes the part at `key` as a whole.

    A shadow of the part's own file does. Shadows of subparts alone do only when the part's file adds
    nothing that has no shadow: many primitives have none (ends of holes, ends of axles), because the
    parts that use them are expected to have one.

    Parameters
    ----------
    library : Library
    shadow : ShadowLibrary
    key : str
        Path in the library.
    """
    if shadow.has(key):
        return True
    described = False
    for name in sorted({reference.name for reference in library.file(key).references}):
        target = library.find(name)
        if target is None or not carries_ports(library, target):
            continue
        if "parts/" in target:
            if not describes(library, shadow, target):
                return False
            described = True
        elif not snaps_of(shadow, library, target):
            return False
    return described


def features_from_shadow(
    library: Library, shadow: ShadowLibrary, number: str
) -> tuple[Feature, ...] | None:
    """Return the whole features of a part (LDU); None when the shadow library does not describe it."""
    key = library.key_of(number)
    if key is None or not describes(library, shadow, key):
        return None
    pieces: list[Piece] = []
    for snap in snaps_of(shadow, library, key):
        pieces += pieces_of(snap)
    return build_features(pieces)


def ports_from_shadow(
    library: Library, shadow: ShadowLibrary, number: str
) -> tuple[Port, ...] | None:
    """Return the ports of a part from a shadow library.

    The shadow library does not tell pins with friction ridges from those without; this comes from
    the part's primitives, else from its title.

    Parameters
    ----------
    library : Library
        The LDraw library whose files the shadows belong to.
    shadow : ShadowLibrary
    number : str
        LDraw number, with or without ``.dat``.

    Returns
    -------
    tuple of Port or None
        In part coordinates (m); None when the shadow library says nothing about the part.

    Raises
    ------
    InputError
        A broken snap line, or broken part files.
    """
    features = features_from_shadow(library, shadow, number)
    if features is None:
        return None
    resolved = library.resolve(number)
    title = library.file(resolved.key).title.lower() if resolved else ""
    # "pin with friction", but not "without friction"
    by_title = "friction" in title and "without friction" not in title
    drawn = [
        feature
        for feature in features_from_primitives(walker_of(library), number) or ()
        if feature.kind is PortKind.PIN
    ]

    def rough(pin: Feature) -> bool:
        for feature in drawn:
            if np.linalg.norm(feature.middle - pin.middle) < SAME_LINE:
                return feature.friction
        return by_title

    return to_ports(
        replace(feature, friction=rough(feature)) if feature.kind is PortKind.PIN else feature
        for feature in features
    )
