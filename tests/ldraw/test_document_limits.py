"""Documents that must be refused, each with file, line and remedy; and lines in any order."""

from __future__ import annotations

import time

import pytest
from hypothesis import given
from hypothesis import strategies as st

from technic.errors import InputError
from technic.ldraw.document import placements
from tests.ldraw.documents import KNOWN, document, parts, ref


@pytest.mark.parametrize(
    ("lines", "cycle", "line"),
    [
        (["0 FILE a.ldr", ref("a.ldr")], "a.ldr > a.ldr", 2),
        (["0 FILE a.ldr", ref("b.ldr"), "0 FILE b.ldr", ref("A.LDR")], "a.ldr > b.ldr > a.ldr", 4),
        (
            [
                "0 FILE a.ldr",
                ref("b.ldr"),
                "0 FILE b.ldr",
                ref("c.ldr"),
                "0 FILE c.ldr",
                ref("b.ldr"),
            ],
            "b.ldr > c.ldr > b.ldr",
            6,
        ),
        (
            [
                "0 FILE a.ldr",
                ref("x.dat"),
                "0 FILE x.dat",
                ref("y.dat"),
                "0 FILE y.dat",
                ref("x.dat"),
            ],
            "x.dat > y.dat > x.dat",
            6,
        ),
    ],
)
def test_a_file_that_includes_itself(lines: list[str], cycle: str, line: int) -> None:
    with pytest.raises(InputError, match="includes itself") as caught:
        parts(*lines)
    assert cycle in caught.value.message
    assert caught.value.line == line
    assert caught.value.remedy


def nested(levels: int) -> list[str]:
    lines = []
    for k in range(levels):
        name = f"{k + 1}.ldr" if k < levels - 1 else "3001.dat"
        lines += [f"0 FILE {k}.ldr", ref(name, at="1 0 0")]
    return lines


def test_deep_nesting_works_up_to_the_limit() -> None:
    (part,) = parts(*nested(256))
    assert part.position[0] == 256
    assert len(part.lines) == 256


@pytest.mark.slow
def test_a_hundred_thousand_levels_are_refused() -> None:
    with pytest.raises(InputError, match="nested more than 256 deep") as caught:
        parts(*nested(100_000))
    assert caught.value.line is not None


def test_depth_counts_the_longest_way() -> None:
    """Short ways are walked first here, so that the deep one meets sections already seen."""
    levels = 200
    lines = ["0 FILE m.ldr", ref("b0.ldr"), ref("a0.ldr")]
    for letter, last in (("a", "b0.ldr"), ("b", "3001.dat")):
        for k in range(levels):
            name = f"{letter}{k + 1}.ldr" if k < levels - 1 else last
            lines += [f"0 FILE {letter}{k}.ldr", ref(name)]
    with pytest.raises(InputError, match="nested more than"):
        parts(*lines)


def doubling(levels: int, last: list[str]) -> list[str]:
    lines = []
    for k in range(levels):
        lines += [f"0 FILE {k}.ldr", ref(f"{k + 1}.ldr"), ref(f"{k + 1}.ldr")]
    return [*lines, f"0 FILE {levels}.ldr", *last]


@pytest.mark.parametrize("last", [[ref("3001.dat")], []], ids=["parts", "empty"])
def test_exponential_growth_is_refused_before_it_happens(last: list[str]) -> None:
    start = time.perf_counter()
    with pytest.raises(InputError, match="unfolds into more than") as caught:
        parts(*doubling(200, last))
    assert caught.value.remedy
    assert time.perf_counter() - start < 5
    with pytest.raises(InputError, match="unfolds into 3,071 parts and submodels"):
        parts(*doubling(10, [ref("3001.dat")]), max_parts=3000)
    assert len(parts(*doubling(10, [ref("3001.dat")]))) == 1024


@pytest.mark.parametrize(
    "lines",
    [
        ["0 only a title"],
        ["0 FILE m.ldr", "0 FILE other.ldr", ref("3001.dat")],
        ["0 MLCAD HIDE " + ref("3001.dat")],
        ["0 FILE m.ldr", ref("empty.ldr"), "0 FILE empty.ldr"],
    ],
)
def test_a_model_without_parts(lines: list[str]) -> None:
    with pytest.raises(InputError, match="no parts") as caught:
        parts(*lines)
    assert caught.value.remedy


def test_a_bad_line_is_an_error_unless_skipped() -> None:
    lines = [ref("3001.dat"), "1 4 0 0 zero 1 0 0 0 1 0 0 0 1 3001.dat"]
    with pytest.raises(InputError, match="'zero'") as caught:
        document(*lines)
    assert caught.value.line == 2
    found = placements(document(*lines, skip_bad_lines=True), KNOWN.__contains__)
    assert len(found) == 1
    assert [n.lines for n in found.notices] == [(2,)]
    assert "left out" in found.notices[0].message


SNIPPETS = st.sampled_from(
    [
        ref("3001.dat"),
        ref("a.ldr"),
        ref("b.ldr", matrix="2 0 0 0 1 0 0 0 1"),
        ref("77.dat", matrix="1 0 0 0 0 0 0 0 1"),
        "0 FILE a.ldr",
        "0 FILE b.ldr",
        "0 FILE",
        "0 NOFILE",
        "0 !DATA x",
        "0 STEP",
        "0 SYNTH",
        "0 SYNTH BEGIN",
        "0 SYNTH SYNTHESIZED",
        "0 SYNTH END",
        "0 MLCAD",
        "0 MLCAD SKIP_BEGIN",
        "0 MLCAD SKIP_END",
        "0 BUFEXCHG A",
        "0 BUFEXCHG A STORE",
        "0 BUFEXCHG A RETRIEVE",
        "0 !LDRAW_ORG",
        "0 !LDRAW_ORG Part",
        "0 !LDCAD CONTENT [type=path]",
        "1 4 0 0",
        "3 16",
        "",
    ]
)


@given(st.lists(SNIPPETS, max_size=14))
def test_any_order_of_lines_is_read_or_refused(lines: list[str]) -> None:
    """Every reference in use ends as a part or in a notice; every refusal has a remedy."""
    try:
        found = parts("0 title", *lines)
    except InputError as error:
        remedy = error.remedy
        event = "refused"
    else:
        remedy = "none needed"
        event = "read"
        assert len({p.id for p in found}) == len(found)
        listed = {line for p in found for line in p.lines}
        listed |= {line for n in found.notices for line in n.lines}
        used = {p.section.name for p in found} | {"m.mpd"}
        for section in document("0 title", *lines).sections:
            if section.name in used and section is section.scope[section.name.lower()]:
                assert {r.number for r in section.references if r.name != "b.ldr"} <= listed
    assert remedy, event
