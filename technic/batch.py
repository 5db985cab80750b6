"""Many models, one after another or side by side; what goes wrong with one says nothing about the others.

Every model gets a process of its own: one that crashes, runs out of memory or out of time is reported
as failed, and the rest goes on.
"""

from __future__ import annotations

import multiprocessing
from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass
from multiprocessing.connection import Connection, wait
from multiprocessing.context import BaseContext
from multiprocessing.process import BaseProcess
from pathlib import Path
from time import perf_counter
from typing import Any, Final, cast

from technic.errors import InputError, NumericalError, TechnicError
from technic.loading import READERS

__all__ = ["Outcome", "analyze_many", "find_models"]

Options = Callable[[Path], dict[str, Any]]
"""Options of the reader for a file; must be picklable, since another process calls it."""

_ASSEMBLY: Final = '"technic-assembly/'
"""What tells an assembly file from other JSON files in a directory."""


@dataclass(frozen=True, slots=True, eq=False)
class Outcome:
    """What became of one model.

    Parameters
    ----------
    path : Path
    report : dict or None
        The report, as `RigidityReport.to_dict` gives it; None if there is none.
    error : str
        Why there is none; empty otherwise.
    exit_code : int
        Of the error, as `technic analyze` would end; 0 without one.
    seconds : float
        Wall time.
    """

    path: Path
    report: dict[str, Any] | None
    error: str
    exit_code: int
    seconds: float


@dataclass(frozen=True, slots=True, eq=False)
class _Running:
    process: BaseProcess
    connection: Connection
    number: int
    began: float


def find_models(places: Sequence[Path]) -> list[Path]:
    """Return the model files at some places: files as they are, directories searched to their depths.

    In directories LDraw models (``.ldr``, ``.mpd``, ``.io``) and assembly files count; ``.dat`` files are
    parts there. Files that are found twice are listed once.

    Raises
    ------
    InputError
        A place does not exist, or there is no model in any of them.
    """
    found: dict[Path, None] = {}
    for place in places:
        if place.is_dir():
            found |= dict.fromkeys(path for path in _files(place, set()) if _is_model(path))
        elif place.exists():
            found[place] = None
        else:
            raise InputError("no such file", path=place, remedy="Check the spelling of the path.")
    if not found:
        raise InputError(
            "no model in it",
            path=places[0] if places else None,
            remedy="Name model files (.ldr, .mpd, .io, .json) or directories that contain some.",
        )
    return list(found)


def _files(folder: Path, seen: set[Path]) -> Iterator[Path]:
    """Yield the files below a folder in order; links to folders are followed, each folder once."""
    real = folder.resolve()
    if real in seen:
        return
    seen.add(real)
    try:
        inside = sorted(folder.iterdir())
    except OSError as error:
        raise InputError(f"cannot be read: {error.strerror}", path=folder) from error
    for path in inside:
        if path.is_dir():
            yield from _files(path, seen)
        elif path.is_file():
            yield path


def _is_model(path: Path) -> bool:
    suffix = path.suffix.lower()
    if suffix != ".json":
        return suffix in READERS and suffix != ".dat"
    try:
        return _ASSEMBLY in path.read_text(encoding="utf-8")
    except (OSError, UnicodeDecodeError):
        return False


def analyze_many(
    paths: Sequence[Path],
    options: Options | None = None,
    *,
    jobs: int = 1,
    max_seconds: float = float("inf"),
    **analysis: Any,
) -> Iterator[Outcome]:
    """Analyse models side by side; yield what became of them in the order given.

    Parameters
    ----------
    paths : sequence of Path
    options : callable, optional
        Gives the reader's options for a path.
    jobs : int
        How many at a time.
    max_seconds : float
        A model that takes longer is given up.
    **analysis
        Passed on to `technic.analyze`, such as ``modes=1``.

    Yields
    ------
    Outcome
    """
    context = _context()
    waiting = list(range(len(paths)))[::-1]
    running: dict[Connection, _Running] = {}
    done: dict[int, Outcome] = {}
    told = 0
    try:
        while told < len(paths):
            while waiting and len(running) < max(1, jobs):
                number = waiting.pop()
                one = _begin(context, paths[number], number, options, analysis)
                running[one.connection] = one
            latest = min((one.began + max_seconds for one in running.values()), default=0.0)
            pause = None if latest == float("inf") else max(0.0, latest - perf_counter())
            ready = set(wait(list(running), pause))
            now = perf_counter()
            for connection, one in list(running.items()):
                late = now - one.began > max_seconds
                if connection in ready or late:
                    done[one.number] = _end(
                        one, paths[one.number], given_up=connection not in ready
                    )
                    del running[connection]
            while told in done:
                yield done.pop(told)
                told += 1
    finally:
        for one in running.values():
            one.process.kill()
            one.process.join()


def _context() -> BaseContext:
    """Return how processes begin: forked from a clean one where that exists, else started anew.

    A clean process has no threads of numerical libraries that a fork would tear apart.
    """
    if "forkserver" not in multiprocessing.get_all_start_methods():
        return multiprocessing.get_context("spawn")
    context = multiprocessing.get_context("forkserver")
    context.set_forkserver_preload([__name__, "technic.rigidity.analyze", "technic.ldraw.reader"])
    return context


def _begin(
    context: BaseContext,
    path: Path,
    number: int,
    options: Options | None,
    analysis: dict[str, Any],
) -> _Running:
    ours, theirs = context.Pipe(duplex=False)
    process = cast(Any, context).Process(target=_work, args=(theirs, path, options, analysis))
    process.start()
    theirs.close()  # so that the end of the process is the end of the pipe
    return _Running(process, ours, number, perf_counter())


def _end(one: _Running, path: Path, *, given_up: bool) -> Outcome:
    seconds = perf_counter() - one.began
    code = NumericalError.exit_code
    if given_up:
        one.process.kill()
        one.process.join()
        return Outcome(path, None, f"given up after {seconds:.0f} s", code, seconds)
    try:
        report, error, failed = one.connection.recv()
    except EOFError:
        one.process.join()
        said = f"its process ended with code {one.process.exitcode}: out of memory, or a crash"
        return Outcome(path, None, said, code, seconds)
    finally:
        one.connection.close()
    one.process.join()
    return Outcome(path, report, error, failed, seconds)


def _work(
    connection: Connection, path: Path, options: Options | None, analysis: dict[str, Any]
) -> None:
    """Analyse one model in a process of its own and send what came out."""
    from technic.loading import load
    from technic.rigidity.analyze import analyze
    from technic.system.inverse import single_thread

    try:
        with single_thread():  # the models share the machine; their matrices are small
            assembly = load(path, **({} if options is None else options(path)))
            report = analyze(assembly, **analysis).to_dict()
    except TechnicError as error:
        connection.send((None, str(error), error.exit_code))
    else:
        connection.send((report, "", 0))
    finally:
        connection.close()
