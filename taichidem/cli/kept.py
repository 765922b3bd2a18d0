"""The checkpoint that `taichidem simulate` keeps of a single experiment."""

from __future__ import annotations

from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import typer

from taichidem.errors import InputError
from taichidem.units import to_si


@dataclass(frozen=True)
class Kept:
    """Where and how often the state is kept.

    Args:
        checkpoint: file of the checkpoint, or None.
        every: wall time between two checkpoints as typed, such as "5 min"; the usual one where None.
    """

    checkpoint: Path | None = None
    every: str | None = None

    def options(self) -> dict[str, Any]:
        """Return the options of the command line and what they were given."""
        return {"--checkpoint": self.checkpoint, "--checkpoint-every": self.every}

    def arguments(self) -> dict[str, Any]:
        """Return what `Experiment.run` is told.

        Raises:
            InputError: an interval without a file, or one that is no time from 0.
        """
        if self.checkpoint is None:
            if self.every is not None:
                raise InputError("--checkpoint-every is of use with --checkpoint alone. Give a file, or leave it out.")
            return {}
        if self.every is None:
            return {"checkpoint": self.checkpoint}
        seconds = to_si(self.every, "s", "--checkpoint-every")
        if seconds < 0:
            raise InputError(f"--checkpoint-every is {self.every!r}; give a time from 0, such as '5 min'.")
        return {"checkpoint": self.checkpoint, "checkpoint_every": seconds}

    @contextmanager
    def told_when_stopped(self) -> Iterator[None]:
        """Say on Ctrl-C what is kept, and end with 130 as shells expect."""
        try:
            yield
        except KeyboardInterrupt as stop:
            typer.echo(str(stop) or "Stopped; nothing more was written.", err=True)
            raise typer.Exit(130) from None
