"""JSON objects to a file or to standard output."""

from __future__ import annotations

import json
import sys
from collections.abc import Mapping
from pathlib import Path
from typing import Any

from technic.report.files import write_atomic

__all__ = ["STDOUT", "dumps", "write_json"]

STDOUT = "-"
"""Path that means standard output."""


def dumps(content: Mapping[str, Any]) -> str:
    """Return JSON text with a final newline.

    Raises
    ------
    ValueError
        When a number is infinite or not a number: JSON has none.
    """
    return json.dumps(content, indent=1, ensure_ascii=False, allow_nan=False) + "\n"


def write_json(content: Mapping[str, Any], target: str) -> None:
    """Write an object to the file `target`, or to standard output when it is ``-``.

    Raises
    ------
    UsageError
        When the file cannot be written.
    """
    text = dumps(content)
    if target == STDOUT:
        sys.stdout.write(text)
        sys.stdout.flush()
        return
    write_atomic(Path(target), lambda path: _write_text(path, text))


def _write_text(path: Path, text: str) -> None:
    path.write_text(text, encoding="utf-8")
