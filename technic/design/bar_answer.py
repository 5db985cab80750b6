"""What the search for bars answers."""

from __future__ import annotations

from collections import Counter
from dataclasses import dataclass, field
from typing import Any

from technic.design.bars import Bar, Pattern
from technic.design.confidence import Confidence
from technic.design.screen import Forecast
from technic.rigidity.result import RigidityReport, WeakSpot

__all__ = ["BarSuggestion", "BarSuggestions"]


@dataclass(frozen=True, slots=True, eq=False)
class BarSuggestion:
    """A new bar, and what it brings.

    Parameters
    ----------
    rank : int
    bar : Bar
    name : str
        Its id.
    rows : tuple of mapping
        The part and its joints as rows of an assembly file, the part first.
    forecast : Forecast
        At the place of the grid where its slide began.
    exact : Forecast
        Where it ended.
    report : RigidityReport
        Of the reinforced model.
    factor : float or None
        Rigidity after by before; None when motions went or pieces were joined.
    stops : tuple of int
        Structural motions of the model before, counted from 1, that the bar resists.
    relieves : (WeakSpot, float) or None
        As in `technic.design.answer.Suggestion`.
    twins : int
        How many other places do as well with a bar of the same length.
    confidence : Confidence or None
    """

    rank: int
    bar: Bar
    name: str
    rows: tuple[dict[str, Any], ...]
    forecast: Forecast
    exact: Forecast
    report: RigidityReport
    factor: float | None
    stops: tuple[int, ...]
    relieves: tuple[WeakSpot, float] | None
    twins: int = 0
    confidence: Confidence | None = None


@dataclass(frozen=True, slots=True, eq=False)
class BarSuggestions:
    """The answer of `suggest_bars`.

    Parameters
    ----------
    before : RigidityReport
    suggestions : tuple of BarSuggestion
        Best first.
    pattern : Pattern
        What new bars are made of.
    places : int
        Bars that were forecast.
    refused : Counter
        Why bars were not taken, and how often.
    """

    before: RigidityReport
    suggestions: tuple[BarSuggestion, ...]
    pattern: Pattern
    places: int
    refused: Counter[str] = field(default_factory=Counter)
