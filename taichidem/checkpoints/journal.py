"""What a procedure did and was told, so that it can be played again from its start without repeating it on the engine.

A procedure is a generator, which can't be written to a file. It depends on nothing but its arguments, its random numbers
and the answers it gets from its world: given the same answers it comes to the same place, in milliseconds.
"""

from __future__ import annotations

import json
from collections.abc import Callable
from typing import Any, TypeVar

import numpy as np

from taichidem.checkpoints.packing import Packer, checksum
from taichidem.errors import InputError
from taichidem.shapes.forms import Forms
from taichidem.snapshot import Frame, Snapshot, WallState

Answer = TypeVar("Answer")

TYPES = (Forms, Frame, Snapshot, WallState)  # of answers, beside plain values


class Journal:
    """The answers one world gave to its procedure, in order; given again while a procedure is played again.

    Answers are packed as they come, so that a procedure that changes one later changes nothing here.

    Args:
        rng: the world's random numbers.
        kept: of an earlier journal, as `state` returned it.
    """

    def __init__(self, rng: np.random.Generator, kept: dict[str, Any] | None = None) -> None:
        self.rng = rng
        self.packer = Packer(TYPES, b"" if kept is None else kept["data"].tobytes())
        self.events: list[list[Any]] = [] if kept is None else json.loads(kept["events"].tobytes())
        self.played = 0  # how many events have been given again
        self.replaying = bool(self.events)

    def state(self) -> dict[str, Any]:
        """Return all that was written down; a later journal goes on from it."""
        parts = {"events": json.dumps(self.events).encode(), "data": bytes(self.packer.data)}
        return {name: np.frombuffer(part, np.uint8) for name, part in parts.items()}

    def asked(self, question: str, answer: Callable[[], Answer], *, draws: bool = False) -> Answer:
        """Return the answer to a question, that of the first time where a procedure is played again.

        Args:
            question: what is asked, in a few words.
            answer: finds it.
            draws: whether finding it takes random numbers of the world.
        """
        if self.replaying:
            value, rng = self._again(question)
            if rng is not None:
                self.rng.bit_generator.state = rng
            return value
        value = answer()
        self._write(question, value, self.rng.bit_generator.state if draws else None)
        return value

    def told(self, act: str, *details: Any) -> bool:
        """Write down what a procedure does; return whether it still has to be done."""
        mark = checksum(list(details))
        if not self.replaying:
            self._write(act, mark, None)
            return True
        before, _ = self._again(act)
        if before != mark:
            raise _changed(f"{act} as it was", f"{act} with other values")
        return False

    def _write(self, question: str, value: Any, rng: Any) -> None:
        self.events.append([question, self.packer.pack(value), rng])

    def _again(self, question: str) -> tuple[Any, Any]:
        before, packed, rng = self.events[self.played]
        if before != question:
            raise _changed(before, question)
        self.played += 1
        self.replaying = self.played < len(self.events)
        return self.packer.unpack(packed), rng


def _changed(before: str, now: str) -> InputError:
    return InputError(
        f"The procedure of this test is not the one that the checkpoint was written by: it came to {before!r} then, and comes to "
        f"{now!r} now. Finish it with the program that wrote it, or delete the checkpoint to start from the beginning. (A "
        "procedure must decide by what its world answers and by world.rng alone.)"
    )
