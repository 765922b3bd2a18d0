"""The checkpoint that `taichidem simulate` keeps of a single experiment."""

from __future__ import annotations

import warnings
from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import typer

from taichidem.errors import CheckpointWarning, InputError
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
        """Say on Ctrl-C what is kept, and end with 130 as shells expect; say also which checkpoint could not be written."""
        try:
            with _told_warnings():
                yield
        except KeyboardInterrupt as stop:
            there = self.checkpoint is not None and self.checkpoint.exists()
            kept = f" {self.checkpoint} is still there; the same command goes on from it." if there else ""
            typer.echo(str(stop) or f"Stopped; nothing more was written.{kept}", err=True)
            raise typer.Exit(130) from None

    def discard(self, experiment: Any, model: Any, seeds: list[int], frames: float | None) -> None:
        """Delete the checkpoint of a run whose results are all written."""
        if self.checkpoint is None:
            return
        from taichidem.experiments.together import discard_checkpoint

        count = len(seeds)
        discard_checkpoint(self.checkpoint, [experiment] * count, [model] * count, seeds, frames=frames)


@contextmanager
def _told_warnings() -> Iterator[None]:
    """Print warnings about checkpoints as notes, without a place in the program."""
    with warnings.catch_warnings():
        warnings.simplefilter("always", CheckpointWarning)  # the disk may be full a second time
        usual = warnings.showwarning

        def show(message: Warning | str, category: type[Warning], *details: Any, **named: Any) -> None:
            if issubclass(category, CheckpointWarning):
                typer.echo(f"Note: {message}", err=True)
            else:
                usual(message, category, *details, **named)

        warnings.showwarning = show
        yield
