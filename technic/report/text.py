"""The report as a builder reads it on a terminal."""

from __future__ import annotations

from collections import Counter
from math import inf

import numpy as np

from technic.assembly.model import FindingKind
from technic.report.bodies import moving_groups
from technic.report.pattern import describe_field
from technic.report.phrases import FINDING_WORDS, merged_stiffness, motion_words
from technic.report.style import Style
from technic.report.wording import (
    count,
    direction_of,
    direction_words,
    number,
    part_name,
    part_names,
    place,
    spot_words,
)
from technic.report.worst_field import worst_field
from technic.rigidity.provenance import spots_sentence, table_sentences, verdict_sentence
from technic.rigidity.result import MotionKind, RigidityReport, Verdict
from technic.rigidity.sentences import import_effects
from technic.rigidity.serialize import joint_stiffness, size_mm, spot_place
from technic.units import MM

__all__ = ["to_text"]

_STRUCTURAL_SHOWN = 8
_HARMLESS_SHOWN = 5
_SPOTS_SHOWN = 5
_FINDINGS_SHOWN = 3
"""Longer lists are in the JSON report; a person acts on the first few."""

_PUSHED = 0.5
"""Parts that go at least this share of the furthest way are named in the softest direction."""

_PUSHED_SHOWN = 2

_VERDICTS = {
    Verdict.RIGID: ("good", "RIGID"),
    Verdict.FLEXIBLE: ("bad", "FLEXIBLE"),
    Verdict.DISCONNECTED: ("bad", "DISCONNECTED"),
    Verdict.UNDETERMINED: ("warn", "UNDETERMINED"),
}


def _more(n: int) -> str:
    return f"and {n} more, see --json"


def _headline(report: RigidityReport, style: Style) -> list[str]:
    assembly = report.assembly
    size = " x ".join(number(value) for value in size_mm(assembly))
    title = (
        f"{assembly.name}: {count(len(assembly.parts), 'part')}, "
        f"{count(len(assembly.joints), 'joint')}, {size} mm, {number(report.mass * 1e3)} g"
    )
    kind, word = _VERDICTS[report.verdict]
    lines = [style("bold", title), "", style(kind, word)]
    if report.reason:
        lines += style.wrap(report.reason)
    return lines


def _sizes(sizes: list[int]) -> str:
    """Return how many parts some groups have, in words."""
    if len(sizes) == 1:
        return count(sizes[0], "part")
    if max(sizes) == 1:
        return "a single part each"
    shown = ", ".join(str(n) for n in sizes[:6])
    return f"{shown}{', ...' if len(sizes) > 6 else ''} parts"


def _bodies(report: RigidityReport, style: Style) -> list[str]:
    lines: list[str] = []
    for c, component in enumerate(report.components[:1]):
        main, *others = moving_groups(report, c)
        whole = "Main body" if len(component.parts) > 1 else "The only part"
        said = f"{whole}: {count(len(main), 'part')}, rigid."
        if component.verdict is Verdict.UNDETERMINED:
            said = f"{whole}: {count(len(main), 'part')}."
        if others:
            said += (
                f" {count(len(others), 'other group')} can move against it "
                f"({_sizes([len(group) for group in others])})."
            )
        lines += style.wrap(said)
    rest = report.components[1:]
    if rest:
        parts = sum(len(component.parts) for component in rest)
        lines += style.wrap(
            f"{count(parts, 'part')} in {count(len(rest), 'separate piece')} not joined to it"
            + (f", the largest: {part_names(report.assembly, rest[0].parts)}." if parts else ".")
        )
    return lines


def _motions(report: RigidityReport, style: Style) -> list[str]:
    by_kind = {
        kind: [motion for motion in report.motions if motion.kind is kind] for kind in MotionKind
    }
    mobility, qualifier = report.mobility, f"{report.qualifier} " if report.qualifier else ""
    lines: list[str] = []
    structural = by_kind[MotionKind.STRUCTURAL]
    if mobility.structural:
        lines += [
            "",
            style("bold", f"What moves: {qualifier}{count(mobility.structural, 'motion')}"),
        ]
        for n, motion in enumerate(structural[:_STRUCTURAL_SHOWN], 1):
            lines += style.wrap(motion_words(report, motion), f" {n:2d}. ", "     ")
        if len(structural) > _STRUCTURAL_SHOWN:
            lines.append("     " + _more(len(structural) - _STRUCTURAL_SHOWN))
        lines += style.wrap(
            "Look at the first one: close it and count again. The usual cause is a part held by one "
            "pin only, or a frame of four sides without a diagonal."
        )
    for kind, word, total in (
        (MotionKind.SPINNING, "Spinning freely", mobility.spinning),
        (MotionKind.SLIDING, "Sliding", mobility.sliding),
    ):
        motions = by_kind[kind]
        if not total:
            continue
        lines += ["", style("bold", f"{word}: {total}")]
        for motion in motions[:_HARMLESS_SHOWN]:
            lines += style.wrap(motion_words(report, motion), "   - ", "     ")
        if len(motions) > _HARMLESS_SHOWN:
            lines.append("     " + _more(len(motions) - _HARMLESS_SHOWN))
    if mobility.idle:
        idle = count(mobility.idle, "pin or other fastener turns", "pins and other fasteners turn")
        lines += ["", f"{idle} in place: harmless."]
    return lines


