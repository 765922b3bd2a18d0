"""The paper's heap of 3 mm grains, and of grains twice as large by coarse graining: `python -m benchmarks.coarse_heap`.

Polypropylene at softened stiffness, 20,000 grains poured at scale 1 and 2,500 at scale 2, through the same stream onto the
same cup; and the coarse ones once more from so high that they strike the heap with the fine ones' energy over weight times
diameter, v²/(g d). Angles, and the wall time that scale 2 saves; the paper saves 71 %.
"""

from __future__ import annotations

import argparse
import json
import sys
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from pathlib import Path
from time import perf_counter, process_time
from typing import Any

from benchmarks.angles import Angles, Difference
from benchmarks.report import aligned, load, machine
from taichidem.coarse_graining import CoarseGraining
from taichidem.errors import SimulationError
from taichidem.experiments import FixedFunnel
from taichidem.library import PAPER_FINE_HEAP, polypropylene
from taichidem.paper.heaps import SCALE, similar_heap
from taichidem.paper.published import TIME_SAVED
from taichidem.runtime import cores
from taichidem.simulation import Simulation

FINE_SEEDS, COARSE_SEEDS = (1, 2), (1, 2, 3, 4, 5, 6)
#: From so high coarse grains strike the heap with the fine ones' energy over weight times diameter.
HIGHER = similar_heap().settings.model_dump(include={"stream_bottom", "stream_top"})
Report = Callable[[float], None]


@dataclass(frozen=True)
class CoarseHeaps:
    """Heaps of coarse grains, of coarse grains that fall twice as deep, and of fine grains."""

    coarse: Angles
    higher: Angles
    fine: Angles

    @property
    def difference(self) -> Difference:
        """Coarse minus fine."""
        return Difference(self.fine, self.coarse)

    @property
    def difference_higher(self) -> Difference:
        """Coarse from twice the fall minus fine."""
        return Difference(self.fine, self.higher)

    @property
    def ratio(self) -> float:
        """Wall time of a fine heap over that of a coarse one, with all threads at work on either."""
        return _per_heap(self.fine) / _per_heap(self.coarse)

    @property
    def processor_ratio(self) -> float:
        """The same of the processors' time."""
        return self.fine.processor / len(self.fine.angles) / (self.coarse.processor / len(self.coarse.angles))

    @property
    def saved(self) -> float:
        """Share of the wall time that coarse graining saves [%]."""
        return 100 * (1 - 1 / self.ratio)

    def as_dict(self) -> dict[str, Any]:
        """Return plain values for JSON."""
        apart = self.difference
        return {
            "difference": apart.value,
            "u": apart.u,
            "difference_over_u": apart.standardised,
            "difference_higher": self.difference_higher.value,
            "u_higher": self.difference_higher.u,
            "wall_time_ratio": self.ratio,
            "processor_time_ratio": self.processor_ratio,
            "saved_percent": self.saved,
        }


def _per_heap(heaps: Angles) -> float:
    return heaps.seconds / len(heaps.angles)


def pour(factor: float, seeds: Sequence[int], report: Report | None = None, **changes: Any) -> Angles:
    """Pour heaps at a scale, a world each, with some settings changed, and measure their angles and the time they take.

    Raises:
        SimulationError: a heap failed.
    """
    rules = CoarseGraining(factor)
    heap, law = rules.experiment(FixedFunnel(**PAPER_FINE_HEAP | changes)), rules.model(polypropylene())
    Simulation([heap.scene(law)] * len(seeds)).run_steps(1)  # compiles
    start, spent = perf_counter(), process_time()
    outcomes = heap.run(law, seeds, report=report)
    seconds, spent = perf_counter() - start, process_time() - spent
    failures = [str(o.failure) for o in outcomes if o.failure]
    if failures:
        raise SimulationError(f"Heaps at scale {factor:g} failed: " + " ".join(failures))
    angles = tuple(float(o.observables["angle_of_repose"]) for o in outcomes)
    name = f"scale {factor:g}: {heap.particles_needed()} grains of {1000 * heap.settings.diameter:g} mm"
    name += ", twice the fall" if changes else ""
    return Angles(name, angles, seconds, tuple(int(o.details["grains_in_cup"]) for o in outcomes), spent)


