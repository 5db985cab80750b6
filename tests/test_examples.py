"""The example models give the answers that stand in examples/README.md."""

from __future__ import annotations

from pathlib import Path

import pytest

from technic.assembly.model import FindingKind
from technic.loading import load
from technic.rigidity.analyze import analyze
from technic.rigidity.result import MotionKind, Verdict


@pytest.mark.parametrize(
    ("name", "parts", "verdict", "structural", "total"),
    [
        ("hinge", 3, Verdict.FLEXIBLE, 1, 2),
        ("square", 8, Verdict.FLEXIBLE, 1, 5),
        ("triangle", 6, Verdict.RIGID, 0, 3),
    ],
)
def test_examples_give_the_answer_in_the_readme(
    repo: Path, name: str, parts: int, verdict: Verdict, structural: int, total: int
) -> None:
    assembly = load(repo / "examples" / f"{name}.ldr")
    report = analyze(assembly)
    assert len(assembly.parts) == parts
    assert report.verdict is verdict
    assert (report.mobility.structural, report.mobility.total) == (structural, total)
    strange = {FindingKind.OFF_GRID, FindingKind.NEAR_MISS, FindingKind.LOOSE}
    assert not strange & {finding.kind for finding in assembly.findings}


def test_hinge_names_the_beam_that_turns(repo: Path) -> None:
    report = analyze(load(repo / "examples" / "hinge.ldr"))
    (motion,) = [m for m in report.motions if m.kind is MotionKind.STRUCTURAL]
    assert "Beam 5" in motion.sentence
    assert "turns about Pin" in motion.sentence
