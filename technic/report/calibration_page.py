"""A calibration as one self-contained HTML page: values, fit plot, residuals, leverage, warnings."""

from __future__ import annotations

from collections.abc import Sequence
from html import escape

import numpy as np

from technic.geometry import Array
from technic.report.calibration import offset_words, scatter_words
from technic.report.wording import count, number
from technic.statics.calibration import Calibration
from technic.units import MM

__all__ = ["calibration_page"]

_WIDE, _HIGH, _EDGE, _FOOT = 460, 320, 62, 46
_COLORS = ("#0072b2", "#d55e00", "#009e73", "#cc79a7", "#e69f00", "#56b4e9", "#000000")
"""Okabe and Ito's palette: told apart by colour-blind people too."""

_STYLE = """body{font:16px/1.5 system-ui,sans-serif;max-width:62rem;margin:2rem auto;padding:0 1rem}
table{border-collapse:collapse;margin:1rem 0}td,th{padding:.2rem .8rem;border-bottom:1px solid #ccc;
text-align:left}figure{display:inline-block;vertical-align:top;margin:0 1rem 1rem 0;max-width:460px}
figcaption{min-height:3em}svg{background:#fafafa;max-width:100%}ul.legend{list-style:none;padding:0}
ul.legend li{display:inline-block;margin-right:1.5rem}
svg text{font:12px system-ui,sans-serif}.warn{background:#fff3cd;padding:.5rem 1rem}"""


def _ticks(low: float, high: float) -> list[float]:
    """Return about five round numbers from `low` to `high`."""
    step = 10.0 ** np.floor(np.log10((high - low) / 4.0))
    for factor in (5.0, 2.0):
        if (high - low) / (factor * step) >= 4.0:
            step *= factor
            break
    first = np.ceil(low / step - 1e-9)
    return [float(step * k) + 0.0 for k in np.arange(first, np.floor(high / step + 1e-9) + 1)]


def _plot(
    title: str,
    labels: tuple[str, str],
    points: tuple[Array, Array],
    colors: Sequence[str],
    rows: Sequence[int],
    lines: Sequence[tuple[float, float]] = (),
) -> str:
    """Return a scatter plot as SVG.

    Parameters
    ----------
    title : str
    labels : (str, str)
        Of the axes.
    points : ((n,) ndarray, (n,) ndarray)
    colors : sequence of str
    rows : sequence of int
        Row of the file of each point, shown when the mouse rests on it.
    lines : sequence of (float, float)
        Straight lines ``y = a + b x`` behind the points.
    """
    x, y = points
    box = []
    level = np.array([a for a, b in lines if b == 0.0])
    for values in (x, np.concatenate([y, level])):
        low, high = float(values.min(initial=0.0)), float(values.max(initial=0.0))
        margin = 0.05 * (high - low) or 1.0
        box.append((low - margin, high + margin))
    (x0, x1), (y0, y1) = box

    def across(value: float) -> float:
        return _EDGE + (value - x0) / (x1 - x0) * (_WIDE - _EDGE - 10)

    def up(value: float) -> float:
        return _HIGH - _FOOT - (value - y0) / (y1 - y0) * (_HIGH - _FOOT - 10)

    out = [f'<svg width="{_WIDE}" height="{_HIGH}" role="img" aria-label="{escape(title)}">']
    for value in _ticks(x0, x1):
        at = across(value)
        out.append(
            f'<path d="M{at:.1f} 10V{_HIGH - _FOOT}" stroke="#ddd"/><text x="{at:.1f}" '
            f'y="{_HIGH - _FOOT + 16}" text-anchor="middle">{value:.4g}</text>'
        )
    for value in _ticks(y0, y1):
        at = up(value)
        out.append(
            f'<path d="M{_EDGE} {at:.1f}H{_WIDE - 10}" stroke="#ddd"/><text x="{_EDGE - 4}" '
            f'y="{at + 4:.1f}" text-anchor="end">{value:.4g}</text>'
        )
    for a, b in lines:
        ends = [(x0, a + b * x0), (x1, a + b * x1)]
        path = " ".join(f"{across(p):.1f},{up(q):.1f}" for p, q in ends)
        out.append(f'<polyline points="{path}" stroke="#888" fill="none"/>')
    for p, q, color, row in zip(x, y, colors, rows, strict=True):
        out.append(
            f'<circle cx="{across(p):.1f}" cy="{up(q):.1f}" r="3" fill="{color}" '
            f'fill-opacity=".6"><title>row {row}</title></circle>'
        )
    middle = _EDGE + (_WIDE - _EDGE) / 2
    out.append(
        f'<text x="{middle}" y="{_HIGH - 8}" text-anchor="middle">{escape(labels[0])}</text>'
        f'<text transform="translate(12 {_HIGH / 2}) rotate(-90)" text-anchor="middle">'
        f"{escape(labels[1])}</text></svg>"
    )
    return f"<figure><figcaption>{escape(title)}</figcaption>{''.join(out)}</figure>"


