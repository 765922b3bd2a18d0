"""Write checkpoints of an experiment's run on a schedule and on Ctrl-C, and take up the run where the last one stands."""

from __future__ import annotations

import signal
import threading
import warnings
from collections.abc import Callable, Mapping
from pathlib import Path
from time import monotonic
from types import FrameType
from typing import Any

from taichidem.checkpoints.course import Course
from taichidem.checkpoints.file import check_writable, may_be_replaced, read_checkpoint, write_checkpoint
from taichidem.checkpoints.journal import Journal
from taichidem.errors import CheckpointWarning, InputError

EVERY = 300.0  # [s] of wall time between two checkpoints
CONTENT = "experiment"  # as checkpoint files call it


class Keeper:
    """Keeps one run in one file; used as a context, in which Ctrl-C writes a last checkpoint before it stops the run.

    A checkpoint that can't be written, since the disk is full or another run has taken the name, is told once and tried again
    at the next time: neither the run nor the older file is hurt. Only on Ctrl-C it is an error.

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
        self.states: list[dict[str, Any]] = read_checkpoint(path, CONTENT, about) if path.exists() else []
        self.ended: list[Course] = []
        self.stopped = False
        self.kept = True  # what was to be kept last
        self.written_at = monotonic()

    def __enter__(self) -> Keeper:
        self._before: Any = None
        if threading.current_thread() is threading.main_thread():  # no other may set what a signal does
            self._before = signal.signal(signal.SIGINT, self._stop)
        return self

    def __exit__(self, kind: type[BaseException] | None, *_: object) -> None:
        if self._before is not None:
            signal.signal(signal.SIGINT, self._before)
        if kind is None:
            self._stop_if_asked()  # while the end was measured

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
            self._keep(course)
        self._stop_if_asked()

    def end(self, course: Course) -> None:
        """Keep a course at its end, so that the same run only measures it."""
        if len(self.ended) + 1 >= len(self.states):  # else the file is ahead, in the course of another kind of grains
            self._keep(course)
        self.ended.append(course)
        self._stop_if_asked()

    def _stop_if_asked(self) -> None:
        if self.stopped and self.kept:
            raise KeyboardInterrupt(f"Stopped. {self.path} holds how far it came; the same command goes on from there.")
        if self.stopped:
            raise KeyboardInterrupt(f"Stopped. The last checkpoint could not be written to {self.path}.")

    def _keep(self, course: Course) -> None:
        try:
            self._write(course)
        except InputError as problem:
            if self.stopped:
                raise
            if self.kept:
                told = f"{problem} The run goes on; until a checkpoint can be written again, what the file holds is left alone."
                warnings.warn(told, CheckpointWarning, stacklevel=2)
            self.kept, self.written_at = False, monotonic()
        else:
            self.kept = True

    def _write(self, course: Course) -> None:
        if not may_be_replaced(self.path, CONTENT, self.about):
            raise InputError(
                f"The checkpoint {self.path} is by now that of another run, or damaged. Move it away, and give each run a file "
                "of its own."
            )
        states = [each.state() for each in (*self.ended, course)]
        write_checkpoint(self.path, CONTENT, self.about, states)
        self.written_at = monotonic()


def discard(path: Path, about: Mapping[str, Any]) -> None:
    """Delete the checkpoint of a run; one that belongs to another is left alone."""
    if may_be_replaced(path, CONTENT, about):
        path.unlink(missing_ok=True)
