"""Models of 5 to 20 parts of several kinds: fine meshes against condensed ones, within 0.5 %.

The fine model has all unknowns of all meshes (130,000). Its lowest modes are found by inverse
iteration from the condensed ones: a load on a mesh is answered by its frames moving (`lift`) and by the
mesh moving under held frames (`inside`), so that no matrix of all meshes is ever needed.
"""

from __future__ import annotations

import logging
from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path

import numpy as np
import pytest
from scipy import linalg

from technic.assembly.model import Assembly, Part
from technic.fem.element import Element
from technic.fem.solid.condense import Solid, condense_and_lift, solid_of
from technic.fem.solid.ports import frame_rows, sample_port
from technic.fem.solid.settings import MeshSettings
from technic.fem.solid.store import load, solid_ports
from technic.fem.solid.superelement import SuperElement, rigid_motions
from technic.geometry import Array
from technic.ldraw.reader import load_ldraw
from technic.parts.definition import PartDefinition
from technic.parts.materials import material_of
from technic.parts.shapes import mesh
from technic.statics.solve import free_motions
from technic.system.assemble import System, assemble
from technic.system.part_models import element_from, element_of

LOG = logging.getLogger(__name__)

COARSE = MeshSettings(cell=1.6e-3)
MODES, SPARE, ROUNDS = 10, 4, 5

ALONG = "1 0 0 0 1 0 0 0 1"
ACROSS = "0 0 1 0 1 0 -1 0 0"
PIN = "0 1 0 1 0 0 0 0 1"


