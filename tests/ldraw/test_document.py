"""Documents: sections, nested poses, steps, editors' lines, flexible things."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from technic.errors import InputError
from technic.ldraw.document import pose, poses
from technic.units import LDU
from tests.ldraw.documents import parts, ref


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