def _softest(report: RigidityReport, style: Style) -> list[str]:
    field = worst_field(report)
    if field is None:
        return []
    assembly = report.assembly
    lines = [
        "",
        style("bold", "Softest direction (where parts go, and where the worst load pushes)"),
    ]
    phrase = describe_field(field.points, field.displacements, field.weights)
    if phrase:
        lines += style.wrap(f"   {phrase[0].upper()}{phrase[1:]}.")
    members = report.components[0].parts
    frames = [k for k in members if not assembly.parts[k].fastener] or list(members)
    way = {k: move for k in frames if (move := field.furthest(k)) is not None}
    size = {k: float(np.linalg.norm(move)) for k, move in way.items()}
    furthest = max(size.values(), default=0.0)
    sides: dict[tuple[int, int], list[int]] = {}
    for k in sorted(size, key=lambda k: (-round(size[k] / (furthest or 1.0), 6), k)):
        if furthest > 0.0 and size[k] >= _PUSHED * furthest:
            sides.setdefault(direction_of(way[k]), []).append(k)
    for side, parts in sides.items():
        names = [
            f"{part_name(assembly.parts[k], line=True)} {number(size[k] / MM)} mm"
            for k in parts[:_PUSHED_SHOWN]
        ]
        rest = len(parts) - _PUSHED_SHOWN
        lines += style.wrap(
            ", ".join(names) + (f" and {rest} more" if rest > 0 else ""),
            f"   {direction_words(assembly)[side]}: ",
            "        ",
        )
    return lines


def _rigidity(report: RigidityReport, style: Style) -> list[str]:
    rigidity = report.rigidity
    if rigidity is None:
        return ["", "No rigidity is given: the model has no elastic part or joint to deform."]
    value = style("number", f"{number(rigidity.value)} N/m")
    lines = ["", f"{style('bold', 'Rigidity')}  {value} (worst case)"]
    if rigidity.measure == "nodal":
        lines += style.wrap(
            "The paper's measure: energy per squared sum of node displacements. It depends on how "
            "finely the parts are divided; compare it only with values found the same way.",
            "   ",
        )
    else:
        lines.append(
            "   The softest way to push this model: 1 N moves it "
            f"{number(rigidity.compliance_mm_per_n)} mm."
        )
    if rigidity.frequency_hz is not None:
        lines.append(f"   Lowest natural frequency: {number(rigidity.frequency_hz)} Hz.")
    if rigidity.interval_95 is None:
        lines.append("   How sure: not known, the joints' stiffnesses are not calibrated.")
    else:
        low, high = rigidity.interval_95
        lines.append(
            f"   How sure: the measured joints alone leave {number(low)} to {number(high)} N/m "
            "with 95 % confidence."
        )
        lines += style.wrap(verdict_sentence(report), "   ")
    if rigidity.rigid_walls is not None:
        lines += style.wrap(
            f"Bores give as the mean over their wall; if they kept their shape it would be "
            f"{number(rigidity.rigid_walls)} N/m: the truth lies between.",
            "   ",
        )
    if report.mobility.total > report.mobility.idle:
        lines += style.wrap(
            "The motions above cost nothing; this number is for what bends once they stand still.",
            "   ",
        )
    return lines + _softest(report, style)


def _weak_spots(report: RigidityReport, style: Style) -> list[str]:
    if not report.weak_spots:
        return []
    assembly = report.assembly
    shown = report.weak_spots[:_SPOTS_SHOWN]
    lines = ["", style("bold", "Weakest spots (share of the strain energy of the softest way)")]
    for spot in shown:
        where = spot_place(assembly, spot)
        # without a file the place is the id, which the words have already
        stands = "" if where.source is None and not where.name else f"; {place(where)}"
        lines += style.wrap(
            f"{spot_words(assembly, spot)}{stands}",
            f" {spot.rank:2d}. {100.0 * spot.energy_share:4.1f} %  ",
            "             ",
        )
    rest = len(report.weak_spots) - len(shown)
    if rest:
        share = 100.0 * sum(spot.energy_share for spot in report.weak_spots[len(shown) :])
        lines.append(f"     {share:4.1f} %  in {rest} more, see --json")
    lines += style.wrap(said, "   ") if (said := spots_sentence(report)) else []
    return lines