def _values(result: Calibration) -> str:
    rows = []
    for m in result.measured:
        sure = "not identifiable: value of the table"
        if m.interval_95 is not None:
            sure = " to ".join(number(x, 4) for x in m.interval_95)
        rows.append(
            f"<tr><td>{escape(m.parameter.connection)}</td><td>{escape(m.parameter.motion)}</td>"
            f"<td>{number(m.value, 4)} {m.unit}</td><td>{sure}</td></tr>"
        )
    head = "<tr><th>Connection</th><th>Motion</th><th>Stiffness</th><th>95 % interval</th></tr>"
    return f"<table>{head}{''.join(rows)}</table>"


def _plots(result: Calibration, colors: Sequence[str], *, tap: bool) -> list[str]:
    """Return a heading and the plots of all sags or all taps: fit, residuals, leverage."""
    fit, readings = result.fit, result.dataset.readings
    kind = np.array([r.tap is tap for r in readings], dtype=bool)
    if not kind.any():
        return []
    scale, unit = (1.0, "Hz") if tap else (1.0 / MM, "mm")
    own = [color for color, shown in zip(colors, kind, strict=True) if shown]
    rows = [r.row for r, shown in zip(readings, kind, strict=True) if shown]
    seen = scale * np.array([r.value for r in readings])[kind]
    said = scale * fit.predicted[kind]
    return [
        f"<h2>{'Tap tests' if tap else 'Readings of the ruler'}</h2>",
        _plot(
            "Measured against fitted; on the line they are equal",
            (f"fitted ({unit})", f"measured ({unit})"),
            (said, seen),
            own,
            rows,
            [(0.0, 1.0)],
        ),
        _plot(
            "Residuals in standard deviations; 19 of 20 lie between the outer lines",
            (f"fitted ({unit})", "residual"),
            (said, fit.residuals[kind]),
            own,
            rows,
            [(-1.96, 0.0), (0.0, 0.0), (1.96, 0.0)],
        ),
        _plot(
            "Leverage: how much one reading decides by itself (1: all)",
            (f"fitted ({unit})", "leverage"),
            (said, fit.leverage[kind]),
            own,
            rows,
        ),
    ]


def calibration_page(result: Calibration) -> str:
    """Return the page; it needs nothing from outside."""
    readings = result.dataset.readings
    groups = sorted({f"{r.condition.rig}, {r.condition.pose}" for r in readings})
    color = {name: _COLORS[k % len(_COLORS)] for k, name in enumerate(groups)}
    colors = [color[f"{r.condition.rig}, {r.condition.pose}"] for r in readings]
    legend = "".join(
        f'<li><span style="color:{color[name]}">&#9679;</span> {escape(name)}</li>'
        for name in groups
    )
    warnings = "".join(f"<li>{escape(text)}</li>" for text in result.warnings)
    plots = [plot for tap in (False, True) for plot in _plots(result, colors, tap=tap)]
    name = escape(result.dataset.name)
    comments = "".join(f"<p>{escape(c.lstrip('# '))}</p>" for c in result.dataset.comments)
    offsets = "".join(f"<p>{escape(said)}</p>" for said in offset_words(result))
    care = f'<div class="warn"><b>Take care</b><ul>{warnings}</ul></div>' if warnings else ""
    return (
        f'<!doctype html><html lang="en"><head><meta charset="utf-8"><title>{name}</title>'
        f"<style>{_STYLE}</style></head><body><h1>Stiffness of joints from {name}</h1>"
        f"<p>{count(len(readings), 'reading')}. {escape(scatter_words(result))} Grid search: "
        f"{'the same values' if result.grid.agrees else 'another point'}.</p>{comments}{care}"
        f'{_values(result)}{offsets}<ul class="legend">{legend}</ul>{"".join(plots)}'
        f"<p>SHA-256 of the readings: <code>{result.dataset.sha256}</code></p></body></html>\n"
    )
