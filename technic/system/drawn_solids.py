"""Solid models of parts that only a parts library draws: meshed once, then found in the cache.

A library surface is not watertight, so nothing here asks for that; the mesher decides by votes. What
it refuses stays a rigid body, with the reason.
"""

from __future__ import annotations

import hashlib
import json
import os
from collections import OrderedDict
from collections.abc import Callable, Sequence
from concurrent.futures import Future
from dataclasses import asdict, dataclass
from functools import lru_cache
from typing import TYPE_CHECKING, Final

import numpy as np

from technic.assembly.model import Assembly
from technic.errors import InputError, TechnicError
from technic.fem.solid.settings import MeshSettings
from technic.fem.solid.store import load, material_of
from technic.fem.solid.superelement import SuperElement
from technic.geometry import Array
from technic.parts.definition import Material, PartDefinition, Port, PortKind
from technic.system.solid_cache import Refusal, recall, remember

if TYPE_CHECKING:
    from technic.fem.solid.grid import Mesh

__all__ = ["build_drawn", "frame_ports", "outcome_of", "prepare", "solid_model"]

VERSION: Final = 1
"""Raised when the method changes in a way that changes the matrices."""

MOST_TRIANGLES: Final = 200_000
"""Triangles of a surface that is meshed; the parts of real models have some thousand."""

MOST_FRAMES: Final = 32
"""Frames of a part. Studs and tubes beyond them take the nearest frame."""

MOST_PORTS: Final = 64
"""Parts with more holes than this get no solid model, as in the shipped file."""

DRAFT_CELLS, FINE_CELLS = 3_000, 30_000
"""Cells of the largest mesh: 0.6 GB and some seconds in the draft setting, 4.6 GB in the shipped one."""

DRAFT_LARGEST, FINE_LARGEST = 2.5e-3, 2e-3
"""Cells are enlarged up to this edge (m) so that big parts fit; beyond it walls are not resolved."""

DRAFT_FROM: Final = 1.2e-3
"""Cells of this edge and more are the draft setting (m)."""

MOST_CUBES: Final = 3_000_000
"""Sub-cubes of the box around a part, which the filling holds in memory at once (0.5 GB)."""

_EVEN: Final = (PortKind.STUD, PortKind.TUBE, PortKind.STOP)
"""Of these there are dozens on a plate, or they hold nothing: they do not count as connections."""

_GROWTH: Final = 1.25
_REMEMBERED: Final = 1024

_memory: OrderedDict[str, SuperElement | Refusal] = OrderedDict()

Progress = Callable[[int, int, str], None]
"""Called with how many parts are done, how many there are, and the title of the last one."""


@dataclass(frozen=True, slots=True, eq=False)
class _Request:
    """What a solid model is made from, and the hash of it all."""

    part_id: str
    title: str
    ports: tuple[Port, ...]
    made_of: Material
    settings: MeshSettings
    key: str


def frame_ports(definition: PartDefinition) -> tuple[Port, ...]:
    """Return the ports that get a frame: all but stops; of many studs and tubes, some spread evenly."""
    held = [port for port in definition.ports if port.kind is not PortKind.STOP]
    if len(held) <= MOST_FRAMES:
        return tuple(held)
    chosen = [k for k, p in enumerate(held) if p.kind not in _EVEN]
    at = np.array([port.position for port in held])
    if not chosen:
        chosen = [int(np.argmax(np.linalg.norm(at - at.mean(axis=0), axis=1)))]
    gap = np.linalg.norm(at[:, None] - at[chosen], axis=2).min(axis=1)
    while len(chosen) < MOST_FRAMES:
        far = int(np.argmax(gap))  # the one furthest from all chosen so far
        chosen.append(far)
        gap = np.minimum(gap, np.linalg.norm(at - at[far], axis=1))
    return tuple(held[k] for k in sorted(chosen))


