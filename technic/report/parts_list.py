"""Shopping lists: a BrickLink wanted list (XML) and a table (CSV); an inventory is read from CSV.

BrickLink's upload format: ``<INVENTORY><ITEM><ITEMTYPE>P</ITEMTYPE><ITEMID>..</ITEMID>
<MINQTY>..</MINQTY></ITEM></INVENTORY>`` (BrickLink help, "Uploading Inventory / Wanted List XML").
Items have no colour there: any will do.
"""

from __future__ import annotations

import csv
import io
from collections import Counter
from collections.abc import Mapping
from functools import partial
from pathlib import Path
from typing import Final
from xml.etree import ElementTree as ET

from technic.errors import SchemaError
from technic.parts.catalogue import catalogue
from technic.report.files import write_atomic

__all__ = ["read_inventory", "wanted_csv", "wanted_xml", "write_parts_list"]

_BRICKLINK: Final = {"32556a": "32556"}
"""Numbers that differ from LDraw's."""


def wanted_xml(parts: Mapping[str, int]) -> str:
    """Return a wanted list for BrickLink."""
    root = ET.Element("INVENTORY")
    for number, n in sorted(parts.items()):
        item = ET.SubElement(root, "ITEM")
        ET.SubElement(item, "ITEMTYPE").text = "P"
        ET.SubElement(item, "ITEMID").text = _BRICKLINK.get(number, number)
        ET.SubElement(item, "MINQTY").text = str(n)
    ET.indent(root)
    return ET.tostring(root, encoding="unicode") + "\n"


def wanted_csv(parts: Mapping[str, int]) -> str:
    """Return a table: part, count, name."""
    out = io.StringIO()
    writer = csv.writer(out, lineterminator="\n")
    writer.writerow(["part", "count", "name"])
    for number, n in sorted(parts.items()):
        definition = catalogue().get(number)
        writer.writerow([number, n, "" if definition is None else definition.title])
    return out.getvalue()


def write_parts_list(path: Path, parts: Mapping[str, int]) -> tuple[Path, Path]:
    """Write both lists, ``.xml`` and ``.csv``, beside each other.

    Returns
    -------
    (Path, Path)
        The files.

    Raises
    ------
    UsageError
        One cannot be written.
    """
    targets = path.with_suffix(".xml"), path.with_suffix(".csv")
    for target, text in zip(targets, (wanted_xml(parts), wanted_csv(parts)), strict=True):
        write_atomic(target, partial(_write, text))
    return targets


def _write(text: str, path: Path) -> None:
    path.write_text(text, encoding="utf-8")


def read_inventory(path: Path) -> dict[str, int]:
    """Read a table with the columns ``part`` and ``count`` (others are ignored).

    Numbers that mean the same part in the catalogue are added up under its id.

    Raises
    ------
    SchemaError
        A column is missing or a count is no number.
    OSError
        The file cannot be read.
    """
    text = path.read_text(encoding="utf-8-sig")
    reader = csv.DictReader(io.StringIO(text))
    names = {name.strip().lower(): name for name in reader.fieldnames or ()}
    missing = [name for name in ("part", "count") if name not in names]
    if missing:
        raise SchemaError([f"column {name!r} is missing" for name in missing], path=path)
    out: Counter[str] = Counter()
    faults = []
    for row in reader:
        number = (row[names["part"]] or "").strip()
        amount = (row[names["count"]] or "").strip()
        if not amount.isdigit():
            faults.append(f"line {reader.line_num}: {amount!r} is no count")
            continue
        definition = catalogue().get(number)
        out[number if definition is None else definition.id] += int(amount)
    if faults:
        raise SchemaError(faults, path=path)
    return dict(out)
