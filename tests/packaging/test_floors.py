"""The floors of the house: who may import whom (contracts in pyproject.toml)."""

from __future__ import annotations

import subprocess
import sys
from pathlib import Path

import pytest

from tests.conftest import REPO


def lint_imports(folder: Path) -> subprocess.CompletedProcess[str]:
    """Run import-linter on the packages in `folder` with our contracts."""
    return subprocess.run(
        [
            sys.executable,
            "-c",
            "from importlinter.cli import lint_imports_command; lint_imports_command()",
            *("--no-cache", "--config", str(REPO / "pyproject.toml")),
        ],
        cwd=folder,
        check=False,
        capture_output=True,
        text=True,
    )


def test_contracts_are_kept() -> None:
    run = lint_imports(REPO)
    assert run.returncode == 0, run.stdout
    assert "0 broken" in run.stdout


@pytest.mark.slow
@pytest.mark.parametrize(
    ("module", "line"),
    [
        ("technic/fem/element.py", "import technic.ldraw"),
        ("technic/rigidity/result.py", "import technic.report"),
        ("technic/parts/definition.py", "import technic.assembly.model"),
        ("parts_library/__init__.py", "import technic.units"),
        ("technic/system/__init__.py", "import pyvista"),
        ("technic/stranger.py", "import technic.units"),
    ],
)
def test_contracts_can_be_broken(tmp_path: Path, module: str, line: str) -> None:
    """Each contract notices a breach: a check that cannot fail would be worth nothing."""
    import shutil

    for name in ("technic", "parts_library", "calibration"):
        shutil.copytree(REPO / name, tmp_path / name, ignore=shutil.ignore_patterns("__pycache__"))
    target = tmp_path / module
    before = (
        target.read_text(encoding="utf-8") if target.exists() else '"""A module on no floor."""\n'
    )
    target.write_text(f"{before}\n{line}\n", encoding="utf-8")
    run = lint_imports(tmp_path)
    assert run.returncode == 1, run.stdout + run.stderr
    assert "BROKEN" in run.stdout
