"""The course of several procedures side by side: what each still waits for, and how to take it up from a checkpoint."""

from __future__ import annotations

from collections.abc import Callable, Generator, Mapping, Sequence
from typing import Any

import numpy as np

from taichidem import errors
from taichidem.checkpoints.checkpoint import restore, state_of
from taichidem.checkpoints.journal import Journal
from taichidem.errors import InputError, TaichidemError
from taichidem.simulation import Simulation
from taichidem.world import World

Procedure = Generator[float, None, None]


class Course:
    """The procedures of all worlds of a simulation, and how far each has come.

    Args:
        simulation: that the worlds belong to.
        procedures: one for each world.
        worlds: as the procedures see them.
        frames: interval [s] at which each world's frame is kept, none where left out.
    """

    def __init__(
        self,
        simulation: Simulation,
        procedures: Sequence[Procedure],
        worlds: Sequence[World],
        frames: float | None = None,
    ) -> None:
        self.simulation, self.procedures, self.worlds, self.frames = simulation, procedures, worlds, frames
        self.waiting = set(range(len(procedures)))  # worlds whose procedures have not ended
        self.due = np.zeros(len(procedures))  # what each procedure still waits for [s]
        self.to_frame = np.full(len(procedures), np.inf if frames is None else 0.0)
        self.errors: list[TaichidemError] = []

    @property
    def share(self) -> float:
        """Mean share done."""
        return float(np.mean([world.progress for world in self.worlds]))

    def act(self) -> None:
        """Let every procedure act whose time has come; what fails or ends drops out."""
        for number in sorted(self.waiting):
            if self.simulation.failure(number):
                self.waiting.remove(number)
                self.due[number] = 0.0
            elif self.due[number] == 0:
                self._act(number)

    def _act(self, number: int) -> None:
        world = self.worlds[number]
        try:
            self.due[number] = next(self.procedures[number])
        except StopIteration:
            self.waiting.remove(number)
            world.progress = 1.0
            self._write(number, "end")
        except TaichidemError as error:
            self.waiting.remove(number)
            world.failure = str(error)
            self.errors.append(error)
        else:
            self._write(number, "wait", float(self.due[number]))

    def _write(self, number: int, act: str, *details: float) -> None:
        journal = self.worlds[number].journal
        if journal is not None:
            journal.told(act, *details)

    def advance(self, between: Callable[[], None] | None = None) -> None:
        """Run every world until its procedure goes on or its next frame is due, whichever comes first; take those frames.

        Args:
            between: called now and then on the way; a state taken there goes on from there.
        """
        for number in np.flatnonzero((self.to_frame == 0) & (self.due > 0)).tolist():
            self.worlds[number].frames.append(self.worlds[number].seen())
            self.to_frame[number] = self.frames
        duration = np.minimum(self.due, self.to_frame)
        # Before the run, so that a state taken on the way knows what is left after it.
        self.due -= duration
        self.to_frame -= duration
        if between is None:
            self.simulation.run(duration)
        else:
            self.simulation.run(duration, between)

    def state(self) -> dict[str, Any]:
        """Return all that the future depends on, in values that `Packer` packs."""
        return {
            "simulation": state_of(self.simulation),
            "waiting": sorted(self.waiting),
            "due": self.due.copy(),
            "to_frame": self.to_frame.copy(),
            "errors": [[type(error).__name__, str(error)] for error in self.errors],
            "worlds": [_state_of_world(world) for world in self.worlds],
        }

    def take_up(self, state: Mapping[str, Any]) -> None:
        """Go on from a state: play every procedure again to where it was, and set the tables.

        Raises:
            InputError: a procedure that does not do what it did.
        """
        self.waiting = set(state["waiting"])
        self.due, self.to_frame = state["due"], state["to_frame"]
        self.errors = [getattr(errors, name, InputError)(text) for name, text in state["errors"]]
        for number, kept in enumerate(state["worlds"]):
            world = self.worlds[number]
            world.frames, world.failure = list(kept["frames"]), kept["failure"]
            if world.failure is None:
                world.journal = Journal(world.rng, kept["journal"])
                self._play_again(number)
            if world.rng.bit_generator.state != kept["rng"] and world.failure is None:
                raise InputError(
                    "The procedure of this test draws other random numbers than when the checkpoint was written. Finish it with "
                    "the versions of program and NumPy that wrote it, or delete the checkpoint to start from the beginning."
                )
            world.progress = kept["progress"]
        restore(self.simulation, state["simulation"])

    def _play_again(self, number: int) -> None:
        journal = self.worlds[number].journal
        while journal is not None and journal.replaying:
            try:
                seconds = next(self.procedures[number])
            except StopIteration:
                journal.told("end")
            else:
                journal.told("wait", float(seconds))


def _state_of_world(world: World) -> dict[str, Any]:
    return {
        "journal": None if world.journal is None else world.journal.state(),
        "rng": world.rng.bit_generator.state,
        "frames": world.frames,
        "failure": world.failure,
        "progress": world.progress,
    }
