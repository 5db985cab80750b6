"""Documents: sections, nested poses, steps, flexible things, and files that must be refused.

Two parts are known here, 3001 and 32524; everything else is unknown to the caller.
"""

from __future__ import annotations

import time
import zipfile
from collections.abc import Callable
from pathlib import Path

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from technic.errors import InputError
from technic.ldraw.document import (
    Document,
    Placements,
    document_from_text,
    placements,
    pose,
    poses,
    read,
)
from technic.ldraw.syntax import Text
from technic.units import LDU

EYE = "1 0 0 0 1 0 0 0 1"
KNOWN = {"3001", "32524"}


def document(*lines: str, skip_bad_lines: bool = False) -> Document:
    text = Text("\n".join(lines) + "\n")
    return document_from_text(text, "m.mpd", skip_bad_lines=skip_bad_lines)


def parts(*lines: str, **options: int) -> Placements:
    return placements(document(*lines), KNOWN.__contains__, **options)


def ref(name: str, color: int = 4, at: str = "0 0 0", matrix: str = EYE) -> str:
    return f"1 {color} {at} {matrix} {name}"


# --- sections ---------------------------------------------------------------------------------
def test_plain_file_is_one_section() -> None:
    found = parts("0 title", ref("3001.dat"), "", ref("32524.DAT", color=16))
    assert [p.id for p in found] == ["m.mpd/2:3001", "m.mpd/4:32524"]
    assert [p.color for p in found] == [4, 16]
    assert found[1].file_name == "32524.DAT"
    assert all(p.known and not p.missing and p.embedded is None for p in found)


def test_first_file_is_main_and_the_rest_counts_where_referenced() -> None:
    found = parts(
        ref("3001.dat"),  # 1: before the first FILE
        "0 FILE main.ldr",
        ref("Arm One.LDR", color=1, at="100 0 0"),  # 3
        "0 NOFILE",
        ref("3001.dat"),  # 5: belongs to nothing
        "0 FILE arm one.ldr",
        ref("3001.dat", color=16, at="1 2 3"),  # 7
        "0 FILE unused.ldr",
        ref("3001.dat"),
        "0 !DATA picture.png",
        "0 !: iVBORw0KGgo=",
    )
    (part,) = found
    assert part.id == "main.ldr/Arm One.LDR/7:3001"
    assert part.lines == (3, 7)
    assert part.color == 1
    assert part.position.tolist() == [101, 2, 3]
    messages = {n.message: n.lines for n in found.notices}
    assert messages == {
        "1 lines before the first 0 FILE are no part of the model": (1,),
        "1 lines after 0 NOFILE are no part of the model": (5,),
        "submodel 'unused.ldr' is not used by the model: 1 lines left out": (8,),
    }


def test_section_named_twice() -> None:
    found = parts(
        "0 FILE m.ldr",
        ref("a.ldr"),
        "0 FILE a.ldr",
        ref("3001.dat"),
        "0 FILE A.ldr",
        ref("32524.dat"),
    )
    assert [p.number for p in found] == ["3001"]
    assert any("appears twice" in n.message for n in found.notices)


def test_comment_that_begins_with_file_is_a_comment() -> None:
    assert len(parts("0 File made by hand", ref("3001.dat"))) == 1


def test_the_same_submodel_twice_has_two_paths() -> None:
    found = parts(
        "0 FILE m.ldr",
        ref("arm.ldr"),
        ref("ARM.ldr", at="50 0 0"),
        ref("arm.ldr", at="90 0 0"),
        "0 FILE arm.ldr",
        ref("3001.dat"),
    )
    assert [p.submodel for p in found] == ["m.ldr/arm.ldr", "m.ldr/ARM.ldr#2", "m.ldr/arm.ldr#3"]
    assert len({p.id for p in found}) == 3


def test_byte_order_marks_inside_joined_files() -> None:
    found = parts("0 FILE m.ldr", ref("a.ldr"), "\ufeff0 FILE a.ldr", "\ufeff" + ref("3001.dat"))
    assert [p.id for p in found] == ["m.ldr/a.ldr/4:3001"]


