"""The page in a real browser: it obeys its policy, shows the model, and every control does something."""

from __future__ import annotations

import io
import shutil
from collections.abc import Callable, Iterator
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from PIL import Image

import technic
from technic.assembly.model import Assembly, Source
from technic.report.html.page import page, write_page
from technic.rigidity.result import RigidityReport
from tests.conftest import IN_CI, REPO

sync_api = pytest.importorskip("playwright.sync_api")

pytestmark = pytest.mark.slow

FLAGS = [
    "--no-sandbox",
    "--disable-background-networking",
    "--disable-component-update",
    "--disable-sync",
    "--no-first-run",
    # Draw without a graphics card.
    "--use-gl=angle",
    "--use-angle=swiftshader",
    "--enable-unsafe-swiftshader",
]


@pytest.fixture(scope="module")
def browser() -> Iterator:
    """Debian's Chromium without a window."""
    program = shutil.which("chromium") or shutil.which("chromium-browser")
    if program is None:
        if IN_CI:
            pytest.fail("no chromium; scripts/test installs it")
        pytest.skip("no chromium")
    with sync_api.sync_playwright() as playwright:
        browser = playwright.chromium.launch(executable_path=program, args=FLAGS)
        yield browser
        browser.close()


class Visit:
    """An open page with everything that it said and asked for."""

    def __init__(self, browser, path: Path, **context) -> None:
        context = {"viewport": {"width": 1000, "height": 900}, "reduced_motion": "reduce"} | context
        self.context = browser.new_context(**context)
        self.page = self.context.new_page()
        self.page.set_default_timeout(20_000)
        self.said: list[str] = []
        self.asked: list[str] = []
        self.page.on("console", lambda message: self.said.append(message.text))
        self.page.on("pageerror", lambda error: self.said.append(str(error)))
        self.page.on("request", lambda request: self.asked.append(request.url))
        self.address = path.as_uri()
        self.page.goto(self.address)
        self.page.wait_for_selector("#viewer.live #canvas[data-drawn]")

    def canvas(self) -> np.ndarray:
        """Pixels of the model, (height, width, 3), two frames after now."""
        self.page.evaluate(
            "() => new Promise((done) => requestAnimationFrame(() => requestAnimationFrame(done)))"
        )
        picture = self.page.locator("#canvas").screenshot()
        # Without the stage's border.
        return np.asarray(Image.open(io.BytesIO(picture)).convert("RGB")).astype(int)[4:-4, 4:-4]


@pytest.fixture(scope="module")
def chassis() -> RigidityReport:
    return technic.analyze(technic.load(REPO / "technic" / "data" / "rolling_chassis.mpd"))


@pytest.fixture
def visit(browser, tmp_path: Path) -> Iterator[Callable[..., Visit]]:
    visits: list[Visit] = []

    def open_page(report: RigidityReport, **context) -> Visit:
        path = tmp_path / "report.html"
        write_page(report, path)
        visits.append(Visit(browser, path, **context))
        return visits[-1]

    yield open_page
    for visit in visits:
        visit.context.close()


def differ(one: np.ndarray, other: np.ndarray) -> int:
    """Pixels that differ clearly."""
    return int((np.abs(one - other).max(axis=2) > 30).sum())


def near(pixels: np.ndarray, color: tuple[int, int, int], within: int = 45) -> int:
    """Pixels near a colour."""
    return int((np.abs(pixels - np.array(color)).max(axis=2) < within).sum())


def test_loads_without_complaint_or_request(visit, chassis: RigidityReport) -> None:
    seen = visit(chassis)
    policy = seen.page.locator("meta[http-equiv]").get_attribute("content")
    assert policy.startswith("default-src 'none'; script-src 'sha256-")
    assert "unsafe" not in policy
    assert seen.said == []
    assert seen.asked == [seen.address]
    assert not seen.page.locator("#viewer-note").is_visible()
    pixels = seen.canvas()
    # Red and yellow beams, orange arrows on the stage's grey.
    assert near(pixels, (180, 8, 8)) > 2000
    assert near(pixels, (225, 115, 0), 30) > 300


def test_policy_stops_what_is_not_ours(visit, pair: RigidityReport) -> None:
    """The policy is in force: a script put in later does not run, a picture is not fetched."""
    seen = visit(pair)
    seen.page.evaluate(
        """() => {
          const script = document.createElement("script");
          script.textContent = "window.foreign = 1";
          const picture = document.createElement("img");
          picture.src = "https://example.org/picture.png";
          document.body.append(script, picture);
        }"""
    )
    assert seen.page.evaluate("window.foreign") is None
    assert any("Content Security Policy" in line for line in seen.said)


def test_slider_moves_the_model(visit, pair: RigidityReport) -> None:
    seen = visit(pair)
    slider = seen.page.locator("#amount")
    there = seen.canvas()
    said = seen.page.locator("#scale-note").text_content()
    assert "deformation at 1 N" in said
    slider.focus()
    slider.press("Home")
    back = seen.canvas()
    assert slider.input_value() == "-100"
    assert seen.page.locator("#scale-note").text_content() != said
    assert differ(there, back) > 300
    slider.press("End")
    assert differ(there, seen.canvas()) < 20


