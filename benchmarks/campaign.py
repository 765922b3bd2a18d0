"""`python -m benchmarks.campaign`: what a campaign costs beside its simulations: speed-up, store, memory.

Times are compared within one run of this program only, since other programs share the machine.
"""

from __future__ import annotations

import argparse
import dataclasses
import tempfile
import time
from collections.abc import Sequence
from pathlib import Path
from typing import Any, ClassVar

import numpy as np

from benchmarks.report import last_core, load, machine, tell
from benchmarks.worker import Worker, resident_memory
from taichidem.experiments import BulkDensity, FixedFunnel
from taichidem.experiments.base import Outcome
from taichidem.library import polypropylene
from taichidem.scene import Model
from taichidem.study import Run, RunStore, SpawnedProcesses, run_all
from taichidem.study.execution import stored_run

BLOCKS = 8  # of which the fastest counts: other programs only ever slow one down
SEEDS = 4  # of a model, as a study has them


class Instant(FixedFunnel):
    """A heap that nobody pours: what remains is what a campaign costs by itself."""

    name: ClassVar[str] = "instant"

    def run(self, models: Any, seeds: Sequence[int], **_: Any) -> list[Outcome]:
        """Return invented angles, with details as long as a heap's."""
        profile = {"angle_deg": 20.0, "radius_m": np.linspace(0, 0.05, 20), "height_m": np.linspace(0.02, 0, 20)}
        return [Outcome({"angle_of_repose": 20.0 + seed / 7}, seed, details={"profile": profile}) for seed in seeds]


def cups(count: int, particles: int = 500, settle_time: float = 0.8) -> list[Run]:
    """Return runs of one small cup, filled with grains at random, with different seeds."""
    test = BulkDensity(cup_radius=0.03, cup_height=0.03, rain_top=0.25, particles=particles, settle_time=settle_time)
    model = _model()
    return [Run(test, model, seed, "cup") for seed in range(count)]


