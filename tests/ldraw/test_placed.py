"""The ports in world coordinates: the index against brute force, overlaps against hand results."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from technic.errors import InputError
from technic.ldraw import placed as module
from technic.ldraw.placed import collect, near_pairs, on_line, overlap
from technic.parts.definition import PortKind
from technic.units import LDU
from tests.ldraw.bricks import X, Y, axle, beam, define, pin, place, port, rotation, turn


def test_collect_follows_the_parts():
    parts = [
        place(beam(3), [10, 0, 0]),
        place(define("s", "S", []), [0, 0, 0]),
        place(pin(), [0, 0, 0]),
    ]
    ports = collect(parts)
    assert ports.start.tolist() == [0, 3, 3, 5]
    assert ports.part.tolist() == [0, 0, 0, 2, 2]
    assert [ports.name(k) for k in range(5)] == ["hole1", "hole2", "hole3", "end1", "end2"]
    np.testing.assert_allclose(ports.position[0] / LDU, [10, 0, -20])
    np.testing.assert_allclose(ports.half / LDU, 10)
    assert ports.of_kind(PortKind.PIN).tolist() == [3, 4]
    assert list(ports.of_part(2)) == [3, 4]


def test_no_parts():
    ports = collect([])
    nothing = ports.of_kind(PortKind.PIN)
    assert near_pairs(ports, nothing, nothing, 1.0).shape == (0, 2)


@settings(max_examples=30)
@given(st.integers(0, 2**32 - 1))
def test_the_index_finds_all_pairs_that_brute_force_finds(seed):
    rng = np.random.default_rng(seed)
    kinds = [beam(1), axle(5), pin(1)]
    parts = [
        place(kinds[k], rng.uniform(-60, 60, 3), rotation(rng.normal(size=3), rng.uniform(0, 180)))
        for k in rng.integers(0, 3, 30)
    ]
    ports = collect(parts)
    axles, bores = ports.of_kind(PortKind.AXLE), ports.of_kind(PortKind.PIN_HOLE)
    reach = rng.uniform(1, 20) * LDU
    found = {tuple(pair) for pair in near_pairs(ports, axles, bores, reach).tolist()}

    def points(k):
        along = np.linspace(-1, 1, 21)[:, None] * ports.half[k]
        return ports.position[k] + along * ports.axis[k]

    for i in axles:
        for j in bores:
            apart = np.linalg.norm(points(i)[:, None] - points(j)[None], axis=2).min()
            if apart <= reach:
                assert (i, j) in found


def test_ports_of_one_part_are_no_pair():
    ports = collect([place(beam(3), [0, 0, 0])])
    holes = ports.of_kind(PortKind.PIN_HOLE)
    assert len(near_pairs(ports, holes, holes, 1.0)) == 0


def test_pairs_far_from_the_origin():
    far = 1e9
    parts = [place(beam(1), [far, far, -far]), place(pin(1), [far, far, -far], turn("x", "y"))]
    ports = collect(parts)
    pairs = near_pairs(ports, ports.of_kind(PortKind.PIN), ports.of_kind(PortKind.PIN_HOLE), LDU)
    assert pairs.tolist() == [[1, 0]]


def test_overlap_of_a_shifted_and_tilted_pin():
    parts = [place(pin(1), [3, 12, 4], rotation(Y, 30) @ turn("x", "y")), place(beam(1), [0, 0, 0])]
    lie = overlap(collect(parts), np.array([[0, 1]]))
    assert lie.low[0] / LDU == pytest.approx(2)
    assert lie.high[0] / LDU == pytest.approx(10)
    assert lie.length[0] / LDU == pytest.approx(8)
    assert lie.offset[0] / LDU == pytest.approx(5)
    assert lie.angle[0] == pytest.approx(0.0, abs=1e-9)
    tilted = [place(pin(1), [0, 0, 0], rotation(X, 25) @ turn("x", "y")), parts[1]]
    assert np.degrees(overlap(collect(tilted), np.array([[0, 1]])).angle[0]) == pytest.approx(25)


def test_on_line():
    ports = collect([place(beam(3), [0, 0, 0]), place(beam(1), [2, 100, 0])])
    found = on_line(ports, range(4), np.zeros(3), Y, 3 * LDU, 0.1)
    assert found.tolist() == [1, 3]
    assert len(on_line(ports, [], np.zeros(3), Y, LDU, 0.1)) == 0


def test_thousands_of_copies_in_one_place_are_refused(monkeypatch):
    monkeypatch.setattr(module, "_MOST_PAIRS", 1000)
    parts = [place(kind, [0, 0, 0]) for kind in (beam(1), pin(1)) for _ in range(40)]
    ports = collect(parts)
    with pytest.raises(InputError, match="in one place"):
        near_pairs(ports, ports.of_kind(PortKind.PIN), ports.of_kind(PortKind.PIN_HOLE), LDU)


def test_a_port_length_of_zero_is_a_point():
    ball = define("ball", "Ball", [port("ball", "ball", [0, 0, 0], Y, 0)])
    socket = define("socket", "Socket", [port("socket", "socket", [0, 0, 0], Y, 0)])
    ports = collect([place(ball, [0, 0, 0]), place(socket, [0, 1, 0])])
    pairs = near_pairs(ports, ports.of_kind(PortKind.BALL), ports.of_kind(PortKind.SOCKET), LDU)
    assert pairs.tolist() == [[0, 1]]
