"""Pictures against kept ones, with an eye for shapes and colours instead of pixels."""

from __future__ import annotations

import io
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from numpy.typing import NDArray
from PIL import Image

from technic.report.picture import report_scene
from technic.report.render import Painter
from tests.report.golden_cases import CASES, FOLDER
from tests.report.perception import likeness, small


def kept(name: str) -> NDArray[np.uint8]:
    with Image.open(FOLDER / f"{name}.png") as file:
        return np.asarray(file.convert("RGB"))


@pytest.mark.slow
@pytest.mark.parametrize("name", list(CASES))
def test_picture_looks_like_the_kept_one(name: str, tmp_path: Path) -> None:
    drawn = small(Image.open(io.BytesIO(Painter().picture(CASES[name](tmp_path)))))
    found = likeness(drawn, kept(name))
    if not found.same:
        Image.fromarray(drawn).save(tmp_path / f"{name}.png")
    assert found.same, f"{found}; drawn: {tmp_path / name}.png; scripts/make_golden draws them anew"


def test_every_kept_picture_has_its_case() -> None:
    assert {path.stem for path in FOLDER.glob("*.png")} == set(CASES)


@pytest.mark.parametrize("name", list(CASES))
def test_what_a_renderer_may_do_is_the_same_picture(name: str) -> None:
    """Other smoothing of edges, a little less light, noise of rounding."""
    picture = kept(name)
    rng = np.random.default_rng(3)
    noisy = np.clip(picture + rng.normal(scale=3.0, size=picture.shape), 0, 255).astype(np.uint8)
    darker = (0.96 * picture).astype(np.uint8)
    shifted = 0.5 * (picture[:, 1:].astype(float) + picture[:, :-1])  # half a pixel
    smoothed = np.concatenate([shifted, picture[:, -1:]], axis=1).astype(np.uint8)
    for other in (noisy, darker, smoothed):
        assert likeness(picture, other).same


@pytest.mark.parametrize("name", list(CASES))
def test_what_a_mistake_does_is_another_picture(name: str) -> None:
    picture = kept(name)
    top, bottom = 60, 225  # where the model is drawn
    mirrored = picture.copy()
    mirrored[top:bottom] = picture[top:bottom, ::-1]
    flipped = picture.copy()
    flipped[top:bottom] = picture[top:bottom][::-1]
    moved = picture.copy()
    moved[top:bottom] = np.roll(picture[top:bottom], 6, axis=1)
    swapped = picture[:, :, ::-1].copy()  # red for blue
    empty = picture.copy()
    empty[top:bottom] = 255
    for other in (mirrored, flipped, moved, swapped, empty):
        assert not likeness(picture, other).same


def test_another_case_is_another_picture() -> None:
    names = list(CASES)
    for k, one in enumerate(names):
        for other in names[k + 1 :]:
            assert not likeness(kept(one), kept(other)).same


def test_picture_does_not_depend_on_the_sense_of_a_motion(scissors) -> None:
    """A null space has two signs; the picture has one."""
    turned = [replace(motion, twists=-motion.twists) for motion in scissors.motions]
    other = replace(scissors, motions=tuple(turned))
    arrows = [
        next(s for s in report_scene(report).panels[0].surfaces if s.on_top)
        for report in (scissors, other)
    ]
    np.testing.assert_allclose(arrows[0].points, arrows[1].points, atol=1e-12)
