"""The heap: grains pour and flow, so that lists are rebuilt, grains come and go, and the load differs between worlds."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass
from time import perf_counter

from benchmarks.worker import Worker, peak_memory
from taichidem.experiments.fixed_funnel import FixedFunnel

QUICK_PARTICLES = 300


@dataclass(frozen=True)
class HeapSpeed:
    """A pour of one or more heaps.

    Attributes:
        worlds: heaps side by side.
        threads: of Taichi.
        particles: poured into each.
        seconds: from the scenes to the measured angles, compilation apart.
        rate: particle-steps per second, counting the grains present.
        angles: of repose [deg]; none after a short pour.
        memory: peak resident memory [MB].
    """

    worlds: int
    threads: int
    particles: int
    seconds: float
    rate: float
    angles: tuple[float, ...]
    memory: float


class CountingFunnel(FixedFunnel):
    """The experiment, counting the steps its grains do."""

    particle_steps = 0.0

    def procedure(self, world, model) -> Iterator[float]:  # type: ignore[no-untyped-def, override]
        dt = self.scene(model).dt
        for duration in super().procedure(world, model):
            self.particle_steps += len(world.snapshot().mass) * duration / dt
            yield duration


def measure_heap(threads: int, core: int | None, worlds: int, quick: bool) -> HeapSpeed:
    """Pour heaps in a process of their own."""
    with Worker(threads, core) as worker:
        return worker.call(pour_heaps, threads, worlds, quick)


def pour_heaps(threads: int, worlds: int, quick: bool) -> HeapSpeed:
    """Pour heaps, one world each; runs in a worker."""
    from taichidem.library import PAPER_HEAP, polypropylene
    from taichidem.simulation import Simulation

    settings = {"particles": QUICK_PARTICLES, "settle_time": 0.1, "longest_settle_time": 0.2} if quick else {}
    test = CountingFunnel(**{**PAPER_HEAP, **settings})
    model = polypropylene()
    Simulation([test.scene(model)] * worlds).run_steps(1)  # compiles
    start = perf_counter()
    outcomes = test.run(model, range(1, worlds + 1))
    seconds = perf_counter() - start
    failures = [o.failure for o in outcomes if o.failure]
    if failures and not quick:
        raise RuntimeError(" ".join(str(failure) for failure in failures))
    # A short pour only covers the bottom; its slope would mean nothing.
    angles = () if quick else tuple(o.observables["angle_of_repose"] for o in outcomes)
    rate = test.particle_steps / seconds
    return HeapSpeed(worlds, threads, test.settings.particles, seconds, rate, angles, peak_memory())
