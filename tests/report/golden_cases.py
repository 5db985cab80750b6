"""The pictures that are kept: what they show and how they are made. scripts/make_golden writes them."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path

import technic
from technic.parts.catalogue import catalogue
from technic.parts.definition import PartDefinition
from technic.report.comparison import comparison_scene
from technic.report.picture import part_scene, report_scene, styled
from technic.report.scene import Scene
from technic.rigidity.result import RigidityReport
from tests.report.conftest import PAIR, SCISSORS, write_model

REPO = Path(__file__).resolve().parents[2]
FOLDER = Path(__file__).parent / "golden"

GLASS = [
    *PAIR[:1],
    "1 47 0 -20 0 1 0 0 0 1 0 0 0 1 32316.dat",
    *PAIR[2:],
]
"""The pair with its upper beam of clear plastic."""


def _report(lines: list[str], folder: Path, name: str) -> RigidityReport:
    # Frame members: their numbers do not change with the condensed models that are shipped.
    path = write_model(folder / f"{name}.ldr", lines)
    return technic.analyze(technic.load(path), parts="frame")


def _gallery(name: str) -> RigidityReport:
    path = REPO / "technic" / "data" / "gallery" / f"{name}.json"
    return technic.analyze(technic.load(path), parts="frame")


def _definition(number: str) -> PartDefinition:
    definition = catalogue().get(number)
    assert definition is not None
    return definition


CASES: dict[str, Callable[[Path], Scene]] = {
    "pair": lambda folder: report_scene(_report(PAIR, folder, "pair")),
    "scissors": lambda folder: report_scene(_report(SCISSORS, folder, "scissors")),
    "scissors-top": lambda folder: report_scene(_report(SCISSORS, folder, "scissors"), view="top"),
    "glass": lambda folder: report_scene(_report(GLASS, folder, "glass"), view="iso"),
    "pair-depth": lambda folder: styled(report_scene(_report(PAIR, folder, "pair")), depth=True),
    "before-after": lambda folder: comparison_scene(
        [_report(SCISSORS, folder, "scissors"), _report(PAIR, folder, "pair")], ["before", "after"]
    ),
    "frame-5x7": lambda _folder: part_scene(_definition("64179")),
    "plane-assembly": lambda _folder: report_scene(_gallery("fig08a_bridge")),
    "upright-assembly": lambda _folder: report_scene(_gallery("fig14c_drying_rack_3")),
}
"""Scene of each picture; the argument is a folder for files."""
