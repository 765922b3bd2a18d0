"""What was measured, as plain values and as text."""

from __future__ import annotations

import os
import platform
import sys
from collections.abc import Sequence
from dataclasses import dataclass, field
from importlib.metadata import version
from statistics import median
from typing import Any

from benchmarks.heap import HeapSpeed


@dataclass(frozen=True)
class BedSpeed:
    """One size of the settled bed; rates are particle-steps per second, a block each.

    Attributes:
        grains: in the bed.
        contacts: touching pairs per grain, walls included.
        one: one thread, one world, the peer's skin; `ratios` are block by block against `peer`.
        one_own_skin: the same with our default skin.
        worlds: every thread its own world.
        particles: every thread on one world.
        peer: LIGGGHTS on the processor that `one` used; empty where it is not installed.
        rebuilds, peer_rebuilds: neighbour lists built in each block.
        memory, memory_worlds, memory_particles, peer_memory: peak resident memory [MB].
        shortened: what was settled for fewer steps than the recipe says, or "".
    """

    grains: int
    contacts: float
    one: list[float]
    one_own_skin: list[float]
    worlds: list[float]
    particles: list[float]
    peer: list[float]
    rebuilds: list[int]
    peer_rebuilds: list[int]
    memory: float
    memory_worlds: float
    memory_particles: float
    peer_memory: float
    shortened: str = ""

    @property
    def ratios(self) -> list[float]:
        """Ours over LIGGGHTS, each pair measured one right after the other."""
        return [ours / theirs for ours, theirs in zip(self.one, self.peer, strict=True)] if self.peer else []

    @property
    def ratio(self) -> float | None:
        """Median of the pairwise ratios."""
        return median(self.ratios) if self.ratios else None

    def as_dict(self) -> dict[str, Any]:
        """Return plain values."""
        return {**vars(self), "ratios": self.ratios, "ratio": self.ratio}


@dataclass(frozen=True)
class ShapeSpeed:
    """One shape's settled bed; rates are grain-steps per second, a block each.

    Attributes:
        name: of the shape.
        rates: of its blocks.
        costs: time per grain-step over that of spheres, each pair of blocks measured one soon after the other.
        rebuilds: neighbour lists built in each block.
        peer: rates of LIGGGHTS on a bed of the same grains; empty where it wasn't run.
        peer_rebuilds: its lists.
        target: cost over a sphere's, at most and aimed at.
    """

    name: str
    rates: list[float]
    costs: list[float]
    rebuilds: list[int]
    peer: list[float]
    peer_rebuilds: list[int]
    target: tuple[float, float] | None = None

    @property
    def ratios(self) -> list[float]:
        """Our rate over LIGGGHTS's, block by block."""
        return [ours / theirs for ours, theirs in zip(self.rates, self.peer, strict=True)] if self.peer else []

    def as_dict(self) -> dict[str, Any]:
        """Return plain values."""
        return {**vars(self), "cost": median(self.costs), "ratios": self.ratios}


@dataclass
class Results:
    """All measurements of one run of the benchmark."""

    threads: int
    machine: str
    peer: str
    load_at_start: float
    load_at_end: float = 0.0
    beds: list[BedSpeed] = field(default_factory=list)
    compile_seconds: dict[str, float] = field(default_factory=dict)
    heaps: list[HeapSpeed] = field(default_factory=list)
    shapes: list[ShapeSpeed] = field(default_factory=list)
    gpu: list[dict[str, Any]] = field(default_factory=list)

    def as_dict(self) -> dict[str, Any]:
        """Return plain values for JSON."""
        values = {**vars(self), "beds": [bed.as_dict() for bed in self.beds]}
        values |= {"heaps": [vars(heap) for heap in self.heaps], "shapes": [shape.as_dict() for shape in self.shapes]}
        return values


def machine() -> str:
    """Return processor, system and versions in one line."""
    processor = platform.processor() or platform.machine()
    try:
        with open("/proc/cpuinfo") as file:
            processor = next(line.split(":")[1].strip() for line in file if line.startswith("model name"))
    except (OSError, StopIteration):
        pass
    versions = f"Python {platform.python_version()}, Taichi {version('taichi')}, taichidem {version('taichidem')}"
    return f"{processor}, {os.cpu_count()} processors, {platform.system()} {platform.release()}; {versions}"


def load() -> float:
    """Return the mean number of runnable processes over the last minute; NaN where the system does not tell."""
    return os.getloadavg()[0] if hasattr(os, "getloadavg") else float("nan")


