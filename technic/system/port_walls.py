"""Rigid walls in the bores that carry a joint: the upper bound on how stiff parts are.

Which walls are rigid depends on the joints of a model, so these matrices cannot be shipped: they are
built for each kind of part and set of bores in use, kept in the user's cache, and found there the next
time. They are meshed with the draft cells: a coarser mesh is stiffer, so the bound stays a bound, and it
takes a third of the time.
"""

from __future__ import annotations

import hashlib
from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass
from typing import Final, Literal

import numpy as np

from technic.assembly.model import Assembly, Part
from technic.errors import TechnicError
from technic.fem.element import Element
from technic.fem.solid.settings import MeshSettings
from technic.fem.solid.store import element_key, fitting, load, stored_shape
from technic.fem.solid.superelement import SuperElement, frames_in_use
from technic.geometry import Array
from technic.parts.definition import PartDefinition
from technic.parts.materials import material_of
from technic.system.assemble import Probe, assemble
from technic.system.part_models import element_from, framed, solid_element_of
from technic.system.solid_cache import Refusal, recall, remember

__all__ = ["DRAFT", "PortWalls", "RigidWalls", "Walled", "build_walled", "rigid_walls"]

PortWalls = Literal["mean", "rigid"]
"""What bores do: give as the mean over their wall (the default), or keep their shape."""

DRAFT: Final = MeshSettings(cell=1.2e-3)
"""Cells of parts with rigid walls."""

VERSION: Final = 1
"""Raised when the method changes in a way that changes the matrices."""

_memory: dict[str, SuperElement | Refusal] = {}

Progress = Callable[[int, int, str], None]
"""Called with how many models are done, how many there are, and the title of the last one."""


@dataclass(frozen=True, slots=True)
class Walled:
    """A kind of part and the bores that a model uses.

    Parameters
    ----------
    definition : PartDefinition
    used : tuple of str
        Ports that carry a joint, a load or a support: their walls are rigid.
    free : tuple of str
        Ports that the mass needs.
    """

    definition: PartDefinition
    used: tuple[str, ...]
    free: tuple[str, ...]

    @property
    def key(self) -> str:
        """Hash of all that the matrices depend on."""
        facts = [
            str(VERSION),
            element_key(self.definition, material_of(self.definition), DRAFT),
            stored_shape(self.definition.id),
            *self.used,
            "free",
            *self.free,
        ]
        return hashlib.sha256("\n".join(facts).encode()).hexdigest()[:32]


class RigidWalls:
    """Makes elements whose used bores keep their shape.

    Parameters
    ----------
    models : mapping of Walled to SuperElement or Refusal
    """

    def __init__(self, models: dict[Walled, SuperElement | Refusal]) -> None:
        self.models = models

    def __call__(self, part: Part, points: Array, ports: tuple[str | None, ...]) -> Element:
        """Return the element of a part; that with mean walls where there is no other."""
        wanted = _wanted(part, points, ports)
        found = None if wanted is None else self.models.get(wanted)
        if wanted is None or not isinstance(found, SuperElement):
            return solid_element_of(part, points, ports)
        mean = load(wanted.definition)
        assert mean is not None  # _wanted has asked for it
        at, _, _ = frames_in_use(mean, framed(mean, ports), points)
        return element_from(found, part, points, tuple(mean.ports[k] for k in at))

    @property
    def refused(self) -> dict[str, str]:
        """Parts whose bores give as ever, with the reason."""
        return {
            wanted.definition.id: found.reason
            for wanted, found in self.models.items()
            if isinstance(found, Refusal)
        }


def _wanted(part: Part, points: Array, ports: tuple[str | None, ...]) -> Walled | None:
    """Return what a part of a model needs; None when it has no solid model, or no joint."""
    mean = None if part.definition is None else load(part.definition)
    if mean is None or part.definition is None or not len(points):
        return None
    at, kept, _ = frames_in_use(mean, framed(mean, ports), points)
    used = sorted(set(at))
    return Walled(
        part.definition,
        tuple(mean.ports[k] for k in used),
        tuple(mean.ports[k] for k in kept if k not in used),
    )


def rigid_walls(
    assembly: Assembly,
    *,
    probes: tuple[Probe, ...] = (),
    jobs: int = 1,
    progress: Progress | None = None,
) -> RigidWalls:
    """Build, or find in the cache, all that a model needs.

    Parameters
    ----------
    assembly : Assembly
    probes : tuple of Probe
        As it is assembled with afterwards.
    jobs : int
        Processes.
    progress : callable, optional
    """
    needed: dict[Walled, None] = {}

    def note(part: Part, points: Array, ports: tuple[str | None, ...]) -> Element:
        wanted = _wanted(part, points, ports)
        if wanted is not None:
            needed[wanted] = None
        return solid_element_of(part, points, ports)

    assemble(assembly, element=note, probes=probes)
    keys = {wanted: wanted.key for wanted in needed}
    models: dict[Walled, SuperElement | Refusal] = {}
    missing = []
    for wanted, key in keys.items():
        found = _memory.get(key) or recall(key, wanted.definition.id)
        if found is None:
            missing.append(wanted)
        else:
            models[wanted] = found
    for done, (wanted, made) in enumerate(_built(missing, keys, jobs), 1):
        remember(keys[wanted], wanted.definition.id, made)
        models[wanted] = _memory[keys[wanted]] = made
        if progress is not None:
            progress(done, len(missing), wanted.definition.title)
    return RigidWalls(models)


def _built(
    missing: Sequence[Walled], keys: dict[Walled, str], jobs: int
) -> Iterator[tuple[Walled, SuperElement | Refusal]]:
    """Build models one after the other, or in processes."""
    if jobs <= 1 or len(missing) <= 1:
        for wanted in missing:
            yield wanted, build_walled(wanted, keys[wanted])
        return
    import multiprocessing
    from concurrent.futures import ProcessPoolExecutor, as_completed

    # a fork of a program with threads (pictures, BLAS) may hang
    context = multiprocessing.get_context("spawn")
    with ProcessPoolExecutor(min(jobs, len(missing)), mp_context=context) as pool:
        waiting = {pool.submit(build_walled, wanted, keys[wanted]): wanted for wanted in missing}
        for done in as_completed(waiting):
            yield waiting[done], done.result()


def build_walled(wanted: Walled, key: str) -> SuperElement | Refusal:
    """Build the model of a part with rigid walls, or say why there is none."""
    from threadpoolctl import threadpool_limits

    from technic.fem.solid.walls import build_with_rigid_walls
    from technic.parts.shapes import mesh

    definition = wanted.definition
    try:
        surface = mesh(definition, "solid")
        with threadpool_limits(1):
            return build_with_rigid_walls(
                definition.id,
                np.asarray(surface.triangles),
                [definition.port(name) for name in wanted.used],
                material_of(definition),
                fitting(DRAFT, float(surface.volume)),
                free=[definition.port(name) for name in wanted.free],
                key=key,
            )
    except TechnicError as fault:
        return Refusal(str(fault))
