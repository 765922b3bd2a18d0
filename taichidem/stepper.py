"""Drive an engine's kernels until every world has reached its target."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from contextlib import nullcontext

import numpy as np

from taichidem.engine import Engine
from taichidem.errors import SimulationError
from taichidem.runtime import compiling_by_llvm_alone

PARTICLE_STEPS = 4_000_000  # of one launch, some tenths of a second, so that an interrupt comes through soon


class Stepper:
    """Choose how many steps a launch does, so that progress and interrupts come through."""

    def __init__(self, engine: Engine) -> None:
        self.engine = engine

    def run(self, worlds: int, between: Callable[[], None] | None = None) -> None:
        """Advance all worlds to their targets, or to where they stop.

        Args:
            worlds: how many there are.
            between: called after each launch; every world is then at the end of a step.

        Raises:
            SimulationError: a launch brought no world forward, which would otherwise go on for ever.
        """
        rows = self.engine.access["worlds"].read_all(worlds)
        waiting = steps_left(rows)
        while waiting.max() > 0:
            before = waiting.sum()
            limit = max(50, int(PARTICLE_STEPS / max(1.0, rows["bodies"].max())))
            with compiling_by_llvm_alone() if self.engine.kind == "superquadric" else nullcontext():
                self._advance(waiting, limit)
            rows = self.engine.access["worlds"].read_all(worlds)
            waiting = steps_left(rows)
            if waiting.sum() >= before:
                raise SimulationError(
                    f"No world moved on; {waiting.tolist()} steps are left. This is a fault of the engine."
                )
            if between:
                between()

    def _advance(self, waiting: np.ndarray, limit: int) -> None:
        """Launch: at most `limit` steps of each world, of which `waiting` are left."""
        if self.engine.particles is None:
            self.engine.advance_worlds(len(waiting), limit)
            return
        for world, steps in enumerate(waiting):
            if steps > 0:
                self.engine.particles.advance(world, int(min(steps, limit)))


def steps_left(rows: Mapping[str, np.ndarray]) -> np.ndarray:
    """Return the steps that each running world still has to do, from the rows of the table of worlds."""
    return np.where(rows["status"] == 0, np.maximum(rows["target"] - rows["step"], 0), 0)