def instants(count: int) -> list[Run]:
    """Return runs that take no time, with some seeds on each of many models."""
    test = Instant()
    models = [_model(0.2 + 1e-6 * k) for k in range(-(-count // SEEDS))]
    return [Run(test, model, seed, "heap") for model in models for seed in range(SEEDS)][:count]


def _model(friction: float = 0.4) -> Model:
    """Return polypropylene, ten times as soft as usual, so that a cup is filled in a fraction of a second."""
    model = polypropylene(static_friction=friction)
    softer = [dataclasses.replace(m, youngs_modulus=m.youngs_modulus / 10) for m in model.materials]
    return dataclasses.replace(model, materials=softer)


def campaign_time(count: int, executor: SpawnedProcesses | None = None) -> tuple[float, float]:
    """Return how long a campaign of small cups takes, its store included [s], and how many cores this process was given."""
    with tempfile.TemporaryDirectory() as folder, RunStore(Path(folder) / "runs.sqlite") as store:
        began, busy = time.perf_counter(), time.process_time()
        table = run_all(cups(count), store, executor=executor)
        seconds, busy = time.perf_counter() - began, time.process_time() - busy
    if set(table["status"]) != {"done"}:
        raise RuntimeError(f"A cup failed: {table['reason'].max()}")
    return seconds, busy / seconds


def speed_up_of_threads(count: int, cores: int) -> tuple[float, float, float]:
    """Return how many times as fast a campaign is on some threads of one process, how many cores these were given in their
    fastest block, and the time of a run on one core [s]."""
    with Worker(1, last_core()) as one, Worker(cores) as many:
        for worker in (one, many):
            worker.call(campaign_time, 2 * cores)
        blocks = [(one.call(campaign_time, count), many.call(campaign_time, count)) for _ in range(BLOCKS)]
    alone, together = (min(side) for side in zip(*blocks, strict=True))
    return alone[0] / together[0], together[1], alone[0] / count


def speed_up_of_processes(count: int, cores: int) -> float:
    """Return how many times as fast a campaign is in some processes of one thread as in one of them."""
    with SpawnedProcesses(1, threads=1) as one, SpawnedProcesses(cores, threads=1) as many:
        for pool, workers in ((one, 1), (many, cores)):
            campaign_time(4 * workers, pool)
        blocks = [(campaign_time(count, one), campaign_time(count, many)) for _ in range(BLOCKS)]
    alone, together = (min(side) for side in zip(*blocks, strict=True))
    return alone[0] / together[0]


def overhead(count: int) -> float:
    """Return what a campaign costs without its simulations: keys, scenes, store, table [s]."""
    with tempfile.TemporaryDirectory() as folder, RunStore(Path(folder) / "runs.sqlite") as store:
        began = time.perf_counter()
        run_all(instants(count), store, worlds=4)
        return time.perf_counter() - began


def large_store(count: int) -> dict[str, float]:
    """Return times with a store of many rows: a row added to it, a key looked up [ms], the whole campaign resumed [s]."""
    new, batch = 400, 4
    runs = instants(count + new)
    old, fresh = runs[:count], runs[count:]
    with tempfile.TemporaryDirectory() as folder, RunStore(Path(folder) / "runs.sqlite") as store:
        store.add(*(stored_run(run, run.experiment.run(run.model, [run.seed])[0], 1.0) for run in old))
        rows = [stored_run(run, run.experiment.run(run.model, [run.seed])[0], 1.0) for run in fresh]
        began = time.perf_counter()
        for first in range(0, new, batch):
            store.add(*rows[first : first + batch])
        added = time.perf_counter()
        store.statuses(run.key for run in old)
        looked_up = time.perf_counter()
        table = run_all(instants(count), store)
        resumed = time.perf_counter()
    if not table["stored"].all():
        raise RuntimeError("A run that was in the store was made again.")
    return {
        "add": 1e3 * (added - began) / new,
        "look_up": 1e3 * (looked_up - added) / count,
        "resume": resumed - looked_up,
    }


def memory_of_runs(count: int, looks: Sequence[float]) -> list[float]:
    """Return the resident memory [MB] of this process when shares of a campaign of real, tiny cups are done."""
    seen: list[float] = []

    def look(share: float) -> None:
        if len(seen) < len(looks) and share >= looks[len(seen)]:
            seen.append(resident_memory())

    with tempfile.TemporaryDirectory() as folder, RunStore(Path(folder) / "runs.sqlite") as store:
        run_all(cups(count, particles=30, settle_time=0.1), store, look)
    return seen


def measure(cores: int, count: int, rows: int, tiny: int) -> list[tuple[str, str, str]]:
    """Return what was measured: a row of words, number, target each."""
    tell("threads")
    threads, given, seconds = speed_up_of_threads(count, cores)
    tell("processes")
    processes = speed_up_of_processes(count, cores)
    tell("store")
    thousand, large = overhead(1000), large_store(rows)
    tell("memory")
    with Worker(cores) as worker:
        early, late = worker.call(memory_of_runs, tiny, (0.2, 1.0))
    share = 100 * thousand / (1000 * seconds / cores)
    wanted = f"at least {0.925 * cores:.2f}"
    return [
        (f"speed-up, {cores} threads of one process over one core", f"{threads:.2f}", wanted),
        ("  cores that these threads were given meanwhile", f"{given:.2f}", f"{cores}, where nothing else runs"),
        (f"speed-up, {cores} processes over one", f"{processes:.2f}", wanted),
        ("one small cup on one core", f"{seconds:.2f} s", ""),
        ("1,000 runs: all but the simulations", f"{thousand:.1f} s", ""),
        ("  their share beside 1,000 such small cups on all cores", f"{share:.2f} %", "below 2 %"),
        (f"{rows:,} rows: a row added", f"{large['add']:.2f} ms", "below 10 ms"),
        (f"{rows:,} rows: a key looked up", f"{large['look_up']:.4f} ms", "below 10 ms"),
        (f"{rows:,} rows: all there, campaign resumed", f"{large['resume']:.1f} s", ""),
        (f"memory after {tiny // 5:,} runs", f"{early:.0f} MB", ""),
        (f"memory after {tiny:,} runs", f"{late:.0f} MB", f"{early:.0f} MB"),
    ]


def main() -> None:
    """Read the arguments, measure, print a table."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--cores", type=int, default=2, help="threads, or processes, beside one")
    parser.add_argument("--runs", type=int, default=16, help="small cups of a timed campaign")
    parser.add_argument("--rows", type=int, default=100_000, help="rows of the large store")
    parser.add_argument("--tiny", type=int, default=1000, help="runs over which memory is watched")
    given = parser.parse_args()
    before = load()
    table = measure(given.cores, given.runs, given.rows, given.tiny)
    print(f"{machine()}; load before {before}, after {load()}\n")
    for words, number, target in [("what", "measured", "wanted"), *table]:
        print(f"{words:<55} {number:>12}   {target}")


if __name__ == "__main__":
    main()
