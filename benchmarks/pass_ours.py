"""One experiment of a pass on our engine, timed; the functions run in a worker."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Mapping, Sequence
from contextlib import contextmanager
from dataclasses import dataclass
from time import perf_counter, process_time
from typing import Any
from unittest.mock import patch

import numpy as np

from taichidem.experiments import Experiment
from taichidem.procedure import World
from taichidem.scene import Model
from taichidem.simulation import Simulation
from taichidem.stepper import Stepper

COUNTS = ("grains_in_box", "grains_in_cup")  # details that two codes can compare besides the observables


@dataclass(frozen=True)
class Timing:
    """One call of `Experiment.run`, all its worlds together.

    Attributes:
        seconds: from the experiment and its model to its observables, compilation apart.
        processor: seconds that all its threads computed; on an idle machine the same as `seconds` for one thread, and what
            is left to compare on a busy one.
        stepping: those of `seconds` in which the engine stepped; the rest is insertion, looks and measurement.
        steps: time steps of the longest world.
        particle_steps: grains present times steps, of all worlds.
        observables: of each world, with counts of grains; empty where it could not be measured.
        failures: what went wrong, of each world that has no observables.
    """

    seconds: float
    processor: float
    stepping: float
    steps: int
    particle_steps: float
    observables: tuple[dict[str, float], ...]
    failures: tuple[str, ...]


@dataclass
class Meter:
    """What stepped while it was switched on; see `Timing`."""

    seconds: float = 0.0
    steps: float = 0.0
    particle_steps: float = 0.0

    @contextmanager
    def on(self) -> Iterator[None]:
        """Count every step that any simulation does inside the block."""
        step = Stepper.run

        def counted(stepper: Stepper, worlds: int, between: Callable[[], None] | None = None) -> None:
            before = stepper.engine.access["worlds"].read_all(worlds)
            start = perf_counter()
            step(stepper, worlds, between)
            self.seconds += perf_counter() - start
            after = stepper.engine.access["worlds"].read_all(worlds)
            done = after["step"] - before["step"]
            self.steps += float(done.max())
            # Grains leave at moments that nobody notes; between two looks their number is taken to fall evenly.
            self.particle_steps += float(done @ (before["bodies"] + after["bodies"])) / 2

        with patch.object(Stepper, "run", counted):
            yield


def seen(observables: Mapping[str, float], details: Mapping[str, Any]) -> dict[str, float]:
    """Return what two codes compare: the observables and counts of grains."""
    return {**observables, **{name: float(details[name]) for name in COUNTS if name in details}}


def warm(test: Experiment, model: Model, worlds: int) -> float:
    """Compile all that an experiment calls, and return the seconds: insert its first grains, do one step, look."""
    start = perf_counter()
    simulation = Simulation([test.scene(model)] * worlds)
    for number in range(worlds):
        world = World(simulation, number, np.random.default_rng(0))
        next(test.procedure(world, model))
    simulation.run_steps(1)
    world.seen()
    return perf_counter() - start


def timed(test: Experiment, model: Model, seeds: Sequence[int]) -> Timing:
    """Run an experiment with the given seeds side by side."""
    meter = Meter()
    with meter.on():
        start, computed = perf_counter(), process_time()
        outcomes = test.run(model, seeds)
        seconds, processor = perf_counter() - start, process_time() - computed
    return Timing(
        seconds,
        processor,
        meter.seconds,
        round(meter.steps),
        meter.particle_steps,
        tuple(seen(outcome.observables, outcome.details) for outcome in outcomes),
        tuple(outcome.failure for outcome in outcomes if outcome.failure),
    )
