"""The page of `technic suggest`: words, shared shapes, and two models that move together."""

from __future__ import annotations

import base64
import gzip
import json
from collections.abc import Callable, Iterator
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from technic.design.reinforce import reinforce
from technic.design.suggest import Suggestions, suggest
from technic.loading import load
from technic.report.html.suggestions import suggestions_page, write_suggestions_page
from technic.report.suggest_text import cure_words, parts_words
from tests.conftest import REPO
from tests.report.browsing import Visit, differ
from tests.report.test_page import Reader, contents
from tests.report.test_page_browser import HOSTILE, hostile

SQUARE = REPO / "examples" / "square.ldr"


@pytest.fixture(scope="module")
def answers() -> list[Suggestions]:
    return [suggest(load(SQUARE), count=3, parts="frame")]


def test_every_suggestion_is_said(answers) -> None:
    words = " ".join(Reader(suggestions_page(answers, sequence=False)).words.split())
    assert len(answers[0].suggestions) == 3
    for suggestion in answers[0].suggestions:
        assert parts_words(suggestion) in words
        assert cure_words(answers[0].before, suggestion) in words
    for heading in ("Suggestions, best first", "Where they go", "Parts needed", "How sure"):
        assert heading in words
    assert all(item in words for item in answers[0].before.not_modelled)


def test_parts_needed_are_counted(answers) -> None:
    from technic.design.filters import needs

    text = suggestions_page(answers, sequence=False)
    table = text.split('<section id="needed">')[1].split("</section>")[0]
    for suggestion in answers[0].suggestions:
        for part in needs(suggestion.candidate):
            assert f"<td>{part}</td>" in table


def test_models_share_shapes_camera_scale_and_range(answers) -> None:
    text = suggestions_page(answers, sequence=False)
    found, array = contents(text)
    assert len(found["models"]) == 4
    before = found["models"][0]
    first = {json.dumps(shape["points"]) for shape in before["shapes"]}
    for model in found["models"][1:]:
        own = {json.dumps(shape["points"]) for shape in model["shapes"]}
        assert own & first  # the same bytes, stored once
        added = set(model["added"])
        assert added
        # Present parts stand where they stood: both models are placed from one point.
        where = array(model["translations"]).reshape(-1, 3)
        kept = [k for k in range(model["count"]) if k not in added]
        old = array(before["translations"]).reshape(-1, 3)
        assert {tuple(row) for row in where[kept].tolist()} <= {tuple(row) for row in old.tolist()}
    energies = [model["work"] * array(model["energy"]).max() for model in found["models"]]
    assert found["most"] == pytest.approx(max(energies), rel=1e-6)
    data = gzip.decompress(base64.b64decode(Reader(text).element("block")))
    assert len(text) < 1.2e6
    assert len(data) > 1000


def test_sequence_says_steps_and_totals() -> None:
    answers = reinforce(load(SQUARE), steps=2, parts="frame")
    words = " ".join(Reader(suggestions_page(answers, sequence=True)).words.split())
    assert "Parts, one after the other" in words
    assert "In all" in words
    assert "Step 1" in words


def test_nothing_to_suggest_is_said(answers) -> None:
    none = [replace(answers[0], suggestions=(), places=0)]
    text = suggestions_page(none, sequence=False)
    assert "Nothing fits" in Reader(text).words
    assert "<script" not in text


# --- in the browser -------------------------------------------------------------------------------


@pytest.fixture
def visit(browser, tmp_path: Path) -> Iterator[Callable[..., Visit]]:
    visits: list[Visit] = []

    def open_page(answers: list[Suggestions], **context) -> Visit:
        path = tmp_path / "suggest.html"
        write_suggestions_page(answers, path, sequence=False)
        visits.append(Visit(browser, path, **context))
        return visits[-1]

    yield open_page
    for visit in visits:
        visit.context.close()


def orange(pixels: np.ndarray) -> int:
    """Pixels that are clearly orange, in light or in shade."""
    red, green, blue = (pixels[:, :, k] for k in range(3))
    return int(((red > green + 55) & (green > blue + 30)).sum())


BEFORE, AFTER = "#canvas-before", "#canvas-after"


