"""What one needs to measure joints: empty table, schema, protocol, pictures, and the rigs to build."""

from __future__ import annotations

from functools import partial
from pathlib import Path

import calibration
from technic.errors import UsageError
from technic.report.files import write_atomic

__all__ = ["PICTURES", "write_template"]

_FILES = (
    ("template", "readings.csv"),
    ("template", "readings.schema.json"),
    ("template", "datapackage.json"),
    ("template", "protocol.md"),
    ("rigs", "rigs.toml"),
)

PICTURES = "pictures"
"""Folder of the rigs' pictures, which the protocol shows."""


def write_template(folder: Path) -> list[Path]:
    """Write the files into a folder, which is made when it does not exist.

    Returns
    -------
    list of Path
        What was written.

    Raises
    ------
    UsageError
        One of the files exists already (readings may be in it), or cannot be written.
    """
    root = calibration.files()
    sources = [root.joinpath(*names) for names in _FILES]
    sources += sorted(
        (x for x in root.joinpath("rigs").iterdir() if x.name.endswith(".ldr")),
        key=lambda x: x.name,
    )
    pictures = sorted(root.joinpath("template", PICTURES).iterdir(), key=lambda x: x.name)
    targets = [folder / source.name for source in sources]
    targets += [folder / PICTURES / picture.name for picture in pictures]
    sources += pictures
    there = [str(path.relative_to(folder)) for path in targets if path.exists()]
    if there:
        raise UsageError(f"{folder} already has {', '.join(there)}; name another directory")
    try:
        (folder / PICTURES).mkdir(parents=True, exist_ok=True)
    except OSError as error:
        raise UsageError(f"{folder} cannot be made: {error.strerror}") from error
    for source, target in zip(sources, targets, strict=True):
        content = source.read_bytes()
        write_atomic(target, partial(_write, content))
    return targets


def _write(content: bytes, path: Path) -> None:
    path.write_bytes(content)
