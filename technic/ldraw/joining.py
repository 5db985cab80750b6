"""From parts in their places to an assembly with its joints: connectors, gears, a user's corrections.

The order matters. Parts to ignore go first, because they take holes. Corrections come before the
findings, which speak of the joints as they are in the end. Teeth hold only what hangs together by
other joints, so they come last.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

from technic.assembly.model import Assembly, Finding, FindingKind, Joining, Joint, Part
from technic.assembly.overrides import apply_overrides, by_user
from technic.assembly.stiffness import default_table
from technic.ldraw.connect import Links, findings_of, link
from technic.ldraw.gears import CONNECTION, coupled, find_meshes, mesh_findings, mesh_joints
from technic.ldraw.seats import tyre_findings

__all__ = ["INSIDE", "join", "rejoin"]

INSIDE = "inside/"
"""How the connections of joints inside one divided part begin (`technic.ldraw.inner`)."""


def join(assembly: Assembly, joining: Joining, *, again: bool = False) -> Assembly:
    """Return the assembly with the joints that its parts make with each other.

    Parameters
    ----------
    assembly : Assembly
        With the joints inside of divided parts only; its findings are kept.
    joining : Joining
    again : bool
        The corrections were checked when the model was read: what no longer applies is passed over.

    Raises
    ------
    SchemaError
        The corrections have faults.
    """
    found: list[Links] = []
    everything = replace(assembly, joining=joining)

    def linked(bare: Assembly) -> Assembly:
        found.append(link(bare.parts, joining.table, axle_slide=joining.axle_slide))
        teeth = mesh_joints(bare.parts, find_meshes(bare.parts), joining.table)
        return replace(bare, joints=(*found[-1].joints, *bare.joints, *teeth))

    if joining.corrections is not None:
        changed = apply_overrides(
            everything, joining.corrections, joining.corrected_by, join=linked, lenient=again
        )
    else:
        changed = linked(everything)
    joints = tuple(joint for joint in changed.joints if joint.connection != CONNECTION)
    left = {joint.parts for joint in changed.joints if joint.connection == CONNECTION}
    meshes = [mesh for mesh in find_meshes(changed.parts) if mesh.parts in left]
    holding = coupled(changed.joints) if joining.gears == "on" else None
    return replace(
        changed,
        joints=(*joints, *(holding or ())),
        findings=(
            *changed.findings,
            *_unsettled(findings_of(found[-1], joints), joints),
            *tyre_findings(changed.parts),
            *mesh_findings(changed.parts, meshes, holding),
        ),
    )


def rejoin(assembly: Assembly, parts: Sequence[Part]) -> Assembly:
    """Return the assembly with other parts, joined as its own were.

    Joints inside of divided parts stay; a user's corrections are made again where they still apply.

    Parameters
    ----------
    assembly : Assembly
        Read from a model file.
    parts : sequence of Part
        Some of its parts, by id, and new ones.
    """
    place = {part.id: k for k, part in enumerate(parts)}
    inside = []
    for joint in assembly.joints:
        ends = tuple(place.get(assembly.parts[k].id, -1) for k in joint.parts)
        if joint.connection.startswith(INSIDE) and min(ends) >= 0:
            inside.append(replace(joint, parts=(ends[0], ends[1])))
    bare = replace(assembly, parts=tuple(parts), joints=tuple(inside), findings=(), supports=())
    return join(bare, assembly.joining or Joining(default_table()), again=True)


def _unsettled(findings: Sequence[Finding], joints: Sequence[Joint]) -> list[Finding]:
    """Return the findings without gaps between parts that the user joined himself."""
    settled = {frozenset(joint.parts) for joint in joints if by_user(joint)}
    gaps = (FindingKind.NEAR_MISS, FindingKind.NO_PIN)
    return [f for f in findings if f.kind not in gaps or frozenset(f.parts) not in settled]