@lru_cache(maxsize=_REMEMBERED)
def _request(definition: PartDefinition) -> _Request | Refusal:
    """Return what the model of a part is made from, or why there can be none."""
    drawing = definition.drawing
    if drawing is None:
        return Refusal("it has no drawing")
    if drawing.cell == 0.0:
        return Refusal("it moves inside, or meshing is turned off")
    if definition.fastener:
        return Refusal("a pin or small connector: its give is in the joints")
    holes = sum(port.kind not in _EVEN for port in definition.ports)
    if holes > MOST_PORTS:
        return Refusal(f"it has {holes} connections, more than the {MOST_PORTS} of a solid model")
    ports = frame_ports(definition)
    if len(ports) < 2:
        return Refusal("fewer than two connections to bend between")
    try:
        triangles = drawing.triangles()
    except InputError as fault:
        return Refusal(fault.message)
    if len(triangles) > MOST_TRIANGLES:
        return Refusal(f"its drawing has {len(triangles)} triangles, more than {MOST_TRIANGLES}")
    made_of = material_of(definition)
    settings = MeshSettings(cell=drawing.cell)
    facts = [
        VERSION,
        definition.id,
        [
            [port.name, str(port.kind), *_whole([*port.position, *port.axis, port.length])]
            for port in ports
        ],
        [made_of.young_pa, made_of.poisson, made_of.density],
        asdict(settings),
    ]
    digest = hashlib.sha256(json.dumps(facts).encode())
    digest.update(np.rint(np.asarray(triangles) * 1e8).astype("<i8").tobytes())
    return _Request(
        definition.id, definition.title, ports, made_of, settings, digest.hexdigest()[:32]
    )


def _whole(values: Sequence[float]) -> list[int]:
    """Return numbers in units of 1e-9, so that round-off does not change a hash."""
    return [int(value) for value in np.rint(np.asarray(values, dtype=float) * 1e9)]


def build_drawn(
    part_id: str,
    triangles: Array,
    ports: Sequence[Port],
    made_of: Material,
    settings: MeshSettings,
    key: str,
) -> SuperElement | Refusal:
    """Build the solid model of a surface, whatever its quality.

    Ports where the surface has no material get no frame; a joint there takes the nearest one.

    Parameters
    ----------
    part_id : str
    triangles : (n, 3, 3) ndarray
        (m)
    ports : sequence of Port
    made_of : Material
    settings : MeshSettings
    key : str
        Stored with the result.
    """
    from threadpoolctl import threadpool_limits

    from technic.fem.solid.condense import condense, factorized
    from technic.fem.solid.ports import frame_rows, sample_port

    try:
        with threadpool_limits(1):
            mesh = _fitting_mesh(triangles, settings)
            framed = []
            for port in ports:
                try:
                    frame_rows(mesh, port, sample_port(mesh, port))
                except InputError:
                    continue
                framed.append(port)
            if len(framed) < 2:
                return Refusal(
                    f"its drawing has material at {len(framed)} of its {len(ports)} connections"
                )
            return condense(part_id, factorized(mesh, made_of), framed, key=key)
    except (TechnicError, np.linalg.LinAlgError) as fault:
        return Refusal(fault.message if isinstance(fault, InputError) else str(fault))


def _fitting_mesh(triangles: Array, settings: MeshSettings) -> Mesh:
    """Mesh a surface with cells so large that time and memory stay within bounds.

    Raises
    ------
    InputError
        The part is too large, empty, or falls into pieces.
    """
    from dataclasses import replace

    from technic.fem.solid.grid import mesh_part

    draft = settings.cell >= DRAFT_FROM
    most = DRAFT_CELLS if draft else FINE_CELLS
    largest = max(DRAFT_LARGEST if draft else FINE_LARGEST, settings.cell)
    if len(triangles) == 0:
        raise InputError("its drawing has no surface")
    corners = triangles.reshape(-1, 3)
    size = np.ptp(corners, axis=0)
    cell = settings.cell
    while cell <= largest:
        cubes = float(np.prod(settings.divisions * (size / cell + 3.0)))
        if cubes <= MOST_CUBES * (1 if draft else 8):
            mesh = mesh_part(triangles, replace(settings, cell=cell))
            if len(mesh.cells) <= most:
                return mesh
        cell *= _GROWTH
    raise InputError("the part is too large for a solid model")


def _recalled(request: _Request) -> SuperElement | Refusal | None:
    """Return what is known of a request, from this run or an earlier one."""
    known = _memory.get(request.key)
    if known is None:
        known = recall(request.key, request.part_id)
        if known is not None:
            _keep(request.key, known)
    return known


