#!/usr/bin/env python3
"""Print the catalogue entry of LDraw parts, ports read from their primitives, to be checked by hand.

    scripts/harvest.py LIBRARY ID ...

What primitives hide (middle stops, the stud end of a half pin, ball sockets) is missing and must be
added by whoever adds the part; `parts_library/SCHEMA.md` describes the notation.
"""

from __future__ import annotations

import argparse
import sys
from collections.abc import Iterable
from pathlib import Path

import numpy as np

ROOT = Path(__file__).resolve().parents[1]
sys.path.insert(0, str(ROOT))

from technic.ldraw.library import Library  # noqa: E402 (the path is set up first)
from technic.ldraw.primitives import ports_from_primitives  # noqa: E402
from technic.parts.definition import Port, PortKind  # noqa: E402
from technic.units import LDU  # noqa: E402

Point = tuple[float, ...]
Run = tuple[Point, tuple[tuple[int, Point], ...]]
_LETTERS: dict[tuple[int, ...], str] = {(1, 0, 0): "x", (0, 1, 0): "y", (0, 0, 1): "z"}


def _tidy(value: float) -> float:
    return round(float(value), 2) + 0.0


def axis_word(axis: Iterable[float], signed: bool) -> str:
    """Return a direction as a letter, or three numbers; the sign is kept when it means something."""
    vector = np.round(np.array(list(axis)), 4) + 0.0
    sign = "" if vector[np.abs(vector).argmax()] > 0 else "-"
    letter = _LETTERS.get(tuple(int(abs(n)) for n in vector))
    if letter and np.isclose(np.abs(vector).sum(), 1.0):
        return (sign if signed else "") + letter
    return ",".join(f"{n:g}" for n in vector)


def _runs(points: list[Run]) -> list[Run]:
    """Fold rows of equal steps into runs: along an axis, or askew when longer than two."""
    left = sorted(points)
    folded: list[Run] = []
    while left:
        start, inner = left[0]
        best, best_key = [left[0]], (False, 2)
        for other, its in left[1:]:
            if its != inner:
                continue
            step = np.subtract(other, start)
            row, here = [left[0]], np.array(start)
            while True:
                here = here + step
                found = [p for p in left if p[1] == inner and np.allclose(p[0], here, atol=0.011)]
                if not found:
                    break
                row.append(found[0])
            along_axis = np.count_nonzero(np.abs(step) > 0.011) == 1
            if len(row) > 1 and (along_axis, len(row)) > best_key:
                best, best_key = row, (along_axis, len(row))
        if len(best) > 1:
            step = np.subtract(best[1][0], best[0][0])
            repeat = (len(best), tuple(_tidy(s) for s in step))
            folded.append((start, (*inner, repeat)))
        else:
            folded.append(left[0])
        left = [p for p in left if p not in best]
    return folded


def phrases(ports: Iterable[Port]) -> list[str]:
    """Return the ports in the notation of the catalogue files."""
    groups: dict[tuple[str, str, float], list[Run]] = {}
    for port in ports:
        word = "friction_pin" if port.friction else port.kind.value
        signed = port.kind in (PortKind.STUD, PortKind.TUBE, PortKind.BALL, PortKind.SOCKET)
        key = (word, axis_word(port.axis, signed), _tidy(port.length / LDU))
        place = tuple(_tidy(c) for c in port.position / LDU)
        groups.setdefault(key, []).append((place, ()))
    out = []
    for (word, axis, length), points in sorted(groups.items()):
        for start, repeats in sorted(_runs(_runs(points))):
            numbers = " ".join(f"{c:g}" for c in start)
            tail = "".join(f" *{n} {' '.join(f'{c:g}' for c in s)}" for n, s in repeats)
            out.append(f"{word} {axis} {numbers} {length:g}{tail}")
    return out


def title_of(library: Library, number: str) -> str:
    """Return the part's name without the words that every part has."""
    found = library.resolve(number)
    title = "" if found is None else library.file(found.key).title
    return " ".join(title.replace("Technic", "").replace("=", "").split())


def main() -> None:
    """Print one table per part number."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("library", type=Path)
    parser.add_argument("ids", nargs="+")
    asked = parser.parse_args()
    library = Library.open(asked.library)
    for number in asked.ids:
        ports = ports_from_primitives(library, number)
        if ports is None:
            print(f"{number}: not in the library", file=sys.stderr)
            continue
        text = "; ".join(phrases(ports))
        print(f'[[part]]\nid = "{number}"\ntitle = "{title_of(library, number)}"')
        print(f'family = ""\nports = "{text}"')


if __name__ == "__main__":
    main()