@pytest.mark.parametrize(
    ("name", "plain"),
    [
        ("8002 - 33299a.dat", "33299a"),
        ("42020-1 - Sticker Left.dat", "sticker left"),
        ("32524.dat", "32524"),
        ("8002 - .dat", "8002 -"),
        ("arm - 2.dat", "arm - 2"),
    ],
)
def test_repository_names(name: str, plain: str) -> None:
    assert parts(ref(name))[0].plain_number.strip() == plain


def test_embedded_part_is_a_part() -> None:
    found = parts(
        "0 FILE m.ldr",
        ref("8002 - 6643.dat"),
        ref("S\\sub.dat"),
        ref("shape.ldr"),
        ref("3001.dat"),
        ref("arm.dat"),
        "0 FILE 8002 - 6643.dat",
        ref("3001.dat"),
        "0 FILE s\\sub.dat",
        "3 16 0 0 0 1 0 0 0 1 0",
        "0 FILE shape.ldr",
        "0 !LDRAW_ORG Unofficial_Part Flexible_Section",
        "0 FILE 3001.dat",
        "4 16 0 0 0 1 0 0 1 1 0 0 1 0",
        "0 FILE arm.dat",
        "0 !LDRAW_ORG Unofficial_Model",
        ref("32524.dat"),
    )
    assert [p.number for p in found] == ["8002 - 6643", "s/sub", "shape.ldr", "3001", "32524"]
    assert [p.embedded is not None for p in found] == [True, True, True, True, False]
    assert found[0].embedded is not None
    assert [r.name for r in found[0].embedded.references] == ["3001.dat"]
    assert "s/sub.dat" in found[0].embedded.scope
    assert found[3].known  # embedded, and known to the caller as well


def test_what_is_nowhere_is_marked_and_kept() -> None:
    found = parts(ref("gone.ldr"), ref("99999.dat"), ref("no ending"), ref("3001"))
    assert [p.number for p in found] == ["gone.ldr", "99999", "no ending", "3001"]
    assert [p.missing for p in found] == [True, False, True, False]
    assert [p.known for p in found] == [False, False, False, True]


# --- poses ------------------------------------------------------------------------------------
def test_nested_poses_multiply() -> None:
    """A quarter turn about Y inside a quarter turn about Z, by hand."""
    found = parts(
        "0 FILE m.ldr",
        ref("a.ldr", at="10 0 0", matrix="0 -1 0 1 0 0 0 0 1"),  # x -> y
        "0 FILE a.ldr",
        ref("3001.dat", at="0 0 5", matrix="0 0 1 0 1 0 -1 0 0"),  # z -> x
    )
    (part,) = found
    np.testing.assert_array_equal(part.position, [10, 0, 5])
    np.testing.assert_array_equal(part.matrix @ [0, 0, 1], [0, 1, 0])
    placed, error = pose(part)
    np.testing.assert_allclose(placed.translation, np.array([10, 0, 5]) * LDU)
    np.testing.assert_allclose(placed.rotation, part.matrix, atol=1e-15)
    assert error < 1e-15
    assert not part.matrix.flags.writeable


numbers = st.floats(-1000, 1000, allow_nan=False).map(lambda v: round(v, 6))


@st.composite
def rotations(draw: st.DrawFn) -> np.ndarray:
    """Rotation or reflection from a random quaternion."""
    q = np.array([draw(st.floats(-1, 1)) for _ in range(4)])
    if np.linalg.norm(q) < 1e-3:
        q = np.array([1.0, 0, 0, 0])
    w, x, y, z = q / np.linalg.norm(q)
    turn = np.array(
        [
            [1 - 2 * (y * y + z * z), 2 * (x * y - z * w), 2 * (x * z + y * w)],
            [2 * (x * y + z * w), 1 - 2 * (x * x + z * z), 2 * (y * z - x * w)],
            [2 * (x * z - y * w), 2 * (y * z + x * w), 1 - 2 * (x * x + y * y)],
        ]
    )
    return turn * (-1 if draw(st.booleans()) else 1)