def last_core() -> int | None:
    """Return the processor that single-threaded measurements are pinned to, ours and the peer's alike."""
    return max(os.sched_getaffinity(0)) if hasattr(os, "sched_getaffinity") else None


def tell(text: str) -> None:
    """Say on standard error what is being done, as this takes minutes."""
    print(text, file=sys.stderr, flush=True)


def spread(values: Sequence[float]) -> str:
    """Return median (least–most), or a dash where there are no values."""
    return f"{median(values):.2f} ({min(values):.2f}–{max(values):.2f})" if values else "–"


def _rates(values: Sequence[float]) -> str:
    return spread([value / 1e6 for value in values])


def bed_table(results: Results) -> str:
    """Return the settled beds as a table, rates in millions of particle-steps per second, median (least–most)."""
    threads = results.threads
    heads = ["grains", "contacts/grain", "1 thread", "LIGGGHTS, 1 core", "ratio", "1 thread, own skin"]
    heads += [f"{threads} threads, {threads} worlds", f"{threads} threads, 1 world"]
    rows = [
        [
            str(bed.grains) + ("*" if bed.shortened else ""),
            f"{bed.contacts:.2f}",
            _rates(bed.one),
            _rates(bed.peer),
            "–" if bed.ratio is None else f"{bed.ratio:.2f} ({min(bed.ratios):.2f}–{max(bed.ratios):.2f})",
            _rates(bed.one_own_skin),
            _rates(bed.worlds),
            _rates(bed.particles),
        ]
        for bed in results.beds
    ]
    return aligned([heads, *rows])


def memory_table(results: Results) -> str:
    """Return peak memory [MB] and lists built per block."""
    heads = ["grains", "1 thread [MB]", "LIGGGHTS [MB]", "all threads, worlds [MB]", "all threads, 1 world [MB]"]
    heads += ["lists built per block", "by LIGGGHTS"]
    rows = [
        [
            str(b.grains),
            *[f"{m:.0f}" if m > 0 else "–" for m in (b.memory, b.peer_memory, b.memory_worlds, b.memory_particles)],
            "/".join(map(str, b.rebuilds)),
            "/".join(map(str, b.peer_rebuilds)) or "–",
        ]
        for b in results.beds
    ]
    return aligned([heads, *rows])


def shapes_table(shapes: Sequence[ShapeSpeed]) -> str:
    """Return the table, median (least–most) of the blocks."""
    rows = [["shape", "M grain-steps/s", "cost over a sphere's", "at most (aim)", "LIGGGHTS", "ratio", "lists built"]]
    for s in shapes:
        rows.append(
            [
                s.name,
                spread([rate / 1e6 for rate in s.rates]),
                spread(s.costs),
                f"{s.target[0]:g} ({s.target[1]:g})" if s.target else "–",
                spread([rate / 1e6 for rate in s.peer]),
                spread(s.ratios),
                "/".join(map(str, s.rebuilds)),
            ]
        )
    return aligned(rows)


def heap_lines(results: Results) -> list[str]:
    """Return a line per pour."""
    return [
        f"Heap of {h.particles} grains poured, {h.worlds} world(s) on {h.threads} thread(s): {h.seconds:.0f} s, "
        f"{h.rate / 1e6:.2f} M particle-steps/s, {h.memory:.0f} MB"
        + (f", angle {', '.join(f'{a:.1f}°' for a in h.angles)}" if h.angles else "")
        for h in results.heaps
    ]


def as_text(results: Results) -> str:
    """Return everything as text for the screen."""
    lines = [results.machine, f"Peer: {results.peer}."]
    lines.append(f"Load before {results.load_at_start:.2f}, after {results.load_at_end:.2f} (idle is near 0).")
    if results.beds:
        lines += ["", "Settled bed, millions of particle-steps per second, median (least–most) of the blocks:"]
        lines += [bed_table(results), *sorted({f"* {b.shortened}" for b in results.beds if b.shortened})]
        lines += ["", memory_table(results), ""]
    if results.shapes:
        lines += ["Beds of 3,000 grains of equal volume, one thread, median (least–most) of the blocks:"]
        lines += [shapes_table(results.shapes), ""]
    for what, seconds in results.compile_seconds.items():
        lines.append(f"First step of {what}: {seconds:.1f} s")
    return "\n".join(lines + heap_lines(results))


def aligned(rows: list[list[str]]) -> str:
    widths = [max(len(row[k]) for row in rows) for k in range(len(rows[0]))]
    return "\n".join("  ".join(cell.rjust(w) for cell, w in zip(row, widths, strict=True)) for row in rows)
