"""`technic paper`: the systems of the paper, analyzed, beside what the paper prints."""

from __future__ import annotations

import sys

from technic.commands.options import JsonOption

__all__ = ["paper"]


def paper(json: JsonOption = None) -> None:
    """Analyze every system of the paper and print the table beside the paper's."""
    from technic.report.json import STDOUT, write_json
    from technic.report.paper_table import paper_table, to_dict, to_text

    table = paper_table()
    if json is not None:
        write_json(to_dict(table), json)
    if json != STDOUT:
        sys.stdout.write(to_text(table))
