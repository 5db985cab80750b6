"""The page without a browser: what it holds, how big it is, what the viewer is given."""

from __future__ import annotations

import base64
import gzip
import hashlib
import json
import re
from collections.abc import Callable
from dataclasses import replace
from html.parser import HTMLParser
from pathlib import Path

import numpy as np
import pytest

import technic
from technic.geometry import shift_twist
from technic.report.carried import carried_twists
from technic.report.drawing import drawing_of
from technic.report.energy import energy_shares
from technic.report.html.bending import bending_of, monomials
from technic.report.html.fields import mode_fields, motion_fields
from technic.report.html.page import page
from technic.report.html.shapes import LIGHT_ABOVE, lighter, shapes_of
from technic.rigidity.result import RigidityReport
from tests.conftest import REPO

NUMBERS = {"float32": "<f4", "uint32": "<u4", "uint16": "<u2", "uint8": "u1"}


class Reader(HTMLParser):
    """The script and style elements of a page, its addresses, and what a person reads."""

    def __init__(self, text: str) -> None:
        super().__init__()
        self.elements: list[tuple[str, dict[str, str | None], str]] = []
        self.addresses: list[str] = []
        self.words = ""
        self._open: tuple[str, dict[str, str | None]] | None = None
        self.feed(text)

    def handle_starttag(self, tag: str, attrs: list[tuple[str, str | None]]) -> None:
        found = dict(attrs)
        self.addresses += [found[key] or "" for key in ("src", "href", "action") if key in found]
        if tag in ("script", "style"):
            self._open = (tag, found)
            self.elements.append((tag, found, ""))

    def handle_endtag(self, tag: str) -> None:
        if self._open is not None and tag == self._open[0]:
            self._open = None

    def handle_data(self, data: str) -> None:
        if self._open is None:
            self.words += data
        else:
            tag, attrs, text = self.elements[-1]
            self.elements[-1] = (tag, attrs, text + data)

    def element(self, name: str) -> str:
        return next(text for _, attrs, text in self.elements if attrs.get("id") == name)


def contents(text: str) -> tuple[dict, Callable[[dict], np.ndarray]]:
    """What the viewer reads: the table of contents and the arrays."""
    reader = Reader(text)
    data = gzip.decompress(base64.b64decode(reader.element("block")))

    def array(place: dict) -> np.ndarray:
        return np.frombuffer(data, NUMBERS[place["type"]], place["length"], place["at"])

    return json.loads(reader.element("contents")), array


def unpacked(codes: np.ndarray, flags: np.ndarray) -> tuple[np.ndarray, list[tuple[int, int]]]:
    """Triangles and edges as the viewer unpacks them (web/src/data.js)."""
    corners, seen = [], 0
    for code in codes.tolist():
        corners.append(seen - code)
        seen += code == 0
    faces = np.array(corners).reshape(-1, 3)
    edges = [
        (int(face[c]), int(face[(c + 1) % 3]))
        for face, flag in zip(faces, flags.tolist(), strict=True)
        for c in range(3)
        if flag & 1 << c
    ]
    return faces, edges


def test_policy_admits_exactly_the_script_and_the_style(pair: RigidityReport) -> None:
    text = page(pair)
    policy = re.search(r'http-equiv="Content-Security-Policy" content="([^"]*)"', text)
    assert policy is not None
    rules = policy[1].replace("&#39;", "'")
    assert rules.startswith("default-src 'none'; ")
    for tag, attrs, inner in Reader(text).elements:
        digest = base64.b64encode(hashlib.sha256(inner.encode()).digest()).decode()
        if attrs.get("type") in ("application/json", "text/plain"):
            assert digest not in rules
        else:
            assert f"{tag}-src 'sha256-{digest}'" in rules


def test_nothing_comes_from_outside(pair: RigidityReport) -> None:
    addresses = Reader(page(pair)).addresses
    assert [a for a in addresses if not a.startswith(("#", "data:"))] == []


def test_same_report_same_page(pair: RigidityReport) -> None:
    assert page(pair) == page(pair)


def test_words_of_the_report_are_there(scissors: RigidityReport) -> None:
    words = " ".join(Reader(page(scissors)).words.split())
    assert scissors.reason in words
    assert "flexible" in words
    for heading in ("Weak spots", "Motions", "Unknown, near misses", "Joints and where", "Not mod"):
        assert heading in words
    assert "pin/pin_hole" in words
    assert all(item in words for item in scissors.not_modelled)


def test_unknown_parts_are_said(make_report: Callable[..., RigidityReport]) -> None:
    beam = "1 4 0 0 0 1 0 0 0 1 0 0 0 1 {}.dat"
    report = make_report([beam.format("32316"), beam.format("zz99")], "unknown")
    words = Reader(page(report)).words
    assert "zz99" in words
    assert "left out of the analysis" in words


def test_uncertainty_is_printed(pair: RigidityReport) -> None:
    assert pair.rigidity is not None
    sure = replace(pair, rigidity=replace(pair.rigidity, interval_95=(1234.0, 5678.0)))
    assert "95 % interval: 1230 to 5680 N/m" in Reader(page(sure)).words
    assert "not calibrated" in Reader(page(pair)).words


