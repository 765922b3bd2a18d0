"""Measurements of our engine; the functions run in a worker."""

from __future__ import annotations

from dataclasses import dataclass
from time import perf_counter

import numpy as np

from benchmarks.bed import bed_scene, lattice
from benchmarks.worker import peak_memory

COMPILED_GRAINS = 1000


@dataclass(frozen=True)
class Block:
    """One timed block: particle-steps per second, and how often neighbour lists were built in it."""

    rate: float
    rebuilds: int


@dataclass(frozen=True)
class Run:
    """What a block does.

    Args:
        skin: of the neighbour lists [m]; ours by default where None.
        schedule: "worlds" or "particles".
        worlds: equal beds side by side.
        warm_up: steps before the clock starts.
        steps: steps that are timed.
    """

    skin: float | None
    schedule: str
    worlds: int
    warm_up: int
    steps: int


def timed_block(position: np.ndarray, run: Run) -> Block:
    """Start from the settled bed at rest, warm up, and time the steps that follow."""
    from taichidem.simulation import Simulation

    simulation = Simulation([bed_scene(position, run.skin)] * run.worlds, run.schedule)
    simulation.run_steps(run.warm_up)
    before = simulation.snapshot().rebuilds
    start = perf_counter()
    simulation.run_steps(run.steps)
    seconds = perf_counter() - start
    simulation.check()
    return Block(run.worlds * len(position) * run.steps / seconds, simulation.snapshot().rebuilds - before)


def first_step(schedule: str) -> float:
    """Return the seconds from a scene to the end of its first step, nearly all of them compilation."""
    from taichidem import runtime
    from taichidem.simulation import Simulation

    runtime.start()
    scene = bed_scene(lattice(COMPILED_GRAINS))
    start = perf_counter()
    Simulation(scene, schedule).run_steps(1)
    return perf_counter() - start


def memory() -> float:
    """Return the worker's peak resident memory [MB]."""
    return peak_memory()
