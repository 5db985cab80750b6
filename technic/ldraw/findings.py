"""What a builder should know about the connections of a model, each with its reason.

Joints placed off the grid, pin ends that narrowly miss a hole, open ends, parts on a single pin, pins
in one part, holes that line up without a pin, and pieces that are joined to nothing.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from typing import Final

import numpy as np

from technic.assembly.model import Finding, FindingKind, Joint
from technic.geometry import Array
from technic.ldraw.matching import MATES, Limits, Matched
from technic.ldraw.placed import Indices, PlacedPorts, near_pairs, overlap
from technic.parts.definition import PortKind
from technic.tolerances import NEAR_MISS, NEAR_MISS_ANGLE, REPORTED_OFFSET, TOUCH
from technic.units import LDU, PITCH

__all__ = ["find"]

_ENDS: Final = (PortKind.PIN, PortKind.AXLE, PortKind.BALL)
"""Ports that are made to enter something; studs without a brick on them are no news."""

_FAR: Final = 2.0 * PITCH
"""A port further away than this has nothing to do with a loose piece."""

_WORDS: Final = {
    PortKind.PIN: "pin end",
    PortKind.AXLE: "axle",
    PortKind.BALL: "ball",
    PortKind.STUD: "stud",
    PortKind.PIN_HOLE: "hole",
    PortKind.AXLE_HOLE: "axle hole",
    PortKind.SOCKET: "socket",
    PortKind.TUBE: "tube",
}


def find(
    placed: PlacedPorts, matched: Matched, joints: Sequence[Joint], limits: Limits
) -> tuple[Finding, ...]:
    """Return the findings, sorted by kind and parts.

    Parameters
    ----------
    placed : PlacedPorts
    matched : Matched
    joints : sequence of Joint
        Made from `matched`.
    limits : Limits
        With which the matching was done.
    """
    reasons = _open_ends(placed, matched, joints, limits)
    bare = _bare_holes(placed, matched, joints)
    found = [
        *_off_grid(placed, joints),
        *reasons.values(),
        *_attachments(placed, joints),
        *bare.values(),
        *_loose(placed, joints, reasons, bare),
    ]
    order = list(FindingKind)
    return tuple(sorted(found, key=lambda f: (order.index(f.kind), f.parts, f.message)))


def _title(placed: PlacedPorts, part: int) -> str:
    """Return how a sentence calls a part: name, number and place in the file."""
    this = placed.parts[part]
    name = f"{this.name} ({this.number})" if this.number and this.number != this.name else this.name
    if this.source is None:
        return name
    _, _, submodel = this.source.submodel.rpartition("/")
    nested = f" of {submodel}" if "/" in this.source.submodel else ""
    return f"{name}, line {this.source.line}{nested}"


def _off_grid(placed: PlacedPorts, joints: Sequence[Joint]) -> Iterator[Finding]:
    for joint in joints:
        if joint.offset > REPORTED_OFFSET:
            first, second = (_title(placed, part) for part in joint.parts)
            message = f"{first} and {second} are placed off by {_ldu(joint.offset)}"
            yield Finding(FindingKind.OFF_GRID, message, joint.parts, joint.offset)


def _open_ends(
    placed: PlacedPorts, matched: Matched, joints: Sequence[Joint], limits: Limits
) -> dict[int, Finding]:
    """Return one finding for each port that is made to enter something and does not."""
    ends = placed.of_kind(*_ENDS)
    ends = ends[~np.isin(ends, list(matched.used))]
    refused = dict(reversed(matched.refused))
    joined = frozenset(pair for joint in joints for pair in (joint.parts, joint.parts[::-1]))
    near = _near_misses(placed, ends, matched, limits)
    distance = _nearest(placed, ends, joined)
    found: dict[int, Finding] = {}
    for end in map(int, ends):
        part = int(placed.part[end])
        kind = PortKind(str(placed.kind[end]))
        who = f"{_WORDS[kind]} {placed.name(end)!r} of {_title(placed, part)}"
        if end in refused:
            other = int(placed.part[refused[end]])
            message = f"{who}: the hole in {_title(placed, other)} is already taken"
            found[end] = Finding(FindingKind.NEAR_MISS, message, (part, other), 0.0)
        elif end in near:
            female, why, miss = near[end]
            other = int(placed.part[female])
            message = f"{who} misses the hole in {_title(placed, other)}: {why}"
            found[end] = Finding(FindingKind.NEAR_MISS, message, (part, other), miss)
        else:
            message = f"{who}: {_where(kind, distance.get(end))}"
            found[end] = Finding(FindingKind.OPEN_PORT, message, (part,), distance.get(end))
    return found


def _females(kind: PortKind) -> list[PortKind]:
    return [female for male, female in MATES if male is kind]


def _near_misses(
    placed: PlacedPorts, ends: Indices, matched: Matched, limits: Limits
) -> dict[int, tuple[int, str, float]]:
    """Return for ends that narrowly miss a free hole: the hole, the reason, the distance (m)."""
    near: dict[int, tuple[int, str, float]] = {}
    used = np.array(sorted(matched.used), dtype=np.intp)
    for kind in _ENDS:
        chosen = ends[placed.kind[ends] == str(kind)]
        free = np.setdiff1d(placed.of_kind(*_females(kind)), used)
        pairs = near_pairs(placed, chosen, free, NEAR_MISS)
        lie = overlap(placed, pairs)
        good = (lie.offset <= NEAR_MISS) & (lie.angle <= NEAR_MISS_ANGLE) & (lie.length > TOUCH)
        if kind is PortKind.BALL:
            apart = placed.position[pairs[:, 0]] - placed.position[pairs[:, 1]]
            lie.offset[:] = np.linalg.norm(apart, axis=1)
            good = lie.offset <= NEAR_MISS
        rank = np.lexsort((pairs[:, 1], lie.angle.round(3), (lie.offset / LDU).round(2)))
        for k in rank:
            end = int(pairs[k, 0])
            if not good[k] or end in near:
                continue
            offset, angle = float(lie.offset[k]), float(lie.angle[k])
            if offset > limits.offset:
                why = f"it is {_ldu(offset)} beside it"
            elif kind is not PortKind.BALL and angle > limits.angle:
                why = f"it is turned by {np.degrees(angle):.1f} degrees against it"
            else:
                why = f"it enters only {_ldu(float(lie.length[k]))}"
            near[end] = (int(pairs[k, 1]), why, offset)
    return near


def _apart(placed: PlacedPorts, pairs: Indices) -> Array:
    """Return the distance (m) from the first port's line to the second port's middle, (m,)."""
    i, j = pairs[:, 0], pairs[:, 1]
    between = placed.position[j] - placed.position[i]
    along = np.einsum("ij,ij->i", between, placed.axis[i])
    along = np.clip(along, -placed.half[i], placed.half[i])
    return np.asarray(np.linalg.norm(between - along[:, None] * placed.axis[i], axis=1))


def _nearest(
    placed: PlacedPorts, ends: Indices, joined: frozenset[tuple[int, int]]
) -> dict[int, float]:
    """Return for each end the distance (m) to the nearest port that it could enter, if there is one
    within a pitch, in a part that its own part is not joined to.
    """
    found: dict[int, float] = {}
    for kind in _ENDS:
        chosen = ends[placed.kind[ends] == str(kind)]
        pairs = near_pairs(placed, chosen, placed.of_kind(*_females(kind)), PITCH)
        for (end, other), distance in zip(pairs.tolist(), _apart(placed, pairs), strict=True):
            parts = (int(placed.part[end]), int(placed.part[other]))
            if distance <= PITCH and parts not in joined:
                found[end] = min(found.get(end, np.inf), float(distance))
    return found


def _where(kind: PortKind, distance: float | None) -> str:
    if distance is None:
        return "nothing there"
    return f"nothing there; the nearest {_WORDS[_females(kind)[0]]} is {_ldu(distance)} away"


def _attachments(placed: PlacedPorts, joints: Sequence[Joint]) -> Iterator[Finding]:
    """Return parts that hang on a single pin, and pins that sit in one part only."""
    neighbours: dict[int, set[int]] = {}
    count: dict[int, list[Joint]] = {}
    for joint in joints:
        for part, other in (joint.parts, joint.parts[::-1]):
            neighbours.setdefault(part, set()).add(other)
            count.setdefault(part, []).append(joint)
    pins = set(map(int, placed.part[placed.of_kind(PortKind.PIN)]))
    for part, own in count.items():
        this = placed.parts[part]
        if this.fastener and part in pins and len(neighbours[part]) == 1:
            (other,) = neighbours[part]
            message = f"{_title(placed, part)} sits in one part only: {_title(placed, other)}"
            yield Finding(FindingKind.ONE_PART_PIN, message, (part, other))
        elif not this.fastener and len(own) == 1 and own[0].connection == "pin/pin_hole":
            (other,) = neighbours[part]
            message = f"{_title(placed, part)} hangs on one pin: {_title(placed, other)}"
            yield Finding(FindingKind.SINGLE_PIN, message, (part, other))


def _bare_holes(
    placed: PlacedPorts, matched: Matched, joints: Sequence[Joint]
) -> dict[tuple[int, int], Finding]:
    """Return, for pairs of parts, how many of their free holes line up face to face.

    Pairs that are joined directly or through a common part are left out: two beams held by two pins
    need no third one.
    """
    used = np.array(sorted(matched.used), dtype=np.intp)
    free = np.setdiff1d(placed.of_kind(PortKind.PIN_HOLE), used)
    pairs = near_pairs(placed, free, free, TOUCH)
    pairs = pairs[placed.part[pairs[:, 0]] < placed.part[pairs[:, 1]]]
    lie = overlap(placed, pairs)
    good = (lie.offset <= REPORTED_OFFSET) & (np.abs(lie.length) <= TOUCH)
    good &= np.sin(lie.angle) * PITCH <= REPORTED_OFFSET
    neighbours: dict[int, set[int]] = {}
    for joint in joints:
        a, b = joint.parts
        neighbours.setdefault(a, {a}).add(b)
        neighbours.setdefault(b, {b}).add(a)
    lined: dict[tuple[int, int], int] = {}
    for i, j in pairs[good]:
        a, b = int(placed.part[i]), int(placed.part[j])
        if not neighbours.get(a, {a}) & neighbours.get(b, {b}):
            lined[a, b] = lined.get((a, b), 0) + 1
    found = {}
    for (a, b), number in sorted(lined.items()):
        holes = "one hole lines up" if number == 1 else f"{number} holes line up"
        message = f"{holes} between {_title(placed, a)} and {_title(placed, b)}: no pin there"
        found[a, b] = Finding(FindingKind.NO_PIN, message, (a, b), 0.0)
    return found


def _loose(
    placed: PlacedPorts,
    joints: Sequence[Joint],
    reasons: dict[int, Finding],
    bare: dict[tuple[int, int], Finding],
) -> Iterator[Finding]:
    """Return one finding for each group of parts that is not joined to the biggest one."""
    if not placed.parts:
        return
    label = _components(len(placed.parts), joints)
    sizes = np.bincount(label)
    if sizes[0] == len(label):
        return
    # The biggest group is the model; the earliest one when several are equally big.
    main = label[int(np.argmax(sizes[label]))]
    nearest = _nearest_outside(placed, label)
    for group in dict.fromkeys(label.tolist()):
        if group == main and sizes[group] > 1:
            continue
        members = tuple(int(k) for k in np.flatnonzero(label == group))
        who = _title(placed, members[0])
        if len(members) > 1:
            who = f"{len(members)} parts that hold each other ({who} and others)"
        why, distance = _why_loose(placed, members, reasons, bare, nearest.get(group))
        message = f"{who}: joined to nothing else; {why}"
        yield Finding(FindingKind.LOOSE, message, members, distance)


def _components(number: int, joints: Sequence[Joint]) -> Indices:
    """Return for each part the smallest index among the parts that it hangs together with."""
    root = list(range(number))

    def find(part: int) -> int:
        while root[part] != part:
            root[part] = root[root[part]]
            part = root[part]
        return part

    for joint in joints:
        a, b = sorted(find(part) for part in joint.parts)
        root[b] = a
    return np.array([find(part) for part in range(number)], dtype=np.intp)


def _why_loose(
    placed: PlacedPorts,
    members: tuple[int, ...],
    reasons: dict[int, Finding],
    bare: dict[tuple[int, int], Finding],
    nearest: tuple[float, str] | None,
) -> tuple[str, float | None]:
    inside = set(members)
    if all(not placed.of_part(part) for part in members):
        return "no known connector on this part", None
    lined = [pair for pair in bare if (pair[0] in inside) != (pair[1] in inside)]
    if lined:
        other = lined[0][0] if lined[0][1] in inside else lined[0][1]
        return f"holes line up with {_title(placed, other)} but no pin is placed", None
    own = [
        finding
        for end, finding in reasons.items()
        if int(placed.part[end]) in inside or set(finding.parts) & inside
    ]
    misses = [
        finding
        for finding in own
        if finding.kind is FindingKind.NEAR_MISS and not set(finding.parts) <= inside
    ]
    if misses:
        best = min(misses, key=lambda finding: (finding.distance or 0.0, finding.message))
        return best.message, best.distance
    if nearest is None:
        return "nothing there", None
    return f"the nearest {nearest[1]} is {_ldu(nearest[0])} away", nearest[0]


def _nearest_outside(placed: PlacedPorts, label: Indices) -> dict[int, tuple[float, str]]:
    """Return for each group how far (m) the nearest port of another group is that one of its own
    could mate with, within two pitches, and what it is.
    """
    best: dict[int, tuple[float, str]] = {}
    for male, female in MATES:
        pairs = near_pairs(placed, placed.of_kind(male), placed.of_kind(female), _FAR)
        groups = label[placed.part[pairs]]
        other = groups[:, 0] != groups[:, 1]
        distance = _apart(placed, pairs[other])
        for (first, second), apart in zip(groups[other].tolist(), distance, strict=True):
            if apart <= _FAR:
                for group, word in ((first, _WORDS[female]), (second, _WORDS[male])):
                    candidate = (float(apart), word)
                    best[group] = min(best.get(group, candidate), candidate)
    return best


def _ldu(length: float) -> str:
    return f"{length / LDU:.1f} LDU ({length * 1e3:.2f} mm)"
