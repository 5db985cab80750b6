"""The file of condensed parts: built once with `build`, shipped, read lazily with `load`.

One zip archive, ``parts_library/super_elements.zip``. A member per part holds a line of JSON (ports,
hash, settings, figures of the condensation) and after it the numbers as float64, little-endian, the
lower triangles of stiffness and mass. float32 would turn the rigid motions into errors of 1e-4 of the
first elastic eigenvalue. Members are written with a fixed date, so that the same input gives the same
file.
"""

from __future__ import annotations

import functools
import hashlib
import io
import json
import zipfile
from collections.abc import Callable, Iterable, Mapping
from dataclasses import asdict, replace
from importlib.resources import files
from pathlib import Path
from typing import Any

import numpy as np

from technic.errors import InputError, TechnicError
from technic.fem.solid.settings import MeshSettings
from technic.fem.solid.superelement import SuperElement
from technic.parts.definition import Material, PartDefinition, Port, PortKind
from technic.parts.materials import material_of

__all__ = [
    "FILE",
    "build",
    "element_key",
    "fitting",
    "has_solid_model",
    "load",
    "material_of",
    "read",
    "read_shape",
    "shape_key",
    "solid_ports",
    "stored",
    "stored_shape",
    "write",
]

FILE = "super_elements.zip"
"""Name of the shipped file in `parts_library`."""

VERSION = 1
"""Raised when the method changes in a way that changes the matrices."""

ASSEMBLIES = (
    "differential",
    "hub",
    "linear-actuator",
    "motor",
    "sensor",
    "shock-absorber",
    "turntable",
    "universal-joint",
    "wheel-rim",
)
"""Families (by their beginning) without a solid model: inner motion, or a block of unknown inside."""

MOST_PORTS = 64
"""A base plate with 209 holes would take 12 MB, three times what all other parts need together."""

MOST_CELLS = 30_000
"""Cells of the largest mesh: a plain 7L has 4,500 and takes 0.7 GB, a frame 5 x 11 has 22,000 and takes
up to 4.6 GB; building has to stay within 6 GB."""

CUT_SHARE = 1.7
"""Cells per volume of a full cell, cut ones included (1.1 for bricks, 1.7 for thin walls)."""

LARGEST_CELL = 2e-3
"""Walls are 1.2 to 1.6 mm thick: larger cells would not resolve them (m)."""

_DATE = (2020, 1, 1, 0, 0, 0)

Progress = Callable[[str, str | None], None]
"""Called with the part's id and None, or the reason why it has no solid model."""


def solid_ports(definition: PartDefinition) -> tuple[Port, ...]:
    """Return the ports that get a frame.

    All but stops, which hold nothing by themselves, and studs and tubes: there are dozens of them on a
    brick, and with them the file would have 28 MB instead of 5. A joint at a stud takes the nearest
    frame.
    """
    left_out = (PortKind.STOP, PortKind.STUD, PortKind.TUBE)
    return tuple(port for port in definition.ports if port.kind not in left_out)


def has_solid_model(definition: PartDefinition) -> bool:
    """Return whether a part gets a super-element, as far as its definition tells.

    Parts need two frames to deform between; fasteners are rigid bodies or frame members (their
    compliance is in the joints); base plates have too many; assemblies with inner motion and
    electric units are no single solid.
    """
    return (
        not definition.fastener
        and 1 < len(solid_ports(definition)) <= MOST_PORTS
        and not definition.family.startswith(ASSEMBLIES)
    )


def fitting(settings: MeshSettings, volume: float) -> MeshSettings:
    """Return the settings with cells so much larger that a big part fits into memory.

    Raises
    ------
    InputError
        Even cells of `LARGEST_CELL` are too many.
    """
    cell = settings.cell
    while CUT_SHARE * volume / cell**3 > MOST_CELLS:
        cell *= 1.25
    if cell > max(LARGEST_CELL, settings.cell):
        raise InputError("the part is too large for a solid model")
    return settings if cell == settings.cell else replace(settings, cell=cell)


def _number(value: float) -> str:
    """Return a number so that round-off (1e-9 m) does not change a hash."""
    return f"{value:.9f}".replace("-0.000000000", "0.000000000")


