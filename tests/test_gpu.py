"""A GPU computes what the processor does, up to round-off at first and in the mean later. Every run is a process of its own."""

from __future__ import annotations

import json
import subprocess
import sys
from pathlib import Path

import numpy as np
import pytest

ROOT = Path(__file__).parents[1]
DEVICE = "cuda"
SEEDS = [1, 2, 3, 4]

CROWD = """
import json, sys
from taichidem import runtime
runtime.start(arch=sys.argv[1])
from taichidem.simulation import Simulation
from tests.crowds import crowd
simulation = Simulation([crowd("sphere", seed) for seed in (1, 2)], sys.argv[2])
found = []
for steps in (100, 400):
    simulation.run_steps(steps)
    simulation.check()
    now = [simulation.snapshot(world) for world in range(2)]
    found.append([[s.position.tolist(), s.kinetic_energy, float(s.carried.sum())] for s in now])
print(json.dumps(found))
"""
HEAP = """
import json, sys
from taichidem import runtime
runtime.start(arch=sys.argv[1])
from taichidem.experiments import FixedFunnel
from tests.experiments.planted import granules
from tests.experiments.test_checkpoints import FUNNEL
outcomes = FixedFunnel(**FUNNEL).run(granules(), json.loads(sys.argv[2]))
print(json.dumps([o.observables["angle_of_repose"] for o in outcomes]))
"""


def run(script, *arguments):
    done = subprocess.run(
        [sys.executable, "-c", script, *arguments], capture_output=True, text=True, cwd=ROOT, check=False
    )
    if "no usable CUDA device" in done.stderr:
        pytest.skip("there is no CUDA device that Taichi can use")
    assert done.returncode == 0, done.stderr
    return json.loads(done.stdout.splitlines()[-1])


@pytest.mark.gpu
@pytest.mark.parametrize("schedule", ["worlds", "particles"])
def test_a_crowd_moves_as_on_the_processor(schedule):
    """Round-off differs, by fused multiply-adds and by how a library takes a root, and collisions make it grow.

    After a hundred steps, a collision or two, a millionth of a radius (3e-9 m) is far above that, and far below the 1e-5 m that a
    grain moves in a single step; a contact missed or counted twice shows. After five hundred, single grains may be elsewhere:
    what is left of the energy agrees within a fifth, the mean height within a tenth of a radius, the liquid within 2 %.
    """
    theirs, ours = run(CROWD, DEVICE, schedule), run(CROWD, "cpu", schedule)
    for (position, energy, carried), (expected, other, liquid) in zip(theirs[0], ours[0], strict=True):
        assert np.abs(np.subtract(position, expected)).max() < 1e-6 * 0.003
        assert energy == pytest.approx(other, rel=1e-6)
        assert carried == pytest.approx(liquid, rel=1e-6)
    for (position, energy, carried), (expected, other, liquid) in zip(theirs[1], ours[1], strict=True):
        assert np.mean(position, axis=0)[2] == pytest.approx(np.mean(expected, axis=0)[2], abs=0.1 * 0.003)
        assert energy == pytest.approx(other, rel=0.2)
        assert carried == pytest.approx(liquid, rel=0.02)


@pytest.mark.gpu
def test_small_heaps_have_the_same_mean_angle():
    """Of four seeds each, within three standard errors of the difference."""
    theirs, ours = run(HEAP, DEVICE, json.dumps(SEEDS)), run(HEAP, "cpu", json.dumps(SEEDS))
    error = np.sqrt((np.var(theirs, ddof=1) + np.var(ours, ddof=1)) / len(SEEDS))
    assert abs(np.mean(theirs) - np.mean(ours)) < 3 * error
