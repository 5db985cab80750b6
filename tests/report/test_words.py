"""Patterns of movement, numbers, files."""

from __future__ import annotations

import json

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from technic.errors import UsageError
from technic.report.files import write_atomic
from technic.report.json import dumps, write_json
from technic.report.pattern import describe_field
from technic.report.wording import joined, number


@pytest.fixture
def grid():
    x, y, z = np.meshgrid(np.linspace(-2, 2, 7), np.linspace(-0.5, 0.5, 3), np.linspace(-1, 1, 5))
    return np.column_stack([x.ravel(), y.ravel(), z.ravel()])


RIGID = [np.array([1.0, 0, 0, 0, 0, 0]), np.array([0.2, -1, 0.3, 0.5, 0.1, -0.7])]


def rigid(points, twist):
    return twist[:3] + np.cross(twist[3:], points)


@pytest.mark.parametrize("twist", RIGID)
@pytest.mark.parametrize("move", [[0.0, 0.0, 0.0], [3.0, -1.0, 2.0]])
def test_twist_is_recognised_whatever_rigid_motion_is_added(grid, twist, move):
    field = grid[:, :1] * np.cross([1.0, 0, 0], grid) + rigid(grid, twist)
    said = describe_field(grid + move, field, np.ones(len(grid)))
    assert said == "it twists about the x axis (left to right)"


def test_bending_is_recognised(grid):
    field = np.zeros_like(grid)
    field[:, 1] = 0.5 * grid[:, 0] ** 2
    field[:, 0] = -grid[:, 0] * grid[:, 1]
    said = describe_field(grid, field, np.ones(len(grid)))
    assert said == "it bends up and down along the x axis (left to right)"


def test_racking_is_recognised(grid):
    field = np.zeros_like(grid)
    field[:, 0] = grid[:, 2]
    said = describe_field(grid, field, np.ones(len(grid)))
    assert said == "it racks (rectangles become diamonds) seen along the y axis (upright)"


def test_noise_and_rigid_motion_have_no_pattern(grid):
    noise = np.random.default_rng(3).normal(size=grid.shape)
    assert describe_field(grid, noise, np.ones(len(grid))) is None
    assert describe_field(grid, np.zeros_like(grid), np.ones(len(grid))) is None
    assert describe_field(grid[:2], noise[:2], np.ones(2)) is None


@given(st.floats(1e-3, 1e6), st.integers(2, 6))
def test_numbers_keep_their_significant_digits(value, digits):
    assert float(number(value, digits)) == pytest.approx(value, rel=0.51 * 10 ** (1 - digits))


def test_words_are_joined():
    assert joined([]) == ""
    assert joined(["a"]) == "a"
    assert joined(["a", "b", "c"]) == "a, b and c"


def test_json_file_is_whole_or_not_there(tmp_path):
    target = tmp_path / "r.json"
    write_json({"a": 1}, str(target))
    assert json.loads(target.read_text()) == {"a": 1}

    def fail(path):
        path.write_text("half")
        raise ValueError("interrupted")

    with pytest.raises(ValueError, match="interrupted"):
        write_atomic(target, fail)
    assert json.loads(target.read_text()) == {"a": 1}
    assert [p.name for p in tmp_path.iterdir()] == ["r.json"]


def test_json_to_standard_output(capsys):
    write_json({"a": "ö"}, "-")
    assert json.loads(capsys.readouterr().out) == {"a": "ö"}


def test_json_refuses_what_is_no_number():
    with pytest.raises(ValueError, match="JSON"):
        dumps({"a": float("nan")})


def test_unwritable_targets_are_usage_errors(tmp_path):
    with pytest.raises(UsageError, match="is a directory"):
        write_json({}, str(tmp_path))
    with pytest.raises(UsageError, match="does not exist"):
        write_json({}, str(tmp_path / "no" / "r.json"))