def _unknown(report: RigidityReport, style: Style) -> list[str]:
    unknown = report.assembly.unknown
    if not unknown:
        return []
    total = sum(entry.count for entry in unknown)
    lines = ["", style("warn", f"Not understood, left out of the analysis: {count(total, 'part')}")]
    for entry in sorted(unknown, key=lambda entry: (-entry.count, entry.number)):
        where = ", ".join(str(line) for line in entry.lines[:6])
        dots = ", ..." if len(entry.lines) > 6 else ""
        word = "line" if len(entry.lines) == 1 else "lines"
        lines += style.wrap(
            f"{entry.count} x {entry.number}: {entry.reason}; {word} {where}{dots}", "   ", "      "
        )
    return lines


def _imported(report: RigidityReport, style: Style) -> list[str]:
    imported = report.assembly.imported
    effects = import_effects(report.assembly, report.library_models)
    if imported is None or not effects:
        return []
    read = sum(part.count for part in imported.from_library)
    unknown = sum(part.count for part in report.assembly.unknown)
    lines = ["", style("bold", "Where the parts come from")]
    lines.append(f"   {imported.catalogue} known, {read} from the parts library, {unknown} unknown")
    if imported.library:
        release = f" (release {imported.release})" if imported.release else ""
        shadow = f", connectors also from {imported.shadow}" if imported.shadow else ""
        lines += style.wrap(f"library: {imported.library}{release}{shadow}", "   ", "      ")
    for sentence in effects:
        lines += style.wrap(sentence, "   - ", "     ")
    return lines


def _findings(report: RigidityReport, style: Style) -> list[str]:
    findings = report.assembly.findings
    if not findings:
        return []
    numbers = Counter(finding.kind for finding in findings)
    lines = ["", style("bold", "Found while reading")]
    for kind in FindingKind:
        if not numbers[kind]:
            continue
        singular, plural = FINDING_WORDS[kind]
        lines.append(f"   {count(numbers[kind], singular, plural)}")
        if kind is FindingKind.OPEN_PORT:
            continue  # most open ends are meant to be open: only counted
        found = [finding for finding in findings if finding.kind is kind]
        for finding in found[:_FINDINGS_SHOWN]:
            lines += style.wrap(finding.message, "     - ", "       ")
        if len(found) > _FINDINGS_SHOWN:
            lines.append("       " + _more(len(found) - _FINDINGS_SHOWN))
    return lines


_UNITS = {"n_per_m": "N/m", "nm_per_rad": "N m/rad"}


def _assumptions(report: RigidityReport, style: Style) -> list[str]:
    lines: list[str] = []
    if report.not_modelled:
        lines += ["", style("bold", "Not modelled")]
        for item in report.not_modelled:
            lines += style.wrap(item, "   - ", "     ")
    entries = merged_stiffness(joint_stiffness(report.assembly))
    if entries:
        lines += ["", style("bold", "Joints and where their stiffness comes from")]
        for said_of_it in table_sentences(report.assembly, report.table, report.part_models):
            lines += style.wrap(said_of_it, "   ", "      ")
    for (name, kind, source), (total, values) in entries.items():
        said = []
        for key, numbers in values.items():
            motion, _, unit = key.partition("_")
            low, high = min(numbers), max(numbers)
            amount = number(low) if low == high else f"{number(low)} to {number(high)}"
            said.append(f"{motion} rigid" if low == inf else f"{motion} {amount} {_UNITS[unit]}")
        lines += style.wrap(
            f"{total} x {name} ({kind}): {', '.join(said)}; source: {source}", "   ", "      "
        )
    return lines


def to_text(report: RigidityReport, style: Style | None = None) -> str:
    """Return the report in the builders' language, with a final newline.

    Parameters
    ----------
    report : RigidityReport
    style : Style, optional
        Colours and width; plain text of 100 columns when left out.
    """
    style = Style() if style is None else style
    lines: list[str] = []
    for section in (
        _headline,
        _bodies,
        _motions,
        _rigidity,
        _weak_spots,
        _unknown,
        _imported,
        _findings,
        _assumptions,
    ):
        lines += section(report, style)
    return "\n".join(lines) + "\n"
