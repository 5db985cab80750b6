"""What every file of the repository keeps to."""

from __future__ import annotations

import ast
import re
import subprocess
import tomllib
from collections.abc import Iterator
from pathlib import Path

import pytest

from tests.conftest import REPO

LONGEST = 420
"""Lines of a module that one can still read at one sitting."""

# Folders at the root of a file system that exist on one machine only; `/usr` and `/etc` are on all.
PRIVATE_ROOTS = ("work", "farm", "root", "home", "tmp", "Users", "mnt")

HOSTS = {
    "aka.ms": "none of ours, bundled libraries' comments",
    "citation-file-format.github.io": "CITATION.cff",
    "creativecommons.org": "licences",
    "doi.org": "papers",
    "json-schema.org": "dialect of our JSON schemas",
    "keepachangelog.com": "format of CHANGELOG.md",
    "ldraw.org": "where the LDraw library comes from",
    "www.ldraw.org": "the same",
    "library.ldraw.org": "the same",
    "omr.ldraw.org": "model repository",
    "opensource.org": "licences",
    "semver.org": "version numbers",
    "www.w3.org": "names of XML and SVG",
    "example.org": "made-up addresses in tests",
    "localhost": "the machine itself",
    "127.0.0.1": "the machine itself",
}
"""Hosts that files may name, and why. Package registries are configured by the user, not by us."""


def tracked() -> list[Path]:
    """Return the files that git knows, except those bundled from others."""
    run = subprocess.run(
        ["git", "ls-files", "-z"], cwd=REPO, check=False, capture_output=True, text=True
    )
    if run.returncode != 0:
        pytest.skip("not a git clone")
    paths = [REPO / name for name in run.stdout.split("\0") if name]
    return [p for p in paths if p.is_file() and not p.name.endswith((".js", ".html"))]


def lines(paths: list[Path]) -> Iterator[tuple[str, str]]:
    """Yield place (file:line) and text of every line of the text files."""
    for path in paths:
        try:
            text = path.read_text(encoding="utf-8")
        except UnicodeDecodeError:
            continue
        for number, line in enumerate(text.splitlines(), 1):
            yield f"{path.relative_to(REPO)}:{number}", line


def test_modules_can_be_read_at_one_sitting() -> None:
    sizes = {
        str(p.relative_to(REPO)): len(p.read_text(encoding="utf-8").splitlines())
        for p in tracked()
        if p.suffix in (".py", ".sh") or p.parent.name in ("scripts", ".ci")
    }
    assert sizes, "no module found"
    assert {name: size for name, size in sizes.items() if size > LONGEST} == {}


def test_no_absolute_path_of_one_machine() -> None:
    private = re.compile(rf"(?:^|[\s\"'`(=])/(?:{'|'.join(PRIVATE_ROOTS)})/")
    assert [place for place, line in lines(tracked()) if private.search(line)] == []


def test_files_name_only_known_hosts() -> None:
    address = re.compile(r"\bhttps?://(?:[^/\s@]*@)?([A-Za-z0-9.-]+)")
    unknown = [
        (place, host)
        for place, line in lines(tracked())
        for host in address.findall(line)
        if host.lower() not in HOSTS
    ]
    assert unknown == []


def test_no_setting_that_names_a_registry() -> None:
    setting = re.compile(
        r"--(?:extra-)?index-url|\b(?:PIP|UV)_\w*INDEX|--registry|\[\[tool\.uv\.index"
    )
    here = f"tests/packaging/{Path(__file__).name}:"
    found = [place for place, line in lines(tracked()) if setting.search(line)]
    assert [place for place in found if not place.startswith(here)] == []


def test_every_lint_exception_has_its_reason() -> None:
    text = (REPO / "pyproject.toml").read_text(encoding="utf-8")
    lint = text[text.index("[tool.ruff.lint]\nselect") : text.index("[tool.ruff.lint.pycodestyle]")]
    ignores = lint[lint.index("ignore = [") :]
    rules = [line for line in ignores.splitlines() if re.match(r'\s+"[A-Z]+\d+"', line)]
    bare = [line for line in rules if "#" not in line]
    assert rules
    assert bare == []


def test_modules_say_what_they_offer() -> None:
    """Every module of the packages has a docstring, and an ``__all__`` unless it has no public name."""
    silent, closed = [], []
    for path in tracked():
        if path.suffix != ".py" or path.relative_to(REPO).parts[0] not in (
            "technic",
            "parts_library",
            "calibration",
        ):
            continue
        tree = ast.parse(path.read_text(encoding="utf-8"))
        if ast.get_docstring(tree) is None:
            silent.append(path)
        public = [
            node.name
            for node in tree.body
            if isinstance(node, ast.FunctionDef | ast.ClassDef) and not node.name.startswith("_")
        ]
        exported = any(
            isinstance(target, ast.Name) and target.id == "__all__"
            for node in tree.body
            if isinstance(node, ast.Assign | ast.AnnAssign)
            for target in (node.targets if isinstance(node, ast.Assign) else [node.target])
        )
        if public and not exported:
            closed.append(path)
    assert silent == []
    assert closed == []


def test_version_is_the_same_everywhere() -> None:
    import technic

    citation = (REPO / "CITATION.cff").read_text(encoding="utf-8")
    changelog = (REPO / "CHANGELOG.md").read_text(encoding="utf-8")
    assert re.search(rf"^version: {re.escape(technic.__version__)}$", citation, re.MULTILINE)
    assert re.search(
        rf"^## \[(?:{re.escape(technic.__version__)}|Unreleased)\]", changelog, re.MULTILINE
    )


def test_supported_python_is_the_same_everywhere() -> None:
    project = tomllib.loads((REPO / "pyproject.toml").read_text(encoding="utf-8"))["project"]
    named = [c.rsplit(" ", 1)[1] for c in project["classifiers"] if "Python :: 3." in c]
    assert named == ["3.11", "3.12", "3.13", "3.14"]
    assert project["requires-python"] == ">=3.11,<3.15"
    setup = (REPO / "scripts" / "_setup.sh").read_text(encoding="utf-8")
    assert "(3, 11) <= sys.version_info[:2] <= (3, 14)" in setup
