"""Models of the gallery that need more than a few lines: see `make_gallery`."""

from __future__ import annotations

from typing import Any, Final

import numpy as np

from technic.assembly.builder import Linkage

__all__ = [
    "BAR",
    "CM",
    "LEGO",
    "Point",
    "at",
    "bird",
    "boat",
    "chain_with_slots",
    "excavator",
    "network",
    "scissor_ring",
    "strip",
    "telescope",
]

Point = tuple[float, ...]

CM: Final = 0.01
"""One unit of the paper's models (m)."""

BAR: Final = 0.003
"""Side of a bar's square section (m): 0.3 units, as in the paper."""

LEGO: Final = {"axial": 1e8, "shear": 65625.0, "tilt": 0.240}
"""A pin in a pin hole (paper; the tilt at an arm of 4 mm)."""


def at(values: Any) -> list[float]:
    """Return a point in metres, without the noise of binary fractions."""
    return [round(float(v) * CM, 10) + 0.0 for v in values]


def network(
    nodes: dict[str, Point],
    bars: dict[str, tuple[str, ...]],
    pins: dict[str, list[str]] | None = None,
    **options: Any,
) -> Linkage:
    """Return bars in the plane, pinned where they share a node; `pins` names further places."""
    linkage = Linkage(2)
    for name, ends in bars.items():
        linkage.bar(name, *(at(nodes[e]) for e in ends), section=BAR)
    for node in nodes:
        own = [name for name, ends in bars.items() if node in ends]
        own += [name for name in (pins or {}).get(node, []) if name not in own]
        if len(own) > 1:
            linkage.hinge(*own, at=at(nodes[node]), **options)
    return linkage


def excavator() -> Linkage:
    """Return a crawler excavator of six parts and seven joints."""
    nodes = {
        "a": (26.1, -43.2),
        "b": (30.3, -58.1),
        "c": (41.3, -27.3),
        "d": (50.0, -18.4),
        "e": (106.0, -16.7),
        "f": (86.6, -8.3),
        "g": (106.7, -2.7),
        "tip": (100.0, -60.0),
    }
    bars: dict[str, tuple[str, ...]] = {
        "base": ("a", "b"),
        "cylinder": ("b", "c"),
        "boom": ("a", "c", "d", "e"),
        "barrel": ("d", "f"),
        "piston": ("f", "g"),
        "stick": ("g", "e", "tip"),
    }
    linkage = Linkage(2)
    for name, ends in bars.items():
        linkage.bar(name, *(at(nodes[e]) for e in ends), section=3 * BAR)
    pins = [("a", "base", "boom"), ("b", "base", "cylinder"), ("c", "cylinder", "boom")]
    pins += [("d", "boom", "barrel"), ("e", "boom", "stick"), ("g", "piston", "stick")]
    for node, first, second in pins:
        linkage.hinge(first, second, at=at(nodes[node]))
    linkage.slider("barrel", "piston", at=at(nodes["f"]), axis=(56.7, 15.7))
    return linkage


def chain_with_slots(*, slides: bool) -> Linkage:
    """Return six bars and two rails on the ground; the bars' pins slide on the rails, or sit in them."""
    nodes = {
        "A": (-5.9, 1.25),
        "B": (0.0, 0.0),
        "C": (3.15, -10.1),
        "D": (13.3, -3.0),
        "E": (16.8, 9.9),
        "F": (10.5, 3.65),
        "C1": (1.125, -9.125),
        "C2": (5.175, -11.075),
        "E1": (15.225, 11.475),
        "E2": (18.375, 8.325),
    }
    bars = {name: (name[0], name[1]) for name in ("AB", "BC", "CD", "DE", "EF", "BF")}
    linkage = network(nodes, {**bars, "rail C": ("C1", "C2"), "rail E": ("E1", "E2")})
    for rail, node, bar in (("rail C", "C", "BC"), ("rail E", "E", "DE")):
        ends = nodes[f"{node}1"], nodes[f"{node}2"]
        if slides:
            along = np.subtract(ends[1], ends[0]).round(10)
            linkage.slot(rail, bar, at=at(nodes[node]), axis2=along)
        else:
            linkage.hinge(rail, bar, at=at(nodes[node]))
        linkage.fix(rail)
    linkage.fix("AB", at=at(nodes["A"]), held="xy")
    return linkage


def telescope(overlap: float, jitter: bool) -> Linkage:
    """Return two bars between walls that overlap, with a pin at either end of the overlap."""
    linkage = Linkage(2)
    half = overlap / 2
    linkage.bar("left", at((-10, 0)), at((half, 0)), section=BAR)
    linkage.bar("right", at((-half, 0)), at((10, 0)), section=BAR)
    play: dict[str, Any] = {"jitter": {"shear": 2e-4, "force": 1.0}} if jitter else {}
    for x in (-half, half):
        linkage.hinge("left", "right", at=at((x, 0)), **play)
    linkage.fix("left", at=at((-10, 0)))
    linkage.fix("right", at=at((10, 0)))
    return linkage