@given(
    st.lists(st.tuples(rotations(), st.tuples(numbers, numbers, numbers)), min_size=1, max_size=6)
)
def test_a_chain_of_submodels_is_the_product(chain: list[tuple[np.ndarray, tuple]]) -> None:
    lines = []
    matrix, position = np.eye(3), np.zeros(3)
    for k, (turn, at) in enumerate(chain):
        name = "3001.dat" if k == len(chain) - 1 else f"{k + 1}.ldr"
        words = " ".join(repr(float(v)) for v in turn.ravel())
        lines += [f"0 FILE {k}.ldr", f"1 16 {at[0]} {at[1]} {at[2]} {words} {name}"]
        position = matrix @ at + position
        matrix = matrix @ turn
    (part,) = parts(*lines)
    np.testing.assert_allclose(part.matrix, matrix, atol=1e-12)
    np.testing.assert_allclose(part.position, position, atol=1e-9)
    assert part.lines == tuple(2 * k + 2 for k in range(len(chain)))
    placed, error = pose(part)
    assert error < 1e-12
    assert np.linalg.det(placed.rotation) == pytest.approx(np.sign(np.linalg.det(matrix)))


def test_mirrored_parts_stay_mirrored() -> None:
    (part,) = parts(ref("3001.dat", matrix="-1 0 0 0 1 0 0 0 1"))
    placed, error = pose(part)
    assert np.linalg.det(placed.rotation) == pytest.approx(-1)
    assert error == 0
    assert part.flexible is None


def test_askew_matrix_is_straightened_and_said() -> None:
    found = parts(ref("3001.dat"), ref("3001.dat", matrix="1 0.04 0 0 1 0 0 0 1"))
    placed, error = pose(found[1])
    assert 0.01 < error < 0.03
    np.testing.assert_allclose(placed.rotation @ placed.rotation.T, np.eye(3), atol=1e-14)
    (notice,) = found.notices
    assert notice.lines == (2,)
    assert "1 parts have a rotation matrix that is no rotation" in notice.message


def test_poses_of_nothing() -> None:
    assert poses([]) == []


@pytest.mark.parametrize(
    "matrix",
    [
        "0 0 0 0 0 0 0 0 0",
        "1e-310 0 0 0 1e-310 0 0 0 1",
        "1 0 0 0 1 0 0 0 0",
        "1 1 0 1 1 0 0 0 1",
        "1 2 3 4 5 6 7 8 9",
    ],
)
def test_singular_matrix(matrix: str) -> None:
    with pytest.raises(InputError, match="singular") as caught:
        parts("0 FILE m.ldr", ref("3001.dat"), ref("3001.dat", matrix=matrix))
    assert caught.value.line == 3
    assert caught.value.remedy


def test_overflowing_product() -> None:
    lines = []
    for k in range(60):
        huge = "9e6 0 0 0 9e6 0 0 0 9e6"
        name = f"{k + 1}.ldr" if k < 59 else "3001.dat"
        lines += [f"0 FILE {k}.ldr", ref(name, matrix=huge)]
    with pytest.raises(InputError, match="overflow"):
        parts(*lines)


# --- steps and editors' lines -----------------------------------------------------------------
def test_steps_count_within_the_submodel() -> None:
    found = parts(
        "0 FILE m.ldr",
        ref("3001.dat"),
        "0 STEP",
        ref("a.ldr"),
        "0 ROTSTEP 0 90 0 REL",
        ref("3001.dat"),
        "0 FILE a.ldr",
        ref("3001.dat"),
        "0 STEP",
        ref("3001.dat"),
    )
    assert [(p.line, p.step) for p in found] == [(2, 1), (8, 1), (10, 2), (6, 3)]


def test_hidden_and_ghost_parts_are_left_out_and_said() -> None:
    found = parts(
        ref("3001.dat"),
        "0 MLCAD HIDE " + ref("3001.dat"),
        "0 GHOST " + ref("3001.dat"),
        "0 GHOST 0 MLCAD HIDE " + ref("3001.dat"),
        "0 MLCAD HIDE is a comment",
        "0 // " + ref("3001.dat"),
    )
    assert len(found) == 1
    (notice,) = found.notices
    assert notice.lines == (2, 3, 4)
    assert notice.message.startswith("3 parts in 'm.mpd' are hidden")


