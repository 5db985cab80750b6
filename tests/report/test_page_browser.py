"""The page in a real browser: it obeys its policy, shows the model, and every control does something."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

import technic
from technic.assembly.model import Assembly, Source
from technic.report.html.page import page, write_page
from technic.rigidity.result import RigidityReport
from tests.conftest import REPO
from tests.report.browsing import Visit, differ, near

pytestmark = pytest.mark.slow


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


def click(seen: Visit, across: float, down: float) -> None:
    """Click into the model, at shares of its width and height."""
    canvas = seen.page.locator("#canvas")
    canvas.scroll_into_view_if_needed()
    box = canvas.bounding_box()
    canvas.click(position={"x": across * box["width"], "y": down * box["height"]})


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
    seen.page.locator("#show-marks").uncheck()
    click(seen, 0.5, 0.5)
    assert info.is_visible()
    names = {part.name for part in chassis.assembly.parts}
    assert seen.page.locator("#info-name").text_content() in names
    # Beside the model there is nothing to choose.
    seen.page.locator("button[data-view=front]").click()
    click(seen, 0.97, 0.5)
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


def test_every_mode_bends_and_can_be_chosen(visit, chassis: RigidityReport) -> None:
    seen = visit(chassis)
    options = seen.page.locator("#what option")
    words = [options.nth(k).text_content() for k in range(options.count())]
    modes = [said for said in words if said.startswith(("Worst case", "Mode "))]
    assert len(modes) == len(chassis.modes) > 3
    assert not any("rigid" in said for said in words)
    pictures = []
    for k in range(3):
        seen.page.locator("#what").select_option(f"mode {k}")
        pictures.append(seen.canvas())
    assert differ(pictures[0], pictures[1]) > 2000
    assert differ(pictures[1], pictures[2]) > 2000
    # Arrows and weak spots belong to the worst case alone.
    assert not seen.page.locator("#load-key").is_visible()
    seen.page.locator("#what").select_option("mode 0")
    assert seen.page.locator("#load-key").is_visible()


def test_marks_of_weak_spots_do_not_overlap(visit, chassis: RigidityReport) -> None:
    seen = visit(chassis)
    for view in ("best", "front", "side", "top"):
        seen.page.locator(f"button[data-view={view}]").click()
        seen.canvas()
        boxes = seen.page.evaluate(
            """() => [...document.querySelectorAll('.mark')].filter((m) => !m.hidden).map((m) => {
              const box = m.getBoundingClientRect();
              return [box.left, box.top, box.right, box.bottom];
            })"""
        )
        assert len(boxes) >= 2
        for k, a in enumerate(boxes):
            for b in boxes[k + 1 :]:
                apart = a[2] <= b[0] + 1 or b[2] <= a[0] + 1 or a[3] <= b[1] + 1 or b[3] <= a[1] + 1
                assert apart


def test_clear_parts_show_what_is_behind(visit, make_report) -> None:
    lines = ["1 4 0 0 0 1 0 0 0 1 0 0 0 1 32316.dat", "1 {} 60 0 0 1 0 0 0 1 0 0 0 1 32316.dat"]
    opaque, clear = (make_report([lines[0], lines[1].format(code)], f"c{code}") for code in (1, 47))
    red = []
    for report in (opaque, clear):
        seen = visit(report)
        seen.page.locator("button[data-view=side]").click()  # the second beam hides the first
        seen.page.locator("#show-edges").uncheck()
        pixels = seen.canvas()
        red.append(int((pixels[:, :, 0] > pixels[:, :, 2] + 5).sum()))
    assert red[1] > 2000
    assert red[1] > 5 * red[0]


def test_assembly_stands_upright(visit) -> None:
    """The rack's feet are below, its shelf above: z is up in the file."""
    path = REPO / "technic" / "data" / "gallery" / "fig14c_drying_rack_3.json"
    report = technic.analyze(technic.load(path))
    seen = visit(report)
    seen.page.locator("#show-load").uncheck()
    seen.page.locator("#show-marks").uncheck()
    seen.page.locator("#what").select_option("none")
    for view in ("front", "best"):
        seen.page.locator(f"button[data-view={view}]").click()
        ink = np.abs(seen.canvas() - seen.canvas()[5, 5]).max(axis=2) > 60
        rows = np.flatnonzero(ink.any(axis=1))
        upper, lower = (ink[rows[0] : rows[0] + 30].sum(), ink[rows[-1] - 30 : rows[-1]].sum())
        assert upper > 1.5 * lower  # the shelf's frame against four feet


def test_calibration_has_its_plots(visit, model_with_calibration) -> None:
    seen = visit(model_with_calibration)
    plot = seen.page.locator("svg.plot").first
    assert plot.is_visible()
    assert plot.locator("circle.dot").count() >= 1
    words = " ".join(plot.locator("text").all_text_contents())
    assert "pin/pin_hole" in words
    assert "N/m" in words
    assert seen.said == []


@pytest.fixture
def model_with_calibration(tmp_path: Path) -> RigidityReport:
    from technic.assembly.stiffness import read_table
    from technic.report.calibration import calibration_toml
    from technic.statics.calibration import calibrate

    sample = REPO / "calibration" / "samples" / "pins_synthetic.csv"
    table = tmp_path / "pins.toml"
    table.write_text(calibration_toml(calibrate(sample), "2026-11-22"), encoding="utf-8")
    path = REPO / "technic" / "data" / "rolling_chassis.mpd"
    return technic.analyze(technic.load(path, table=read_table(table)), table=read_table(table))


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
    sections = (
        "#weak-spots",
        "#motions",
        "#findings",
        "#stiffness",
        "#parts-made",
        "#not-modelled",
    )
    for wanted in sections:
        assert seen.page.locator(wanted).is_visible()
    tables = seen.page.locator("table:not(#part-list table)")
    assert tables.count() >= 3
    for k in range(tables.count()):
        assert tables.nth(k).is_visible()
        # Nothing is cut off at the edge of the paper.
        assert tables.nth(k).evaluate("(table) => table.scrollWidth <= innerWidth")
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
