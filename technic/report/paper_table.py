"""The paper's table beside ours: every system of the gallery, analyzed, with what the paper prints.

The rows stand in ``technic/data/gallery/table.toml``. Magnitudes agree only where the paper's discretisation
is known (`technic.rigidity.replica`); elsewhere verdicts, orders and ratios can be compared.
"""

from __future__ import annotations

import tomllib
from dataclasses import dataclass, field
from importlib.resources import as_file, files
from itertools import pairwise
from pathlib import Path
from time import perf_counter
from typing import Any, Final

import numpy as np

from technic.assembly.model import Assembly
from technic.loading import load
from technic.rigidity.analyze import analyze
from technic.rigidity.replica import PaperBars
from technic.rigidity.result import RigidityReport, Verdict

__all__ = ["PaperTable", "Row", "paper_table", "to_dict", "to_text"]

SCHEMA: Final = "technic-paper/1"

SAME: Final = 0.01
"""Values agree when they differ by at most this share: the paper prints three digits."""


@dataclass(frozen=True, slots=True)
class Row:
    """One system: ours, and the paper's facts as far as they are known.

    Parameters
    ----------
    figure, file, name, geometry : str
    parts, joints, places, nodes : int
        `places` are the distinct points where parts are joined, what the paper calls joints.
    verdict : str
    rigidity : float
        N/m; 0 for a flexible assembly, as the paper has it.
    assemble_s, eigen_s, total_s : float
        Time for the matrices, for the eigenvalue step, and in all (s).
    replica : float or None
        Eigenvalue of the paper's own discretisation, in its units.
    paper : dict
        ``parts, joints, nodes, rigid, before, after, ratio, value, note``, each only where known.
    """

    figure: str
    file: str
    name: str
    geometry: str
    parts: int
    joints: int
    places: int
    nodes: int
    verdict: str
    rigidity: float
    assemble_s: float
    eigen_s: float
    total_s: float
    replica: float | None
    paper: dict[str, Any] = field(default_factory=dict)

    @property
    def same_verdict(self) -> bool | None:
        """Whether the verdict is the paper's; None when it is not known."""
        if "rigid" not in self.paper:
            return None
        return bool((self.verdict == Verdict.RIGID.value) == self.paper["rigid"])

    @property
    def same_value(self) -> bool | None:
        """Whether the replica comes to the printed value; None when there is none to compare."""
        if self.replica is None or "value" not in self.paper:
            return None
        printed = float(self.paper["value"])
        return bool(abs(self.replica - printed) <= SAME * max(abs(printed), 1e-300))


@dataclass(frozen=True, slots=True)
class Order:
    """Rigidities that must ascend."""

    what: str
    values: tuple[float, ...]

    @property
    def holds(self) -> bool:
        """Whether each is larger than the one before."""
        return all(a < b for a, b in pairwise(self.values))


@dataclass(frozen=True, slots=True)
class PaperTable:
    """All rows and the orders among them."""

    rows: tuple[Row, ...]
    orders: tuple[Order, ...]


def paper_table() -> PaperTable:
    """Analyze the gallery.

    Raises
    ------
    TechnicError
        A file of the gallery cannot be read or analyzed.
    """
    with as_file(files("technic") / "data") as data:
        folder = data / "gallery"
        listed = tomllib.loads((folder / "table.toml").read_text(encoding="utf-8"))
        rows = tuple(_row(folder, entry) for entry in listed["row"])
    values = {row.file: row.rigidity for row in rows}
    orders = tuple(
        Order(entry["what"], tuple(values[name] for name in entry["files"]))
        for entry in listed["order"]
    )
    return PaperTable(rows, orders)


def _row(folder: Path, entry: dict[str, Any]) -> Row:
    assembly = load(folder / entry["file"])
    start = perf_counter()
    report = analyze(assembly, modes=1)
    total = perf_counter() - start
    replica = None
    if "replica" in entry:
        recipe = PaperBars(**entry["replica"])
        replica = _rigidity(analyze(assembly, modes=1, measure="nodal", parts=recipe))
    return Row(
        figure=entry["figure"],
        file=entry["file"],
        name=assembly.name,
        geometry=entry["geometry"],
        parts=len(assembly.parts),
        joints=len(assembly.joints),
        places=_places(assembly),
        nodes=sum(len(points) for points in report.node_points.values()),
        verdict=report.verdict.value,
        rigidity=_rigidity(report),
        assemble_s=report.timings.get("assemble", 0.0),
        eigen_s=report.timings.get("eigen", 0.0),
        total_s=total,
        replica=replica,
        paper=entry.get("paper", {}),
    )


def _places(assembly: Assembly) -> int:
    points = np.array([joint.point for joint in assembly.joints]).reshape(-1, 3)
    return len(np.unique(points.round(6), axis=0))


