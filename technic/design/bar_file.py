"""An assembly file with new bars: the file as it is, with rows added."""

from __future__ import annotations

import json
import os
from collections.abc import Sequence
from pathlib import Path
from typing import Any

from technic.design.bar_answer import BarSuggestion
from technic.errors import UsageError

__all__ = ["with_bars", "write_with_bars"]


def with_bars(data: dict[str, Any], chosen: Sequence[BarSuggestion]) -> dict[str, Any]:
    """Return the content of an assembly file with new bars and their joints at the end.

    Parameters
    ----------
    data : mapping
        Content of the file.
    chosen : sequence of BarSuggestion
    """
    out = dict(data)
    out["parts"] = [*data["parts"], *(s.rows[0] for s in chosen)]
    out["joints"] = [*data.get("joints", []), *(row for s in chosen for row in s.rows[1:])]
    return out


def write_with_bars(path: str | Path, target: str | Path, chosen: Sequence[BarSuggestion]) -> None:
    """Write an assembly file with new bars.

    Parameters
    ----------
    path : path
        The file that the model was read from.
    target : path

    Raises
    ------
    UsageError
        The target is the model itself, or cannot be written.
    """
    path, target = Path(path), Path(target)
    if target.resolve() == path.resolve():
        raise UsageError("the reinforced model must not replace the model: name another file")
    data = with_bars(json.loads(path.read_text(encoding="utf-8-sig")), chosen)
    for row in data["parts"]:
        if "file" in row["shape"]:  # meshes are named from where the file stands
            file = os.path.relpath(path.parent / row["shape"]["file"], target.parent)
            row["shape"] = {**row["shape"], "file": file}
    try:
        target.write_text(json.dumps(data, indent=1) + "\n", encoding="utf-8")
    except OSError as error:
        raise UsageError(f"{target} cannot be written: {error.strerror}") from error
