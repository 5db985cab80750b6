"""The report in words."""

from __future__ import annotations

import dataclasses
import io
import re

import pytest

from technic.assembly.model import Finding, FindingKind, UnknownPart
from technic.report.bodies import moving_groups
from technic.report.style import Style, style_for
from technic.report.text import to_text
from technic.rigidity.result import MotionKind, Verdict


def find(pattern, text):
    """First match; fails when there is none."""
    match = re.search(pattern, text)
    assert match is not None, pattern
    return match


def with_assembly(report, **changes):
    return dataclasses.replace(report, assembly=dataclasses.replace(report.assembly, **changes))


def test_rigid_model(pair):
    said = to_text(pair)
    assert said.startswith("pair: 4 parts, 4 joints, 7.20 x 16.0 x 39.2 mm, ")
    assert "\nRIGID\n" in said
    assert "Main body: 4 parts, rigid.\n" in said
    assert "What moves" not in said
    assert re.search(r"1 N moves it \d+(\.\d+)? mm", said)
    assert "2 pins and other fasteners turn in place" in said


def test_rigidity_in_words_is_that_of_the_report(pair):
    value = float(find(r"Rigidity  (\S+) N/m", to_text(pair))[1])
    assert value == pytest.approx(pair.rigidity.value, rel=5e-3)
    millimetres = float(find(r"moves it (\S+) mm", to_text(pair))[1])
    assert millimetres == pytest.approx(1e3 / pair.rigidity.value, rel=5e-3)


def test_flexible_model_names_number_first_motion_and_usual_cause(scissors):
    assert scissors.verdict is Verdict.FLEXIBLE
    said = to_text(scissors)
    assert "\nFLEXIBLE\n" in said
    assert "What moves: 1 motion\n  1. " in said
    assert "1 other group can move against it (1 part)" in said
    assert "Look at the first one" in said
    assert "held by one pin" in said.replace("\n", " ")


def test_weakest_spot_names_part_number_colour_place_and_share(pair):
    said = to_text(pair)
    first = find(r"  1\. +(\d+\.\d) %  (.*\n.*)", said)
    assert float(first[1]) == pytest.approx(100 * pair.weak_spots[0].energy_share, abs=0.06)
    assert re.search(r"32316, red|32316, blue|2780, black|32316, ", first[2])
    assert re.search(r"pair\.ldr step \d, line \d", said)


def test_shares_of_shown_and_hidden_weak_spots_sum_to_one(pair):
    shares = [float(x) for x in re.findall(r"(\d+\.\d) %  ", to_text(pair))]
    assert sum(shares) == pytest.approx(100.0, abs=0.4)


def test_unknown_parts_appear_with_count_and_lines(pair):
    report = with_assembly(
        pair, unknown=(UnknownPart("98765", (7, 9)), UnknownPart("4711", (12,), "no shape"))
    )
    said = to_text(report)
    assert "left out of the analysis: 3 parts" in said
    assert "2 x 98765: no definition; lines 7, 9" in said
    assert "1 x 4711: no shape; line 12" in said


def test_findings_are_counted_and_capped(pair):
    findings = tuple(Finding(FindingKind.LOOSE, f"part {k} is loose") for k in range(10))
    said = to_text(with_assembly(pair, findings=findings))
    assert "10 loose parts" in said
    assert "part 2 is loose" in said
    assert "part 3 is loose" not in said
    assert "and 7 more, see --json" in said


def test_long_lists_of_motions_are_capped(scissors):
    spin = dataclasses.replace(
        scissors.motions[0], kind=MotionKind.SPINNING, sentence="A wheel spins."
    )
    report = dataclasses.replace(
        scissors,
        motions=(*scissors.motions, *[spin] * 17),
        mobility=dataclasses.replace(scissors.mobility, spinning=17),
    )
    said = to_text(report)
    assert "Spinning freely: 17" in said
    assert said.count("A wheel spins.") == 5
    assert "and 12 more, see --json" in said


def test_first_order_motion_is_called_shaky(scissors):
    first = dataclasses.replace(scissors.motions[0], order="first-order")
    report = dataclasses.replace(scissors, motions=(first, *scissors.motions[1:]))
    assert "Shaky: moves a little" in to_text(report)
    assert "Shaky" not in to_text(scissors)
    for found, said in (("stiffens", "stiffens at once"), ("undecided", "does not decide")):
        told = dataclasses.replace(first, second_order=found)
        report = dataclasses.replace(scissors, motions=(told, *scissors.motions[1:]))
        assert said in " ".join(to_text(report).split())


def test_qualifier_is_said(scissors):
    report = dataclasses.replace(scissors, qualifier="at least")
    assert "What moves: at least 1 motion" in to_text(report)


def test_stiffness_and_its_source_are_printed(pair):
    assert re.search(r"4 x pin/pin_hole \(hinge\): .*source: \w+", to_text(pair).replace("\n", " "))


def test_plain_text_has_no_escape_codes_and_fits_the_width(pair, scissors):
    for report in (pair, scissors):
        for width in (60, 100):
            said = to_text(report, Style(width=width))
            assert "\033" not in said
            words = [line for line in said.splitlines() if " " in line.strip()]
            assert max(map(len, words)) <= width + 20  # headings are not broken


def test_colours_on_a_terminal_only():
    class Terminal(io.StringIO):
        def isatty(self):
            return True

    assert not style_for(io.StringIO()).color
    assert Style(color=True)("good", "RIGID") == "\033[1;32mRIGID\033[0m"
    assert style_for(Terminal()).width <= 100


@pytest.mark.parametrize(
    ("name", "value", "colored"),
    [("NO_COLOR", "1", False), ("NO_COLOR", "", True), ("TERM", "dumb", False)],
)
def test_no_color_is_respected(monkeypatch, name, value, colored):
    class Terminal(io.StringIO):
        def isatty(self):
            return True

    monkeypatch.delenv("NO_COLOR", raising=False)
    monkeypatch.setenv("TERM", "xterm")
    monkeypatch.setenv(name, value)
    assert bool(style_for(Terminal()).color) is colored


def test_groups_of_the_scissors(scissors):
    main, *others = moving_groups(scissors, 0)
    numbers = [scissors.assembly.parts[k].number for k in main]
    assert numbers.count("32316") == 1
    assert [[scissors.assembly.parts[k].number for k in g] for g in others] == [["32316"]]


def test_groups_of_the_pair_are_one_body(pair):
    assert moving_groups(pair, 0) == ((0, 1, 2, 3),)
