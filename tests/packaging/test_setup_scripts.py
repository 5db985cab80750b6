"""The shell functions behind scripts/demo and scripts/test, on machines that we play with stand-ins."""

from __future__ import annotations

import os
import shutil
import subprocess
from pathlib import Path

import pytest

from tests.conftest import REPO

pytestmark = pytest.mark.skipif(shutil.which("bash") is None, reason="needs bash")

BASE = "base-files"
"""A package that the stand-in for dpkg-query calls installed; no other is."""


class Machine:
    """A folder of stand-ins for system programs, and a log of what was called."""

    def __init__(self, folder: Path) -> None:
        self.bin = folder / "bin"
        self.log = folder / "log"
        self.bin.mkdir()
        self.log.touch()
        self.program(
            "dpkg-query", f'[ "${{@: -1}}" = {BASE} ] && printf "ii " || exit 1', logged=False
        )
        self.program("apt-get", "exit 0")

    def program(self, name: str, body: str, *, logged: bool = True) -> None:
        note = f'echo "{name} $*" >> "{self.log}"' if logged else ":"
        path = self.bin / name
        path.write_text(f"#!/usr/bin/env bash\n{note}\n{body}\n", encoding="utf-8")
        path.chmod(0o755)

    def run(self, commands: str) -> subprocess.CompletedProcess[str]:
        setup = REPO / "scripts" / "_setup.sh"
        return subprocess.run(
            ["bash", "-c", f'set -euo pipefail; source "{setup}"; {commands}'],
            env={**os.environ, "PATH": f"{self.bin}:{os.environ['PATH']}"},
            check=False,
            capture_output=True,
            text=True,
        )

    def calls(self) -> list[str]:
        return self.log.read_text(encoding="utf-8").splitlines()


@pytest.fixture
def machine(tmp_path: Path) -> Machine:
    return Machine(tmp_path)


def test_root_installs_what_is_missing_and_only_that(machine):
    machine.program("id", "echo 0", logged=False)
    run = machine.run(f"system_packages pictures {BASE} libegl1 chromium")
    assert run.returncode == 0, run.stderr
    assert machine.calls() == [
        "apt-get -qq update",
        "apt-get -qq install -y --no-install-recommends libegl1 chromium",
    ]


def test_nothing_is_called_when_all_is_there(machine):
    machine.program("id", "echo 0", logged=False)
    run = machine.run(f"system_packages pictures {BASE}")
    assert run.returncode == 0
    assert machine.calls() == []
    assert run.stderr == ""


def test_sudo_without_password_is_used(machine):
    machine.program("id", "echo 1000", logged=False)
    machine.program("sudo", 'shift; "$@"', logged=False)
    run = machine.run("system_packages pictures libegl1")
    assert run.returncode == 0, run.stderr
    assert machine.calls()[-1].endswith("install -y --no-install-recommends libegl1")


def test_without_rights_the_exact_line_is_printed(machine):
    machine.program("id", "echo 1000", logged=False)
    machine.program("sudo", "exit 1", logged=False)
    run = machine.run(f"system_packages pictures {BASE} libegl1 libxrender1 || echo goes on")
    assert run.stdout == "goes on\n"
    assert "    sudo apt-get update && sudo apt-get install -y libegl1 libxrender1\n" in run.stderr
    assert machine.calls() == []


def test_a_failed_installation_is_not_a_success(machine):
    machine.program("id", "echo 0", logged=False)
    machine.program("apt-get", '[ "$2" = update ]')
    run = machine.run("system_packages pictures libegl1 || echo failed")
    assert run.stdout == "failed\n"
    assert "sudo apt-get install -y libegl1" in run.stderr


@pytest.mark.parametrize(
    ("version", "suitable"),
    [("3, 10", False), ("3, 11", True), ("3, 14", True), ("3, 15", False), ("2, 7", False)],
)
def test_which_python_is_suitable(machine, version, suitable):
    """The stand-in runs the script's own question with the version replaced."""
    machine.program(
        "pythonX",
        f'python3 -c "${{2/sys.version_info/({version}, 0)}}"',
        logged=False,
    )
    run = machine.run("suitable_python pythonX && echo yes || echo no")
    assert run.stdout.strip() == ("yes" if suitable else "no")


def test_missing_venv_module_names_the_package(machine):
    """Debian ships Python without venv: as a user, one reads which package to install."""
    machine.program("id", "echo 1000", logged=False)
    machine.program("sudo", "exit 1", logged=False)
    machine.program(
        "pythonX",
        'case "$2" in *ensurepip*) exit 1;; *print*) echo 3.11;; *) exit 0;; esac',
        logged=False,
    )
    run = machine.run("TECHNIC_PYTHON=pythonX make_venv")
    assert run.returncode == 4
    assert "sudo apt-get install -y python3.11-venv" in run.stderr
