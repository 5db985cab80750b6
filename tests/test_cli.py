"""The program from the command line: what it prints where, and its exit codes."""

from __future__ import annotations

import json
import os
import stat
import subprocess
import sys

import pytest

import technic
from technic.report import render

BEAM = "1 4 0 {y} 0 1 0 0 0 1 0 0 0 1 32316.dat"
PIN = "1 0 0 -10 {z} 0 1 0 1 0 0 0 0 1 2780.dat"


@pytest.fixture
def pair(tmp_path):
    """Two beams on two pins: rigid."""
    path = tmp_path / "pair.ldr"
    lines = [BEAM.format(y=0), BEAM.format(y=-20), PIN.format(z=40), PIN.format(z=-40)]
    path.write_text("\n".join(["0 Pair", *lines, ""]))
    return path


@pytest.fixture
def scissors(tmp_path):
    """Two beams on one pin: flexible."""
    path = tmp_path / "scissors.ldr"
    lines = [BEAM.format(y=0), BEAM.format(y=-20), PIN.format(z=40)]
    path.write_text("\n".join(["0 Scissors", *lines, ""]))
    return path


# --- what is said -----------------------------------------------------------------------------


def test_analyze_prints_text_to_stdout_and_nothing_to_stderr(run, pair):
    code, out, err = run("analyze", pair)
    assert code == 0
    assert "RIGID" in out
    assert "N/m" in out
    assert err == ""


def test_json_to_stdout_is_one_object_and_nothing_else(run, scissors):
    code, out, err = run("analyze", scissors, "--json", "-")
    content = json.loads(out)
    assert code == 0
    assert content["schema"] == "technic-report/1"
    assert content["verdict"] == "flexible"
    assert content["mobility"]["structural"] == 1
    assert content["source"]["path"] == str(scissors)
    assert err == ""


def test_json_to_a_file_beside_the_text(run, pair, tmp_path):
    code, out, _ = run("analyze", pair, "--json", tmp_path / "r.json")
    assert code == 0
    assert "RIGID" in out
    content = json.loads((tmp_path / "r.json").read_text())
    assert content["verdict"] == "rigid"
    if os.name == "posix":
        mask = os.umask(0)
        os.umask(mask)
        assert stat.S_IMODE((tmp_path / "r.json").stat().st_mode) == 0o666 & ~mask


def test_quiet_prints_nothing(run, pair):
    assert run("analyze", pair, "--quiet") == (0, "", "")


def test_number_of_modes(run, pair):
    _, out, _ = run("analyze", pair, "--json", "-", "--modes", "3")
    assert len(json.loads(out)["spectrum_n_per_m"]) == 3


def test_measure_of_the_paper(run, pair):
    _, out, _ = run("analyze", pair, "--json", "-", "--measure", "nodal")
    assert json.loads(out)["rigidity"]["measure"] == "nodal"
    _, out, _ = run("analyze", pair, "--measure", "nodal")
    assert "The paper's measure" in out


def test_rigid_parts_have_six_unknowns_each(run, pair):
    dof = {}
    for kind in ("frame", "rigid"):
        _, out, _ = run("analyze", pair, "--json", "-", "--parts", kind)
        dof[kind] = json.loads(out)["model"]["dof"]
    assert dof["rigid"] == 4 * 6
    assert dof["frame"] > dof["rigid"]


def test_fixing_a_part_is_reported_and_stiffens(run, pair):
    _, free, _ = run("analyze", pair, "--json", "-")
    code, out, _ = run("analyze", pair, "--json", "-", "--fix", "2:32316")
    content = json.loads(out)
    assert code == 0
    assert [s["part"] for s in content["supports"]] == ["pair.ldr/2:32316"]
    assert content["verdict"] == "rigid"
    assert content["spectrum_n_per_m"] != json.loads(free)["spectrum_n_per_m"]


def test_fixing_both_scissors_makes_them_rigid(run, scissors):
    code, out, _ = run(
        "analyze",
        scissors,
        "--fix",
        "2:32316",
        "--fix",
        "3:32316",
        "--json",
        "-",
        "--require-rigid",
    )
    assert code == 0
    assert json.loads(out)["mobility"]["structural"] == 0


# --- exit codes -------------------------------------------------------------------------------


def test_require_rigid(run, pair, scissors):
    assert run("analyze", pair, "--require-rigid")[0] == 0
    code, out, err = run("analyze", scissors, "--require-rigid")
    assert code == 1
    assert "FLEXIBLE" in out
    assert "--require-rigid" in err