def test_shapes_are_stored_once_per_type(pair: RigidityReport) -> None:
    found, array = contents(page(pair))
    assert len(found["shapes"]) == 2  # the beam, the pin
    members = np.concatenate([array(shape["parts"]) for shape in found["shapes"]])
    assert sorted(members) == list(range(len(pair.assembly.parts)))


def test_viewer_puts_parts_where_they_are(scissors: RigidityReport) -> None:
    found, array = contents(page(scissors))
    drawing = drawing_of(scissors.assembly)
    everything = np.concatenate(drawing.points)
    middle = 0.5 * (everything.min(axis=0) + everything.max(axis=0))
    rotations = array(found["rotations"]).reshape(-1, 3, 3)
    translations = array(found["translations"]).reshape(-1, 3)
    for shape in found["shapes"]:
        points = array(shape["points"]).reshape(-1, 3)
        faces, edges = unpacked(array(shape["faces"]), array(shape["edges"]))
        for k in array(shape["parts"]):
            world = points @ rotations[k].T + translations[k]
            wanted = 1e3 * (drawing.points[k] - middle)
            assert np.allclose(world[faces], wanted[drawing.solids[k].faces], atol=1e-3)
            drawn = {frozenset(map(tuple, world[list(edge)].round(2).tolist())) for edge in edges}
            sharp = wanted[drawing.solids[k].edges].round(2)
            assert len(edges) == len(sharp) == len(drawn)


def test_motion_of_the_viewer_is_that_of_the_report(scissors: RigidityReport) -> None:
    found, array = contents(page(scissors))
    (motion,) = found["motions"]
    first = scissors.motions[motion["number"]]
    assert set(array(motion["parts"])) >= set(first.parts)
    twists = array(motion["twists"]).reshape(-1, 6)[list(first.parts)]
    assert np.allclose(twists[:, 3:], first.twists[:, 3:], rtol=1e-5)
    assert np.allclose(twists[:, :3], 1e3 * first.twists[:, :3], rtol=1e-5)


def test_energy_of_parts_adds_up(scissors: RigidityReport, pair: RigidityReport) -> None:
    for report in (scissors, pair):
        assert energy_shares(report).sum() == pytest.approx(1.0, abs=1e-9)


def test_bending_polynomial_gives_back_a_cubic() -> None:
    """A beam bent like a cubic: exact at its nodes up to the small penalty, and between them."""
    x = np.linspace(-1.0, 1.0, 15)
    line = np.column_stack([0.05 * x, 0.0 * x, 0.0 * x])
    bent = np.column_stack([0.0 * x, 1e-3 * (x**3 - x), 2e-3 * x**2])
    found = bending_of(line, line, bent, np.zeros(3), np.zeros(6), 0.05)
    assert np.allclose(monomials(line / 0.05) @ found, bent, atol=2e-6)
    between = 0.5 * (x[1:] + x[:-1])
    points = np.column_stack([between, 0 * between, 0 * between])
    wanted = np.column_stack([0 * between, 1e-3 * (between**3 - between), 2e-3 * between**2])
    assert np.allclose(monomials(points) @ found, wanted, atol=2e-6)


def test_bending_takes_the_rigid_movement_off() -> None:
    nodes = np.random.default_rng(7).normal(scale=0.02, size=(9, 3))
    twist = np.array([1e-3, -2e-3, 5e-4, 0.1, 0.2, -0.05])
    rigid = np.einsum("nij,j->ni", shift_twist(nodes)[:, :3], twist)
    assert np.allclose(bending_of(nodes, nodes, rigid, np.zeros(3), twist, 0.02), 0.0, atol=1e-12)


@pytest.mark.parametrize(("parts", "share"), [("frame", 0.05), ("solid", 0.1)])
def test_bending_polynomial_of_the_demo_is_close(parts: str, share: float) -> None:
    """The cubic is an approximation: at the nodes it errs by less than the eye can see."""
    path = REPO / "technic" / "data" / "rolling_chassis.mpd"
    report = technic.analyze(technic.load(path), parts=parts)
    drawing = drawing_of(report.assembly)
    worst = mode_fields(report, drawing, shapes_of(report.assembly.parts, drawing.solids))[0]
    assert worst.bending is not None
    most, error = 0.0, 0.0
    for k, nodes in report.node_points.items():
        part, twist = report.assembly.parts[k], worst.twists[k]
        rigid = np.einsum("nij,j->ni", shift_twist(nodes - part.centroid)[:, :3], twist)
        bent = report.node_displacements[k] / report.modes[0].value - rigid
        local = part.pose.to_local(nodes) - part.mass_properties.centroid
        drawn = monomials(local / worst.sizes[k]) @ worst.bending[k]
        most, error = max(most, np.abs(bent).max()), max(error, np.abs(drawn - bent).max())
    assert error < share * most


