#!/usr/bin/env python3
"""Compare ports from LDraw primitives with those of an LDCad shadow library, part by part.

    scripts/compare_ports.py LIBRARY SHADOW [--all] [--quiet]

Compares the parts of the families that builders connect by pins and axles, told by their titles;
`--all` takes every part whose title begins with "Technic". Parts that the shadow library does not
describe are left out and counted. Prints the differences by cause, and the share of parts that agree.
"""

from __future__ import annotations

import argparse
import re
import sys
from collections import Counter, defaultdict
from pathlib import Path

ROOT = Path(__file__).resolve().parents[1]
sys.path.insert(0, str(ROOT))

from technic.errors import InputError  # noqa: E402 (the path is set up first)
from technic.ldraw.agreement import COMPARED, Difference, differences  # noqa: E402
from technic.ldraw.library import Library  # noqa: E402
from technic.ldraw.primitives import ports_from_primitives  # noqa: E402
from technic.ldraw.shadow import ShadowLibrary  # noqa: E402
from technic.ldraw.shadow_ports import ports_from_shadow  # noqa: E402

FAMILIES = re.compile(
    r"^Technic (Beam|Brick|Plate|Frame|Pin|Axle|Cross Block|Connector|Angle Connector|Bush|Gear|Panel)\b"
)


def main() -> int:
    """Run the comparison; return 1 when fewer than 92 % of the parts agree."""
    parser = argparse.ArgumentParser(description=__doc__.split("\n\n")[0])
    parser.add_argument("library", type=Path)
    parser.add_argument("shadow", type=Path)
    parser.add_argument("--all", action="store_true", help="every part called Technic")
    parser.add_argument("--quiet", action="store_true", help="only the summary")
    options = parser.parse_args()
    library, shadow = Library.open(options.library), ShadowLibrary.open(options.shadow)
    found: dict[str, tuple[str, tuple[Difference, ...]]] = {}
    silent = agreed = 0
    families: dict[str, Counter[bool]] = defaultdict(Counter)
    for number in library.part_numbers():
        key = library.key_of(number)
        title = re.sub(r"\s+", " ", library.file(key).title) if key else ""
        family = FAMILIES.match(title)
        if not title.startswith("Technic ") or not (options.all or family):
            continue
        try:
            first = ports_from_primitives(library, number)
            second = ports_from_shadow(library, shadow, number)
        except InputError as error:
            print(f"{number}: {error}")
            continue
        if first is None or second is None:
            silent += 1
            continue
        if not any(port.kind in COMPARED for port in (*first, *second)):
            continue
        different = differences(first, second)
        families[family.group(1) if family else "other"][not different] += 1
        if different:
            found[number] = (title, different)
        else:
            agreed += 1
    if not options.quiet:
        for number, (title, different) in found.items():
            print(f"{number} {title}")
            for difference in different:
                print(f"    {difference}")
    for name, counter in sorted(families.items()):
        print(f"{name:16} {counter[True]:4} of {counter.total():4} agree")
    causes = Counter(cause for _, ds in found.values() for cause in {d.cause for d in ds})
    for cause, count in causes.most_common():
        print(f"{count:4} parts: {cause}")
    total = agreed + len(found)
    share = agreed / total if total else 0.0
    print(f"{agreed} of {total} parts agree ({share:.1%}); {silent} are not in the shadow library")
    return 0 if share >= 0.92 else 1


if __name__ == "__main__":
    sys.exit(main())
