"""Pictures of rigs: down is down, what is clamped is shown, and the program draws them."""

from __future__ import annotations

import sys

import numpy as np
import pytest

from calibration.rigs import shipped_rigs
from technic import cli
from technic.assembly.stiffness import default_table
from technic.report.rig_picture import rig_scene
from technic.statics.forward import held_rig
from technic.statics.loads import parse_probe


@pytest.mark.parametrize("name", sorted(shipped_rigs()))
def test_down_is_down_and_all_is_in_the_picture(name):
    rig = shipped_rigs()[name]
    scene = rig_scene(rig)
    place = parse_probe(held_rig(rig, default_table()), rig.loads[0].place).point
    assert [panel.caption for panel in scene.panels] == [f"pose: {pose}" for pose in rig.poses]
    for panel, pose in zip(scene.panels, rig.poses.values(), strict=True):
        down = pose.down_at(pose.angle_deg)
        right, up, toward = panel.camera.axes()
        assert abs(right @ down) < 1e-9
        assert up @ down < -0.8
        assert toward @ down < 0.0  # from above
        (marker,) = panel.markers
        assert marker.point == pytest.approx(place)
        points = np.concatenate([surface.points for surface in panel.surfaces])
        seen = np.abs((points - panel.camera.center) @ np.array([right, up]).T)
        assert np.all(seen <= [panel.camera.half_width, panel.camera.half_height])
        # thread and weight hang below the hole
        lowest = points[np.argmax(points @ down)]
        assert (lowest - place) @ down > 0.02


@pytest.mark.slow
def test_the_command_draws_own_rigs(tmp_path, monkeypatch, capsys):
    (tmp_path / "r.toml").write_text("""schema = "technic-rigs/1"
[rig.mine]
model = "r.ldr"
clamped = ["2:32316:hole1"]
loads = [{ place = "3:32316:hole5", span_mm = 10 }]
joints = { "pin/pin_hole" = ["shear"] }
[rig.mine.pose.up]
down = [0, 1, 0]
turn = [1, 0, 0]
""")
    (tmp_path / "r.ldr").write_text("""0 Pair
1 4 0 0 0 1 0 0 0 1 0 0 0 1 32316.dat
1 4 0 -20 60 1 0 0 0 1 0 0 0 1 32316.dat
1 0 0 -10 40 0 1 0 1 0 0 0 0 1 2780.dat
1 0 0 -10 20 0 1 0 1 0 0 0 0 1 2780.dat
""")
    monkeypatch.setattr(
        sys,
        "argv",
        [
            "technic",
            "calibrate",
            "--draw",
            str(tmp_path / "out"),
            "--rigs",
            str(tmp_path / "r.toml"),
        ],
    )
    with pytest.raises(SystemExit) as end:
        cli.main()
    assert not end.value.code, capsys.readouterr().err
    assert (tmp_path / "out" / "mine.png").read_bytes().startswith(b"\x89PNG")
