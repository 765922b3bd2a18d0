"""Throughput of a GPU: settled beds as worlds × particles, and one bed on all threads; nothing where there is no GPU.

Written for the aim of 10⁹ particle-steps per second on one NVIDIA H200.
"""

from __future__ import annotations

from dataclasses import dataclass

from benchmarks.bed import SKIN, settled_bed
from benchmarks.ours import Run, timed_block
from benchmarks.report import aligned, tell
from benchmarks.worker import Worker

WORLDS = (1, 64, 1024, 8192)
SIZES = (1000, 10000)
MOST_GRAINS = 10_000_000  # some 4 kB each
STEPS = (50, 200)  # to warm up, and timed


@dataclass(frozen=True)
class Throughput:
    """One cell of the table: particle-steps per second, None where the cell was not run to its end, and why."""

    worlds: int
    grains: int
    schedule: str
    rate: float | None
    problem: str = ""


def start_on(arch: str) -> str:
    """Start Taichi on a kind of device and return it; runs in a worker."""
    from taichidem import runtime

    return runtime.start(arch=arch).arch


def present(arch: str = "cuda") -> bool:
    """Return whether Taichi can use a device of a kind here."""
    try:
        with Worker(1) as worker:
            return worker.call(start_on, arch) == arch
    except RuntimeError:
        return False


def cells(quick: bool) -> list[tuple[int, int, str]]:
    """Return worlds, grains a world and schedule of each cell; the schedule over particles takes worlds one by one."""
    sizes = SIZES[:1] if quick else SIZES
    side_by_side = [(w, n, "worlds") for n in sizes for w in WORLDS if w * n <= MOST_GRAINS]
    return side_by_side + [(1, n, "particles") for n in sizes]


def measure_gpu(quick: bool = False, arch: str = "cuda") -> list[Throughput]:
    """Return the table's cells, none where there is no such device."""
    if not present(arch):
        return []
    return [_measure(*cell, arch) for cell in cells(quick)]


def _measure(worlds: int, grains: int, schedule: str, arch: str) -> Throughput:
    tell(f"{arch}: {worlds} × {grains}, schedule {schedule}")
    position = settled_bed(grains)
    try:
        with Worker(1) as worker:  # a process each, so that the device's memory is free again
            worker.call(start_on, arch)
            rate = worker.call(timed_block, position, Run(SKIN, schedule, worlds, *STEPS)).rate
    except RuntimeError as problem:
        return Throughput(worlds, grains, schedule, None, str(problem))
    return Throughput(worlds, grains, schedule, rate)


def throughput_table(cells: list[Throughput]) -> str:
    """Return the table, rates in millions of particle-steps per second."""
    rows = [["worlds", "grains a world", "schedule", "M particle-steps/s"]]
    for cell in cells:
        shown = cell.problem if cell.rate is None else f"{cell.rate / 1e6:.2f}"
        rows.append([str(cell.worlds), str(cell.grains), cell.schedule, shown])
    return aligned(rows)
