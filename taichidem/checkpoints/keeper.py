"""Write checkpoints of an experiment's run on a schedule and on Ctrl-C, and take up the run where the last one stands."""

from __future__ import annotations

import signal
import threading
from collections.abc import Callable, Mapping
from pathlib import Path
from time import monotonic
from types import FrameType
from typing import Any

from taichidem.checkpoints.course import Course
from taichidem.checkpoints.file import check_writable, read_checkpoint, write_checkpoint
from taichidem.checkpoints.journal import Journal
from taichidem.errors import InputError

EVERY = 300.0  # [s] of wall time between two checkpoints


class Keeper:
    """Keeps one run in one file; used as a context, in which Ctrl-C writes a last checkpoint before it stops the run.

    Args:
        path: of the file; a run that is there already is taken up.
        every: wall time between two checkpoints [s].
        about: what is run, in plain values; a file about anything else is refused.

    Raises:
        InputError: a path that can't be written to, an interval below 0, or a file that doesn't fit.
    """

    def __init__(self, path: Path, every: float, about: Mapping[str, Any]) -> None:
        if not every >= 0:
            raise InputError(f"checkpoint_every is {every!r}; give the seconds between two checkpoints, from 0.")
        check_writable(path)
        self.path, self.every, self.about = path, every, about
        # A run is one course after another, one for each kind of grains. Those that ended are kept as they ended.
        self.states: list[dict[str, Any]] = read_checkpoint(path, "experiment", about) if path.exists() else []
        self.ended: list[Course] = []
        self.stopped = False
        self.written_at = monotonic()

    def __enter__(self) -> Keeper:
        self._before: Any = None
        if threading.current_thread() is threading.main_thread():  # no other may set what a signal does
            self._before = signal.signal(signal.SIGINT, self._stop)
        return self

    def __exit__(self, *_: object) -> None:
        if self._before is not None:
            signal.signal(signal.SIGINT, self._before)

    def _stop(self, number: int, frame: FrameType | None) -> None:
        """Ask for a stop at the end of a step, since a state in the middle of one is of no use; a second time, at once."""
        if self.stopped:
            raise KeyboardInterrupt(f"Stopped at once; {self.path} holds the last checkpoint, if one was written.")
        self.stopped = True

    def begin(self, course: Course) -> Callable[[], None]:
        """Prepare a course, take it up where its checkpoint stands, and return what to call between launches."""

        def between() -> None:
            self._between(course)

        for world in course.worlds:
            world.journal = Journal(world.rng)
        if len(self.ended) < len(self.states):
            course.take_up(self.states[len(self.ended)])
            course.simulation.run(0.0, between)  # to the end of the run in which the state was taken
        return between

    def _between(self, course: Course) -> None:
        if self.stopped or monotonic() - self.written_at >= self.every:
            self._write(course)
        if self.stopped:
            raise KeyboardInterrupt(f"Stopped. {self.path} holds how far it came; the same command goes on from there.")

    def end(self, course: Course) -> None:
        """Keep a course that has ended, for the checkpoints of those that follow."""
        self.ended.append(course)

    def _write(self, course: Course) -> None:
        states = [each.state() for each in (*self.ended, course)]
        write_checkpoint(self.path, "experiment", self.about, states)
        self.written_at = monotonic()

    def finished(self) -> None:
        """Delete the file, since its run has been measured."""
        self.path.unlink(missing_ok=True)
