"""The public interface: the names that ``import technic`` offers, and nothing else by accident."""

from __future__ import annotations

import subprocess
import sys

import pytest

import technic

PUBLIC = [
    "Assembly",
    "Linkage",
    "RigidityReport",
    "System",
    "TechnicError",
    "__version__",
    "analyze",
    "assemble",
    "calibrate",
    "load",
    "optimize",
    "save",
    "suggest",
]
"""Taking one away breaks somebody's program: say so in CHANGELOG.md."""


def test_public_names_are_these() -> None:
    assert sorted(technic.__all__) == PUBLIC
    assert dir(technic) == PUBLIC


@pytest.mark.parametrize("name", PUBLIC)
def test_every_public_name_can_be_had(name: str) -> None:
    value = getattr(technic, name)
    assert isinstance(value, str) if name == "__version__" else callable(value)


def test_unknown_name_is_an_attribute_error() -> None:
    with pytest.raises(AttributeError, match="nothing_of_this_name"):
        technic.nothing_of_this_name  # noqa: B018 - the attribute access is the test


def test_import_is_light() -> None:
    """``import technic`` loads nothing heavy; programs that only want one name do not pay for all."""
    code = "import sys, technic; print(*sorted({'numpy', 'scipy', 'pyvista'} & set(sys.modules)))"
    run = subprocess.run([sys.executable, "-c", code], check=True, capture_output=True, text=True)
    assert run.stdout.split() == []
