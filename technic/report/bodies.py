"""Which parts hold together: groups that no motion, but pins turning in place, takes apart."""

from __future__ import annotations

from collections import defaultdict

import numpy as np

from technic.geometry import shift_twist
from technic.rigidity.result import MotionKind, RigidityReport

__all__ = ["moving_groups"]

_DIGITS = 5
"""Twists that agree to so many digits of the largest displacement are one body's. Motions come from a
null space computed to about 1e-10; placement noise of real files stays below 1e-3 (tolerances)."""


def moving_groups(report: RigidityReport, component: int) -> tuple[tuple[int, ...], ...]:
    """Return the groups of parts of one component that move as one body, the standing one first.

    Two parts belong together when every structural, spinning or sliding motion moves them by the same
    twist, seen from the same point. A fastener that only turns in a hole goes its own way and forms
    no group of its own: groups made of fasteners alone are left out.

    Parameters
    ----------
    report : RigidityReport
    component : int
        Index into ``report.components``.

    Returns
    -------
    tuple of tuple of int
        The main body (it stands still in every motion), then the others, largest first.
    """
    assembly = report.assembly
    members = report.components[component].parts
    movers = [
        motion
        for motion in report.motions
        if motion.component == component and motion.kind is not MotionKind.IDLE
    ]
    signatures: dict[int, list[tuple[int, tuple[float, ...]]]] = {k: [] for k in members}
    for m, motion in enumerate(movers):
        centroids = np.array([assembly.parts[k].centroid for k in motion.parts])
        # Seen from the origin, the parts of one body have one twist.
        seen = np.einsum("pij,pj->pi", shift_twist(-centroids), motion.twists)
        scale = max(float(np.abs(seen).max()), 1e-300)
        for k, twist in zip(motion.parts, seen / scale, strict=True):
            key = tuple(float(v) + 0.0 for v in twist.round(_DIGITS))
            if any(key):
                signatures[k].append((m, key))
    groups: dict[tuple[tuple[int, tuple[float, ...]], ...], list[int]] = defaultdict(list)
    for k in members:
        groups[tuple(signatures[k])].append(k)
    main = tuple(groups.pop((), []))
    others = [
        tuple(group)
        for group in groups.values()
        if not all(assembly.parts[k].fastener for k in group)
    ]
    return main, *sorted(others, key=lambda group: (-len(group), group))
