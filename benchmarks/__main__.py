"""`python -m benchmarks`: settled beds, beside LIGGGHTS where it is installed, and the heap."""

from __future__ import annotations

import argparse
import json
import sys
import tempfile
from collections.abc import Sequence
from pathlib import Path

import numpy as np

from benchmarks import ours, peer_liggghts
from benchmarks.bed import SKIN, contacts_per_grain, settled_bed, settling
from benchmarks.gpu_throughput import measure_gpu, throughput_table
from benchmarks.heap import measure_heap
from benchmarks.ours import Run
from benchmarks.report import BedSpeed, Results, as_text, last_core, load, machine, tell
from benchmarks.shapes_bed import measure_shapes
from benchmarks.worker import Worker
from taichidem.runtime import cores

SIZES = (1000, 3000, 10000, 30000)
BLOCKS = 3
PARTICLE_STEPS = 1.6e7  # of a timed block and thread, some seconds


def measure_bed(grains: int, threads: int, peer: bool, quick: bool) -> BedSpeed:
    """Measure one size of the settled bed."""
    tell(f"{grains} grains: settling")
    position = settled_bed(grains)
    steps = max(50, round(PARTICLE_STEPS / (4 if quick else 1) / grains))
    warm_up = max(50, steps // 4)
    core = last_core()
    one: list[ours.Block] = []
    own: list[ours.Block] = []
    theirs: list[peer_liggghts.PeerBlock] = []
    with Worker(1, core) as worker:
        # The first block of a process also compiles or loads kernels; a short one takes that out of the way.
        worker.call(ours.timed_block, position, Run(SKIN, "worlds", 1, 1, 50))
        for block in range(BLOCKS):
            tell(f"{grains} grains: one thread, block {block + 1} of {BLOCKS}")
            one.append(worker.call(ours.timed_block, position, Run(SKIN, "worlds", 1, warm_up, steps)))
            if peer:
                theirs.append(peer_liggghts.timed_block(position, warm_up, steps, core or 0))
        for _ in range(1 if quick else 2):
            own.append(worker.call(ours.timed_block, position, Run(None, "worlds", 1, warm_up, steps)))
        memory = worker.call(ours.memory)
    many, memory_worlds = _all_threads(position, Run(SKIN, "worlds", threads, warm_up, steps), threads)
    shared, memory_particles = _all_threads(position, Run(SKIN, "particles", 1, warm_up, steps), threads)
    steps_settled = " + ".join(str(stage.steps) for stage in settling(grains))
    shortened = f"settled for {steps_settled} steps, where the recipe for 30,000 grains has 20000 + 64000"
    return BedSpeed(
        grains=grains,
        contacts=contacts_per_grain(position),
        one=[block.rate for block in one],
        one_own_skin=[block.rate for block in own],
        worlds=many,
        particles=shared,
        peer=[block.rate for block in theirs],
        rebuilds=[block.rebuilds for block in one],
        peer_rebuilds=[block.rebuilds for block in theirs],
        memory=memory,
        memory_worlds=memory_worlds,
        memory_particles=memory_particles,
        peer_memory=max((block.memory for block in theirs), default=0.0),
        shortened=shortened if grains > 10000 else "",
    )


def _all_threads(position: np.ndarray, run: Run, threads: int) -> tuple[list[float], float]:
    """Return the rates of two blocks with every thread at work, and the peak memory [MB]."""
    tell(f"{len(position)} grains: {threads} threads, schedule {run.schedule}")
    with Worker(threads) as worker:
        worker.call(ours.timed_block, position, Run(run.skin, run.schedule, run.worlds, 1, 50))
        rates = [worker.call(ours.timed_block, position, run).rate for _ in range(2)]
        return rates, worker.call(ours.memory)


def measure_compilation() -> dict[str, float]:
    """Return the seconds to the first step with an empty cache of kernels and with a filled one."""
    seconds = {}
    for schedule in ("worlds", "particles"):
        with tempfile.TemporaryDirectory() as cache:
            for state in ("compiled", "from Taichi's cache"):
                tell(f"first step, schedule {schedule}, {state}")
                with Worker(1, None, cache) as worker:
                    seconds[f"schedule {schedule}, {state}"] = worker.call(ours.first_step, schedule)
    return seconds


def main(arguments: Sequence[str] | None = None) -> int:
    """Run the benchmark and print its tables."""
    parser = argparse.ArgumentParser(prog="python -m benchmarks", description=__doc__)
    parser.add_argument("--sizes", type=int, nargs="*", default=None, metavar="N", help="grains of the settled beds")
    parser.add_argument("--quick", action="store_true", help="1,000 and 3,000 grains, short blocks, a tiny heap")
    parser.add_argument("--json", type=Path, metavar="FILE", help="write all numbers to a file")
    parser.add_argument("--no-peer", action="store_true", help="do not run LIGGGHTS")
    parser.add_argument("--no-heap", action="store_true", help="do not pour heaps")
    parser.add_argument("--no-shapes", action="store_true", help="do not measure beds of other shapes")
    given = parser.parse_args(arguments)
    sizes = given.sizes if given.sizes is not None else SIZES[:2] if given.quick else SIZES
    if any(grains < 1 for grains in sizes):
        parser.error(f"--sizes is {sizes}; give whole numbers from 1")
    peer = not given.no_peer and peer_liggghts.executable() is not None
    peer_text = "left out" if given.no_peer else "liggghts is not on the PATH (Debian: apt-get install liggghts)"
    threads = cores()
    results = Results(threads, machine(), peer_liggghts.version() if peer else peer_text, load())
    for grains in sizes:
        results.beds.append(measure_bed(grains, threads, peer, given.quick))
    if not given.no_shapes:
        results.shapes = measure_shapes(peer, given.quick)
    results.compile_seconds = measure_compilation()
    if not given.no_heap:
        for heap_threads, core in ((1, last_core()), (threads, None)):
            tell(f"heap, {heap_threads} thread(s)")
            results.heaps.append(measure_heap(heap_threads, core, heap_threads, given.quick))
    results.load_at_end = load()
    on_gpu = measure_gpu(given.quick)
    results.gpu = [vars(cell) for cell in on_gpu]
    print(as_text(results))
    if on_gpu:
        print(f"\nOn the GPU:\n{throughput_table(on_gpu)}")
    if given.json is not None:
        given.json.write_text(json.dumps(results.as_dict(), indent=2) + "\n")
    return 0


if __name__ == "__main__":
    sys.exit(main())
