"""Find the commands that a page shows, and hold them to what the command line knows."""

from __future__ import annotations

import re
import shlex

import typer

from taichidem.cli.application import app

FENCED = re.compile(r"^```[a-z]*\n(.*?)^```", re.S | re.M)
COMMAND = re.compile(r"^(?:\$ )?(taichidem .*?)(?:\s+#.*)?$", re.M)


def shown_commands(page: str) -> list[str]:
    """Return the lines of a page's blocks that call taichidem, without prompt and comment."""
    return [line for block in FENCED.findall(page) for line in COMMAND.findall(block)]


def check_command(line: str) -> None:
    """Read a line such as "taichidem --arch cuda compare my_study --seeds 4" as the command line would, and run nothing.

    Raises:
        AssertionError: an unknown command or option, a value that an option doesn't take, an argument that is missing.
    """
    program, *arguments = shlex.split(line)
    every = typer.main.get_command(app)
    for command in (every, *every.commands.values()):  # type: ignore[attr-defined]
        command.callback = None  # so that it is read only
    try:
        every.main(arguments, prog_name=program)
    except SystemExit as end:
        if end.code:
            raise AssertionError(f"{line!r} is refused; standard error says why.") from None