def test_buffer_exchange_shows_parts_for_a_step_only() -> None:
    found = parts(
        ref("3001.dat", at="1 0 0"),
        "0 BUFEXCHG A STORE",
        ref("3001.dat", at="2 0 0"),
        "0 STEP",
        "0 BUFEXCHG A RETRIEVE",
        ref("3001.dat", at="3 0 0"),
        "0 BUFEXCHG B RETRIEVE",  # never stored: nothing happens
    )
    assert [(p.position[0], p.step) for p in found] == [(1, 1), (3, 2)]
    (notice,) = found.notices
    assert notice.lines == (3,)


def test_drawn_lines_in_a_model_are_said() -> None:
    found = parts(ref("3001.dat"), "4 16 0 0 0 1 0 0 1 1 0 0 1 0", "2 24 0 0 0 1 1 1")
    assert [n.lines for n in found.notices] == [(2, 3)]


# --- flexible things --------------------------------------------------------------------------
def test_stretched_pieces_are_one_thing() -> None:
    found = parts(
        "0 FILE m.ldr",
        ref("3001.dat"),
        ref("band.ldr"),
        ref("band.ldr", at="9 0 0"),
        "0 FILE band.ldr",
        ref("box.dat", matrix="1 0 0 0 2 0 0 0 1"),
        ref("box.dat", matrix="1 0 0 0 0.3 0 0 0 1"),
        ref("box.dat"),  # a link that happens to have its own length
        ref("3001.dat"),  # a real part in the same submodel
    )
    assert [len(pieces) for pieces in found.flexible.values()] == [3, 3]
    assert [p.scaled for p in found] == [False] + [True, True, False, False] * 2
    assert [p.flexible is None for p in found if p.number == "3001"] == [True] * 3


def test_hose_cable_and_constraint_segments() -> None:
    found = parts(
        "0 FILE m.ldr",
        ref("hose.ldr"),
        ref("3711.dat"),
        ref("3711.dat"),
        ref("LS01.dat"),
        ref("LS1.dat"),
        "0 FILE hose.ldr",
        ref("77.dat", matrix="1 0 0 0 1 0 0 0 0"),  # flattened: no body, so no error
        ref("77.dat"),
        ref("343.DAT"),
    )
    assert {label: len(pieces) for label, pieces in found.flexible.items()} == {
        "hose in m.ldr/hose.ldr": 2,
        "cable in m.ldr/hose.ldr": 1,
        "chain in m.ldr": 2,
        "LSynth hose in m.ldr": 1,
    }


@pytest.mark.parametrize("kind", ["path", "spring"])
def test_ldcad_generated_section(kind: str) -> None:
    found = parts(
        "0 FILE m.ldr",
        ref("p.ldr"),
        ref("q.ldr"),
        "0 FILE p.ldr",
        f"0 !LDCAD CONTENT [type={kind}] [version=2]",
        ref("3001.dat"),
        ref("inner.ldr"),
        "0 FILE inner.ldr",
        ref("32524.dat"),
        "0 FILE q.ldr",
        "0 !LDCAD CONTENT [type=standard]",
        ref("3001.dat"),
    )
    assert [p.flexible for p in found] == [f"LDCad {kind} in m.ldr/p.ldr"] * 2 + [None]


def test_lsynth_block() -> None:
    found = parts(
        ref("3001.dat"),
        "0 SYNTH BEGIN RUBBER_BAND 0",
        ref("3001.dat"),  # the wheel that the band runs over: a real part
        ref("LS05.dat"),
        "0 SYNTH SYNTHESIZED BEGIN",
        ref("3001.dat"),
        ref("u1234.dat"),
        "0 SYNTH SYNTHESIZED END",
        "0 SYNTH END",
        ref("u1234.dat"),
    )
    label = "LSynth rubber_band (line 2) in m.mpd"
    assert [p.flexible for p in found] == [None, None, label, label, label, None]


