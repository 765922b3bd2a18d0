"""Drive an engine's kernels until every world has reached its target."""

from __future__ import annotations

import numpy as np

from taichidem.engine import Engine

MOST_STEPS = 1 << 16


class Stepper:
    """Choose how many steps a launch does, so that progress and interrupts come through."""

    def __init__(self, engine: Engine) -> None:
        self.engine = engine

    def run(self, worlds: int) -> None:
        """Advance all worlds to their targets, or to where they stop."""
        while left := self.left(worlds):
            if self.engine.particles is None:
                self.engine.advance_worlds(worlds, MOST_STEPS)
            else:
                for world, steps in enumerate(self.steps_left(worlds)):
                    if steps > 0:
                        self.engine.particles.advance(world, int(min(steps, left)))

    def steps_left(self, worlds: int) -> np.ndarray:
        """Return the steps that each running world still has to do."""
        rows = self.engine.access["worlds"].read_all(worlds)
        return np.where(rows["status"] == 0, rows["target"] - rows["step"], 0)

    def left(self, worlds: int) -> int:
        """Return the largest number of steps left."""
        return int(self.steps_left(worlds).max())
