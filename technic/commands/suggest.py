"""`technic suggest`: which real beam helps most, where it goes, and what it brings."""

from __future__ import annotations

import sys
from collections import Counter
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Literal

import typer

from technic.commands.options import (
    AS_FOUND,
    JsonOption,
    ModelOptions,
    PartModelOption,
    PictureOption,
    QuietOption,
    ReportOption,
)
from technic.commands.progress import progress_bar
from technic.commands.reading import model_options, reading
from technic.commands.solids import make_solids
from technic.commands.suggest_bars import BarWishes, box_in, parts_between, suggest_for_linkage
from technic.errors import MissingDependency, UsageError

if TYPE_CHECKING:
    from technic.assembly.model import Assembly
    from technic.design.apply import Change
    from technic.design.filters import Filters
    from technic.design.suggest import Suggestion, Suggestions

__all__ = ["suggest"]


@dataclass(frozen=True, slots=True)
class _Wishes:
    """Filters as they were typed."""

    between: tuple[str, str] | None
    box: tuple[float, float, float, float, float, float] | None
    lengths: str | None
    straight: bool
    also: str | None
    snug: float
    inventory: Path | None
    max_parts: int | None
    keep_out: tuple[str, ...]


def _filters(assembly: Assembly, wishes: _Wishes) -> Filters:
    from technic.assembly.select import find_part
    from technic.design.filters import Filters
    from technic.report.parts_list import read_inventory
    from technic.units import LDU, MM

    also = [word.strip() for word in (wishes.also or "").split(",") if word.strip()]
    if unknown := sorted(set(also) - {"thin", "frames"}):
        raise UsageError(f"--also takes thin and frames, not {unknown[0]!r}")
    inventory = None
    if wishes.inventory is not None:
        try:
            inventory = read_inventory(wishes.inventory)
        except OSError as error:
            raise UsageError(f"{wishes.inventory} cannot be read: {error.strerror}") from error
    return Filters(
        between=parts_between(assembly, wishes.between),
        box=box_in(wishes.box, LDU),
        lengths=_lengths(wishes.lengths),
        bent=not wishes.straight,
        thin="thin" in also,
        frames="frames" in also,
        snug=wishes.snug * MM,
        inventory=inventory,
        max_parts=wishes.max_parts,
        keep_out=frozenset(find_part(assembly, text) for text in wishes.keep_out),
    )


def _refuse(given: Mapping[str, object], why: str) -> None:
    """Refuse options that say nothing about this kind of model."""
    for name, value in given.items():
        if value:
            raise UsageError(f"{name} is {why}")


def _lengths(text: str | None) -> tuple[int, ...] | None:
    if text is None:
        return None
    try:
        return tuple(int(word) for word in text.split(","))
    except ValueError as error:
        raise UsageError(f"--lengths is a list of numbers such as 5,7,9, not {text!r}") from error


def _taken(answers: Sequence[Suggestions], rank: int, *, sequence: bool) -> list[Suggestion]:
    """Return the suggestions that ``--apply RANK`` means: one alternative, or a sequence up to it."""
    every = [s for a in answers for s in (a.suggestions[:1] if sequence else a.suggestions)]
    if not 1 <= rank <= len(every):
        raise UsageError(f"there is no suggestion {rank}; there are {len(every)}")
    return every[:rank] if sequence else [every[rank - 1]]


def _changes(chosen: Sequence[Suggestion], *, pair: bool) -> list[Change]:
    """Return what to write, twins included when they are asked for."""
    changes = [suggestion.change for suggestion in chosen]
    if pair:
        if len(chosen) != 1 or chosen[0].pair is None:
            raise UsageError("--pair needs a suggestion that has a twin to be built beside it")
        changes.append(chosen[0].pair.change)
    return changes


def _draw(
    answers: Sequence[Suggestions], chosen: Sequence[Suggestion], picture: Path, *, pair: bool
) -> None:
    """Draw the model before and after what is applied, or after the best suggestion."""
    from technic.report.render import Painter
    from technic.report.suggest_picture import before_after_scene

    last = chosen[-1] if chosen else None
    for answer in answers if last is None else ():
        last = answer.suggestions[0] if answer.suggestions else last
    if last is None:
        raise UsageError("there is no suggestion to draw")
    after = last.pair.report if pair and last.pair is not None else last.report
    painter = Painter()
    try:
        painter.draw(before_after_scene(answers[0].before, after), picture)
    finally:
        painter.close()


