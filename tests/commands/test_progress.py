"""The progress bar: on a terminal only, and on standard error only."""

from __future__ import annotations

import sys

from technic.commands.progress import progress_bar


def run():
    with progress_bar() as tell:
        for k in range(3):
            tell("forecast", k, 3)
        tell("prove", 1, 2)


def test_nothing_is_drawn_into_a_pipe(capsys):
    run()
    assert capsys.readouterr() == ("", "")


def test_stages_are_drawn_on_a_terminal(capsys, monkeypatch):
    monkeypatch.setattr(sys.stderr, "isatty", lambda: True)
    monkeypatch.setenv("FORCE_COLOR", "1")
    run()
    out, err = capsys.readouterr()
    assert out == ""
    assert "prove" in err
    assert "1/2" in err
