"""Readings of weights hung on rigs and of rigs tapped: a tidy CSV file, units in the header.

One reading per row: how far a point went down (``reading_mm``), or the natural frequency of the tapped
rig (``frequency_hz``). Spreadsheets write CSV in many ways; commas or semicolons, decimal points or commas,
blank cells or NA are all understood. What could be read in two ways is refused, with row and column.
"""

from __future__ import annotations

import csv
import difflib
import hashlib
import io
from collections.abc import Mapping
from dataclasses import dataclass, replace
from math import isfinite, sqrt
from pathlib import Path
from typing import Final

from calibration.errors import DataError
from calibration.rigs import ANGLE_OFF, Condition, Rig

__all__ = ["COLUMNS", "GRAVITY", "PAIRS", "Dataset", "Reading", "parse_csv", "read_csv"]

GRAVITY: Final = 9.80665
"""Standard acceleration of gravity (m/s2)."""

COLUMNS: Final = {
    "test_id": False,
    "joint_type": True,
    "rig": True,
    "pose": True,
    "pose_angle_deg": False,
    "specimen": False,
    "repeat": False,
    "span_mm": False,
    "load_g": True,
    "reading_mm": False,
    "reading_unloaded_mm": False,
    "resolution_mm": False,
    "frequency_hz": False,
    "resolution_hz": False,
    "direction": False,
    "notes": False,
}
"""Columns of the file, and whether each must be there and filled; either pair of `PAIRS` must be too."""

PAIRS: Final = (("reading_mm", "resolution_mm"), ("frequency_hz", "resolution_hz"))
"""What is read, and the finest step of it: of a sag, or of a tap test."""

DIRECTIONS: Final = {"loading": 1, "unloading": -1}

_BLANK: Final = frozenset({"", "na", "n/a", "nan", "-", "null", "none"})
_FAULTS_SHOWN: Final = 20
_MOST_LOAD_G: Final = 50_000.0
"""More than this hangs from no LEGO beam: a slip of the unit or of the decimal sign."""


@dataclass(frozen=True, slots=True)
class Reading:
    """One reading, SI units.

    Parameters
    ----------
    row : int
        Line of the file, counted from 1.
    condition : Condition
    joint_type, specimen, test : str
    repeat : int
    force : float
        Weight of what hangs there (N).
    displacement : float
        How far the point went down (m); 0 in a tap test.
    own_weight : bool
        True when the displacement counts from the rig without any weight, so that the rig's own weight
        is in it; False when the unloaded reading was taken off.
    resolution : float
        Smallest step of the ruler or gauge (m), of the frequency in a tap test (Hz).
    direction : int
        1 while loading, -1 while unloading, 0 when not said.
    frequency : float
        Natural frequency of the tapped rig (Hz); 0 when a displacement was read.
    """

    row: int
    condition: Condition
    joint_type: str
    specimen: str
    test: str
    repeat: int
    force: float
    displacement: float
    own_weight: bool
    resolution: float
    direction: int
    frequency: float = 0.0

    @property
    def tap(self) -> bool:
        """Whether a frequency was read."""
        return self.condition.tap

    @property
    def value(self) -> float:
        """What was read: a displacement (m) or a frequency (Hz)."""
        return self.frequency if self.tap else self.displacement

    @property
    def rounding(self) -> float:
        """Standard deviation from rounding to the ruler's steps: resolution / sqrt(12) per reading."""
        once = self.tap or self.own_weight
        return self.resolution * sqrt((1.0 if once else 2.0) / 12.0)


@dataclass(frozen=True, slots=True)
class Dataset:
    """All readings of a file.

    Parameters
    ----------
    readings : tuple of Reading
    sha256 : str
        Of the file's bytes.
    name : str
    comments : tuple of str
        Lines of the file that begin with ``#``.
    """

    readings: tuple[Reading, ...]
    sha256: str = ""
    name: str = ""
    comments: tuple[str, ...] = ()


def read_csv(path: str | Path, rigs: Mapping[str, Rig]) -> Dataset:
    """Read a file of readings.

    Raises
    ------
    DataError
        With every fault, by row and column.
    """
    path = Path(path)
    try:
        content = path.read_bytes()
    except OSError as error:
        raise DataError([f"cannot be read: {error.strerror}"]) from error
    try:
        text = content.decode("utf-8-sig")
    except UnicodeDecodeError as error:
        raise DataError(["not a text file in UTF-8; save it as CSV UTF-8"]) from error
    return parse_csv(text, rigs, name=path.name, sha256=hashlib.sha256(content).hexdigest())


