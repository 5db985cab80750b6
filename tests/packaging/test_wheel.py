"""The wheel: what is in it, and that it works where there is nothing else of ours."""

from __future__ import annotations

import json
import os
import shutil
import subprocess
import sys
import venv
import zipfile
from pathlib import Path

import pytest

from tests.conftest import REPO

pytestmark = pytest.mark.slow

PACKAGES = ("technic", "parts_library", "calibration")


@pytest.fixture(scope="module")
def wheel(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """Build the wheel with the tools of the test environment."""
    out = tmp_path_factory.mktemp("dist")
    run = subprocess.run(
        [sys.executable, "-m", "build", "--wheel", "--outdir", str(out), str(REPO)],
        check=False,
        capture_output=True,
        text=True,
    )
    assert run.returncode == 0, run.stdout + run.stderr
    (built,) = out.glob("*.whl")
    return built


@pytest.fixture(scope="module")
def names(wheel: Path) -> list[str]:
    with zipfile.ZipFile(wheel) as archive:
        return archive.namelist()


def package_files() -> set[str]:
    """Return the files of the packages that git knows."""
    run = subprocess.run(
        ["git", "ls-files", "-z", "--", *PACKAGES],
        cwd=REPO,
        check=False,
        capture_output=True,
        text=True,
    )
    if run.returncode != 0:
        pytest.skip("not a git clone")
    return {name for name in run.stdout.split("\0") if name and (REPO / name).is_file()}


def test_wheel_has_every_file_of_the_packages(names: list[str]) -> None:
    assert package_files() - set(names) == set()


def test_wheel_has_the_data(names: list[str]) -> None:
    for folder, ending in (
        ("parts_library/definitions/", ".toml"),
        ("parts_library/", "materials.toml"),
        ("calibration/tables/", ".toml"),
        ("technic/", "py.typed"),
        ("technic_rigidity-", "licenses/LICENSE"),
    ):
        assert any(n.startswith(folder) and n.endswith(ending) for n in names), folder + ending


def test_wheel_has_nothing_else(names: list[str]) -> None:
    """No tests, no scripts, no model or part file of others."""
    foreign = [
        name
        for name in names
        if not name.startswith(tuple(f"{p}/" for p in PACKAGES)) and ".dist-info/" not in name
    ]
    assert foreign == []
    own = {"parts_library/super_elements.zip"}  # our condensed solid models
    other = [n for n in names if "/tests/" in n or n.endswith((".pyc", ".zip", ".dat"))]
    assert set(other) <= own
    from tests.conftest import shared_dir

    models = {p.name for p in (shared_dir() / "models").glob("*.*") if p.name != "README.md"}
    assert [n for n in names if Path(n).name in models] == []


def test_wheel_is_small(wheel: Path) -> None:
    assert wheel.stat().st_size < 20e6


def test_installed_wheel_runs_the_demo(wheel: Path, tmp_path: Path) -> None:
    """A clean environment, an unrelated folder: `technic demo --json -` gives the contract's object."""
    home = tmp_path / "env"
    venv.create(home, with_pip=True)
    scripts = home / ("Scripts" if os.name == "nt" else "bin")
    install = subprocess.run(
        [str(scripts / "python"), "-m", "pip", "install", "-q", str(wheel)],
        check=False,
        capture_output=True,
        text=True,
    )
    assert install.returncode == 0, install.stderr
    elsewhere = tmp_path / "elsewhere"
    elsewhere.mkdir()
    technic = shutil.which("technic", path=str(scripts))
    assert technic is not None, "the wheel installs no command"
    run = subprocess.run(
        [technic, "demo", "--json", "-"],
        cwd=elsewhere,
        env={k: v for k, v in os.environ.items() if not k.startswith(("PYTHON", "TECHNIC_"))},
        check=False,
        capture_output=True,
        text=True,
    )
    assert run.returncode == 0, run.stderr
    report = json.loads(run.stdout)
    assert report["schema"] == "technic-report/1"
    assert report["model"]["parts"] == 153
    assert report["verdict"] == "rigid"
    assert report["rigidity"]["value_n_per_m"] > 0
    assert report["model"]["unknown_parts"] == []
    assert sum(w["energy_share"] for w in report["weak_spots"]) <= 1 + 1e-9
    assert {path.name for path in elsewhere.iterdir()} <= {"technic-demo.png"}
