"""Flexible things end as one item of the report each, whatever they are drawn with; tyres as one in all."""

from __future__ import annotations

import pytest

from technic.assembly.model import FindingKind
from technic.ldraw.flexible import segment_kind
from technic.ldraw.reader import load_ldraw
from technic.rigidity.analyze import analyze

BEAM = "1 4 0 0 0 1 0 0 0 1 0 0 0 1 32316.dat\n"
AT = "1 0 {x} 0 0 1 0 0 0 1 0 0 0 1 {number}.dat\n"


def items(tmp_path, text: str) -> tuple[list[str], int]:
    path = tmp_path / "m.mpd"
    path.write_text("0 FILE m.ldr\n0 M\n" + BEAM + text)
    assembly = load_ldraw(path)
    assert not assembly.unknown
    found = [f.message for f in assembly.findings if f.kind is FindingKind.FLEXIBLE]
    assert all("not modelled" in message for message in found)
    report = analyze(assembly, parts="rigid")
    said = [sentence for sentence in report.not_modelled if "flexible item" in sentence]
    assert bool(said) == bool(found)
    return found, len(assembly.parts)


@pytest.mark.parametrize(
    ("numbers", "kind"),
    [
        (["77"] * 5, "hose"),
        (["76250"], "hose"),
        (["72706"], "ribbed hose"),
        (["79", "80", "80"], "ribbed hose"),
        (["3711"] * 9, "chain"),
        (["57518"] * 4, "tread"),
        (["71372-f1"], "tread"),
        (["342", "343", "343"], "cable"),
    ],
)
def test_pieces_of_a_thing_are_one_item(tmp_path, numbers, kind):
    text = "".join(AT.format(x=20 * k, number=number) for k, number in enumerate(numbers))
    (message,), parts = items(tmp_path, text)
    assert message.startswith(kind)
    assert parts == 1


@pytest.mark.parametrize("kind", ["path", "spring"])
def test_what_ldcad_made_is_one_item(tmp_path, kind):
    text = AT.format(x=0, number="bow").replace(".dat", ".ldr")
    text += f"0 FILE bow.ldr\n0 Bow\n0 !LDCAD CONTENT [type={kind}]\n"
    text += "".join(AT.format(x=4 * k, number="u9053") for k in range(6))
    (message,), parts = items(tmp_path, text)
    assert f"LDCad {kind}" in message
    assert "6 pieces" in message
    assert parts == 1


def test_a_rubber_band_of_lsynth_is_one_item(tmp_path):
    text = "0 SYNTH BEGIN RUBBER_BAND 0\n0 SYNTH SYNTHESIZED BEGIN\n"
    text += "".join(AT.format(x=4 * k, number="sband") for k in range(30))
    text += "0 SYNTH SYNTHESIZED END\n0 SYNTH END\n"
    (message,), parts = items(tmp_path, text)
    assert "LSynth rubber_band" in message
    assert parts == 1


def test_tyres_are_bodies_and_one_item(tmp_path):
    rim, tyre = "56145", "50951"
    assert segment_kind(tyre) is None
    text = "".join(AT.format(x=100 * k, number=n) for k in range(4) for n in (rim, tyre))
    (message,), parts = items(tmp_path, text)
    assert message.startswith("4 tyres: taken as rigid")
    assert parts == 9


def test_what_only_a_hose_holds_is_said(tmp_path):
    """A half pin with a stud, on which the hose sits; one with nothing around."""
    pin = "1 0 {x} 0 0 1 0 0 0 1 0 0 0 1 4274.dat\n"
    hose = "1 0 {x} 0 0 1 0 0 0 1 0 0 0 1 77.dat\n"
    path = tmp_path / "m.ldr"
    path.write_text("0 M\n" + BEAM + pin.format(x=300) + hose.format(x=305) + pin.format(x=900))
    assembly = load_ldraw(path)
    held = {
        assembly.parts[f.parts[0]].id: "a hose holds it" in f.message
        for f in assembly.findings
        if f.kind is FindingKind.LOOSE
    }
    assert held["m.ldr/3:4274"]
    assert not held["m.ldr/5:4274"]
    ends = {
        assembly.parts[f.parts[0]].id: f.message
        for f in assembly.findings
        if f.kind is FindingKind.OPEN_PORT
    }
    assert ends["m.ldr/3:4274"].endswith("nothing there but a hose, which is not modelled")
    assert ends["m.ldr/5:4274"].endswith("nothing there")
