"""Ends and pieces that only something flexible holds: a hose in a connector, a band on a hook.

Flexible things are not modelled, so what they hold is loose in the analysis. The report should say so,
and not that there is nothing.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import replace
from typing import Final

import numpy as np

from technic.assembly.model import Assembly, Finding, FindingKind
from technic.geometry import Array
from technic.ldraw.document import Placement
from technic.units import LDU, PITCH

__all__ = ["beside_flexible"]

NOTHING: Final = "nothing there"

SHOWN: Final = {"stretched": "a stretched piece"}
"""What a label's first word is called, where it does not name a thing."""


def beside_flexible(
    assembly: Assembly, flexible: Mapping[str, Sequence[Placement]]
) -> tuple[Finding, ...]:
    """Return the findings of an assembly; where something flexible holds a part, they say so.

    Parameters
    ----------
    assembly : Assembly
        With its joints and findings.
    flexible : mapping of str to sequence of Placement
        Pieces of flexible things, by what they are a piece of; see `document.Placements`.
    """
    pieces = [(label, piece) for label, group in flexible.items() for piece in group]
    if not pieces:
        return assembly.findings
    points = np.array([piece.position for _, piece in pieces]) * LDU
    told = []
    for finding in assembly.findings:
        open_end = finding.kind is FindingKind.OPEN_PORT and NOTHING in finding.message
        if not open_end and finding.kind is not FindingKind.LOOSE:
            told.append(finding)
            continue
        near = _nearest(_ports(assembly, finding), points)
        if near is None:
            told.append(finding)
            continue
        what = pieces[near][0].split(" in ")[0].split(" (")[0]
        what = next((word for start, word in SHOWN.items() if what.startswith(start)), f"a {what}")
        if open_end:
            start, _, _ = finding.message.partition(NOTHING)
            message = f"{start}{NOTHING} but {what}, which is not modelled"
        else:
            message = f"{finding.message}; {what} holds it, which is not modelled"
        told.append(replace(finding, message=message, distance=None))
    return tuple(told)


def _ports(assembly: Assembly, finding: Finding) -> Array:
    """Return the connectors of the parts of a finding, or of the end that it names, (n, 3)."""
    places = []
    for k in finding.parts:
        part = assembly.parts[k]
        named = [port for port in part.ports if repr(port.name) in finding.message]
        for port in named or part.ports:
            ends = np.array([-0.5, 0.0, 0.5])[:, None] * port.length * port.axis
            places.append(part.pose.points(port.position + ends))
    return np.concatenate([np.empty((0, 3)), *places])


def _nearest(ports: Array, points: Array) -> int | None:
    """Return the piece that comes nearest to a connector, if one comes within a pitch."""
    if not len(ports):
        return None
    apart = np.linalg.norm(ports[:, None] - points[None], axis=2).min(axis=0)
    best = int(np.argmin(apart))
    return best if apart[best] <= PITCH else None