def test_min_rigidity(run, pair):
    value = json.loads(run("analyze", pair, "--json", "-")[1])["rigidity"]["value_n_per_m"]
    assert run("analyze", pair, "-q", "--min-rigidity", value * 0.999)[0] == 0
    code, _, err = run("analyze", pair, "-q", "--min-rigidity", value * 1.001)
    assert code == 1
    assert "--min-rigidity" in err


@pytest.mark.parametrize(
    "arguments",
    [
        ("analyze",),
        ("analyze", "{pair}", "--no-such-option"),
        ("analyze", "{pair}", "--modes", "0"),
        ("analyze", "{pair}", "--measure", "furlongs"),
        ("analyze", "{pair}", "--fix", "99999"),
        ("analyze", "{pair}", "--fix", "32316"),
        ("analyze", "{pair}", "--fix", "2:32316:hole99"),
        ("analyze", "{pair}", "--json", "/no/such/directory/r.json"),
        ("analyze", "{pair}", "--picture", "/no/such/directory/p.png"),
        ("no-such-command",),
        ("parts", "show", "no-such-part"),
        ("parts", "list", "--family", "no-such-family"),
    ],
)
def test_usage_errors_exit_with_2_and_a_message(run, pair, arguments):
    code, out, err = run(*(a.format(pair=pair) for a in arguments))
    assert code == 2
    assert out == ""
    assert err.strip()
    assert "Traceback" not in err


@pytest.mark.parametrize(
    ("name", "content"),
    [
        ("missing.ldr", None),
        ("empty.ldr", b""),
        ("binary.ldr", bytes(range(256)) * 8),
        ("short.ldr", b"1 4 0 0 0 1 0 0 0 1 0 0 0 1\n"),
        ("word.ldr", b"1 4 0 zero 0 1 0 0 0 1 0 0 0 1 32316.dat\n"),
        ("nan.ldr", b"1 4 0 nan 0 1 0 0 0 1 0 0 0 1 32316.dat\n"),
        ("singular.ldr", b"1 4 0 0 0 1 0 0 0 1 0 0 0 0 32316.dat\n"),
        ("unknown.ldr", b"1 4 0 0 0 1 0 0 0 1 0 0 0 1 no-such-part.dat\n"),
        ("model.xyz", b"0\n"),
    ],
)
def test_bad_input_exits_with_3_names_the_file_and_leaves_no_output(run, tmp_path, name, content):
    path = tmp_path / name
    if content is not None:
        path.write_bytes(content)
    before = sorted(tmp_path.iterdir())
    code, out, err = run("analyze", path, "--json", tmp_path / "r.json")
    assert code == 3
    assert out == ""
    assert name in err
    assert "Traceback" not in err
    assert sorted(tmp_path.iterdir()) == before


def test_directory_as_model_exits_with_3(run, tmp_path):
    code, _, err = run("analyze", tmp_path)
    assert code == 3
    assert "directory" in err


def test_no_way_to_draw_exits_with_4_after_the_analysis(run, pair, tmp_path, monkeypatch):
    def crash(*_how):
        return subprocess.Popen(
            [sys.executable, "-c", "import os; os.abort()"],
            stdin=subprocess.PIPE,
            stdout=subprocess.PIPE,
            stderr=subprocess.PIPE,
        )

    monkeypatch.setattr(render, "_start", crash)
    code, out, err = run("analyze", pair, "--picture", tmp_path / "p.png")
    assert code == 4
    assert "RIGID" in out
    assert "apt install libegl1" in err
    assert not (tmp_path / "p.png").exists()


# --- the other commands -----------------------------------------------------------------------


def test_version_and_help(run):
    assert run("--version") == (0, f"technic {technic.__version__}\n", "")
    code, out, _ = run("--help")
    assert code == 0
    assert "analyze" in out
    assert "parts" in out


def test_parts_list_and_show(run):
    code, out, _ = run("parts", "list", "--family", "beam-thick")
    assert code == 0
    assert "32316" in out
    assert "2780" not in out
    code, out, _ = run("parts", "show", "32316")
    assert code == 0
    assert "Beam 5" in out
    assert out.count("pin_hole") == 5


def test_parts_as_json(run):
    _, out, _ = run("parts", "list", "--json", "-")
    rows = json.loads(out)["parts"]
    assert {"32316", "2780"} <= {row["id"] for row in rows}
    _, out, _ = run("parts", "show", "32316.dat", "--json", "-")
    content = json.loads(out)
    assert [port["length_mm"] for port in content["ports"]] == pytest.approx([8.0] * 5)


