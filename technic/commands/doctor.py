"""`technic doctor`: what this installation can do, and what to install for the rest."""

from __future__ import annotations

import platform
import sys
from importlib.metadata import PackageNotFoundError, version
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import Annotated, Any

import typer

from technic.commands.options import JsonOption, LibraryOption, ShadowOption
from technic.errors import TechnicError

__all__ = ["doctor"]

_PACKAGES = ("numpy", "scipy", "trimesh", "manifold3d", "python-fcl", "pyvista", "vtk", "typer")


def _versions() -> dict[str, str | None]:
    found: dict[str, str | None] = {}
    for package in _PACKAGES:
        try:
            found[package] = version(package)
        except PackageNotFoundError:
            found[package] = None
    return found


def _library(explicit: Path | None) -> dict[str, Any]:
    from technic.ldraw.library import candidate_folders, find_library

    try:
        library = find_library(explicit)
    except TechnicError as error:
        return {"found": False, "problem": str(error), "remedy": "Correct LDRAWDIR or --library."}
    if library is None:
        looked = [str(place) for place in candidate_folders()]
        remedy = "technic parts fetch, or on Debian: apt install ldraw-parts, or set LDRAWDIR"
        return {"found": False, "looked_in": looked, "remedy": remedy}
    return {
        "found": True,
        "path": str(library.path),
        "files": len(library),
        "parts": sum(1 for _ in library.part_numbers()),
        "release": library.release() or None,
    }


def _shadow(explicit: Path | None) -> dict[str, Any]:
    from technic.ldraw.shadow import find_shadow

    try:
        shadow = find_shadow(explicit)
    except TechnicError as error:
        return {"found": False, "problem": str(error), "remedy": "Correct TECHNIC_SHADOW."}
    if shadow is None:
        remedy = "Optional: LDCad's offLibShadow.csl or a copy of it; name it in TECHNIC_SHADOW."
        return {"found": False, "remedy": remedy}
    return {"found": True, "path": str(shadow.store.path), "files": len(shadow.store)}


def _pictures() -> dict[str, Any]:
    """Draw one part, which is the only sure way to know."""
    from technic.parts.catalogue import catalogue
    from technic.report.picture import part_scene
    from technic.report.render import Painter

    definition = next(iter(catalogue()))
    painter = Painter()
    try:
        with TemporaryDirectory() as folder:
            painter.draw(part_scene(definition), Path(folder) / "part.png")
    except TechnicError as error:
        said, _, remedy = str(error).partition("\n")
        return {"possible": False, "problem": said, "remedy": remedy.strip()}
    finally:
        painter.close()
    return {"possible": True}


def _size(size: int) -> str:
    return f"{size / 2**20:.1f} MB" if size >= 2**20 else f"{size / 1024:.0f} kB"


def _text(found: dict[str, Any]) -> str:
    from technic.report.style import style_for

    style = style_for(sys.stdout)
    lines: list[str] = []

    def say(good: bool | None, head: str, *details: str | None) -> None:
        mark = style("good", "ok     ") if good else style("warn", "missing")
        lines.extend(style.wrap(f"{'       ' if good is None else mark}  {head}", "", " " * 9))
        for detail in details:
            if detail:
                lines.extend(style.wrap(detail, " " * 9, " " * 9))

    say(True, f"technic {found['technic']}, Python {found['python']}, {found['system']}")
    for name, number in found["packages"].items():
        if number is None:
            say(False, f"the package {name}", f"pip install --upgrade {name}")
    known = [f"{name} {number}" for name, number in found["packages"].items() if number]
    say(None, ", ".join(known))
    library, shadow, pictures = found["library"], found["shadow"], found["pictures"]
    if library["found"]:
        release = f", release {library['release']}" if library["release"] else ""
        say(True, f"LDraw parts library: {library['path']}", f"{library['parts']} parts{release}")
    else:
        looked = library.get("looked_in")
        say(
            False,
            "LDraw parts library: parts outside the catalogue stay unknown",
            library.get("problem"),
            f"looked in: {', '.join(looked)}" if looked else None,
            library["remedy"],
        )
    if shadow["found"]:
        say(True, f"LDCad shadow library: {shadow['path']}")
    else:
        say(False, "LDCad shadow library", shadow.get("problem"), shadow["remedy"])
    if pictures is None:
        say(None, "pictures: not tried")
    elif pictures["possible"]:
        say(True, "pictures")
    else:
        say(False, "pictures", pictures["problem"], pictures["remedy"])
    say(None, f"equations are solved by {found['solver']}; no other solver is needed")
    for cache in found["caches"]:
        head = f"cache: {cache['files']} files, {_size(cache['bytes'])} in {cache['folder']}"
        say(None, head, "technic parts cache --clear empties it" if cache["files"] else None)
    return "\n".join(line.rstrip() for line in lines) + "\n"


def doctor(
    json: JsonOption = None,
    library: LibraryOption = None,
    shadow: ShadowOption = None,
    no_picture: Annotated[
        bool, typer.Option("--no-picture", help="Do not try to draw (saves a few seconds).")
    ] = False,
) -> None:
    """Show what this installation finds, and what to install for the rest."""
    from technic import __version__
    from technic.ldraw.caches import caches
    from technic.report.json import STDOUT, write_json

    found: dict[str, Any] = {
        "schema": "technic-doctor/1",
        "technic": __version__,
        "python": platform.python_version(),
        "system": platform.platform(),
        "packages": _versions(),
        "library": _library(library),
        "shadow": _shadow(shadow),
        "pictures": None if no_picture else _pictures(),
        "solver": f"SuperLU of SciPy {version('scipy')}",
        "caches": [
            {
                "name": cache.name,
                "title": cache.title,
                "folder": str(cache.folder),
                "files": len(cache.files),
                "bytes": cache.size,
            }
            for cache in caches()
        ],
    }
    if json is not None:
        write_json(found, json)
    if json != STDOUT:
        sys.stdout.write(_text(found))
