"""The file that names vertices and says how they may move: ``technic-vertices/1``.

::

    {"schema": "technic-vertices/1",
     "vertices": [{"name": "top", "at": [0.01, 0.2], "line": [1, 0]},
                  {"name": "foot", "at": [0, 0], "fixed": true},
                  {"name": "knee", "at": [0.1, 0], "box": [[0.05, -0.1], [0.2, 0.1]]},
                  {"name": "elbow", "at": [-0.1, 0],
                   "mirror": {"of": "knee", "point": [0, 0], "normal": [1, 0]}}]}
"""

from __future__ import annotations

import json
from pathlib import Path
from typing import Any, Final

import numpy as np

from technic.assembly.model import Assembly
from technic.design.optimize.freedom import Rule
from technic.design.optimize.vertices import find_geometry
from technic.errors import InputError, SchemaError
from technic.geometry import Array

__all__ = ["SCHEMA", "read_rules", "rules_from"]

SCHEMA: Final = "technic-vertices/1"

KINDS: Final = ("fixed", "line", "mirror")


def read_rules(path: Path, assembly: Assembly) -> tuple[dict[str, Array], dict[str, Rule]]:
    """Read names and rules of vertices.

    Raises
    ------
    InputError
        The file is no JSON; SchemaError with every fault when it breaks the form above.
    """
    try:
        data = json.loads(path.read_text(encoding="utf-8"))
    except OSError as error:
        raise InputError(f"cannot be read: {error.strerror}", path=path) from error
    except (UnicodeDecodeError, json.JSONDecodeError) as error:
        raise InputError(f"not JSON: {error}", path=path) from error
    return rules_from(data, assembly, path=path)


def rules_from(
    data: Any, assembly: Assembly, *, path: Path | None = None
) -> tuple[dict[str, Array], dict[str, Rule]]:
    """Return names and rules of vertices from parsed JSON.

    Raises
    ------
    SchemaError
        With every fault.
    """
    rows = data.get("vertices") if isinstance(data, dict) else None
    if not isinstance(rows, list) or data.get("schema") != SCHEMA:
        raise SchemaError([f"$: expected schema {SCHEMA!r} and a list of vertices"], path=path)
    faults: list[str] = []
    names: dict[str, Array] = {}
    for k, row in enumerate(rows):
        if not isinstance(row, dict) or not isinstance(row.get("name"), str):
            faults.append(f"$.vertices[{k}].name: is missing")
            continue
        extra = sorted(set(row) - {"name", "at", "box", *KINDS})
        if extra:
            faults.append(f"$.vertices[{k}]: unknown key {', '.join(map(repr, extra))}")
        if "at" in row:
            at = _vector(row["at"], f"$.vertices[{k}].at", faults)
            if at is not None:
                names[row["name"]] = at
    if faults:
        raise SchemaError(faults, path=path)
    geometry = find_geometry(assembly, names)
    rules: dict[str, Rule] = {}
    for k, row in enumerate(rows):
        rule = _rule(row, f"$.vertices[{k}]", geometry.index, faults)
        if rule is not None:
            rules[row["name"]] = rule
    if faults:
        raise SchemaError(faults, path=path)
    return names, rules


def _rule(row: dict[str, Any], where: str, index: Any, faults: list[str]) -> Rule | None:
    given = [key for key in KINDS if row.get(key) not in (None, False)]
    if len(given) > 1:
        faults.append(f"{where}: {' and '.join(given)} exclude each other")
        return None
    box = None
    if "box" in row:
        corners = [_vector(c, f"{where}.box", faults) for c in row["box"]]
        if len(corners) != 2 or any(c is None for c in corners):
            faults.append(f"{where}.box: expected two corners")
            return None
        box = np.sort(np.array(corners), axis=0)
    if not given:
        return Rule(box=box) if box is not None else None
    if given == ["fixed"]:
        return Rule("fixed")
    if given == ["line"]:
        way = _vector(row["line"], f"{where}.line", faults)
        return None if way is None else Rule("line", direction=way, box=box)
    mirror = row["mirror"]
    if not isinstance(mirror, dict) or not {"of", "point", "normal"} <= set(mirror):
        faults.append(f"{where}.mirror: expected of, point and normal")
        return None
    plane = [_vector(mirror[key], f"{where}.mirror.{key}", faults) for key in ("point", "normal")]
    if any(p is None for p in plane):
        return None
    return Rule("mirror", of=index(mirror["of"]), plane=np.array(plane))


def _vector(value: Any, where: str, faults: list[str]) -> Array | None:
    good = isinstance(value, list) and len(value) in (2, 3)
    if not good or not all(isinstance(v, int | float) for v in value):
        faults.append(f"{where}: expected two or three numbers")
        return None
    return np.array([*value, 0.0], dtype=float)[:3]