def as_text(kinds: Sequence[Angles]) -> str:
    """Return the table of what has been poured so far, and the verdict once all are there."""
    rows = [["heap", "angles [deg]", "mean ± u", "on the cup", "wall per heap [s]", "processors [s]"]]
    for kind in kinds:
        angles, stay = ", ".join(f"{a:.2f}" for a in kind.angles), ", ".join(map(str, kind.in_cup))
        rows.append(
            [kind.name, angles, kind.text, stay, f"{_per_heap(kind):.1f}", f"{kind.processor / len(kind.angles):.1f}"]
        )
    lines = [aligned(rows)]
    if len(kinds) == 3:
        both = CoarseHeaps(*kinds)
        apart, higher = both.difference, both.difference_higher
        lines.append(
            f"Coarse minus fine {apart.value:+.2f}° ± {apart.u:.2f}°, {apart.standardised:.2f} u; with twice the fall "
            f"{higher.value:+.2f}° ± {higher.u:.2f}°, {higher.standardised:.2f} u. A fine heap takes "
            f"{both.ratio:.1f} times as long ({both.processor_ratio:.1f} of processors' time): scale {SCALE:g} saves "
            f"{both.saved:.0f} % (the paper: {TIME_SAVED:g} %)."
        )
    return "\n".join(lines)


def _write(path: Path | None, kinds: Sequence[Angles], before: float) -> None:
    """Write what is known so far, since a fine heap takes many minutes."""
    if path is None:
        return
    head = {"machine": machine(), "threads": cores(), "load": [before, load()], "settings": PAPER_FINE_HEAP}
    both = CoarseHeaps(*kinds).as_dict() if len(kinds) == 3 else {}
    path.write_text(json.dumps({**head, "heaps": [k.as_dict() for k in kinds], **both}, indent=2) + "\n")


class _Lines:
    """Tells every tenth of the way on standard error."""

    def __init__(self, name: str) -> None:
        self.name, self.told, self.start = name, 0, perf_counter()

    def __call__(self, share: float) -> None:
        tenths = int(10 * share)
        if tenths > self.told:
            self.told = tenths
            print(f"{self.name}: {10 * tenths} % in {perf_counter() - self.start:.0f} s", file=sys.stderr, flush=True)


def main(arguments: Sequence[str] | None = None) -> int:
    """Pour at both scales, the quick one first, and print the table."""
    parser = argparse.ArgumentParser(prog="python -m benchmarks.coarse_heap", description=__doc__)
    parser.add_argument("--fine-seeds", type=int, nargs="+", default=FINE_SEEDS)
    parser.add_argument("--coarse-seeds", type=int, nargs="+", default=COARSE_SEEDS)
    parser.add_argument("--json", type=Path, metavar="FILE", help="write all numbers to a file, as they come")
    given = parser.parse_args(arguments)
    before = load()
    kinds: list[Angles] = []
    try:
        pours: list[tuple[float, list[int], dict[str, Any]]] = [(SCALE, given.coarse_seeds, {})]
        pours += [(SCALE, given.coarse_seeds, HIGHER), (1.0, given.fine_seeds, {})]
        for factor, seeds, changes in pours:
            kinds.append(pour(factor, seeds, _Lines(f"scale {factor:g}"), **changes))
            print(as_text(kinds), flush=True)
            _write(given.json, kinds, before)
    except SimulationError as error:
        print(f"Error: {error}", file=sys.stderr)
        return 2
    print(f"{machine()}, {cores()} threads. Load before {before:.2f}, after {load():.2f}.")
    return 0


if __name__ == "__main__":
    sys.exit(main())