def parse_csv(text: str, rigs: Mapping[str, Rig], *, name: str = "", sha256: str = "") -> Dataset:
    """Return the readings that a CSV text holds; see `read_csv`."""
    numbered = list(enumerate(text.splitlines(), 1))
    comments = tuple(line for _, line in numbered if line.lstrip().startswith("#"))
    numbered = [(n, x) for n, x in numbered if x.strip() and not x.lstrip().startswith("#")]
    if not numbered:
        raise DataError(["the file is empty; it needs a header and at least one reading"])
    separator = _separator(numbered[0][1])
    rows = [(n, next(csv.reader(io.StringIO(line), delimiter=separator))) for n, line in numbered]
    header = [cell.strip().lower() for cell in rows[0][1]]
    _check_header(header, rows[0][0])
    faults: list[str] = []
    readings: list[Reading] = []
    for n, cells in rows[1:]:
        if not any(cell.strip() for cell in cells):
            continue
        if len(cells) > len(header):
            extra = "; numbers with a decimal comma need semicolons between the columns"
            faults.append(
                f"row {n}: {len(cells)} cells under {len(header)} columns"
                f"{extra if separator == ',' else ''}"
            )
            continue
        row = _Row(n, dict(zip(header, cells, strict=False)), faults)
        reading = row.reading(rigs)
        if reading is not None:
            readings.append(reading)
    if not faults and not readings:
        faults.append("the file has a header but no reading")
    if faults:
        rest = len(faults) - _FAULTS_SHOWN
        shown = faults[:_FAULTS_SHOWN] + ([f"and {rest} more"] if rest > 0 else [])
        raise DataError(shown)
    return Dataset(tuple(readings), sha256, name, comments)


def _separator(header: str) -> str:
    return max(",;\t", key=lambda mark: (header.count(mark), mark == ","))


def _check_header(header: list[str], line: int) -> None:
    faults = []
    for name in header:
        if name in COLUMNS:
            continue
        stem = name.rsplit("_", 1)[0] if name else ""
        unit = [c for c in COLUMNS if "_" in c and c.rsplit("_", 1)[0] in (stem, name)]
        close = unit or difflib.get_close_matches(name, COLUMNS, n=1)
        hint = f"; did you mean {close[0]!r}?" if close else f"; known are {', '.join(COLUMNS)}"
        faults.append(f"row {line}, column {name!r}: unknown column{hint}")
    faults += [
        f"row {line}, column {name!r}: stands there {header.count(name)} times"
        for name in dict.fromkeys(header)
        if header.count(name) > 1
    ]
    faults += [
        f"row {line}: the column {name!r} is missing"
        for name, needed in COLUMNS.items()
        if needed and name not in header
    ]
    read = [pair for pair in PAIRS if pair[0] in header]
    if not read:
        faults.append(f"row {line}: there is neither a column 'reading_mm' nor 'frequency_hz'")
    faults += [
        f"row {line}: the column {step!r} is missing" for _, step in read if step not in header
    ]
    if faults:
        raise DataError(faults)


