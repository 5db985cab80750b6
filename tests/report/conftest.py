"""Small models of our own for the reports."""

from __future__ import annotations

import shutil
from collections.abc import Callable, Iterator
from pathlib import Path
from typing import Any

import pytest

import technic
from technic.rigidity.result import RigidityReport
from tests.conftest import IN_CI
from tests.report.browsing import FLAGS

BEAM = "1 4 0 {y} {z} 1 0 0 0 1 0 0 0 1 32316.dat"
PIN = "1 0 0 -10 {z} 0 1 0 1 0 0 0 0 1 2780.dat"

PAIR = [
    BEAM.format(y=0, z=0),
    BEAM.format(y=-20, z=0),
    "0 STEP",
    PIN.format(z=40),
    PIN.format(z=-40),
]
"""Two beams of five holes on top of each other, joined by two pins: rigid."""

SCISSORS = [BEAM.format(y=0, z=0), BEAM.format(y=-20, z=0), PIN.format(z=40)]
"""The same with one pin: one beam turns about it."""


def write_model(path: Path, lines: list[str]) -> Path:
    """Write an LDraw file."""
    path.write_text("\n".join(["0 Example", *lines]) + "\n", encoding="utf-8")
    return path


@pytest.fixture(scope="session")
def make_report(tmp_path_factory: pytest.TempPathFactory) -> Callable[..., RigidityReport]:
    """From LDraw lines to the report."""

    def make(lines: list[str], name: str = "example", **options: Any) -> RigidityReport:
        path = write_model(tmp_path_factory.mktemp("model") / f"{name}.ldr", lines)
        return technic.analyze(technic.load(path), **options)

    return make


@pytest.fixture(scope="session")
def pair(make_report: Callable[..., RigidityReport]) -> RigidityReport:
    """Report of `PAIR`."""
    return make_report(PAIR, "pair")


@pytest.fixture(scope="session")
def scissors(make_report: Callable[..., RigidityReport]) -> RigidityReport:
    """Report of `SCISSORS`."""
    return make_report(SCISSORS, "scissors")


@pytest.fixture(scope="session")
def models() -> dict[str, list[str]]:
    """Lines of the small models by name."""
    return {"pair": PAIR, "scissors": SCISSORS}


@pytest.fixture(scope="session")
def browser() -> Iterator[Any]:
    """Debian's Chromium without a window."""
    sync_api = pytest.importorskip("playwright.sync_api")
    program = shutil.which("chromium") or shutil.which("chromium-browser")
    if program is None:
        if IN_CI:
            pytest.fail("no chromium; scripts/test installs it")
        pytest.skip("no chromium")
    with sync_api.sync_playwright() as playwright:
        browser = playwright.chromium.launch(executable_path=program, args=FLAGS)
        yield browser
        browser.close()
