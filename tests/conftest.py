"""What all tests share: where the shared data lie, how hypothesis runs, how VTK draws without a screen."""

from __future__ import annotations

import os
import sys
import tempfile
from collections.abc import Callable
from pathlib import Path

# Before numpy and VTK are imported: both read these once, at import.
# One BLAS thread: the matrices are small, and two threads on two test processes only get in each
# other's way.
for _name in ("OPENBLAS_NUM_THREADS", "OMP_NUM_THREADS", "MKL_NUM_THREADS"):
    os.environ.setdefault(_name, "1")
os.environ.setdefault("VTK_DEFAULT_OPENGL_WINDOW", "vtkEGLRenderWindow")
os.environ.setdefault("PYVISTA_OFF_SCREEN", "true")
# What the program caches during tests is theirs: not in the user's folder, and gone afterwards.
_CACHE = tempfile.TemporaryDirectory(prefix="technic-tests-")
os.environ.setdefault("TECHNIC_CACHE", _CACHE.name)
# Settings of the person who runs the tests must not reach them.
os.environ["TECHNIC_CONFIG"] = str(Path(__file__).resolve().parent / "no_settings")

import hypothesis
import pytest

REPO = Path(__file__).resolve().parents[1]
"""Root of the repository."""

IN_CI = os.environ.get("CI", "").lower() in ("1", "true", "yes")
"""In continuous integration a missing tool or data set is a failure, elsewhere a reason to skip."""

# Deadlines off: the machine that runs the tests may be busy. In CI the examples are the same in every
# run, so that a red run can be repeated; at home they are new each time, so that bugs get found.
hypothesis.settings.register_profile(
    "technic", deadline=None, derandomize=IN_CI, print_blob=not IN_CI
)
hypothesis.settings.load_profile("technic")


def shared_dir() -> Path:
    """Return the directory of shared data: ``$TECHNIC_SHARED``, else ``shared`` beside the repository."""
    return Path(os.environ.get("TECHNIC_SHARED") or REPO.parent / "shared")


def shared_file(*parts: str) -> Path:
    """Return a file or directory of the shared data.

    Skips the test when the shared data are not there at all (a plain clone); fails when they are there
    without this file, or in CI.
    """
    path = shared_dir().joinpath(*parts)
    if path.exists():
        return path
    if shared_dir().is_dir() or IN_CI:
        pytest.fail(f"shared data lack {path}; set TECHNIC_SHARED to the folder that has them")
    pytest.skip(f"no shared data at {shared_dir()}; set TECHNIC_SHARED to the folder that has them")


@pytest.fixture(scope="session")
def shared() -> Path:
    """Directory of the shared data; skips (in CI: fails) when it is absent."""
    return shared_file()


@pytest.fixture(scope="session")
def model() -> Callable[[str], Path]:
    """Path of one of the shared models by file name, e.g. ``model("square.ldr")``."""

    def find(name: str) -> Path:
        return shared_file("models", name)

    return find


@pytest.fixture(scope="session")
def ldraw_library() -> Path:
    """Zip with the Technic subset of the LDraw library, 2026-02."""
    return shared_file("ldraw", "ldraw-technic-2026-02.zip")


@pytest.fixture(scope="session")
def repo() -> Path:
    """Root of the repository."""
    return REPO


@pytest.fixture
def run(
    monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> Callable[..., tuple[int, str, str]]:
    """Run the program in this process: exit code, standard output, standard error."""
    from technic import cli

    def call(*arguments: object) -> tuple[int, str, str]:
        monkeypatch.setattr(sys, "argv", ["technic", *map(str, arguments)])
        code = 0
        try:
            cli.main()
        except SystemExit as end:
            code = int(end.code or 0)
        out, err = capsys.readouterr()
        return code, out, err

    return call
