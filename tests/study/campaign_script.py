"""Run a campaign of quick runs in a process of its own: STORE RUNS PAUSE, as arguments or one campaign per line of input."""

from __future__ import annotations

import operator
import os
import sys

from taichidem.effects import BodyGravity, NormalHertz, TangentialMindlin
from taichidem.experiments import FixedFunnel
from taichidem.materials import Material
from taichidem.scene import Model
from taichidem.study import Run, RunStore, run_all
from tests.study import fakes

SMALL = {
    "diameter": 0.006,
    "cup_radius": 0.024,
    "rim_height": 0.006,
    "stream_radius": 0.012,
    "stream_bottom": 0.03,
    "stream_top": 0.07,
    "stream_rate": 2000.0,
    "batch_interval": 0.02,
    "particles": 220,  # far more than the cup holds, so that there is a slope whatever the seed
    "settle_time": 0.05,
    "longest_settle_time": 0.1,
    "method": "rings",
    "fit_from": 0.2,
    "fit_to": 0.95,
}


MODEL = Model(
    [Material("grain", 1000.0, 1e7, 0.3)],
    [NormalHertz(restitution=0.5), TangentialMindlin(static_friction=0.4), BodyGravity()],
)


def runs(count, pause):
    tests = [fakes.Quick(width=width, pause=pause) for width in (0.04, 0.05)]
    return [Run(test, MODEL, seed, "test") for seed in range(count // 2) for test in tests]


def made(seeds, **settings):
    """Return runs of one quick test, which takes no time."""
    test = fakes.Quick(**{"width": 0.04, **settings})
    return [Run(test, MODEL, seed, "quick") for seed in seeds]


def small_pour(**changes):
    """Return a real test that takes a second."""
    return FixedFunnel(**SMALL | changes)


def simulate(path, count, pause):
    """Run the campaign into a store."""
    with RunStore(path) as store:
        run_all(runs(int(count), float(pause)), store, worlds=4)


def serve():
    """Run a campaign in a forked process per line of input, which saves the second that importing takes.

    Its number is printed when it begins, its exit code when it has ended.
    """
    for line in sys.stdin:
        child = os.fork()  # which Taichi stands as long as it hasn't started
        if child == 0:
            simulate(*line.split())
            os._exit(0)
        print(child, flush=True)
        print(os.waitstatus_to_exitcode(os.waitpid(child, 0)[1]), flush=True)


if __name__ == "__main__":
    fakes.register(operator.setitem)
    if sys.argv[1:]:
        simulate(*sys.argv[1:])
    else:
        serve()
