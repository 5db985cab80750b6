"""Writing: what was there stays letter for letter, what is new comes in a new step."""

from __future__ import annotations

import pytest

from technic.design.apply import change_of, extend, reinforced_text, write_reinforced
from technic.design.candidates import candidates
from technic.errors import UsageError
from technic.ldraw.reader import load_ldraw
from technic.units import LDU
from tests.design.made import SQUARE, text_of


@pytest.fixture(params=["\r\n", "\n"])
def square(request, tmp_path):
    """A file with the square, odd spacing included."""
    path = tmp_path / "square.ldr"
    text = "0 Square" + request.param + text_of(*SQUARE, end=request.param).replace(" 7 ", "  7\t")
    path.write_bytes(text.encode())
    return path


def chosen(assembly, kind):
    """The first candidate with a fastening of a kind in each of its holes."""
    return next(
        c for c in candidates(assembly) if {a.fastening.kind for a in c.attachments} == {kind}
    )


def test_new_parts_follow_in_a_step_of_their_own(square):
    assembly = load_ldraw(square)
    change = change_of(assembly, chosen(assembly, "pin"))
    old = square.read_bytes().decode()
    new = reinforced_text(square, assembly, [change]).text
    assert new.startswith(old)
    lines = new[len(old) :].splitlines()
    assert lines[0] == "0 STEP"
    assert len(lines) == 1 + len(change.added)
    assert all(line.startswith("1 25 ") for line in lines[1:])


def test_the_line_of_an_exchanged_pin_becomes_a_comment(square):
    assembly = load_ldraw(square)
    change = change_of(assembly, chosen(assembly, "exchange"))
    old = square.read_bytes().decode().splitlines()
    new = reinforced_text(square, assembly, [change]).text.splitlines()
    changed = [(a, b) for a, b in zip(old, new, strict=False) if a != b]
    assert len(changed) == len(change.removed) > 0
    for before, after in changed:
        assert "2780" in before
        assert after.startswith("0 // ")
        assert after.endswith(before)


def test_the_extended_assembly_is_what_the_file_gives(square, tmp_path):
    assembly = load_ldraw(square)
    for candidate in candidates(assembly)[::40]:
        change = change_of(assembly, candidate)
        target = tmp_path / "new.ldr"
        write_reinforced(square, target, assembly, [change])
        again, made = load_ldraw(target), extend(assembly, [change])
        assert [p.number for p in again.parts] == [p.number for p in made.parts]
        for a, b in zip(again.parts, made.parts, strict=True):
            assert abs(a.pose.translation - b.pose.translation).max() < 1e-9 * LDU
            assert abs(a.pose.rotation - b.pose.rotation).max() < 1e-12
        assert [j.parts for j in again.joints] == [j.parts for j in made.joints]
        assert [j.type for j in again.joints] == [j.type for j in made.joints]


def test_the_model_itself_is_never_overwritten(square):
    assembly = load_ldraw(square)
    change = change_of(assembly, chosen(assembly, "pin"))
    before = square.read_bytes()
    with pytest.raises(UsageError, match="must not replace"):
        write_reinforced(square, square, assembly, [change])
    assert square.read_bytes() == before


def test_joints_inside_a_part_stay(square, tmp_path):
    """A universal joint is read as two pieces: they stay joined in the extended model."""
    path = tmp_path / "universal.ldr"
    path.write_bytes(square.read_bytes() + b"1 7 300 0 0 1 0 0 0 1 0 0 0 1 61903.dat\r\n")
    assembly = load_ldraw(path)
    inside = [j for j in assembly.joints if j.connection.startswith("inside/")]
    assert inside
    change = change_of(assembly, chosen(assembly, "exchange"))
    target = tmp_path / "new.ldr"
    write_reinforced(path, target, assembly, [change])
    again, made = load_ldraw(target), extend(assembly, [change])
    assert sorted(j.parts for j in again.joints) == sorted(j.parts for j in made.joints)
    assert sum(j.connection.startswith("inside/") for j in made.joints) == len(inside)