def element_key(definition: PartDefinition, made_of: Material, settings: MeshSettings) -> str:
    """Return the hash of what a super-element is made from, as far as an analysis knows it.

    The shape's table takes part in `shape_key`, which only the builder and the tests compute: reading
    it needs the solid modeller.
    """
    facts = [
        VERSION,
        definition.id,
        [
            [port.name, str(port.kind), *map(_number, [*port.position, *port.axis, port.length])]
            for port in solid_ports(definition)
        ],
        [made_of.young_pa, made_of.poisson, made_of.density],
        asdict(settings),
    ]
    return hashlib.sha256(json.dumps(facts).encode()).hexdigest()[:32]


def shape_key(definition: PartDefinition) -> str:
    """Return the hash of a part's solid shape: its triangles to a hundredth of a millimetre."""
    from technic.parts.shapes import mesh

    corners = np.round(np.asarray(mesh(definition, "solid").triangles) * 1e5).astype(np.int64)
    rows = corners.reshape(-1, 9)
    return hashlib.sha256(np.unique(rows, axis=0).tobytes()).hexdigest()[:32]


def build(
    definitions: Iterable[PartDefinition],
    settings: MeshSettings | None = None,
    *,
    jobs: int = 1,
    progress: Progress | None = None,
) -> tuple[dict[str, SuperElement], dict[str, str]]:
    """Build the super-elements of parts, in parallel processes.

    Parameters
    ----------
    definitions : iterable of PartDefinition
        Parts without a solid model are left out, with the reason.
    settings : MeshSettings, optional
        Parts that would need more than `MOST_CELLS` get larger cells.
    jobs : int
        Processes; each uses one thread.
    progress : callable, optional

    Returns
    -------
    elements : dict
        By part id.
    failures : dict
        Reason by part id.
    """
    from concurrent.futures import ProcessPoolExecutor, as_completed

    chosen = settings or MeshSettings()
    work = list(definitions)
    elements: dict[str, SuperElement] = {}
    failures: dict[str, str] = {}

    def note(part: str, result: SuperElement | str) -> None:
        if isinstance(result, SuperElement):
            elements[part] = result
        else:
            failures[part] = result
        if progress is not None:
            progress(part, result if isinstance(result, str) else None)

    if jobs <= 1:
        for definition in work:
            note(definition.id, _build_one(definition, chosen))
    else:
        with ProcessPoolExecutor(jobs) as pool:
            waiting = {pool.submit(_build_one, item, chosen): item.id for item in work}
            for done in as_completed(waiting):
                note(waiting[done], done.result())
    return dict(sorted(elements.items())), dict(sorted(failures.items()))


def _build_one(definition: PartDefinition, settings: MeshSettings) -> SuperElement | str:
    """Return a super-element, or why there is none."""
    from threadpoolctl import threadpool_limits

    from technic.fem.solid.condense import build_super_element
    from technic.parts.shapes import has_shape, mesh

    if not has_shape(definition):
        return "no solid shape"
    if not has_solid_model(definition):
        return "no solid model by its definition"
    made_of = material_of(definition)
    key = element_key(definition, made_of, settings)
    try:
        surface = mesh(definition, "solid")
        with threadpool_limits(1):
            return build_super_element(
                definition.id,
                np.asarray(surface.triangles),
                solid_ports(definition),
                made_of,
                fitting(settings, float(surface.volume)),
                key=key,
            )
    except TechnicError as fault:
        return str(fault)


def _pack(element: SuperElement, extra: Mapping[str, Any]) -> bytes:
    """Return one member of the archive."""
    head = {
        "id": element.id,
        "ports": list(element.ports),
        "merged": [list(pair) for pair in element.merged],
        "key": element.key,
        "fineness": element.fineness,
        "condensation_error": element.condensation_error,
        "cell": element.cell,
        **extra,
    }
    lower = np.tril_indices(6 * len(element.ports))
    numbers = np.concatenate(
        [
            element.points.ravel(),
            element.centroid,
            element.stiffness[lower],
            element.mass[lower],
        ]
    )
    return json.dumps(head).encode() + b"\n" + numbers.astype("<f8").tobytes()


