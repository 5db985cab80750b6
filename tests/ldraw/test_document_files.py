"""Files beside the model, Studio archives, and real models."""

from __future__ import annotations

import zipfile
from collections.abc import Callable
from pathlib import Path

import pytest

from technic.errors import InputError
from technic.ldraw.document import Placements, placements, read
from tests.ldraw.documents import KNOWN, ref


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
    assert len(labels) == 25
    # segments, and three hoses and two ribbed ones that are one piece each
    hoses = [n for label, n in labels.items() if label.startswith(("hose", "cable", "ribbed"))]
    assert sum(len(n) for n in hoses) == 537 + 5
