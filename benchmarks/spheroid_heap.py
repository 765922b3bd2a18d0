"""The same heap of spheroids twice, made of spheres and as superquadrics: `python -m benchmarks.spheroid_heap`.

1,000 prolate spheroids, half as long again as wide, of the volume of a 6 mm sphere, poured on a cup that they overflow.
Polypropylene at softened stiffness without rolling resistance, so that friction and form alone hold the heap.
"""

from __future__ import annotations

import argparse
import json
import sys
from collections.abc import Callable, Sequence
from dataclasses import asdict, dataclass, replace
from pathlib import Path
from time import perf_counter, process_time
from typing import Any

from benchmarks.angles import Angles, Difference
from benchmarks.report import aligned, load, machine
from taichidem.effects import RollingConstantTorque
from taichidem.errors import SimulationError
from taichidem.experiments import FixedFunnel
from taichidem.library import PAPER_HEAP, polypropylene
from taichidem.scene import Model
from taichidem.shapes import GrainShape, Multisphere, ShapeError, Superquadric
from taichidem.simulation import Simulation

ASPECT_RATIO = 1.5
SPHERES = 7  # of a clump; with 3 it lacks 16 % of the spheroid's volume between them
SEEDS = (1, 2, 3, 4, 5)
FARTHEST = 2.5  # difference over its standard uncertainty
# The paper's heap on a smaller cup. About 700 grains stay on it.
SETTINGS = PAPER_HEAP | {
    "cup_radius": "40 mm",
    "rim_height": "15 mm",
    "stream_bottom": "60 mm",
    "stream_top": "100 mm",
    "particles": 1000,
}
Report = Callable[[str, float], None]


@dataclass(frozen=True)
class SpheroidHeaps:
    """Heaps of clumps and of superquadrics, and how far the clump is from the spheroid."""

    clumps: Angles
    superquadrics: Angles
    shape_error: ShapeError

    @property
    def difference(self) -> Difference:
        """Superquadrics minus clumps."""
        return Difference(self.clumps, self.superquadrics)

    @property
    def agrees(self) -> bool:
        """True if the angles differ by at most 2.5 of their combined standard uncertainties."""
        return self.difference.standardised <= FARTHEST

    def as_dict(self) -> dict[str, Any]:
        """Return plain values for JSON."""
        apart = self.difference
        return {
            "settings": SETTINGS,
            "aspect_ratio": ASPECT_RATIO,
            "spheres": SPHERES,
            "shape_error": asdict(self.shape_error),
            "heaps": [self.clumps.as_dict(), self.superquadrics.as_dict()],
            "difference": apart.value,
            "u": apart.u,
            "difference_over_u": apart.standardised,
        }


def model(shape: GrainShape | None) -> Model:
    """Return the paper's polypropylene in a form, without rolling resistance."""
    spheres = polypropylene()
    effects = [e for e in spheres.effects if not isinstance(e, RollingConstantTorque)]
    return replace(spheres, effects=effects, shape=shape)


def pour(name: str, shape: GrainShape | None, seeds: Sequence[int] = SEEDS, report: Report | None = None) -> Angles:
    """Pour a heap of a form per seed, all as worlds of one simulation, and measure the angles.

    Raises:
        SimulationError: a heap failed.
    """
    heap, law = FixedFunnel(**SETTINGS), model(shape)
    Simulation([heap.scene(law)] * len(seeds)).run_steps(1)  # compiles
    start, spent = perf_counter(), process_time()
    outcomes = heap.run(law, seeds, report=(lambda share: report(name, share)) if report else None)
    seconds, spent = perf_counter() - start, process_time() - spent
    failures = [str(o.failure) for o in outcomes if o.failure]
    if failures:
        raise SimulationError(f"Heaps of {name} failed: " + " ".join(failures))
    angles = tuple(float(o.observables["angle_of_repose"]) for o in outcomes)
    return Angles(name, angles, seconds, tuple(int(o.details["grains_in_cup"]) for o in outcomes), spent)


def pour_both(seeds: Sequence[int] = SEEDS, report: Report | None = None) -> SpheroidHeaps:
    """Pour the heaps of clumps and of superquadrics."""
    clump = Multisphere.spheroid(ASPECT_RATIO, SPHERES)
    return SpheroidHeaps(
        pour(f"clumps of {SPHERES} spheres", clump, seeds, report),
        pour("superquadrics", Superquadric.spheroid(ASPECT_RATIO), seeds, report),
        clump.shape_error(ASPECT_RATIO),
    )


def as_text(heaps: SpheroidHeaps) -> str:
    """Return the table and the verdict."""
    error, apart = heaps.shape_error, heaps.difference
    rows = [["spheroids as", "angles [deg]", "mean ± u", "on the cup", "wall [s]", "processors [s]"]]
    for kind in (heaps.clumps, heaps.superquadrics):
        angles, stay = ", ".join(f"{a:.2f}" for a in kind.angles), ", ".join(map(str, kind.in_cup))
        rows.append([kind.name, angles, kind.text, stay, f"{kind.seconds:.0f}", f"{kind.processor:.0f}"])
    return "\n".join(
        [
            aligned(rows),
            f"The clump: volume {100 * error.volume:+.1f} %, inertia {100 * error.inertia:+.1f} % at equal length, largest gap "
            f"{100 * error.largest_gap:.1f} % of the short semi-axis.",
            f"Difference {apart.value:+.2f}° ± {apart.u:.2f}°, {apart.standardised:.2f} u (allowed {FARTHEST}): "
            + ("agrees." if heaps.agrees else "does NOT agree."),
        ]
    )


def main(arguments: Sequence[str] | None = None) -> int:
    """Print the table; the exit status is 0 if both forms agree."""
    parser = argparse.ArgumentParser(prog="python -m benchmarks.spheroid_heap", description=__doc__)
    parser.add_argument("--seeds", type=int, nargs="+", default=SEEDS)
    parser.add_argument("--json", type=Path, metavar="FILE", help="write all numbers to a file")
    given = parser.parse_args(arguments)
    from taichidem.cli.progress import progress

    before = load()
    try:
        with progress() as report:
            heaps = pour_both(given.seeds, report)
    except SimulationError as error:
        print(f"Error: {error}", file=sys.stderr)
        return 2
    print(f"{machine()}\nLoad before {before:.2f}, after {load():.2f}.\n\n{as_text(heaps)}")
    if given.json is not None:
        numbers = {"machine": machine(), "load": [before, load()], **heaps.as_dict()}
        given.json.write_text(json.dumps(numbers, indent=2) + "\n")
    return 0 if heaps.agrees else 1


if __name__ == "__main__":
    sys.exit(main())