def test_drawn_scale_shows_the_deformation(pair: RigidityReport) -> None:
    drawing = drawing_of(pair.assembly)
    shapes = shapes_of(pair.assembly.parts, drawing.solids)
    for movement in mode_fields(pair, drawing, shapes):
        ways = [
            twist[:3] + np.cross(twist[3:], points - part.centroid)
            for part, points, twist in zip(
                pair.assembly.parts, drawing.points, movement.twists, strict=True
            )
        ]
        furthest = movement.scale * np.linalg.norm(np.concatenate(ways), axis=1).max()
        assert 0.02 * drawing.diagonal < furthest < 0.1 * drawing.diagonal


def test_swing_of_a_motion_stays_small(scissors: RigidityReport) -> None:
    drawing = drawing_of(scissors.assembly)
    shapes = shapes_of(scissors.assembly.parts, drawing.solids)
    for _, movement in motion_fields(scissors, drawing, shapes):
        assert np.linalg.norm(movement.scale * movement.twists[:, 3:], axis=1).max() <= 0.6 + 1e-9


def test_lighter_shape_is_smaller_and_close() -> None:
    drawing = drawing_of(technic.load(REPO / "technic" / "data" / "rolling_chassis.mpd"))
    solid = max(drawing.solids, key=lambda s: len(s.points))
    points, faces = lighter(solid.points, solid.faces)
    assert len(faces) < 0.6 * len(solid.faces)
    assert faces.max() < len(points)
    assert np.allclose(points.min(axis=0), solid.points.min(axis=0), atol=1.2e-3)
    assert np.allclose(points.max(axis=0), solid.points.max(axis=0), atol=1.2e-3)


def bundle(times: int, folder: Path) -> Path:
    """The demo many times over, side by side."""
    text = (REPO / "technic" / "data" / "rolling_chassis.mpd").read_text(encoding="utf-8")
    name = re.search(r"0 FILE (.*)", text)
    assert name is not None
    rows = [
        f"1 16 {900 * (k % 6)} 0 {500 * (k // 6)} 1 0 0 0 1 0 0 0 1 {name[1].strip()}"
        for k in range(times)
    ]
    path = folder / "many.mpd"
    path.write_text("\n".join(["0 FILE many.ldr", *rows, text]), encoding="utf-8")
    return path


def test_size_for_150_parts() -> None:
    report = technic.analyze(technic.load(REPO / "technic" / "data" / "rolling_chassis.mpd"))
    # Without the picture, which adds about 0.15 MB.
    assert len(page(report).encode()) < 1.25e6


@pytest.mark.slow
def test_size_for_4000_parts(tmp_path: Path) -> None:
    report = technic.analyze(technic.load(bundle(26, tmp_path)))
    parts = len(report.assembly.parts)
    assert parts > 3900 > LIGHT_ABOVE
    text = page(report)
    assert len(text.encode()) < 8e6
    found, _ = contents(text)
    assert found["light"]
    assert all(shape["edges"]["length"] == 0 for shape in found["shapes"])


def test_notebook_summary_escapes(pair: RigidityReport) -> None:
    name = "<script>alert(1)</script>"
    report = replace(pair, assembly=replace(pair.assembly, name=name))
    html = report._repr_html_()
    assert "<script>" not in html
    assert "&lt;script&gt;" in html
    assert "N/m" in html


def test_show_opens_the_page_in_the_browser(
    pair: RigidityReport, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    import webbrowser

    opened: list[str] = []
    monkeypatch.setattr(webbrowser, "open", opened.append)
    path = pair.show(tmp_path / "page.html")
    assert path is not None
    assert opened == [path.as_uri()]
    assert path.read_text(encoding="utf-8") == page(pair)


def test_pins_go_along_with_what_they_hold(model: Callable[[str], Path]) -> None:
    """A frame of four: the two pins between moving beams move with them, the other two stay."""
    assembly = technic.load(model("square.ldr"))
    (motion, *_) = technic.analyze(assembly).motions
    twists = carried_twists(assembly, motion)
    still = next(
        k for k, p in enumerate(assembly.parts) if not p.fastener and k not in motion.parts
    )
    held = {k for j in assembly.joints if still in j.parts for k in j.parts}
    for k in range(len(assembly.parts)):
        assert bool(np.any(twists[k])) == (k not in held)
    # At every joint both parts go the same way.
    for joint in assembly.joints:
        one, other = (
            (shift_twist(joint.point - assembly.parts[k].centroid) @ twists[k])[:3]
            for k in joint.parts
        )
        assert np.allclose(one, other, atol=1e-6)


def test_part_that_only_bends_is_drawn_bent(make_report: Callable[..., RigidityReport]) -> None:
    """One beam alone: its twist is zero up to rounding, the factor is not infinite for that."""
    report = make_report(["1 4 0 0 0 1 0 0 0 1 0 0 0 1 32316.dat"], "alone", parts="frame")
    drawing = drawing_of(report.assembly)
    shapes = shapes_of(report.assembly.parts, drawing.solids)
    worst = mode_fields(report, drawing, shapes)[0]
    furthest = max(np.linalg.norm(way, axis=1).max() for way in report.node_displacements.values())
    drawn = worst.scale * furthest / report.modes[0].value
    assert 0.02 * drawing.diagonal < drawn < 0.1 * drawing.diagonal
