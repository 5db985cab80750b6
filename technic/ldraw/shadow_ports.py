"""Ports of a part from an LDCad shadow library."""

from __future__ import annotations

from dataclasses import replace

from technic.ldraw.features import Feature, build_features, to_ports
from technic.ldraw.library import Library
from technic.ldraw.pieces import Piece
from technic.ldraw.shadow import ShadowLibrary, snaps_of
from technic.ldraw.snap_shapes import pieces_of
from technic.parts.definition import Port, PortKind

__all__ = ["features_from_shadow", "ports_from_shadow"]


def features_from_shadow(
    library: Library, shadow: ShadowLibrary, number: str
) -> tuple[Feature, ...] | None:
    """Return the whole features of a part (LDU); None when the shadow library does not describe it."""
    key = library.key_of(number)
    if key is None or not shadow.describes(library, key):
        return None
    snaps = snaps_of(shadow, library, key)
    if not snaps:
        return None
    pieces: list[Piece] = []
    for snap in snaps:
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
    rough = "friction" in title and "without friction" not in title
    return to_ports(
        replace(feature, friction=rough) if feature.kind is PortKind.PIN else feature
        for feature in features
    )