def strip(upper: list[Point], lower: list[Point]) -> Linkage:
    """Return a triangulated strip of bars between two rows of points of equal or nearly equal length."""
    nodes = {f"u{k}": p for k, p in enumerate(upper)} | {f"l{k}": p for k, p in enumerate(lower)}
    bars: dict[str, tuple[str, str]] = {}
    for row, count in (("u", len(upper)), ("l", len(lower))):
        for k in range(count - 1):
            bars[f"{row}{k}-{row}{k + 1}"] = (f"{row}{k}", f"{row}{k + 1}")
    for k in range(len(lower)):
        bars[f"u{k}-l{k}"] = (f"u{k}", f"l{k}")
        if k + 1 < len(upper):
            bars[f"l{k}-u{k + 1}"] = (f"l{k}", f"u{k + 1}")
    return network(nodes, bars)


BIRD = {
    "tail tip": (0, 6), "tail low": (2, 3.5), "tail top": (5, 6), "rump": (6, 3), "back": (9, 6),
    "belly": (10, 2), "wing root": (12, 7), "breast": (14, 2.5), "shoulder": (16, 6.5),
    "neck": (18, 4), "nape": (19, 8), "throat": (20.5, 6), "crown": (21.5, 9), "beak": (24, 7),
    "wing low": (10, 11), "wing high": (13, 12), "wing mid": (11, 16), "wing tip": (14, 17),
}  # fmt: skip
BIRD_ORDER = list(BIRD)


def bird() -> Linkage:
    """Return two flat triangulated birds of 33 beams each on 18 axles: 84 parts."""
    order = BIRD_ORDER
    pairs = [(order[k], order[k + 1]) for k in range(13)]
    pairs += [(order[k], order[k + 2]) for k in range(12)]
    chain = ["wing root", "shoulder", "wing low", "wing high", "wing mid", "wing tip"]
    pairs += [(chain[k], chain[k + 1]) for k in range(1, 5)]
    pairs += [(chain[k], chain[k + 2]) for k in range(4)]
    linkage = Linkage(3)
    for side, z in (("left", 0.0), ("right", 8.0)):
        for p, q in pairs:
            ends = [at((*BIRD[n], z)) for n in (p, q)]
            section = {"kind": "rectangle", "width": 0.0072, "height": 0.0072}
            linkage.bar(f"{side} {p}-{q}", *ends, section=section)
    for node, place in BIRD.items():
        ends = [at((*place, z)) for z in (-1.0, 9.0)]
        linkage.bar(f"axle {node}", *ends, section={"kind": "circle", "diameter": 0.0048})
        linkage.mark_fastener(f"axle {node}")
        for side, z in (("left", 0.0), ("right", 8.0)):
            for p, q in pairs:
                if node in (p, q):
                    pair = (f"axle {node}", f"{side} {p}-{q}")
                    linkage.hinge(*pair, at=at((*place, z)), axis=(0, 0, 1), stiffness=LEGO)
    return linkage


def boat(model: dict[str, Any], *more: tuple[int, int]) -> Linkage:
    """Return 88 rods with ball joints: the mirror's nodes and the rods of its common length, less two."""
    spare = {
        (18, 7),
        (20, 10),
    }  # mirror images of each other; no motion comes from leaving them out
    rods = [pair for pair in map(tuple, model["edges_of_nominal_length"]) if pair not in spare]
    rods += more
    nodes = np.array(model["nodes"])
    linkage = Linkage(3)
    for a, b in rods:
        linkage.bar(
            f"rod {a}-{b}", at(nodes[a]), at(nodes[b]), section={"kind": "circle", "diameter": 0.01}
        )
    for k, node in enumerate(nodes):
        own = [f"rod {a}-{b}" for a, b in rods if k in (a, b)]
        if len(own) > 1:
            linkage.ball(*own, at=at(node))
    return linkage


def scissor_ring(count: int = 8) -> Linkage:
    """Return a closed ring of scissors: pairs of crossed bars with tangential hinges."""
    linkage = Linkage(3)
    turns = 2 * np.pi * np.arange(count) / count
    outer = np.column_stack([np.cos(turns), np.sin(turns), 0 * turns]) * 20
    inner = 0.75 * outer
    up = (0, 0, 1)
    for k in range(count):
        n = (k + 1) % count
        linkage.bar(f"out {k}", at(outer[k]), at(inner[n]), section=BAR)
        linkage.bar(f"in {k}", at(inner[k]), at(outer[n]), section=BAR)
    for k in range(count):
        n = (k + 1) % count
        middle = (outer[k] + inner[k] + outer[n] + inner[n]) / 4
        linkage.hinge(f"out {k}", f"in {k}", at=at(middle), axis=up)
        linkage.hinge(f"out {k}", f"in {n}", at=at(inner[n]), axis=up)
        linkage.hinge(f"in {k}", f"out {n}", at=at(outer[n]), axis=up)
    return linkage