def _unpack(data: bytes) -> SuperElement:
    """Return the super-element of one member."""
    cut = data.index(b"\n")
    head = json.loads(data[:cut])
    numbers = np.frombuffer(data[cut + 1 :], dtype="<f8")
    count = len(head["ports"])
    size = 6 * count
    half = size * (size + 1) // 2
    points, centroid, k, m = np.split(numbers, np.cumsum([3 * count, 3, half]))
    lower = np.tril_indices(size)

    def whole(values: np.ndarray[Any, Any]) -> np.ndarray[Any, Any]:
        out = np.empty((size, size))
        out[lower] = values
        out[lower[1], lower[0]] = values
        return out

    return SuperElement(
        id=head["id"],
        ports=tuple(head["ports"]),
        points=points.reshape(count, 3),
        stiffness=whole(k),
        mass=whole(m),
        centroid=centroid,
        merged=tuple((a, b) for a, b in head["merged"]),
        condensation_error=head["condensation_error"],
        fineness=head["fineness"],
        cell=head["cell"],
        key=head["key"],
    )


def write(
    path: str | Path,
    elements: Mapping[str, SuperElement],
    *,
    shapes: Mapping[str, str] | None = None,
) -> None:
    """Write super-elements to one file.

    Parameters
    ----------
    path : path-like
    elements : mapping
        By part id.
    shapes : mapping, optional
        `shape_key` by part id.
    """
    with zipfile.ZipFile(path, "w") as archive:
        for part in sorted(elements):
            extra = {"shape": (shapes or {}).get(part, "")}
            member = zipfile.ZipInfo(part, date_time=_DATE)
            member.compress_type = zipfile.ZIP_DEFLATED
            archive.writestr(member, _pack(elements[part], extra))


def read(path: str | Path, part: str) -> SuperElement | None:
    """Return the super-element of a part from a file, None when it has none.

    Raises
    ------
    InputError
        The file is not an archive of super-elements.
    """
    try:
        with zipfile.ZipFile(path) as archive:
            return _unpack(archive.read(part)) if part in archive.namelist() else None
    except (zipfile.BadZipFile, ValueError, KeyError, OSError) as fault:
        raise InputError(f"not a file of super-elements: {fault}", path=path) from fault


def read_shape(path: str | Path, part: str) -> str:
    """Return the `shape_key` that a super-element in a file was built from.

    Raises
    ------
    InputError
        The file is not an archive of super-elements, or the part is not in it.
    """
    try:
        with zipfile.ZipFile(path) as archive, archive.open(part) as member:
            return str(json.loads(member.readline())["shape"])
    except (zipfile.BadZipFile, ValueError, KeyError, OSError) as fault:
        raise InputError(f"not a file of super-elements: {fault}", path=path) from fault


@functools.cache
def _archive() -> zipfile.ZipFile | None:
    """Return the shipped archive, opened once; None when it has not been built."""
    path = files("parts_library").joinpath(FILE)
    if not path.is_file():
        return None
    # In memory (a few MB): no handle stays open, and it works from a zipped package too.
    return zipfile.ZipFile(io.BytesIO(path.read_bytes()))


def stored() -> tuple[str, ...]:
    """Return the ids of the parts in the shipped file."""
    archive = _archive()
    return () if archive is None else tuple(archive.namelist())


def stored_shape(part: str) -> str:
    """Return the `shape_key` that a part's shipped super-element was built from, "" when it has none."""
    archive = _archive()
    if archive is None or part not in archive.NameToInfo:
        return ""
    with archive.open(part) as member:
        return str(json.loads(member.readline())["shape"])


@functools.lru_cache(maxsize=1024)
def _stored_element(part: str) -> SuperElement | None:
    archive = _archive()
    if archive is None or part not in archive.NameToInfo:
        return None
    return _unpack(archive.read(part))


def load(definition: PartDefinition, settings: MeshSettings | None = None) -> SuperElement | None:
    """Return the shipped super-element of a part.

    Parameters
    ----------
    definition : PartDefinition
    settings : MeshSettings, optional
        Those it must have been built with.

    Returns
    -------
    SuperElement or None
        None when there is none, or when the stored one was built from another definition (ports,
        material) or with other settings: it is then out of date and must be rebuilt.
    """
    element = _stored_element(definition.id)
    if element is None:
        return None
    key = element_key(definition, material_of(definition), settings or MeshSettings())
    return element if element.key == key else None
