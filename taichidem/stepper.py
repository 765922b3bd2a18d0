"""Drive an engine's kernels until every world has reached its target."""

from __future__ import annotations

import numpy as np

from taichidem.engine import Engine

MOST_STEPS = 1 << 16


class Stepper:
    """Choose how many steps a launch does, so that progress and interrupts come through."""

    def __init__(self, engine: Engine) -> None:
        self.engine = engine

    def run(self, worlds: int, schedule: str) -> None:
        """Advance all worlds to their targets."""
        if schedule == "worlds":
            while self.left(worlds):
                self.engine.advance_worlds(worlds, MOST_STEPS)

    def left(self, worlds: int) -> int:
        """Return the largest number of steps that a running world still has to do."""
        rows = self.engine.access["worlds"].read_all(worlds)
        return int(np.where(rows["status"] == 0, rows["target"] - rows["step"], 0).max())