def test_play_goes_on_and_stops(visit, pair: RigidityReport) -> None:
    seen = visit(pair)
    button = seen.page.locator("#play")
    button.click()
    assert button.text_content() == "Pause"
    first = seen.page.locator("#amount").input_value()
    seen.page.wait_for_function(
        "(old) => document.getElementById('amount').value !== old", arg=first
    )
    button.click()
    assert button.text_content() == "Play"


def test_row_flies_and_click_chooses(visit, chassis: RigidityReport) -> None:
    seen = visit(chassis)
    before = seen.canvas()
    seen.page.locator("button.fly-spot").first.click()
    info = seen.page.locator("#info")
    spot = chassis.weak_spots[0]
    fastener = next(
        chassis.assembly.parts[k] for k in spot.parts if chassis.assembly.parts[k].fastener
    )
    assert info.is_visible()
    facts = info.text_content()
    assert fastener.name in facts
    assert fastener.number in facts
    assert fastener.source.submodel in facts
    assert f"line {fastener.source.line}" in facts
    assert "% of the worst mode" in facts
    assert differ(before, seen.canvas()) > 5000
    seen.page.locator("#info-close").click()
    assert not info.is_visible()
    # The spot is in the middle now: what lies there can be chosen with the mouse.
    box = seen.page.locator("#canvas").bounding_box()
    seen.page.locator("#show-marks").uncheck()
    seen.page.mouse.click(box["x"] + box["width"] / 2, box["y"] + box["height"] / 2)
    assert info.is_visible()
    names = {part.name for part in chassis.assembly.parts}
    assert seen.page.locator("#info-name").text_content() in names
    # Beside the model there is nothing to choose.
    seen.page.locator("button[data-view=front]").click()
    seen.page.mouse.click(box["x"] + box["width"] / 2, box["y"] + box["height"] - 4)
    assert not info.is_visible()


def test_parts_can_be_hidden_and_shown(visit, chassis: RigidityReport) -> None:
    seen = visit(chassis)
    whole = seen.canvas()
    seen.page.locator("#show-frame").uncheck()
    fasteners = sum(part.fastener for part in chassis.assembly.parts)
    hidden = len(chassis.assembly.parts) - fasteners
    assert seen.page.locator("#hidden-note").text_content() == f"{hidden} parts hidden"
    assert differ(whole, seen.canvas()) > 10_000
    seen.page.locator("#show-all").click()
    assert differ(whole, seen.canvas()) < 20
    seen.page.locator("#part-list summary").click()
    seen.page.locator("#part-search").fill("frame 5 x 7")
    rows = seen.page.locator("#part-list tbody tr")
    frames = sum(part.name == "Frame 5 x 7" for part in chassis.assembly.parts)
    assert rows.count() == frames
    rows.first.locator("input").uncheck()
    assert seen.page.locator("#hidden-note").text_content() == "1 parts hidden"


def test_energy_colours_have_a_labelled_legend(visit, chassis: RigidityReport) -> None:
    from technic.report.energy import energy_shares

    seen = visit(chassis)
    own = seen.canvas()
    seen.page.locator("#by-energy").check()
    assert differ(own, seen.canvas()) > 10_000
    most = 100.0 * energy_shares(chassis).max()
    said = seen.page.locator("#heat-most").text_content()
    assert float(said.removesuffix(" %")) == pytest.approx(most, rel=0.01)


def test_motion_plays_in_green(visit, scissors: RigidityReport) -> None:
    seen = visit(scissors)
    seen.page.locator("button.play-motion").first.click()
    assert seen.page.locator("#what").input_value() == "motion 0"
    assert seen.page.locator("#motion-key").is_visible()
    assert seen.page.locator("#play").text_content() == "Pause"
    seen.page.locator("#play").click()
    pixels = seen.canvas()
    green = (pixels[:, :, 1] > pixels[:, :, 0] + 60) & (pixels[:, :, 1] > pixels[:, :, 2] + 40)
    assert green.sum() > 1000


def test_arrows_are_over_the_parts(visit, pair: RigidityReport) -> None:
    """Seen from any side as many arrows are there: none is hidden in a part."""
    seen = visit(pair)
    seen.page.locator("#show-marks").uncheck()
    for view in ("iso", "front", "top"):
        seen.page.locator(f"button[data-view={view}]").click()
        shown = seen.canvas()
        seen.page.locator("#show-frame").uncheck()
        seen.page.locator("#show-fasteners").uncheck()
        bare = seen.canvas()
        orange = (225, 115, 0)
        assert near(bare, orange, 40) > 100
        assert near(shown, orange, 40) >= 0.97 * near(bare, orange, 40)
        seen.page.locator("#show-all").click()


