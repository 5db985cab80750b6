"""Thin beams and frames, beside straight and bent thick beams: laid, pinned, forecast, proven."""

from __future__ import annotations

from collections import Counter

import numpy as np
import pytest

from technic.design.apply import change_of, extend
from technic.design.candidates import FRAMES, THIN, THIN_BENT, candidates
from technic.design.collide import Surroundings
from technic.design.faces import faces
from technic.design.fit import fit, still_apart
from technic.design.reanalysis import Reanalysis
from technic.design.screen import Screen
from technic.design.sites import SHORT_PIN
from technic.rigidity.analyze import analyze
from tests.design.made import SQUARE, build

FLAT = {*THIN.values(), *THIN_BENT}


@pytest.fixture(scope="module")
def square():
    return build(*SQUARE)


def proven(assembly, chosen):
    """Each is what it was promised to be, joined and apart from the others."""
    model, screen = Reanalysis(assembly), Screen(assembly, chosen)
    before = analyze(assembly, modes=1)
    for candidate, forecast in zip(chosen, screen.forecasts(chosen), strict=True):
        change = change_of(assembly, candidate)
        made = extend(assembly, [change])
        report = analyze(made, modes=1)
        exact = model.exact(change)
        assert exact.rigidity == pytest.approx(report.rigidity.value, rel=1e-6)
        went = before.mobility.structural - report.mobility.structural
        assert forecast.removed == exact.removed == went
        assert still_apart(made, len(change.added))
        assert len(report.components) == 1


def test_they_are_offered_when_asked_for_only(square):
    usual = {c.number for c in candidates(square)}
    assert not usual & (FLAT | set(FRAMES))
    assert {c.number for c in candidates(square, thin=True)} & FLAT
    assert {c.number for c in candidates(square, frames=True)} >= {"64178", "64179"}


def test_thin_beams_are_pinned_with_the_short_pin(square):
    chosen = [c for c in candidates(square, thin=True) if c.number in FLAT]
    assert chosen
    surroundings = Surroundings(square.parts)
    for candidate in chosen:
        pins = {a.fastening.pin for a in candidate.attachments}
        assert pins == {SHORT_PIN}
        change = change_of(square, candidate)
        found = fit(surroundings, candidate, change)
        assert found
        # the collar of the pin is on the beam's side: the pin comes from there
        outwards = {"+y" if a.fastening.sign > 0 else "-y" for a in candidate.attachments}
        if candidate.axis[1] < 0:
            outwards = {"-y" if side == "+y" else "+y" for side in outwards}
        assert set(found.sides) == outwards
    proven(square, chosen[::5])


def test_frames_are_pinned_by_any_of_their_sides(square):
    chosen = [c for c in candidates(square, frames=True) if c.number in FRAMES]
    used = Counter((c.number, c.face) for c in chosen)
    assert len({face for _, face in used}) > 1
    for candidate in chosen[::60]:
        for attachment in candidate.attachments:
            name = faces(candidate.number)[candidate.face].names[attachment.hole]
            port = candidate.definition.port(name)
            where = candidate.pose.points(port.position)
            assert np.allclose(where, attachment.point, atol=1e-9)
            along = candidate.pose.directions(port.axis)
            assert abs(along @ candidate.axis) == pytest.approx(1.0)
    surroundings = Surroundings(square.parts)
    fits = [c for c in chosen[::40] if fit(surroundings, c, change_of(square, c))]
    proven(square, fits[:6])


def test_a_frame_turned_by_half_is_offered_once(square):
    chosen = [c for c in candidates(square, frames=True) if c.number == "64179" and c.face == 0]
    places = [
        tuple(sorted(map(tuple, np.round(c.pose.points(_middles(c)) * 1e5).tolist())))
        for c in chosen
    ]
    assert len(set(places)) == len(places)


def _middles(candidate):
    return np.array([p.position for p in candidate.definition.ports])