@pytest.mark.slow
def test_both_models_are_shown_without_complaint(visit, answers) -> None:
    seen = visit(answers)
    assert seen.said == []
    assert seen.asked == [seen.address]
    before = seen.canvas(BEFORE)
    # It is flexible: what moves is green.
    green = (before[:, :, 1] > before[:, :, 0] + 40) & (before[:, :, 1] > before[:, :, 2] + 30)
    assert green.sum() > 500
    seen.page.locator("#what").select_option("none")
    # The new parts are orange.
    assert orange(seen.canvas(AFTER)) > 500
    assert orange(seen.canvas(BEFORE)) < 50


@pytest.mark.slow
def test_one_camera_for_both(visit, answers) -> None:
    seen = visit(answers)
    seen.page.locator("#what").select_option("none")
    seen.page.locator("#by-color").check()
    old = [seen.canvas(BEFORE), seen.canvas(AFTER)]
    # Where nothing is new both halves show the same pixels.
    assert (np.abs(old[0] - old[1]).max(axis=2) < 30).mean() > 0.85
    for where in (BEFORE, AFTER):
        seen.page.locator(where).press("ArrowLeft")
        new = [seen.canvas(BEFORE), seen.canvas(AFTER)]
        assert differ(old[0], new[0]) > 500
        assert differ(old[1], new[1]) > 500
        old = new


@pytest.mark.slow
def test_slider_rows_colours_and_click(visit, answers) -> None:
    seen = visit(answers)
    seen.page.locator("#what").select_option("mode")
    there = seen.canvas(BEFORE)
    slider = seen.page.locator("#amount")
    slider.focus()
    slider.press("Home")
    assert differ(there, seen.canvas(BEFORE)) > 200
    assert "1 N" in seen.page.locator("#scale-note").text_content()
    after = seen.canvas(AFTER)
    seen.page.locator("button.choose").nth(1).click()
    assert seen.page.locator("#which").input_value() == "2"
    assert seen.page.locator("#caption-after").text_content().startswith("after 2")
    assert differ(after, seen.canvas(AFTER)) > 200
    seen.page.locator("#by-energy").check()
    assert seen.page.locator("#heat-most").text_content().endswith("µJ")
    box = seen.page.locator(AFTER).bounding_box()
    found = ""
    for x in np.linspace(0.3, 0.7, 9):
        seen.page.mouse.click(box["x"] + x * box["width"], box["y"] + box["height"] / 2)
        found = found or seen.page.locator("#chosen").text_content()
    assert "strain energy" in found
    assert seen.said == []


@pytest.mark.slow
def test_phone_dark_and_print(visit, answers) -> None:
    phone = visit(answers, viewport={"width": 360, "height": 740}, color_scheme="dark")
    assert phone.page.evaluate("document.documentElement.scrollWidth") <= 360
    boxes = [phone.page.locator(where).bounding_box() for where in (BEFORE, AFTER)]
    assert boxes[1]["y"] > boxes[0]["y"] + 100  # one above the other
    seen = visit(answers)
    seen.page.evaluate("window.dispatchEvent(new Event('beforeprint'))")
    seen.page.emulate_media(media="print")
    for wanted in ("#suggestions table", "#places", "#needed table", "#sure", "#not-modelled"):
        assert seen.page.locator(wanted).is_visible()
    for wanted in ("#snapshot-before", "#snapshot-after"):
        picture = seen.page.locator(wanted)
        assert picture.is_visible()
        assert picture.evaluate("(picture) => picture.naturalWidth") > 200
    assert not seen.page.locator("#controls").is_visible()


@pytest.mark.slow
def test_hostile_names_are_harmless(visit, answers) -> None:
    first = answers[0]
    before = replace(first.before, assembly=hostile(first.before.assembly), reason=HOSTILE)
    suggestions = tuple(
        replace(s, report=replace(s.report, assembly=replace(s.report.assembly, name=HOSTILE)))
        for s in first.suggestions
    )
    seen = visit([replace(first, before=before, suggestions=suggestions)])
    assert HOSTILE in seen.page.locator("h1").text_content()
    assert seen.page.evaluate("window.broken") is None
    assert seen.said == []


@pytest.mark.slow
def test_command_writes_the_page(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    import sys

    from technic import cli

    page = tmp_path / "page.html"
    command = ["technic", "suggest", str(SQUARE), "--top", "2", "--report", str(page), "-q"]
    monkeypatch.setattr(sys, "argv", command)
    with pytest.raises(SystemExit) as end:
        cli.main()
    assert not end.value.code
    text = page.read_text(encoding="utf-8")
    assert 'src="data:image/webp;base64,' in text
    assert text.count('button type="button" class="choose') == 2
