"""Options that steer how a model is read: every command that reads a model file has them all."""

from __future__ import annotations

from dataclasses import fields
from pathlib import Path

import pytest
import typer.main

from technic.cli import app
from technic.commands.options import ModelOptions
from technic.commands.reading import reading
from technic.errors import UsageError

COMMANDS = typer.main.get_command(app).commands  # type: ignore[attr-defined]
NAMES = {field.name for field in fields(ModelOptions)}


def options_of(command) -> set[str]:
    return {parameter.name for parameter in command.params}


@pytest.mark.parametrize(
    "name",
    sorted(name for name, command in COMMANDS.items() if "axle_slide" in options_of(command)),
)
def test_commands_that_read_models_have_all_options(name):
    assert options_of(COMMANDS[name]) >= NAMES


def test_those_are_the_commands_with_a_model():
    reading_models = {
        name for name, command in COMMANDS.items() if {"model", "models"} & options_of(command)
    }
    assert reading_models >= {"analyze", "deflect", "suggest"}
    for name in reading_models:
        assert options_of(COMMANDS[name]) >= NAMES, name


OWN = {"no_library", "calibration"}
"""What says something about assembly files, too, or does no harm."""


@pytest.mark.parametrize("name", sorted(NAMES - OWN))
def test_an_assembly_file_takes_few_of_them(name):
    value = {"axle_slide": "free", "gears": "on", "inner": "free"}.get(name, Path("x"))
    with pytest.raises(UsageError, match="LDraw models"):
        reading(Path("a.json"), ModelOptions(**{name: value}))
    assert reading(Path("a.json"), ModelOptions(no_library=True)) == {}


def test_an_ldraw_file_passes_them_on(tmp_path):
    how = ModelOptions(gears="on", inner="free", overrides=tmp_path / "o.toml", no_library=True)
    assert reading(Path("a.ldr"), how) == {
        "axle_slide": "held",
        "gears": "on",
        "inner": "free",
        "solids": "draft",
        "overrides": tmp_path / "o.toml",
    }