def _rigidity(report: RigidityReport) -> float:
    if report.verdict is not Verdict.RIGID or report.rigidity is None:
        return 0.0
    return report.rigidity.value


def to_dict(table: PaperTable) -> dict[str, Any]:
    """Return the table as the JSON object ``technic-paper/1``."""
    return {
        "schema": SCHEMA,
        "rows": [
            {
                "figure": row.figure,
                "file": row.file,
                "name": row.name,
                "geometry": row.geometry,
                "parts": row.parts,
                "joints": row.joints,
                "places": row.places,
                "nodes": row.nodes,
                "verdict": row.verdict,
                "rigidity_n_per_m": row.rigidity,
                "timings_s": {
                    "assemble": row.assemble_s,
                    "eigen": row.eigen_s,
                    "total": row.total_s,
                },
                "replica": row.replica,
                "paper": row.paper,
                "agrees": {"verdict": row.same_verdict, "value": row.same_value},
            }
            for row in table.rows
        ],
        "orders": [
            {"what": order.what, "values_n_per_m": list(order.values), "holds": order.holds}
            for order in table.orders
        ],
        "total_s": sum(row.total_s for row in table.rows),
    }


_HEAD = (
    "fig.",
    "system",
    "parts",
    "places",
    "nodes",
    "verdict",
    "K s",
    "eigen s",
    "total s",
    "N/m",
    "replica",
    "printed",
    "gain",
    "agrees",
)

_LEFT = 2
"""Columns that are flush left; the others are numbers."""


def _pair(ours: int, paper: dict[str, Any], key: str) -> str:
    return f"{ours} ({paper.get(key, 'n/a')})"


def _printed(value: Any) -> str:
    return "n/a" if value is None else f"{value:.4g}"


def _agrees(row: Row) -> str:
    said = []
    for word, same in (("verdict", row.same_verdict), ("value", row.same_value)):
        if same is not None:
            said.append(word if same else f"not {word}")
    return ", ".join(said) if said else "n/a"


def _after(paper: dict[str, Any]) -> float | None:
    """Return what the paper's optimization gained, as a ratio."""
    if "ratio" in paper:
        return float(paper["ratio"])
    before, after = paper.get("before"), paper.get("after")
    return None if not before or after is None else float(after / before)


def _cells(row: Row) -> list[str]:
    paper = row.paper
    rigid = "n/a" if "rigid" not in paper else "rigid" if paper["rigid"] else "flexible"
    return [
        row.figure,
        row.name + ("" if row.geometry == "published" else " *"),
        _pair(row.parts, paper, "parts"),
        _pair(row.places, paper, "joints"),
        _pair(row.nodes, paper, "nodes"),
        f"{row.verdict} ({rigid})",
        f"{row.assemble_s:.3f}",
        f"{row.eigen_s:.3f}",
        f"{row.total_s:.3f}",
        f"{row.rigidity:.4g}",
        "-" if row.replica is None else f"{row.replica:.4g}",
        _printed(paper.get("value", paper.get("before"))),
        _printed(_after(paper)),
        _agrees(row),
    ]


def to_text(table: PaperTable) -> str:
    """Return the table for a terminal: ours, and in brackets what the paper prints."""
    cells = [list(_HEAD), *(_cells(row) for row in table.rows)]
    widths = [max(len(line[k]) for line in cells) for k in range(len(_HEAD))]
    lines = []
    for line in cells:
        shown = [
            text.ljust(width) if k < _LEFT or k == len(widths) - 1 else text.rjust(width)
            for k, (text, width) in enumerate(zip(line, widths, strict=True))
        ]
        lines.append("  ".join(shown).rstrip())
    lines.insert(1, "-" * max(len(line) for line in lines))
    lines += [
        "",
        "In brackets: the paper (n/a: not known to us). Places: points where parts are joined.",
        "N/m: our rigidity, 0 for a flexible system. Replica: the paper's own discretisation, beside",
        "the value printed in the paper. Gain: after the paper's optimization, a factor.",
        "* designed for this gallery after a picture or a count.",
        "The paper reports up to 0.9 s for models of up to 500 nodes.",
        "",
    ]
    for row in table.rows:
        if "note" in row.paper:
            lines.append(f"Fig. {row.figure}, {row.name}: {row.paper['note']}.")
    lines.append("")
    for order in table.orders:
        values = " < ".join(f"{value:.4g}" for value in order.values)
        lines.append(f"{'holds' if order.holds else 'FAILS'}: {order.what}: {values} N/m")
    total = sum(row.total_s for row in table.rows)
    return (
        "\n".join([*lines, "", f"{len(table.rows)} systems in {total:.1f} s of analysis."]) + "\n"
    )