class _Row:
    """One row on its way to a reading; every fault is noted with its column."""

    def __init__(self, line: int, cells: Mapping[str, str], faults: list[str]) -> None:
        self.line, self.cells, self.faults = line, cells, faults

    def fault(self, column: str, message: str) -> None:
        self.faults.append(f"row {self.line}, column {column!r}: {message}")

    def text(self, column: str) -> str | None:
        cell = self.cells.get(column, "").strip()
        if cell.lower() in _BLANK:
            if COLUMNS[column]:
                self.fault(column, "is blank")
            return None
        return cell

    def number(self, column: str, low: float | None = None) -> float | None:
        cell = self.text(column)
        if cell is None:
            return None
        plain = cell.replace(" ", "").replace("\u00a0", "")
        if plain.count(",") + plain.count(".") > 1:
            self.fault(column, f"{cell!r} can be read in two ways; write no thousands separator")
            return None
        try:
            value = float(plain.replace(",", "."))
        except ValueError:
            worded = any(letter.isalpha() for letter in plain)
            tail = "; the unit stands in the header and is the same for all rows" if worded else ""
            self.fault(column, f"{cell!r} is not a number{tail}")
            return None
        if not isfinite(value):
            self.fault(column, f"{cell!r} is not a finite number")
            return None
        if low is not None and value < low:
            self.fault(column, f"{cell} is negative" if low == 0.0 else f"{cell} is too small")
            return None
        return value

    def condition(self, rigs: Mapping[str, Rig]) -> Condition | None:
        """Return the row's rig, pose, angle and loaded hole."""
        rig_name, pose_name, joint = (self.text(c) for c in ("rig", "pose", "joint_type"))
        angle, span = self.number("pose_angle_deg"), self.number("span_mm", 0.0)
        if rig_name is None:
            return None
        rig = rigs.get(rig_name)
        if rig is None:
            self.fault("rig", f"{rig_name!r} is no rig; known are {', '.join(rigs)}")
            return None
        if joint is not None and joint not in rig.joints:
            self.fault(
                "joint_type", f"rig {rig_name!r} measures {', '.join(rig.joints)}, not {joint!r}"
            )
        pose = rig.poses.get(pose_name or "")
        if pose is None:
            if pose_name is not None:
                known = ", ".join(rig.poses)
                self.fault("pose", f"rig {rig_name!r} has no pose {pose_name!r}; it has {known}")
            return None
        hole = rig.hole(span)
        if hole is None:
            spans = " and ".join(f"{h.span_mm:g}" for h in rig.loads)
            self.fault("span_mm", f"rig {rig_name!r} has holes at {spans} mm, not at {span:g}")
            return None
        if angle is not None and abs(angle - pose.angle_deg) > ANGLE_OFF:
            self.fault(
                "pose_angle_deg", f"pose {pose_name!r} is at {pose.angle_deg:g}, not at {angle:g}"
            )
            return None
        at = pose.angle_deg if angle is None else angle
        return Condition(rig_name, str(pose_name), at, hole.place)

    def reading(self, rigs: Mapping[str, Rig]) -> Reading | None:
        """Return the reading, or None when a fault was noted."""
        before = len(self.faults)
        condition = self.condition(rigs)
        load = self.number("load_g", 0.0)
        if load is not None and load > _MOST_LOAD_G:
            self.fault("load_g", f"{load:g} g is more than any rig carries; is it in grams?")
        word = (self.text("direction") or "").lower()
        if word and word not in DIRECTIONS:
            self.fault("direction", f"{word!r} is neither 'loading' nor 'unloading'")
        repeat = self.number("repeat", 0.0)
        if repeat is not None and repeat != int(repeat):
            self.fault("repeat", f"{repeat:g} is not a whole number")
        tap = self.text("frequency_hz") is not None
        value, unloaded, resolution = self.tapped() if tap else self.sagged()
        if len(self.faults) > before or None in (condition, load, value, resolution):
            return None
        assert condition is not None  # said above; the type checker does not see it
        assert load is not None
        assert value is not None
        assert resolution is not None
        if not tap and value < -5.0 * resolution:
            self.fault(
                "reading_mm",
                f"went up by {-value:g} mm under a load; millimetres must count downward",
            )
            return None
        return Reading(
            row=self.line,
            condition=replace(condition, tap=True, mass=load * 1e-3) if tap else condition,
            joint_type=str(self.text("joint_type")),
            specimen=self.text("specimen") or "1",
            test=self.text("test_id") or "",
            repeat=int(repeat or 1),
            force=load * 1e-3 * GRAVITY,
            displacement=0.0 if tap else value * 1e-3,
            own_weight=not tap and unloaded is None,
            resolution=resolution if tap else resolution * 1e-3,
            direction=0 if tap else DIRECTIONS.get(word, 0),
            frequency=value if tap else 0.0,
        )

    def sagged(self) -> tuple[float | None, float | None, float | None]:
        """Return how far the point went down, the unloaded reading and the finest step (mm)."""
        if self.text("reading_mm") is None:
            self.fault("reading_mm", "is blank, and so is 'frequency_hz': nothing was read")
            return None, None, None
        loaded, unloaded = self.number("reading_mm"), self.number("reading_unloaded_mm")
        down = None if loaded is None else loaded - (unloaded or 0.0)
        return down, unloaded, self.step("resolution_mm")

    def tapped(self) -> tuple[float | None, None, float | None]:
        """Return the frequency and the finest step of it (Hz)."""
        for name in ("reading_mm", "reading_unloaded_mm"):
            if self.text(name) is not None:
                self.fault(name, "stands beside 'frequency_hz': one reading per row")
        frequency = self.number("frequency_hz", 0.0)
        if frequency == 0.0:
            self.fault(
                "frequency_hz", "must be more than 0; leave it blank where nothing was tapped"
            )
        return frequency, None, self.step("resolution_hz")

    def step(self, column: str) -> float | None:
        """Return the finest step that can be read."""
        if self.text(column) is None:
            self.fault(column, "is blank")
            return None
        value = self.number(column, 0.0)
        if value == 0.0:
            self.fault(column, "must be more than 0: it is the finest step you can read")
        return value