def _page(answers: Sequence[Suggestions], path: Path, *, sequence: bool) -> None:
    """Write the page with before and after, its picture left out on a machine that cannot draw."""
    from technic.report.comparison import comparison_scene
    from technic.report.html.suggestions import write_suggestions_page
    from technic.report.render import Painter

    if not answers:
        raise UsageError("no page was written: the model is as rigid as demanded")
    taken = [answer.suggestions[0] for answer in answers if answer.suggestions]
    picture = None
    if taken:
        reports = [answers[0].before, taken[-1].report]
        painter = Painter()
        try:
            picture = painter.picture(comparison_scene(reports, ["before", "after"]))
        except MissingDependency as error:
            typer.echo(f"technic: the page is without a picture: {error}", err=True)
        finally:
            painter.close()
    write_suggestions_page(answers, path, sequence=sequence, picture=picture)


@model_options
def suggest(
    model: Annotated[
        Path,
        typer.Argument(metavar="MODEL", help="LDraw file (.ldr, .mpd) or assembly file (.json)."),
    ],
    json: JsonOption = None,
    top: Annotated[
        int, typer.Option("--top", min=1, max=100, metavar="N", help="How many alternatives.")
    ] = 5,
    count: Annotated[
        int | None,
        typer.Option(
            "--count", min=1, max=100, metavar="K", help="Add beams one after another, at most K."
        ),
    ] = None,
    target: Annotated[
        float | None,
        typer.Option(
            "--target", min=0.0, metavar="N/m", help="Add beams until the model is this rigid."
        ),
    ] = None,
    between: Annotated[
        tuple[str, str] | None,
        typer.Option("--between", metavar="A B", help="Only beams that tie these two parts."),
    ] = None,
    box: Annotated[
        tuple[float, float, float, float, float, float] | None,
        typer.Option(
            "--box",
            metavar="X Y Z X Y Z",
            help="Only inside this box (LDU; mm for assembly files).",
        ),
    ] = None,
    lengths: Annotated[
        str | None,
        typer.Option("--lengths", metavar="5,7,...", help="Only straight beams of these lengths."),
    ] = None,
    straight: Annotated[bool, typer.Option("--straight", help="No bent beams.")] = False,
    also: Annotated[
        str | None,
        typer.Option("--also", metavar="thin,frames", help="Thin beams, frames as well."),
    ] = None,
    snug: Annotated[
        float,
        typer.Option(
            "--snug", min=0.0, max=0.3, metavar="MM", help="Also where holes miss by this much."
        ),
    ] = 0.0,
    shortest: Annotated[
        float,
        typer.Option("--shortest", min=0.0, metavar="MM", help="Assembly files: shortest bar."),
    ] = 0.0,
    longest: Annotated[
        float | None,
        typer.Option("--longest", min=0.0, metavar="MM", help="Assembly files: longest bar."),
    ] = None,
    inventory: Annotated[
        Path | None,
        typer.Option("--inventory", metavar="CSV", help="Only parts of this list (part,count)."),
    ] = None,
    max_parts: Annotated[
        int | None,
        typer.Option("--max-parts", min=1, metavar="N", help="Most new parts of one, pins too."),
    ] = None,
    keep_out: Annotated[
        list[str] | None,
        typer.Option("--keep-out", metavar="PART", help="Tie nothing to it. May be repeated."),
    ] = None,
    rank: Annotated[
        Literal["ritz", "paper"],
        typer.Option("--rank", help="ritz: modes of the model; paper: its projection heuristic."),
    ] = "ritz",
    shortlist: Annotated[
        int,
        typer.Option(
            "--shortlist", min=1, max=1000, metavar="N", help="How many to look at closely."
        ),
    ] = 50,
    apply: Annotated[
        int | None,
        typer.Option("--apply", min=1, metavar="RANK", help="Write the model with this one."),
    ] = None,
    out: Annotated[
        Path | None, typer.Option("--out", metavar="FILE", help="Where --apply writes.")
    ] = None,
    picture: PictureOption = None,
    report: ReportOption = None,
    parts_list: Annotated[
        Path | None,
        typer.Option(
            "--parts-list", metavar="FILE", help="Write FILE.xml (BrickLink wanted list), FILE.csv."
        ),
    ] = None,
    color: Annotated[
        int, typer.Option("--color", min=0, metavar="CODE", help="LDraw colour of new parts.")
    ] = 25,
    pair: Annotated[
        bool, typer.Option("--pair", help="With --apply: write it and its twin on the other side.")
    ] = False,
    parts: PartModelOption = "solid",
    how: ModelOptions = AS_FOUND,
    quiet: QuietOption = False,
) -> None:
    """Say which real beam (for a linkage: which new bar) makes a model more rigid, and write it."""
    from technic.design.apply import write_reinforced
    from technic.design.filters import needs
    from technic.design.reinforce import reinforce
    from technic.design.suggest import suggest as find
    from technic.loading import load
    from technic.report.files import check_writable
    from technic.report.json import STDOUT, write_json
    from technic.report.parts_list import write_parts_list

    if (apply is None) != (out is None):
        raise UsageError("--apply RANK and --out FILE go together")
    for path in (
        out,
        picture,
        report,
        parts_list,
        Path(json) if json not in (None, STDOUT) else None,
    ):
        if path is not None:
            check_writable(path)
    if model.suffix.lower() == ".json":
        options = reading(model, how)  # refuses what says nothing about an assembly file
        lego = {
            "--lengths": lengths,
            "--straight": straight,
            "--also": also,
            "--snug": snug,
            "--inventory": inventory,
            "--max-parts": max_parts,
            "--parts-list": parts_list,
            "--pair": pair,
            "--report": report,
        }
        _refuse(lego, "for LDraw models; an assembly file gets new bars")
        suggest_for_linkage(
            model,
            options,
            BarWishes(
                between=between,
                box=box,
                shortest=shortest,
                longest=longest,
                keep_out=tuple(keep_out or ()),
                top=top,
                count=count,
                target=target,
                rank=rank,
                apply=apply,
                out=out,
                picture=picture,
                json=json,
                quiet=quiet,
            ),
        )
        return
    _refuse({"--shortest": shortest, "--longest": longest}, "for assembly files; see --lengths")
    options = reading(model, how)
    assembly = load(model, **options)
    make_solids(assembly, "solid", quiet=quiet)
    wishes = _Wishes(
        between, box, lengths, straight, also, snug, inventory, max_parts, tuple(keep_out or ())
    )
    filters = _filters(assembly, wishes)
    sequence = count is not None or target is not None
    with progress_bar(shown=not quiet) as tell:
        if sequence:
            answers = reinforce(
                assembly,
                steps=count or 100,
                target=target,
                filters=filters,
                shortlist=shortlist,
                rank=rank,
                color=color,
                parts=parts,
                progress=tell,
            )
        else:
            answers = [
                find(
                    assembly,
                    count=top,
                    shortlist=shortlist,
                    rank=rank,
                    filters=filters,
                    color=color,
                    parts=parts,
                    progress=tell,
                )
            ]
    chosen = _taken(answers, apply, sequence=sequence) if apply is not None else []
    if json is not None:
        from technic.report.suggest_json import suggestions_dict

        write_json(suggestions_dict(answers, sequence=sequence), json)
    if not quiet and json != STDOUT:
        from technic.report.style import style_for
        from technic.report.suggest_text import alternatives_text, sequence_text

        style = style_for(sys.stdout)
        text = sequence_text(answers, style) if sequence else alternatives_text(answers[0], style)
        sys.stdout.write(text)
        sys.stdout.flush()
    if out is not None:
        write_reinforced(model, out, assembly, _changes(chosen, pair=pair))
    if picture is not None:
        _draw(answers, chosen, picture, pair=pair)
    if report is not None:
        _page(answers, report, sequence=sequence)
    if parts_list is not None:
        every = [s for a in answers for s in (a.suggestions if sequence else a.suggestions[:1])]
        total: Counter[str] = Counter()
        for suggestion in chosen or every:
            total.update(needs(suggestion.candidate))
        write_parts_list(parts_list, total)
