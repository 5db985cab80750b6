"""The mechanics of all rigs as the fit wants it: a callable from conditions and stiffnesses to readings."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Mapping, Sequence
from contextlib import ExitStack
from dataclasses import dataclass, replace
from functools import cache
from importlib.resources import as_file
from typing import TypeVar

import numpy as np
from numpy.typing import NDArray

from calibration.dataset import GRAVITY
from calibration.model import Forward, Response
from calibration.rigs import Condition, Rig
from technic.assembly.model import Assembly
from technic.assembly.select import parse_fix
from technic.assembly.stiffness import StiffnessTable
from technic.geometry import Array
from technic.loading import load
from technic.statics.loads import parse_probe
from technic.statics.rig import RigModel, rig_model
from technic.statics.tap import TapModel, tap_model
from technic.system.assemble import ElementFactory, solid_element_of
from technic.system.parameters import Parameter

__all__ = ["forward_model", "held_rig"]


Model = TypeVar("Model")


def held_rig(rig: Rig, table: StiffnessTable) -> Assembly:
    """Return a rig's assembly, clamped.

    Raises
    ------
    TechnicError
        Its model cannot be read, or lacks a clamped part.
    """
    with ExitStack() as stack:
        path = stack.enter_context(as_file(rig.model))
        assembly = load(path, table=table)
    supports = tuple(parse_fix(assembly, text) for text in rig.clamped)
    return replace(assembly, supports=assembly.supports + supports)


@dataclass(frozen=True, slots=True, eq=False)
class _Plan:
    """Which rows of the answer each model fills.

    Parameters
    ----------
    down : (c, 3) ndarray
        Where down is under each condition.
    sags : list
        Model, its parameters, and its conditions.
    taps : list
        Model, its parameters, its conditions, and their weights (kg).
    """

    down: Array
    sags: list[tuple[RigModel, list[int], NDArray[np.int64]]]
    taps: list[tuple[TapModel, list[int], NDArray[np.int64], Array]]


def forward_model(
    rigs: Mapping[str, Rig],
    places: Iterable[tuple[str, str]],
    parameters: Sequence[Parameter],
    table: StiffnessTable,
    element: ElementFactory = solid_element_of,
) -> Forward:
    """Return the mechanics as the fit wants it; every rig is solved once for each loaded hole.

    Parameters
    ----------
    rigs : mapping of str to Rig
    places : iterable of (str, str)
        Rig and loaded hole.
    parameters : sequence of Parameter
        Those that a rig does not have are zero in its derivatives.
    table : StiffnessTable
    element : callable

    Raises
    ------
    UsageError
        A rig has no such place or no joint of a parameter, or is not held.
    """
    assembly = cache(lambda name: held_rig(rigs[name], table))

    def own(name: str) -> list[int]:
        joints = rigs[name].joints
        return [k for k, p in enumerate(parameters) if p.motion in joints.get(p.connection, ())]

    def made(make: Callable[..., Model], name: str, place: str) -> Model:
        rig = assembly(name)
        chosen = [parameters[k] for k in own(name)]
        return make(rig, parse_probe(rig, place), chosen, table, element=element)

    sag_models = {key: made(rig_model, *key) for key in sorted(set(places))}
    tapped = cache(lambda name, place: made(tap_model, name, place))

    @cache
    def plan(conditions: tuple[Condition, ...]) -> _Plan:
        def members(key: tuple[str, str], *, tap: bool) -> NDArray[np.int64]:
            found = [
                k for k, c in enumerate(conditions) if c.tap is tap and (c.rig, c.place) == key
            ]
            return np.array(found, dtype=np.int64)

        def keys(*, tap: bool) -> list[tuple[str, str]]:
            return sorted({(c.rig, c.place) for c in conditions if c.tap is tap})

        mass = np.array([c.mass for c in conditions])
        swung = [(key, members(key, tap=True)) for key in keys(tap=True)]
        return _Plan(
            np.array([rigs[c.rig].poses[c.pose].down_at(c.angle_deg) for c in conditions]),
            [(sag_models[key], own(key[0]), members(key, tap=False)) for key in keys(tap=False)],
            [(tapped(*key), own(key[0]), found, mass[found]) for key, found in swung],
        )

    def forward(conditions: Sequence[Condition], log_stiffness: Array) -> Response:
        todo = plan(tuple(conditions))
        stiffness = np.exp(np.asarray(log_stiffness, dtype=float))
        c, k = len(todo.down), len(parameters)
        value, slope = np.zeros((3, c)), np.zeros((3, c, k))
        for model, chosen, members in todo.sags:
            answer, change = model.response(stiffness[chosen])
            d = todo.down[members]
            for half, scale in ((0, 1.0), (1, GRAVITY)):
                columns = slice(3 * half, 3 * half + 3)
                value[half, members] = scale * np.einsum("ci,ij,cj->c", d, answer[:, columns], d)
                sloped = np.einsum("ci,pij,cj->cp", d, change[:, :, columns], d)
                slope[half][np.ix_(members, np.array(chosen))] = scale * sloped
        for tap, chosen, members, mass in todo.taps:
            found = tap.response(stiffness[chosen], mass, todo.down[members])
            value[2, members], slope[2][np.ix_(members, np.array(chosen))] = found
        return Response(value[0], value[1], slope[0], slope[1], value[2], slope[2])

    return forward