def test_wrong_part_number_suggests_similar_ones(run):
    _, _, err = run("parts", "show", "3231")
    assert "32316" in err


# --- start-up ---------------------------------------------------------------------------------


def loaded_modules(code):
    command = f"{code}\nimport sys; print('\\n'.join(sys.modules), file=sys.stderr)"
    done = subprocess.run(
        [sys.executable, "-c", command], capture_output=True, text=True, check=True
    )
    return {name.split(".")[0] for name in done.stderr.split()}


HEAVY = {"numpy", "scipy", "rich", "pyvista", "vtkmodules", "trimesh", "manifold3d", "matplotlib"}


def test_help_loads_no_heavy_library():
    code = (
        "import sys; sys.argv = ['technic', '--help']\n"
        "from technic.cli import main\n"
        "try: main()\nexcept SystemExit: pass"
    )
    assert not loaded_modules(code) & HEAVY


def test_analysis_loads_no_drawing_library(pair):
    code = (
        f"import sys; sys.argv = ['technic', 'analyze', {str(pair)!r}, '-q']\n"
        "from technic.cli import main\n"
        "try: main()\nexcept SystemExit: pass"
    )
    found = loaded_modules(code) & HEAVY
    assert found <= {"numpy", "scipy"}


def test_public_names_are_there():
    for name in technic.__all__:
        assert getattr(technic, name) is not None
    with pytest.raises(AttributeError):
        _ = technic.no_such_name


def test_demo_is_rigid_but_soft_in_twist_and_says_where_the_picture_is(run, tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    code, out, err = run("demo")
    assert code == 0
    assert "153 parts" in out
    assert "\nRIGID\n" in out
    assert "twists about" in out
    assert err == "picture: technic-demo.png\n"
    assert (tmp_path / "technic-demo.png").read_bytes().startswith(b"\x89PNG")


def test_demo_without_picture(run, tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    code, out, _ = run("demo", "--no-picture", "--json", "-", "--require-rigid")
    assert code == 0
    assert json.loads(out)["model"]["parts"] == 153
    assert not list(tmp_path.iterdir())


# --- parts library ----------------------------------------------------------------------------


def test_parts_of_a_library_are_used_and_said(run, tmp_path, monkeypatch):
    from tests.ldraw.small_library import files_with, line, part, write_folder

    monkeypatch.delenv("LDRAWDIR", raising=False)
    monkeypatch.delenv("TECHNIC_SHADOW", raising=False)
    monkeypatch.setenv("TECHNIC_DATA", str(tmp_path / "data"))
    monkeypatch.setenv("HOME", str(tmp_path))
    files = files_with({"parts/xbeam.dat": part(line("connhole.dat"), title="Odd Beam")})
    library = write_folder(tmp_path / "library", files)
    model = tmp_path / "odd.ldr"
    odd = "1 4 0 -20 40 1 0 0 0 1 0 0 0 1 xbeam.dat"
    model.write_text("\n".join([BEAM.format(y=0), PIN.format(z=40), odd, ""]))

    code, out, _ = run("analyze", model)
    assert code == 0
    assert "1 x xbeam: no definition" in out
    assert "technic parts fetch" in " ".join(out.split())

    code, out, _ = run("analyze", model, "--library", library)
    assert code == 0
    assert f"library: {library} (release 2026-02)" in " ".join(out.split())
    assert "2 known, 1 from the parts library, 0 unknown" in out

    monkeypatch.setenv("LDRAWDIR", str(library))
    code, out, _ = run("analyze", model, "--json", "-")
    content = json.loads(out)["model"]
    assert content["unknown_parts"] == []
    assert content["import"]["from_library"] == 1
    assert content["import"]["library_parts"][0]["id"] == "xbeam"

    _, out, _ = run("analyze", model, "--no-library", "--json", "-")
    content = json.loads(out)["model"]
    assert content["import"]["library"] is None
    assert content["import"]["unknown"] == 1
    assert any("leave --no-library out" in sentence for sentence in content["import"]["effect"])


def test_contradicting_and_missing_libraries(run, pair, tmp_path, monkeypatch):
    monkeypatch.delenv("LDRAWDIR", raising=False)
    monkeypatch.setenv("TECHNIC_DATA", str(tmp_path / "data"))
    monkeypatch.setenv("HOME", str(tmp_path))
    assert run("analyze", pair, "--no-library", "--library", tmp_path)[0] == 2
    assert run("analyze", pair, "--shadow", tmp_path)[0] == 2
    assert run("analyze", pair, "--library", tmp_path / "missing")[0] == 4
    assert run("analyze", pair, "--library", pair)[0] == 3
