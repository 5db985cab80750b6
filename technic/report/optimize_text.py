"""An optimised geometry as text and as JSON."""

from __future__ import annotations

from typing import Any

import numpy as np

from technic.design.optimize.solve import Optimization
from technic.report.style import Style
from technic.report.wording import count, number

__all__ = ["SCHEMA", "optimization_dict", "optimization_text", "vertex_table"]

SCHEMA = "technic-optimization/1"

STILL = 1e-6
"""A vertex that moved by less than this (m) stays, to the eye and to the saw."""

_ENDS = {
    "converged": "no small move makes it better",
    "interrupted": "interrupted; this is the best so far",
    "evaluations": "stopped at the number of evaluations allowed; this is the best so far",
    "time": "stopped at the time allowed; this is the best so far",
}


def optimization_text(found: Optimization, style: Style) -> str:
    """Return what a person reads: how much better, which joints moved, how the search ended."""
    start, end = found.start, found.end
    line = f"{number(start.rigidity)} -> {number(end.rigidity)} N/m, {number(found.factor)} times"
    change = 100.0 * (end.edges / start.edges - 1.0)
    out = [
        style("bold", found.before.name),
        f"Rigidity   {style('good' if found.factor > 1.0 else 'warn', line)}",
        (
            f"Bars       {number(1e3 * start.edges)} -> {number(1e3 * end.edges)} mm in all "
            f"({change:+.1f} %), {number(1e3 * start.mass)} -> {number(1e3 * end.mass)} g"
        ),
        f"Motions    {found.internal}, as before",
        (
            f"Search     {count(found.parameters, 'parameter')}, {count(found.evaluations, 'evaluation')}, "
            f"{found.seconds:.1f} s: {_ENDS[found.status]}"
        ),
        "",
        *vertex_table(found),
    ]
    held = sum(1 for name in found.geometry.pinned)
    if held:
        out += ["", f"{count(held, 'vertex', 'vertices')} could not move:"]
        reasons: dict[str, list[str]] = {}
        for v, reason in found.geometry.pinned.items():
            reasons.setdefault(reason, []).append(found.geometry.names[v])
        out += [f"  {', '.join(names)}: {reason}" for reason, names in reasons.items()]
    return "\n".join(out) + "\n"


def vertex_table(found: Optimization) -> list[str]:
    """Return lines: every vertex that moved, from where to where, in millimetres."""
    dimension = found.before.dimension
    rows = [("vertex", "from (mm)", "to (mm)", "moved (mm)")]
    for k, name in enumerate(found.geometry.names):
        way = float(np.linalg.norm(found.moves[k]))
        if way > STILL:
            rows.append(
                (
                    name,
                    _millimetres(found.geometry.positions[k, :dimension]),
                    _millimetres(found.positions[k, :dimension]),
                    f"{1e3 * way:.2f}",
                )
            )
    widths = [max(len(row[c]) for row in rows) for c in range(4)]
    return ["  ".join(cell.rjust(w) for cell, w in zip(row, widths, strict=True)) for row in rows]


def _millimetres(point: Any) -> str:
    return ", ".join(f"{1e3 * v + 0.0:.2f}" for v in point)


def optimization_dict(found: Optimization) -> dict[str, Any]:
    """Return the JSON object ``technic-optimization/1``."""
    geometry = found.geometry
    return {
        "schema": SCHEMA,
        "source": dict(found.before.source),
        "name": found.before.name,
        "status": found.status,
        "before": _state(found, end=False),
        "after": _state(found, end=True),
        "factor": found.factor,
        "motions": found.internal,
        "parameters": found.parameters,
        "evaluations": found.evaluations,
        "seconds": found.seconds,
        "vertices": [
            {
                "name": name,
                "from_m": geometry.positions[k].tolist(),
                "to_m": found.positions[k].tolist(),
                "pinned": geometry.pinned.get(k),
                "parts": sorted(
                    found.before.parts[p].id for p, own in geometry.corners.items() if k in own
                ),
            }
            for k, name in enumerate(geometry.names)
        ],
        "history": [
            {
                "evaluation": step.evaluation,
                "rigidity_n_per_m": step.rigidity,
                "second_n_per_m": step.second if np.isfinite(step.second) else None,
                "edges_m": step.edges,
                "objective": step.merit,
                "positions_m": step.positions.tolist(),
            }
            for step in found.history
        ],
    }


def _state(found: Optimization, *, end: bool) -> dict[str, Any]:
    point = found.end if end else found.start
    return {
        "rigidity_n_per_m": point.rigidity,
        "spectrum_n_per_m": point.spectrum.tolist(),
        "edges_m": point.edges,
        "mass_kg": point.mass,
    }
