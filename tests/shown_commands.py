"""Hold commands that a page shows to what the command line knows."""

from __future__ import annotations

import shlex

from typer.testing import CliRunner

from taichidem.cli.application import app


def check_command(line: str) -> None:
    """Fail unless a line such as "taichidem compare my_study --seeds 4" names a command and options of it."""
    _, name, *arguments = shlex.split(line)
    shown = CliRunner().invoke(app, [name, "--help"], env={"COLUMNS": "200"})
    assert shown.exit_code == 0, shown.output
    for option in (argument for argument in arguments if argument.startswith("-")):
        assert option in shown.output, option