def test_keyboard_reaches_everything(visit, pair: RigidityReport) -> None:
    seen = visit(pair)
    reached: list[str] = []
    for _ in range(40):
        seen.page.keyboard.press("Tab")
        reached.append(
            seen.page.evaluate(
                "document.activeElement.id || document.activeElement.className.split(' ')[0]"
            )
        )
    for wanted in ("skip", "canvas", "what", "play", "amount", "show-load", "fly-spot"):
        assert wanted in reached
    canvas = seen.page.locator("#canvas")
    canvas.focus()
    before = seen.canvas()
    canvas.press("ArrowLeft")
    canvas.press("ArrowUp")
    turned = seen.canvas()
    assert differ(before, turned) > 1000
    canvas.press("+")
    assert differ(turned, seen.canvas()) > 1000
    canvas.press("n")
    info = seen.page.locator("#info")
    assert info.is_visible()
    assert seen.page.locator("#info-name").text_content() == pair.assembly.parts[0].name
    canvas.press("Escape")
    assert not info.is_visible()
    canvas.press("Home")
    assert differ(before, seen.canvas()) < 50


def test_phone_width_needs_no_sideways_scrolling(visit, chassis: RigidityReport) -> None:
    deep = {**chassis.assembly.source, "path": "/" + "a_folder_with_a_long_name/" * 6 + "model.mpd"}
    chassis = replace(chassis, assembly=replace(chassis.assembly, source=deep))
    seen = visit(chassis, viewport={"width": 360, "height": 740}, has_touch=True, is_mobile=True)
    width = seen.page.evaluate("document.documentElement.scrollWidth")
    assert width <= 360
    assert seen.page.locator("#canvas").bounding_box()["width"] > 300


def test_dark_mode_is_dark_and_readable(visit, pair: RigidityReport) -> None:
    seen = visit(pair, color_scheme="dark")

    def luminance(name: str, where: str) -> float:
        text = seen.page.evaluate(f"getComputedStyle(document.querySelector('{where}')).{name}")
        channels = [float(v) / 255 for v in text[text.index("(") + 1 : -1].split(",")[:3]]
        linear = [v / 12.92 if v <= 0.04045 else ((v + 0.055) / 1.055) ** 2.4 for v in channels]
        return 0.2126 * linear[0] + 0.7152 * linear[1] + 0.0722 * linear[2]

    paper = luminance("backgroundColor", "body")
    assert paper < 0.05
    for where in ("body", ".facts dt", "th", ".remark", "footer p"):
        # WCAG 2.2, contrast (minimum): 4.5 to 1.
        assert (luminance("color", where) + 0.05) / (paper + 0.05) >= 4.5


def test_print_layout_has_the_tables_and_a_view(visit, chassis: RigidityReport) -> None:
    seen = visit(chassis)
    seen.page.evaluate("window.dispatchEvent(new Event('beforeprint'))")
    seen.page.emulate_media(media="print")
    for wanted in ("#weak-spots", "#motions", "#findings", "#stiffness", "#not-modelled"):
        assert seen.page.locator(wanted).is_visible()
    assert seen.page.locator("#weak-spots tbody tr").count() == 40
    assert not seen.page.locator("#controls").is_visible()
    picture = seen.page.locator("#snapshot")
    assert picture.is_visible()
    assert picture.evaluate("(picture) => picture.naturalWidth") > 300
    assert len(seen.page.pdf()) > 20_000
    assert seen.said == []


HOSTILE = "</script><script>window.broken = 1</script><img src=x onerror='window.broken = 2'>\"'&"


def hostile(assembly: Assembly) -> Assembly:
    """The same model with names that try to get out of every place they are put into."""
    parts = tuple(
        replace(part, name=HOSTILE, number=HOSTILE, source=Source(HOSTILE, 1))
        for part in assembly.parts
    )
    return replace(assembly, name=HOSTILE, parts=parts)


def test_names_from_the_file_are_harmless(visit, scissors: RigidityReport) -> None:
    report = replace(technic.analyze(hostile(scissors.assembly)), not_modelled=(HOSTILE,))
    seen = visit(report)
    assert seen.page.locator("h1").text_content() == HOSTILE
    seen.page.locator("#canvas").press("n")
    assert seen.page.locator("#info-name").text_content() == HOSTILE
    seen.page.locator("#part-list summary").click()
    assert seen.page.evaluate("window.broken") is None
    assert seen.page.locator("img[src=x]").count() == 0
    assert seen.said == []
    assert seen.asked == [seen.address]


def test_model_named_script(visit, make_report: Callable[..., RigidityReport]) -> None:
    report = make_report(["1 4 0 0 0 1 0 0 0 1 0 0 0 1 32316.dat"], "<script>")
    seen = visit(report)
    assert seen.page.locator("h1").text_content() == report.assembly.name
    assert "<script>" in report.assembly.name
    assert seen.said == []


def test_without_webgl_the_tables_stay(browser, pair: RigidityReport, tmp_path: Path) -> None:
    path = tmp_path / "page.html"
    path.write_text(page(pair), encoding="utf-8")
    context = browser.new_context()
    context.add_init_script("HTMLCanvasElement.prototype.getContext = () => null")
    seen = context.new_page()
    seen.goto(path.as_uri())
    seen.wait_for_function(
        "document.getElementById('viewer-note').textContent.includes('cannot be shown')"
    )
    assert seen.locator("#weak-spots table").is_visible()
    context.close()
