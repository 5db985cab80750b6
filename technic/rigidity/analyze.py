"""The analysis: mobility, motions, worst-case rigidity, weak spots."""

from __future__ import annotations

from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import dataclass, replace
from time import perf_counter
from typing import Literal

import numpy as np
from numpy.typing import NDArray
from scipy import sparse

from technic.assembly.model import Assembly, FindingKind
from technic.assembly.stiffness import StiffnessTable
from technic.errors import UsageError
from technic.geometry import Array
from technic.rigidity.eigen import elastic_modes
from technic.rigidity.exact import lattice_rows, modular_rank
from technic.rigidity.kinematics import (
    ComponentMotions,
    Kinematics,
    component_motions,
    kinematics,
)
from technic.rigidity.motions import SortedMotions, sort_motions
from technic.rigidity.replica import PaperBars, paper_elements, paper_joints
from technic.rigidity.result import (
    Component,
    Mobility,
    Mode,
    MotionKind,
    Rigidity,
    RigidityReport,
    Verdict,
)
from technic.rigidity.sentences import motion_sentence, not_modelled, reason
from technic.rigidity.stability import Pencil, stability
from technic.rigidity.uncertainty import rigidity_interval
from technic.rigidity.worst_case import mode_of, node_fields, rigid_parts, weak_spots
from technic.system.assemble import System, assemble
from technic.system.inverse import single_thread
from technic.system.library_models import library_models
from technic.system.part_models import FACTORIES, PartModel, models_of, plain_parts
from technic.system.port_walls import PortWalls, rigid_walls
from technic.tolerances import MAIN_COMPONENT_SHARE, MOBILITY_GAP

__all__ = ["FACTORIES", "Measure", "PartModel", "analyze"]

Measure = Literal["mean_square", "nodal"]


@dataclass(frozen=True, slots=True, eq=False)
class _Body:
    """One component on its way through the analysis."""

    motions: ComponentMotions
    sorted: SortedMotions
    mobility: Mobility
    verdict: Verdict


def analyze(
    assembly: Assembly,
    *,
    measure: Measure = "mean_square",
    modes: int = 6,
    parts: PartModel | PaperBars = "solid",
    port_walls: PortWalls = "mean",
    table: StiffnessTable | None = None,
) -> RigidityReport:
    """Tell how rigid an assembly is.

    Parameters
    ----------
    assembly : Assembly
    measure : {"mean_square", "nodal"}
        What rigidity is measured against: the mean square displacement over the material (N/m,
        independent of the mesh), or the unweighted node displacements of the paper.
    modes : int
        Elastic modes of the heaviest component.
    parts : {"solid", "frame", "rigid"} or PaperBars
        What parts are made of: condensed solid models where they are shipped (elsewhere frame
        members, or rigid bodies where a part has none), frame members, or rigid bodies.
        `technic.rigidity.replica.PaperBars`, with the nodal measure, gives the paper's own numbers:
        strips of springs without units, joined rigidly.
    port_walls : {"mean", "rigid"}
        "rigid": also find the rigidity with bores that keep their shape, the upper bound. Their
        matrices are built when first needed (seconds for each kind of part) and kept in the cache.
    table : StiffnessTable, optional
        Where the joints' stiffnesses came from; when some of them were measured, the rigidity gets a
        95 % interval.

    Returns
    -------
    RigidityReport

    Raises
    ------
    UsageError
        Rigid walls are asked for parts that are not solid models, or the paper's bars for anything but
        a two-dimensional linkage of straight bars.
    NumericalError
        The eigenvalue step failed.
    """
    if port_walls == "rigid" and parts != "solid":
        raise UsageError("rigid port walls are for solid models of parts (parts: solid)")
    kind = "paper" if isinstance(parts, PaperBars) else parts
    timings: dict[str, float] = {}
    # small decompositions by the hundred: a second thread makes them seven times slower
    with _timed(timings, "mobility"), single_thread():
        kin = kinematics(assembly)
        bodies = [_body(kin, c) for c in range(len(kin.components))]
    with _timed(timings, "assemble"):
        system = _system(assembly, parts)
    with _timed(timings, "eigen"):
        pencils = [_pencil(system, kin, body.motions, measure) for body in bodies]
        found = [
            _elastic(system, body.motions, pencil, measure, modes if c == 0 else 1, shown=c == 0)
            for c, (body, pencil) in enumerate(zip(bodies, pencils, strict=True))
        ]
    if found:
        found[0] = (_with_interval(system, *found[0], table), found[0][1])
    if found and port_walls == "rigid":
        with _timed(timings, "rigid_walls"):
            stiffer = assemble(assembly, element=rigid_walls(assembly))
            first_body = bodies[0].motions
            walls = _pencil(stiffer, kin, first_body, measure)
            upper, _ = _elastic(stiffer, first_body, walls, measure, 1, shown=True)
        if found[0][0] is not None and upper is not None:
            found[0] = (replace(found[0][0], rigid_walls=upper.value), found[0][1])
    with _timed(timings, "weak_spots"):
        main_modes = found[0][1] if found else ()
        first = main_modes[0].unknowns if main_modes else None
        spots = weak_spots(system, first) if first is not None else ()
        fields = node_fields(system, first) if first is not None else ({}, {})
        stable = stability(system, pencils[0], main_modes, spots, table) if main_modes else None
    motions = tuple(
        replace(m, sentence=motion_sentence(assembly, m))
        for kind in MotionKind
        for b in bodies
        for m in b.sorted.motions
        if m.kind is kind
    )
    mobility = _sum([b.mobility for b in bodies])
    verdict = _verdict(assembly, kin, bodies)
    return RigidityReport(
        assembly=assembly,
        verdict=verdict,
        reason=reason(assembly, kin.components, verdict, mobility),
        mobility=mobility,
        motions=motions,
        rigidity=found[0][0] if found else None,
        modes=tuple(main_modes),
        weak_spots=spots,
        components=tuple(
            Component(
                parts=b.motions.parts,
                mass=sum(assembly.parts[p].mass_properties.mass for p in b.motions.parts),
                verdict=b.verdict,
                mobility=b.mobility,
                rigidity=rigidity,
            )
            for b, (rigidity, _) in zip(bodies, found, strict=True)
        ),
        unknowns=system.size,
        part_models=models_of(assembly, kind),
        plain_parts=plain_parts(assembly, kind),
        library_models=library_models(assembly, kind),
        mass=system.mass,
        qualifier=_qualifier(assembly),
        not_modelled=not_modelled(assembly),
        timings=timings,
        table=table,
        stability=stable,
        node_points=fields[0],
        node_displacements=fields[1],
    )


