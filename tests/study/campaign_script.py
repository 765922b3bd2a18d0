"""Run a campaign of quick runs in a process of its own: STORE RUNS PAUSE."""

from __future__ import annotations

import operator
import sys

from taichidem.effects import BodyGravity, NormalHertz, TangentialMindlin
from taichidem.materials import Material
from taichidem.scene import Model
from taichidem.study import Run, RunStore, run_all
from tests.study import fakes


def runs(count, pause):
    model = Model(
        [Material("grain", 1000.0, 1e7, 0.3)],
        [NormalHertz(restitution=0.5), TangentialMindlin(static_friction=0.4), BodyGravity()],
    )
    tests = [fakes.Quick(width=width, pause=pause) for width in (0.04, 0.05)]
    return [Run(test, model, seed, "test") for seed in range(count // 2) for test in tests]


if __name__ == "__main__":
    fakes.register(operator.setitem)
    with RunStore(sys.argv[1]) as store:
        run_all(runs(int(sys.argv[2]), float(sys.argv[3])), store, worlds=4)