def test_mlcad_generated_block() -> None:
    found = parts(
        "0 MLCAD FLEXHOSE 1 2 3",
        "0 MLCAD SKIP_BEGIN",
        ref("3001.dat"),
        "0 MLCAD SKIP_END",
        ref("3001.dat"),
    )
    assert [p.flexible for p in found] == ["MLCad flexhose (line 2) in m.mpd", None]


# --- what must be refused ---------------------------------------------------------------------
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


# --- files beside the model -------------------------------------------------------------------
def folder(root: Path, files: dict[str, list[str]]) -> Path:
    for name, lines in files.items():
        path = root / name
        path.parent.mkdir(parents=True, exist_ok=True)
        path.write_text("\n".join(lines) + "\n")
    return root


def expand(path: Path) -> Placements:
    return placements(read(path), KNOWN.__contains__)


def test_files_beside_the_model(tmp_path: Path) -> None:
    folder(
        tmp_path,
        {
            "main.ldr": [ref("ARM.ldr", at="5 0 0"), ref("sub\\leg.mpd"), ref("own.dat")],
            "Arm.LDR": [ref("3001.dat")],
            "Sub/leg.mpd": [
                "0 FILE first.ldr",
                ref("foot.ldr"),
                "0 FILE foot.ldr",
                ref("32524.dat"),
            ],
            "own.dat": ["3 16 0 0 0 1 0 0 0 1 0"],
            "3001.dat": ["0 not looked at: the part is known"],
        },
    )
    found = expand(tmp_path / "main.ldr")
    assert [p.id for p in found] == [
        "main.ldr/ARM.ldr/1:3001",
        "main.ldr/sub\\leg.mpd/foot.ldr/4:32524",
        "main.ldr/3:own",
    ]
    assert found[0].section.path.name == "Arm.LDR"
    assert [p.embedded is None for p in found] == [True, True, False]


def test_files_that_include_each_other(tmp_path: Path) -> None:
    folder(tmp_path, {"a.ldr": [ref("b.ldr")], "b.ldr": [ref("3001.dat"), ref("a.ldr")]})
    with pytest.raises(InputError, match="includes itself") as caught:
        expand(tmp_path / "a.ldr")
    assert caught.value.path == str(tmp_path / "b.ldr")
    assert caught.value.line == 2


def test_nothing_outside_of_the_folder_is_opened(tmp_path: Path) -> None:
    secret = folder(tmp_path / "out", {"secret.ldr": [ref("3001.dat")]}) / "secret.ldr"
    inside = tmp_path / "in"
    names = [str(secret), "..\\out\\secret.ldr", "../out/secret.ldr", "./../out/secret.ldr"]
    names += ["x/../../out/secret.ldr", "link.ldr", "linked/secret.ldr", "C:\\secret.ldr"]
    folder(inside, {"m.ldr": [ref(name) for name in names], "x/y": []})
    (inside / "link.ldr").symlink_to(secret)
    (inside / "linked").symlink_to(secret.parent)
    found = expand(inside / "m.ldr")
    assert [p.missing for p in found] == [True] * len(names)


def test_a_broken_file_beside_the_model_is_named(tmp_path: Path) -> None:
    folder(tmp_path, {"m.ldr": [ref("3001.dat"), ref("arm.ldr")], "arm.ldr": ["1 2 3"]})
    with pytest.raises(InputError, match="cut off") as caught:
        expand(tmp_path / "m.ldr")
    assert caught.value.path == str(tmp_path / "arm.ldr")
    assert caught.value.line == 1


# --- Studio archives --------------------------------------------------------------------------
def test_studio_archive(tmp_path: Path) -> None:
    path = tmp_path / "m.io"
    with zipfile.ZipFile(path, "w", zipfile.ZIP_DEFLATED) as archive:
        archive.writestr("thumbnail.png", b"\x89PNG")
        archive.writestr("model.ldr", "0 FILE m.ldr\r\n" + ref("3001.dat") + "\r\n0 NOFILE\r\n")
    (part,) = expand(path)
    assert part.id == "m.ldr/2:3001"
    path.rename(tmp_path / "m.ldr")  # the contents say what it is, not the name
    assert len(expand(tmp_path / "m.ldr")) == 1