def _system(assembly: Assembly, parts: PartModel | PaperBars) -> System:
    if isinstance(parts, PaperBars):
        return assemble(paper_joints(assembly), element=paper_elements(assembly, parts))
    return assemble(assembly, element=FACTORIES[parts])


def _body(kin: Kinematics, component: int) -> _Body:
    motions = component_motions(kin, component)
    kinds = sort_motions(kin, motions, component)
    mobility = Mobility(
        structural=kinds.structural,
        spinning=kinds.spinning,
        sliding=kinds.sliding,
        idle=kinds.idle,
        proof=_proof(kin, motions, component),
        smallest_kept=motions.smallest_kept,
        largest_dropped=motions.largest_dropped,
    )
    if motions.smallest_kept < MOBILITY_GAP * motions.largest_dropped:
        verdict = Verdict.UNDETERMINED
    else:
        verdict = Verdict.FLEXIBLE if mobility.structural else Verdict.RIGID
    return _Body(motions, kinds, mobility, verdict)


def _proof(kin: Kinematics, motions: ComponentMotions, component: int) -> str:
    """Return "exact" when the rank modulo a prime is as high as the numerical one."""
    if kin.assembly.dimension == 2:
        return "numerical"
    rows = lattice_rows(kin, kin.links_of(component))
    if rows is None:
        return "numerical"
    rank = 6 * len(motions.parts) - motions.twists.shape[1]
    return "exact" if modular_rank(rows) == rank else "numerical"


def _pencil(system: System, kin: Kinematics, motions: ComponentMotions, measure: Measure) -> Pencil:
    """Return the eigenproblem of one component."""
    parts = list(motions.parts)
    component = kin.component_of[parts[0]]
    if len(kin.components) == 1:
        own, columns = np.arange(system.size), np.arange(6 * len(parts))
    else:
        own = np.concatenate([np.arange(system.offsets[p], system.offsets[p + 1]) for p in parts])
        columns = (6 * np.array(parts)[:, None] + np.arange(6)).ravel()
    rows = kin.link_component[system.rows.link] == component
    elastic = rows & system.elastic
    a = _part_of(system.A, np.flatnonzero(elastic), own)
    joints = a.T @ sparse.diags_array(system.rows.stiffness[elastic]) @ a
    mass = sum(system.assembly.parts[p].mass_properties.mass for p in parts)
    full = system.mass_matrix if measure == "mean_square" else system.nodal()
    scale = sparse.diags_array(np.tile(kin.units, len(parts)))
    return Pencil(
        own=own,
        stiffness=sparse.csr_array(_part_of(system.K, own, own) + joints),
        measure=_part_of(full, own, own) / (mass if measure == "mean_square" else 1.0),
        constraints=_part_of(system.A, np.flatnonzero(rows & ~system.elastic), own),
        motions=sparse.csc_array(_part_of(system.R, own, columns) @ (scale @ motions.twists)),
        mass=float(mass),
    )


