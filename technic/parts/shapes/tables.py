"""The shape tables of `parts_library/shapes`: which features make which part.

A table has ``add`` and ``cut``, lists of features; the bores of the definition's ports are cut from
the sum unless ``bores = false``. Tables are looked up by part id, then by family.
"""

from __future__ import annotations

import functools
import tomllib
from collections.abc import Mapping
from importlib.resources import files
from typing import Any

import numpy as np
from manifold3d import Manifold

from technic.errors import SchemaError
from technic.parts.definition import PartDefinition
from technic.parts.shapes import kernel
from technic.parts.shapes.bench import FEATURES, Bench

__all__ = ["build", "shape_table", "tables"]

Table = Mapping[str, Any]
_AXES = {"x": 0, "y": 1, "z": 2}


@functools.cache
def tables() -> tuple[dict[str, Table], dict[str, Table]]:
    """Return the tables by part id and by family, read once."""
    parts: dict[str, Table] = {}
    families: dict[str, Table] = {}
    for file in sorted(files("parts_library").joinpath("shapes").iterdir(), key=lambda f: f.name):
        if not file.name.endswith(".toml"):
            continue
        content = tomllib.loads(file.read_text(encoding="utf-8"))
        for target, key in ((parts, "part"), (families, "family")):
            for name, table in content.get(key, {}).items():
                if name in target:
                    raise SchemaError([f"{key} {name} has two shapes"], path=file.name)
                target[name] = table
    return parts, families


def shape_table(definition: PartDefinition) -> Table | None:
    """Return the shape table of a definition, or None."""
    parts, families = tables()
    table = parts.get(definition.id) or families.get(definition.family)
    if table is not None and "like" in table:
        other = parts[table["like"]]
        return {**other, **{key: table[key] for key in table if key != "like"}}
    return table


def build(bench: Bench, table: Table) -> Manifold:
    """Return the solid (LDU) that a shape table describes.

    Raises
    ------
    SchemaError
        When an entry names no feature, or lacks a parameter.
    """
    body = kernel.union(_feature(bench, entry, "add") for entry in table["add"])
    cutters = [_feature(bench, entry, "cut") for entry in table.get("cut", ())]
    if table.get("bores", True):
        cutters += _bores(bench, table)
    if cutters:
        body = kernel.difference(body, cutters)
    late = [_feature(bench, entry, "late") for entry in table.get("late", ())]
    return kernel.union([body, *late]) if late else body


def _bores(bench: Bench, table: Table) -> list[Manifold]:
    """Return the cutters of the definition's bores."""
    skip = table.get("solid_bores", ())
    plain = table.get("counterbores", True)
    cutters = []
    for bore in bench.bores:
        if bore.name in skip:
            continue
        if bore.cross:
            across = table.get("across", {}).get(bore.name)
            where = bench.across(bore) if across is None else np.asarray(across, dtype=float)
            cutters.append(kernel.cross_bore(bore.start, bore.end, where))
        else:
            both = (plain, plain) if isinstance(plain, bool) else plain.get(bore.name, (True, True))
            cutters.append(
                kernel.pin_bore(bore.start, bore.end, bench.segments, (both[0], both[1]))
            )
    return cutters


def _feature(bench: Bench, entry: Table, where: str) -> Manifold:
    """Return one feature of a table, with its copies."""
    kind = entry.get("kind", "")
    if kind == "group":
        body = build(bench, {"bores": False, **entry})
    elif kind == "hull":
        body = Manifold.batch_hull([_feature(bench, part, where) for part in entry["of"]])
    elif kind in FEATURES:
        try:
            body = FEATURES[kind](bench, entry)
        except (KeyError, TypeError, ValueError) as error:
            fault = f"shape of {bench.definition.id}, {where} {kind}: {error!r}"
            raise SchemaError([fault]) from error
    else:
        raise SchemaError([f"shape of {bench.definition.id}: no feature is called {kind!r}"])
    return _copies(body, entry)


def _copies(body: Manifold, entry: Table) -> Manifold:
    """Return `body` with the copies that ``repeat``, ``around`` and ``mirror`` ask for.

    ``repeat`` [count, dx, dy, dz] (or several of them), ``around`` [axis, count] about the origin or
    ``pivot``, ``mirror`` "x", "xz": a copy mirrored in each of these coordinates in turn; ``turn``
    [axis, degrees] and ``at`` [x, y, z] place the feature before it is copied.
    """
    if "turn" in entry:
        axis, angle = entry["turn"]
        body = body.rotate(tuple(angle * (i == _AXES[axis]) for i in range(3)))
    if "at" in entry:
        body = body.translate(tuple(entry["at"]))
    repeats = entry.get("repeat", ())
    for count, *step in [repeats] if repeats and not isinstance(repeats[0], list) else repeats:
        shift = np.array(step, dtype=float)
        body = kernel.union(body.translate(tuple((k * shift).tolist())) for k in range(count))
    if "around" in entry:
        axis, count = entry["around"]
        pivot = np.array(entry.get("pivot", (0, 0, 0)), dtype=float)
        still = body.translate(tuple((-pivot).tolist()))
        turned = [
            still.rotate(tuple(k * 360.0 / count * (i == _AXES[axis]) for i in range(3)))
            for k in range(count)
        ]
        body = kernel.union(turned).translate(tuple(pivot.tolist()))
    for letter in entry.get("mirror", ""):
        normal = tuple(float(i == _AXES[letter]) for i in range(3))
        body = kernel.union([body, body.mirror(normal)])
    return body
