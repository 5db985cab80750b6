"""Readings made up with known truth: what a perfect rig would show, rounded and scattered."""

from __future__ import annotations

from functools import cache

import numpy as np

from calibration.dataset import COLUMNS, GRAVITY
from calibration.rigs import Condition, shipped_rigs
from technic.assembly.stiffness import default_table
from technic.statics.calibration import forward_model
from technic.system.parameters import Parameter

SHEAR, TILT = 65625.0, 0.240
"""The values of Liu et al. 2022, in our units."""

PIN = (Parameter("pin/pin_hole", "shear"), Parameter("pin/pin_hole", "tilt"))
HEADER = ",".join(COLUMNS)
PAIR = (("pin-pair", "edge", 32, (20, 50)), ("pin-pair", "flat", 32, (20, 50)))
BOTH = (*PAIR, ("pin-sandwich", "edge", 32, (100, 250)))


@cache
def pin_model():
    """Forward model of both pin rigs, solved once for all tests."""
    places = [(n, h.place) for n in ("pin-pair", "pin-sandwich") for h in shipped_rigs()[n].loads]
    return forward_model(shipped_rigs(), places, PIN, default_table())


@cache
def sag(rig, pose, span, values=(SHEAR, TILT)):
    """Displacement per newton (mm) of a rig's hole."""
    entry = shipped_rigs()[rig]
    condition = Condition(rig, pose, entry.poses[pose].angle_deg, entry.hole(float(span)).place)
    return 1e3 * float(pin_model()([condition], np.log(values)).per_newton[0])


def rows(
    plan=PAIR,
    *,
    seed=None,
    repeats=5,
    scatter=0.05,
    resolution=0.1,
    values=(SHEAR, TILT),
    free_play=0.0,
    hysteresis=0.0,
    specimens=1,
    specimen_scatter=0.0,
):
    """CSV rows; without a seed the readings are exact."""
    random = None if seed is None else np.random.default_rng(seed)
    out = []
    for specimen in range(1, specimens + 1):
        own = 1.0 if random is None else 1.0 + specimen_scatter * random.standard_normal()
        for rig, pose, span, loads in plan:
            for repeat in range(1, repeats + 1):
                for load in loads:
                    for way in ("loading", "unloading") if hysteresis else ("",):
                        down = sag(rig, pose, span, values) * load * 1e-3 * GRAVITY * own
                        zero = 10.0
                        if random is not None:
                            down *= 1.0 + scatter * random.standard_normal()
                            zero += random.uniform(0, 1)
                        down += free_play + (0.5 if way == "unloading" else -0.5) * hysteresis
                        read = [zero + down, zero]
                        if random is not None:
                            read = [round(x / resolution) * resolution for x in read]
                        out.append(
                            f"t,pin/pin_hole,{rig},{pose},,{specimen},{repeat},{span},{load},"
                            f"{read[0]!r},{read[1]!r},{resolution},,,{way},synthetic"
                        )
    return [row.replace("np.float64(", "").replace(")", "") for row in out]


def text(*args, **kwargs):
    """A whole CSV file."""
    return "\n".join([HEADER, *rows(*args, **kwargs), ""])
