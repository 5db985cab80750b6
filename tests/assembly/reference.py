"""The reference models of the paper's family as assembly files."""

from __future__ import annotations

import json
from typing import Any

import numpy as np

from tests.conftest import shared_file

SCALE = 0.01
SECTION = {"kind": "rectangle", "width": 0.003, "height": 0.003}


def reference_models() -> dict[str, dict[str, Any]]:
    """Return the reference models by name."""
    path = shared_file("reference", "paper_models.json")
    data = json.loads(path.read_text(encoding="utf-8"))
    return {model["name"]: model for model in data["models"]}


def scaled(values):
    return [float(v) * SCALE for v in values]


def document(model, *, grounded=False, shape="bar"):
    """Return the assembly file of a reference model, independent of the gallery's script."""
    parts, joints, supports = [], [], []

    def part(name, p, q):
        body: dict[str, Any] = {"kind": shape, "points": [scaled(p), scaled(q)]}
        if shape == "bar":
            body["section"] = SECTION
        parts.append({"id": name, "shape": body})

    if model["dim"] == 2:
        nodes = model["nodes"]
        for name, (p, q) in model["links"].items():
            part(name, nodes[p], nodes[q])
        for a, b, node, *rest in model["joints"]:
            row: dict[str, Any] = {"type": rest[0] if rest else "hinge", "parts": [a, b]}
            row["point"] = scaled(nodes[node])
            if len(rest) == 3:
                along = np.subtract(nodes[rest[1]], nodes[rest[2]]).tolist()
                if row["type"] == "slider":
                    row["axis"] = along
                else:
                    row.update({"type": "slot", "axis2": along})
            joints.append(row)
        for name, node, _ in (model["grounded"] or []) if grounded else []:
            supports.append({"part": name, "point": scaled(nodes[node]), "held": ["x", "y"]})
    else:
        for row in model["parts"]:
            part(row["name"], row["p"], row["q"])
        for given in model["joints"]:
            row = {"type": given["type"], "parts": [given["a"], given["b"]]}
            row["point"] = scaled(given["point"])
            if "axis" in given:
                row["axis"] = given["axis"]
            if row["type"] == "hinge+slider":
                row.update({"type": "slot", "axis2": given["slide"]})
            joints.append(row)
    out = {"schema": "technic-assembly/1", "dimension": model["dim"], "parts": parts}
    return {**out, "joints": joints, "supports": supports}