def encrypt(raw: bytes) -> bytes:
    """Set the encryption flag in the local and the central header."""
    out = bytearray(raw)
    out[raw.index(b"PK\x03\x04") + 6] |= 1
    out[raw.index(b"PK\x01\x02") + 8] |= 1
    return bytes(out)


@pytest.mark.parametrize(
    ("change", "says"),
    [
        (encrypt, "encrypted"),
        (lambda raw: raw[: len(raw) // 2], "not a readable Studio archive"),
        (lambda raw: raw.replace(b"model.ldr", b"other.ldr"), "no model.ldr"),
        (lambda _: b"PK\x03\x04", "not a readable Studio archive"),
        (lambda _: b"0 text\n", "not a readable Studio archive"),
    ],
)
def test_bad_archives(tmp_path: Path, change: Callable[[bytes], bytes], says: str) -> None:
    path = tmp_path / "m.io"
    with zipfile.ZipFile(path, "w") as archive:
        archive.writestr("model.ldr", ref("3001.dat"))
    path.write_bytes(change(path.read_bytes()))
    with pytest.raises(InputError, match=says) as caught:
        read(path)
    assert "Studio" in str(caught.value.remedy)


# --- real models ------------------------------------------------------------------------------
COUNTS = {
    "hinged_L.ldr": 3,
    "triangle.ldr": 6,
    "square.ldr": 8,
    "trapezoid.ldr": 11,
    "cube7.ldr": 36,
    "cube9_simple.ldr": 36,
    "omr_42020_twin_rotor.mpd": 143,
    "omr_42004_mini_backhoe.mpd": 246,
    "fll_robot.mpd": 197,
    "omr_31066_rover.mpd": 174,
    "omr_8002_destroyer_droid.mpd": 1074,
    "omr_10212_imperial_shuttle.mpd": 2526,
}
"""Parts after expansion, from the README of the shared models."""


@pytest.mark.parametrize("name", COUNTS)
def test_real_models(model: Callable[[str], Path], ldraw_library: Path, name: str) -> None:
    with zipfile.ZipFile(ldraw_library) as archive:
        names = {n.lower() for n in archive.namelist()}
    found = placements(read(model(name)), lambda number: f"ldraw/parts/{number}.dat" in names)
    # The README counts parts; bands drawn from bare primitives (8002) are none.
    real = [p for p in found if f"ldraw/p/{p.number}.dat" not in names]
    assert len(real) == COUNTS[name]
    assert len({p.id for p in found}) == len(found)
    assert not any(p.missing for p in found)
    assert {p.number for p in found} - {p.number for p in real} <= {"box4o8a", "4-4cyli"}
    assert all(p.flexible for p in found if p.number in ("box4o8a", "4-4cyli"))
    assert all(p.orthogonality_error < 0.1 for p in found if not p.flexible)


def test_the_droids_hoses_are_a_few_things(model: Callable[[str], Path]) -> None:
    found = placements(read(model("omr_8002_destroyer_droid.mpd")), lambda _: False)
    labels = found.flexible
    assert len(labels) == 22
    hoses = [n for label, n in labels.items() if label.startswith(("hose", "cable"))]
    assert sum(len(n) for n in hoses) == 537


@pytest.mark.speed
def test_reading_2500_parts_takes_less_than_half_a_second(model: Callable[[str], Path]) -> None:
    """Processor time, so that other work on the machine does not count."""
    path = model("omr_10212_imperial_shuttle.mpd")
    times = []
    for _ in range(5):
        start = time.process_time()
        found = placements(read(path), lambda number: not number.endswith(".ldr"))
        assert len(poses(found.parts)) == 2526
        times.append(time.process_time() - start)
    assert min(times) < 0.5