def _keep(key: str, outcome: SuperElement | Refusal) -> None:
    _memory[key] = outcome
    while len(_memory) > _REMEMBERED:
        _memory.popitem(last=False)


def outcome_of(definition: PartDefinition) -> SuperElement | Refusal:
    """Return the solid model of a drawn part, built when it is not cached, or why there is none."""
    request = _request(definition)
    if isinstance(request, Refusal):
        return request
    known = _recalled(request)
    if known is None:
        known = build_drawn(*_arguments(definition, request))
        remember(request.key, request.part_id, known)
        _keep(request.key, known)
    return known


def solid_model(definition: PartDefinition) -> SuperElement | None:
    """Return the solid model of a part: the shipped one, else one of its drawing, else None."""
    shipped = load(definition)
    if shipped is not None or definition.drawing is None:
        return shipped
    made = outcome_of(definition)
    return None if isinstance(made, Refusal) else made


_Arguments = tuple[str, Array, tuple[Port, ...], Material, MeshSettings, str]


def _arguments(definition: PartDefinition, request: _Request) -> _Arguments:
    assert definition.drawing is not None  # a request was made from it
    return (
        request.part_id,
        np.asarray(definition.drawing.triangles()),
        request.ports,
        request.made_of,
        request.settings,
        request.key,
    )


def prepare(
    assembly: Assembly, *, jobs: int | None = None, progress: Progress | None = None
) -> tuple[int, int]:
    """Build the missing solid models of an assembly's library parts, in parallel processes.

    An analysis does this by itself, one part after the other; this is the quick way.

    Parameters
    ----------
    assembly : Assembly
    jobs : int, optional
        Processes; default: one for each processor (one for cells below `DRAFT_FROM`, which need
        gigabytes). More than one needs a program that can be imported (``if __name__ == "__main__"``).
    progress : callable, optional

    Returns
    -------
    built, cached : int
        Kinds of part that were meshed now, and that were there.
    """
    found: dict[str, tuple[PartDefinition, _Request]] = {}
    for part in assembly.parts:
        definition = part.definition
        if definition is None or definition.drawing is None:
            continue
        request = _request(definition)
        if isinstance(request, _Request) and load(definition) is None:
            found.setdefault(request.key, (definition, request))
    missing = [entry for entry in found.values() if _recalled(entry[1]) is None]
    draft = all(request.settings.cell >= DRAFT_FROM for _, request in missing)
    if missing and progress is not None:
        progress(0, len(missing), "")
    workers = min(jobs or ((os.cpu_count() or 1) if draft else 1), len(missing))
    if workers <= 1:
        for done, (definition, request) in enumerate(missing, 1):
            outcome_of(definition)
            if progress is not None:
                progress(done, len(missing), request.title)
    else:
        _build_in_parallel(missing, workers, progress)
    return len(missing), len(found) - len(missing)


def _build_in_parallel(
    missing: Sequence[tuple[PartDefinition, _Request]], workers: int, progress: Progress | None
) -> None:
    import multiprocessing
    from concurrent.futures import FIRST_COMPLETED, ProcessPoolExecutor, wait
    from concurrent.futures.process import BrokenProcessPool

    # a fork of a program with threads (pictures, BLAS) may hang
    context = multiprocessing.get_context("spawn")
    done = 0
    with ProcessPoolExecutor(workers, mp_context=context) as pool:
        waiting: dict[Future[SuperElement | Refusal], _Request] = {}

        def collect() -> None:
            nonlocal done
            finished, _ = wait(waiting, return_when=FIRST_COMPLETED)
            for future in finished:
                request = waiting.pop(future)
                try:
                    outcome = future.result()
                    remember(request.key, request.part_id, outcome)
                except BrokenProcessPool:
                    # not cached: it may go well where there is more memory
                    outcome = Refusal("meshing it was stopped, as for want of memory")
                _keep(request.key, outcome)
                done += 1
                if progress is not None:
                    progress(done, len(missing), request.title)

        # a few at a time: the triangles of hundreds of parts would fill the memory
        for definition, request in missing:
            while len(waiting) >= 2 * workers:
                collect()
            try:
                future = pool.submit(build_drawn, *_arguments(definition, request))
            except BrokenProcessPool:
                _keep(request.key, Refusal("meshing it was stopped, as for want of memory"))
                continue
            waiting[future] = request
        while waiting:
            collect()
