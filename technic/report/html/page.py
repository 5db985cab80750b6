"""Put the page together: words, tables, the model, the viewer, and a policy that lets nothing else in."""

from __future__ import annotations

from pathlib import Path
from typing import Any

from technic.report.drawing import Drawing, drawing_of
from technic.report.files import write_bytes
from technic.report.html.pack import Block, pack
from technic.report.html.shell import embedded, render
from technic.report.html.stiffness_plot import stiffness_plots
from technic.report.html.tables import (
    SPOT_ROWS,
    finding_groups,
    model_words,
    motion_rows,
    plain_rows,
    spot_rows,
    stiffness_rows,
    unknown_rows,
)
from technic.report.pattern import describe_field
from technic.report.wording import count, number
from technic.report.worst_field import worst_field
from technic.rigidity.provenance import spots_sentence, table_sentences
from technic.rigidity.result import RigidityReport, Verdict
from technic.rigidity.sentences import import_effects
from technic.rigidity.serialize import size_mm

__all__ = ["TONES", "facts", "page", "write_page"]

TONES = {
    Verdict.RIGID: "good",
    Verdict.FLEXIBLE: "bad",
    Verdict.DISCONNECTED: "bad",
    Verdict.UNDETERMINED: "warn",
}


def facts(report: RigidityReport) -> list[tuple[str, str, str]]:
    """Return the numbers at the top: name, value, remark."""
    found: list[tuple[str, str, str]] = []
    rigidity = report.rigidity
    if rigidity is not None:
        sure = (
            "how sure: not known, the joints are not calibrated"
            if rigidity.interval_95 is None
            else "95 % interval: {} to {} N/m".format(*(number(v) for v in rigidity.interval_95))
        )
        found.append(("Rigidity, worst case", f"{number(rigidity.value)} N/m", sure))
        if rigidity.rigid_walls is not None:
            walls = f"{number(rigidity.rigid_walls)} N/m"
            found.append(("With rigid walls of bores", walls, "the truth lies between the two"))
        if rigidity.measure == "mean_square":
            found.append(
                (
                    "Softest way to push it",
                    f"{number(rigidity.compliance_mm_per_n)} mm",
                    "for 1 N (root mean square over the material)",
                )
            )
        if rigidity.frequency_hz is not None:
            found.append(
                (
                    "Lowest natural frequency",
                    f"{number(rigidity.frequency_hz)} Hz",
                    "as it swings after a tap",
                )
            )
    mobility = report.mobility
    said = [f"{mobility.spinning} spin", f"{mobility.sliding} slide", f"{mobility.idle} idle"]
    qualifier = f"{report.qualifier} " if report.qualifier else ""
    found.append(("Motions", f"{qualifier}{mobility.structural}", "and " + ", ".join(said)))
    size = " x ".join(number(value) for value in size_mm(report.assembly))
    parts = count(len(report.assembly.parts), "part")
    found.append(("Model", parts, f"{size} mm, {number(report.mass * 1e3)} g"))
    return found


def _softest(report: RigidityReport) -> str:
    field = worst_field(report)
    if field is None:
        return ""
    phrase = describe_field(field.points, field.displacements, field.weights)
    return f"Under its worst load {phrase}." if phrase else ""


def page(
    report: RigidityReport, *, picture: bytes | None = None, drawing: Drawing | None = None
) -> str:
    """Return the whole page.

    Parameters
    ----------
    report : RigidityReport
    picture : bytes, optional
        PNG of `technic.report.picture.report_scene`; without it the page prints the viewer's view.
    drawing : Drawing, optional
        Of the report's assembly, when it is there already.

    Returns
    -------
    str
        HTML that asks for nothing from outside.
    """
    contents: dict[str, Any] | None = None
    block = Block()
    if report.assembly.parts:
        drawing = drawing_of(report.assembly) if drawing is None else drawing
        contents = pack(report, drawing, block, spots=SPOT_ROWS)
    motions = [] if contents is None else contents["motions"]
    played = {entry["number"]: n for n, entry in enumerate(motions)}
    origin, plots = stiffness_plots(report)
    return render(
        "page.html.j2",
        contents,
        block.text(),
        title=f"{report.assembly.name}: {report.verdict.value}",
        name=report.assembly.name,
        tone=TONES[report.verdict],
        verdict=report.verdict.value,
        reason=report.reason,
        facts=facts(report),
        softest=_softest(report),
        moves=report.mobility.total > report.mobility.idle,
        picture=None if picture is None else embedded(picture),
        spots=spot_rows(report),
        spot_count=len(report.weak_spots),
        spots_sure=spots_sentence(report),
        table=table_sentences(report.assembly, report.table, report.part_models),
        motions=motion_rows(report, played),
        motion_count=len(report.motions) - sum(m.kind == "idle" for m in report.motions),
        idle=report.mobility.idle,
        unknown=unknown_rows(report),
        findings=finding_groups(report),
        stiffness=stiffness_rows(report),
        calibration=origin,
        plots=plots,
        plain=plain_rows(report),
        models=model_words(report),
        effects=list(import_effects(report.assembly, report.library_models)),
        not_modelled=report.not_modelled,
        rigidity=report.rigidity,
        mobility=report.mobility,
        source=report.assembly.source,
        joints=len(report.assembly.joints),
        unknowns=report.unknowns,
    )


def write_page(
    report: RigidityReport,
    path: Path,
    *,
    picture: bytes | None = None,
    drawing: Drawing | None = None,
) -> None:
    """Write `page` into a file.

    Raises
    ------
    UsageError
        When the file cannot be written.
    """
    write_bytes(path, page(report, picture=picture, drawing=drawing).encode("utf-8"))