def _part_of(
    matrix: sparse.csr_array, rows: NDArray[np.int64], columns: NDArray[np.int64]
) -> sparse.csr_array:
    """Return some rows and columns, both ascending; the matrix itself when they are all."""
    if len(rows) < matrix.shape[0]:
        matrix = matrix[rows]
    if len(columns) < matrix.shape[1]:
        matrix = matrix[:, columns]
    return sparse.csr_array(matrix)


def _elastic(
    system: System,
    motions: ComponentMotions,
    pencil: Pencil,
    measure: Measure,
    count: int,
    *,
    shown: bool,
) -> tuple[Rigidity | None, tuple[Mode, ...]]:
    """Return the rigidity and the lowest modes of one component."""
    if len(motions.parts) == 1 and not shown:
        return None, ()  # a loose part: it says nothing about the model
    pairs = elastic_modes(
        pencil.stiffness, pencil.measure, pencil.constraints, pencil.motions, count
    )
    if not len(pairs.values):
        return None, ()
    value = float(pairs.values[0])
    frequency = (
        float(np.sqrt(value / pencil.mass) / (2 * np.pi)) if measure == "mean_square" else None
    )
    rigidity = Rigidity(value, frequency, measure, float(pairs.residuals[0]))
    if not shown:
        return rigidity, ()
    out = []
    inertia = rigid_parts(system)
    for k in range(len(pairs.values)):
        unknowns: Array = np.zeros(system.size)
        unknowns[pencil.own] = pairs.vectors[:, k]
        out.append(mode_of(system, inertia, float(pairs.values[k]), unknowns, measure))
    return rigidity, tuple(out)


def _with_interval(
    system: System,
    rigidity: Rigidity | None,
    modes: tuple[Mode, ...],
    table: StiffnessTable | None,
) -> Rigidity | None:
    if rigidity is None or table is None or not modes:
        return rigidity
    found = rigidity_interval(system, modes[0].unknowns, rigidity.value, table)
    if found is None:
        return rigidity
    return replace(rigidity, interval_95=found[0], log_slopes=found[1])


def _verdict(assembly: Assembly, kin: Kinematics, bodies: list[_Body]) -> Verdict:
    structure = [not p.fastener for p in assembly.parts]
    total = sum(structure)
    biggest = max((sum(structure[p] for p in c) for c in kin.components), default=0)
    if total and biggest < MAIN_COMPONENT_SHARE * total:
        return Verdict.DISCONNECTED
    verdicts = {b.verdict for b in bodies}
    for verdict in (Verdict.UNDETERMINED, Verdict.FLEXIBLE):
        if verdict in verdicts:
            return verdict
    return Verdict.RIGID


def _sum(parts: list[Mobility]) -> Mobility:
    return Mobility(
        structural=sum(m.structural for m in parts),
        spinning=sum(m.spinning for m in parts),
        sliding=sum(m.sliding for m in parts),
        idle=sum(m.idle for m in parts),
        proof="exact" if parts and all(m.proof == "exact" for m in parts) else "numerical",
        smallest_kept=min((m.smallest_kept for m in parts), default=float("inf")),
        largest_dropped=max((m.largest_dropped for m in parts), default=0.0),
    )


def _qualifier(assembly: Assembly) -> str:
    """Unknown parts may hold what seems to move, and may move themselves: then a count is a bound."""
    if assembly.unknown:
        return "at most"
    if any(f.kind is FindingKind.OFF_GRID for f in assembly.findings):
        return "at least"
    # A motor or actuator that is taken as one body, because it holds its position, can let go.
    if any(f.kind is FindingKind.INNER and len(f.parts) == 1 for f in assembly.findings):
        return "at least"
    return ""


@contextmanager
def _timed(timings: dict[str, float], name: str) -> Iterator[None]:
    start = perf_counter()
    yield
    timings[name] = perf_counter() - start