def crossed(layers: int) -> list[str]:
    """Return layers of two beams, 7L along and 9L across in turns, pinned where they cross."""
    lines: list[str] = []
    before: list[int] = []
    for layer in range(layers):
        own = []
        for line in ((-2, 2), (-1, 3))[layer // 2 % 2]:
            if layer % 2:
                lines.append(f"1 1 0 {-20 * layer} {20 * line} {ACROSS} 40490.dat")
            else:
                lines.append(f"1 4 {20 * line} {-20 * layer} 0 {ALONG} 32524.dat")
            own.append(line)
        for a in before:
            for b in own:
                x, z = (b, a) if layer % 2 == 0 else (a, b)
                lines.append(f"1 0 {20 * x} {10 - 20 * layer} {20 * z} {PIN} 2780.dat")
        before = own
    return lines


def three() -> list[str]:
    """Return three beams, two of them on two pins, the third on one: it turns."""
    return [
        f"1 4 0 0 0 {ALONG} 32316.dat",
        f"1 1 0 -20 0 {ALONG} 32316.dat",
        f"1 0 0 -10 -40 {PIN} 2780.dat",
        f"1 0 0 -10 40 {PIN} 2780.dat",
        f"1 1 0 20 40 {ALONG} 32523.dat",
        f"1 0 0 10 20 {PIN} 2780.dat",
    ]


@dataclass
class Fine:
    """The mesh of a kind of part, and how it follows its frames."""

    solid: Solid
    element: SuperElement
    lift: Array
    frames: Array
    spread: Array

    def inside(self, load: Array) -> Array:
        """Answer a load with the frames held."""
        held = self.solid.factor.solve(load - self.frames.T @ (self.spread @ load))
        return np.asarray(held - self.lift @ (self.frames @ held))


def fine_of(definition: PartDefinition) -> Fine:
    ports = solid_ports(definition)
    surface = np.asarray(mesh(definition, "solid").triangles)
    solid = solid_of(surface, material_of(definition), COARSE)
    element, lift = condense_and_lift(definition.id, solid, ports)
    assert not element.merged
    rows = [frame_rows(solid.mesh, p, sample_port(solid.mesh, p)).toarray() for p in ports]
    motion = rigid_motions(element.points, np.zeros(3))
    spread = motion @ np.linalg.inv(motion.T @ motion) @ solid.rigid.T
    return Fine(solid, element, lift, np.vstack(rows), spread)


def with_models(
    models: dict[str, Fine], *, every_port: bool
) -> Callable[[Part, Array, tuple[str | None, ...]], Element]:
    def element(part: Part, points: Array, ports: tuple[str | None, ...]) -> Element:
        fine = models.get(part.definition.id) if part.definition is not None else None
        if fine is None:
            return element_of(part, points, ports)
        if not every_port:
            return element_from(fine.element, part, points, ports)
        whole = fine.element
        extra = np.concatenate([points, whole.points])
        made = element_from(whole, part, extra, (*ports, *whole.ports))
        assert made.size == 6 * len(whole.ports)
        return made

    return element


def lowest(system: System, count: int) -> tuple[Array, Array, Array]:
    """Return eigenvalues and vectors above the free motions, and the free motions."""
    stiffness = (system.K + system.J).toarray()
    mass = system.mass_matrix.toarray()
    motions = free_motions(system).toarray()
    values, vectors = linalg.eigh(stiffness, mass)
    first = motions.shape[1]
    assert values[first] > 1e3 * abs(values[first - 1])
    return values[first : first + count], vectors[:, first : first + count], motions


def fine_modes(system: System, models: dict[str, Fine], start: Array, motions: Array) -> Array:
    """Return the lowest eigenvalues of the model with all meshes, from approximate modes."""
    parts, slices = (
        system.assembly.parts,
        [system.part_slice(k) for k in range(len(system.elements))],
    )
    kinds = [models.get(p.definition.id) if p.definition is not None else None for p in parts]
    scale = []
    for part, kind in zip(parts, kinds, strict=True):
        own = 1.0 if kind is None else float(kind.element.mass[::6, ::6].sum())
        scale.append(part.mass_properties.mass / own if kind is not None else 1.0)

    def spread(x: Array) -> list[Array]:
        return [x[s] if f is None else f.lift @ x[s] for f, s in zip(kinds, slices, strict=True)]

    def weigh(fields: list[Array]) -> list[Array]:
        return [
            e.mass @ x if f is None else c * f.solid.apply_mass(np.ascontiguousarray(x))
            for e, f, c, x in zip(system.elements, kinds, scale, fields, strict=True)
        ]

    def dot(a: list[Array], b: list[Array]) -> Array:
        return np.asarray(sum(x.T @ y for x, y in zip(a, b, strict=True)))

    stiffness = (system.K + system.J).toarray()
    basis, _ = np.linalg.qr(motions)
    grounded = linalg.lu_factor(stiffness + 1e3 * basis @ basis.T)
    rigid = spread(motions)
    heavy = weigh(rigid)
    gram = dot(rigid, heavy)
    fields, values = spread(start), np.zeros(start.shape[1])
    for _ in range(ROUNDS):
        loads = weigh(fields)
        on_frames = np.zeros((system.size, start.shape[1]))
        for f, s, force in zip(kinds, slices, loads, strict=True):
            on_frames[s] = force if f is None else f.lift.T @ force
        moved = spread(linalg.lu_solve(grounded, on_frames))
        answers = [
            m if f is None else m + f.inside(force)
            for f, m, force in zip(kinds, moved, loads, strict=True)
        ]
        drift = np.linalg.solve(gram, dot(heavy, answers))
        answers = [y - r @ drift for y, r in zip(answers, rigid, strict=True)]
        energy, inertia = dot(answers, loads), dot(answers, weigh(answers))
        values, turn = linalg.eigh((energy + energy.T) / 2.0, (inertia + inertia.T) / 2.0)
        fields = [y @ turn for y in answers]
    return values


@pytest.mark.slow
@pytest.mark.parametrize(("lines", "count"), [(three(), 6), (crossed(4), 20)])
def test_condensed_model_has_the_modes_of_its_fine_meshes(
    lines: list[str], count: int, tmp_path: Path
) -> None:
    path = tmp_path / "model.ldr"
    path.write_text("\n".join(["0 Model", *lines]) + "\n")
    assembly: Assembly = load_ldraw(path)
    assert len(assembly.parts) == count
    models: dict[str, Fine] = {}
    for part in assembly.parts:
        kind = part.definition
        if kind is not None and kind.id not in models and load(kind) is not None:
            models[kind.id] = fine_of(kind)
    whole = assemble(assembly, element=with_models(models, every_port=True))
    values, modes, motions = lowest(whole, MODES + SPARE)
    exact = fine_modes(whole, models, modes, motions)[:MODES]
    unknowns = sum(
        len(models[p.definition.id].lift) if p.definition and p.definition.id in models else 6
        for p in assembly.parts
    )
    LOG.info("%d parts, %d unknowns in all meshes", count, unknowns)
    LOG.info("all ports, condensed / fine - 1: %s", values[:MODES] / exact - 1.0)
    assert values[:MODES] == pytest.approx(exact, rel=5e-3)
    assert np.all(values[:MODES] > exact * (1.0 - 1e-6))

    # as an analysis does: ports that neither carry a joint nor are needed for the mass are left out
    used = assemble(assembly, element=with_models(models, every_port=False))
    assert used.size < whole.size
    fewer, _, _ = lowest(used, MODES)
    LOG.info("%d of %d unknowns: %s", used.size, whole.size, fewer / exact - 1.0)
    assert fewer == pytest.approx(exact, rel=5e-3)
