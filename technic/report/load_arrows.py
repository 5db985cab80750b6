"""Where the arrows of the worst-case load stand, and how long they are."""

from __future__ import annotations

import numpy as np

from technic.geometry import Array
from technic.report.arrows import arrow
from technic.report.drawing import Drawing
from technic.report.scene import RGB, Surface, merge
from technic.report.worst_field import WorstField
from technic.rigidity.result import RigidityReport

__all__ = ["ARROW_RADIUS", "ARROW_SHARE", "LOAD_COLOR", "load_arrows", "load_samples"]

LOAD_COLOR: RGB = (0.96, 0.49, 0.0)

ARROW_SHARE = 0.16
ARROW_RADIUS = 0.0045
_ARROWS = 24
_APART = 0.04
_BULGE = 1.25
"""A point between the ends of a part has an arrow when its load is so many times theirs."""

_FAINT = 0.25
"""Loads below this share of the largest are not drawn."""


def _sample_pairs(report: RigidityReport, field: WorstField) -> list[tuple[int, int]]:
    """Return (part, sample) pairs where arrows may stand: both ends of each part of structure, and the
    point between them that is pushed harder.
    """
    parts = report.assembly.parts
    members = report.components[0].parts
    frames = [k for k in members if not parts[k].fastener] or list(members)
    chosen = []
    for k in frames:
        mine = np.flatnonzero(field.parts == k)
        if not len(mine):
            continue
        where = field.points[mine]
        _, _, vt = np.linalg.svd(where - where.mean(axis=0), full_matrices=False)
        along = (where - where.mean(axis=0)) @ vt[0]
        ends = {int(along.argmin()), int(along.argmax())}
        # A bar that bends is pushed in its middle.
        ways = np.linalg.norm(field.displacements[mine], axis=1)
        if ways.max() > _BULGE * max(ways[i] for i in ends):
            ends.add(int(ways.argmax()))
        chosen += [(k, int(mine[i])) for i in sorted(ends)]
    return chosen


def load_samples(
    report: RigidityReport, diagonal: float, field: WorstField, scale: float
) -> list[int]:
    """Return the samples of the field where arrows stand, the largest load first.

    Arrows that would run into each other on the deformed shape are left out, the larger one speaks
    for both; so are loads too small to matter.

    Parameters
    ----------
    report : RigidityReport
    diagonal : float
        Of the model (m).
    field : WorstField
    scale : float
        By which the deformation is drawn.
    """
    pairs = _sample_pairs(report, field)
    sizes = {i: float(np.linalg.norm(field.displacements[i])) for _, i in pairs}
    largest = max(sizes.values(), default=0.0)
    if largest == 0.0:
        return []
    order = sorted((i for i in sizes if sizes[i] >= _FAINT * largest), key=lambda i: (-sizes[i], i))
    chosen: list[int] = []
    starts: list[Array] = []
    for i in order:
        start = field.points[i] + scale * field.displacements[i]
        if any(np.linalg.norm(start - other) < _APART * diagonal for other in starts):
            continue
        starts.append(start)
        chosen.append(i)
        if len(chosen) == _ARROWS:
            break
    return chosen


def load_arrows(
    report: RigidityReport,
    drawing: Drawing,
    field: WorstField,
    scale: float,
    strongest: float | None = None,
) -> tuple[Surface | None, float]:
    """Return the arrows of the worst-case load and the largest load per mass (N/kg).

    The load on material is in proportion to how far the material goes. Arrows begin at the points
    that they push, on the deformed shape. The longest stands for `strongest` (N/kg): the largest load
    of this model unless given.
    """
    samples = load_samples(report, drawing.diagonal, field, scale)
    if not samples:
        return None, 0.0
    ways = field.displacements[samples]
    largest = float(np.linalg.norm(ways, axis=1).max())
    longest = largest if strongest is None else strongest / field.load_per_mass
    pieces = [
        arrow(
            start,
            way / longest * ARROW_SHARE * drawing.diagonal,
            ARROW_RADIUS * drawing.diagonal,
            LOAD_COLOR,
        )
        for start, way in zip(field.points[samples] + scale * ways, ways, strict=True)
    ]
    return merge(pieces, on_top=True), largest * field.load_per_mass
