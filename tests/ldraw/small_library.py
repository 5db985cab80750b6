"""A parts library of a few lines, for tests that say what stands in each file."""

from __future__ import annotations

import zipfile
from collections.abc import Mapping
from pathlib import Path
from typing import TypeVar

HEADER = "0 {title}\r\n0 Name: {name}\r\n0 !LDRAW_ORG Part UPDATE 2026-02\r\n0 BFC CERTIFY CCW\r\n"

PRIMITIVES = (
    "peghole",
    "connhole",
    "axlehole",
    "axlehol8",
    "axleend2",
    "axle",
    "connect",
    "confric",
)


T = TypeVar("T")


def there(found: T | None) -> T:
    """What was looked up, which must exist."""
    assert found is not None
    return found


def line(name: str, at=(0, 0, 0), matrix=(1, 0, 0, 0, 1, 0, 0, 0, 1)) -> str:
    """A type 1 line."""
    return "1 16 " + " ".join(map(str, (*at, *matrix))) + f" {name}\r\n"


def part(*lines: str, title: str = "Part") -> str:
    """The text of a part file."""
    return HEADER.format(title=title, name="x.dat") + "".join(lines)


SQUARE = "4 16 -6 0 -6 6 0 -6 6 0 6 -6 0 6\r\n"
"""A primitive's surface: a part without any has no mass."""


def files_with(extra: Mapping[str, str]) -> dict[str, str]:
    """`extra`, with a square each for the primitives that ports are read from."""
    files = {f"p/{name}.dat": part(SQUARE, title=name) for name in PRIMITIVES}
    for name in ("4-4cyli", "2-4cyli", "48/4-4cyli"):
        files[f"p/{name}.dat"] = part(title="Cylinder")
    return {**files, **extra}


def write_folder(folder: Path, files: Mapping[str, str]) -> Path:
    """Write a library into a folder."""
    for name, text in files.items():
        path = folder / name
        path.parent.mkdir(parents=True, exist_ok=True)
        path.write_bytes(text.encode("utf-8"))
    return folder


def write_zip(path: Path, files: Mapping[str, str], prefix: str = "") -> Path:
    """Write a library into a zip."""
    with zipfile.ZipFile(path, "w", zipfile.ZIP_DEFLATED) as archive:
        for name, text in files.items():
            archive.writestr(prefix + name, text)
    return path
