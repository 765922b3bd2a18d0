"""What a shape costs: settled beds of grains of equal volume, timed in turn, beside LIGGGHTS where it is installed.

3,000 grains of the volume of a 6 mm sphere in the box of `bed`, 20 × 20 diameters wide, at E = 100 MPa. They start turned at
random on a lattice of 15 × 15 a layer and settle for 0.3 s; each block then starts from that bed at rest. Times are those of the
processor, so that other work on the machine counts little.
"""

from __future__ import annotations

import argparse
import json
import sys
from collections.abc import Sequence
from contextlib import ExitStack
from pathlib import Path
from time import process_time
from typing import TYPE_CHECKING

import numpy as np

from benchmarks import peer_liggghts
from benchmarks.bed import CACHE, DENSITY, DIAMETER, SKIN, box
from benchmarks.ours import Block
from benchmarks.peer_clumps import PeerClumps
from benchmarks.report import ShapeSpeed, last_core, load, machine, shapes_table, tell
from benchmarks.worker import Worker
from taichidem.shapes import GrainShape, Multisphere, Superquadric

if TYPE_CHECKING:
    from taichidem.scene import Scene

GRAINS = 3000
STIFFNESS = 1e8  # [Pa]
SETTLING = 0.3  # [s]
BLOCKS = 5
STEPS = {"sphere": 2000, "clump": 1000, "spheroid": 600, "box-like": 400}  # of a timed block
HEADROOM = 0.1  # while settling [m]
_LATTICE, _SPACING = 15, np.array([0.008, 0.008, 0.0085])  # grains along a side, and apart [m]
_ASTRAY = 0.9  # largest share of the long axis along a side, 26° off

CLUMP = Multisphere.spheroid(1.5, 3, DIAMETER / 2)
SHAPES: dict[str, GrainShape | None] = {
    "sphere": None,
    "clump": CLUMP,
    "spheroid": Superquadric.spheroid(1.5, DIAMETER / 2),
    "box-like": Superquadric(1.0, 1.0, 1.5, 4.0, 4.0),
}
MEASURED = ("sphere", "clump", "spheroid")  # the box-like one takes minutes to settle
NAMES = {
    "sphere": "sphere",
    "clump": "clump of 3 spheres, 1.5 long",
    "spheroid": "superquadric spheroid, 1.5 long",
    "box-like": "superquadric n1 = n2 = 4, 1.5 long",
}
TARGETS = {"clump": (4.0, 2.5), "spheroid": (6.0, 3.0)}  # cost over a sphere's: at most, and aimed at


def lattice(name: str) -> tuple[np.ndarray, np.ndarray]:
    """Return centres (n, 3) [m] and orientations (n, 4) of a shape before settling.

    No grain points at a neighbour or a side. Spheres are moved by up to 4 % of a diameter, or they would stay in columns.
    """
    from taichidem.grain import random_rotations

    k = np.arange(GRAINS)
    cells = np.column_stack([k % _LATTICE, (k // _LATTICE) % _LATTICE, k // _LATTICE**2]) + 0.5
    rng = np.random.default_rng(12345)
    if SHAPES[name] is None:
        jitter = rng.uniform(-0.04 * DIAMETER, 0.04 * DIAMETER, (GRAINS, 3))
        return cells * _SPACING + jitter, np.tile((1.0, 0.0, 0.0, 0.0), (GRAINS, 1))
    drawn = random_rotations(rng, 2 * GRAINS)
    w, x, y, z = drawn.T
    along = np.abs([2 * (x * z + w * y), 2 * (y * z - w * x)])  # of the long axis, on the lattice's directions
    return cells * _SPACING, drawn[np.all(along < _ASTRAY, axis=0)][:GRAINS]


def scene(name: str, position: np.ndarray, orientation: np.ndarray, headroom: float = 2 * DIAMETER) -> Scene:
    """Return the box with grains of a shape at rest."""
    from taichidem.bodies import Bodies

    shape = SHAPES[name]
    if shape is None:
        grains = Bodies.spheres(position, DIAMETER / 2, DENSITY)
    else:
        grains = shape.bodies(position, DENSITY, radius=DIAMETER / 2, orientation=orientation)
    return box(grains, STIFFNESS, SKIN, headroom=headroom)


def settle(name: str) -> tuple[np.ndarray, np.ndarray]:
    """Return centres and orientations of a shape's settled bed; runs in a worker."""
    from taichidem.simulation import Simulation

    simulation = Simulation(scene(name, *lattice(name), HEADROOM))
    simulation.run(SETTLING)
    simulation.check()
    end = simulation.snapshot()
    if len(end.mass) != GRAINS:
        raise RuntimeError(f"{GRAINS - len(end.mass)} of {GRAINS} grains left the box while settling.")
    return end.position, end.orientation


def settled_bed(name: str, worker: Worker) -> tuple[np.ndarray, np.ndarray]:
    """Return the settled bed of a shape, kept in a file between runs."""
    path = CACHE / f"shapes_bed_{name}_{GRAINS}_{SETTLING}.npz"
    if not path.is_file():
        tell(f"{NAMES[name]}: settling")
        position, orientation = worker.call(settle, name)
        CACHE.mkdir(exist_ok=True)
        np.savez(path, position=position, orientation=orientation)
    kept = np.load(path)
    return kept["position"], kept["orientation"]


def timed_block(name: str, position: np.ndarray, orientation: np.ndarray, steps: int) -> Block:
    """Start from a settled bed at rest, warm up for a quarter, and time the steps that follow; runs in a worker."""
    from taichidem.simulation import Simulation

    simulation = Simulation(scene(name, position, orientation))
    simulation.run_steps(max(50, steps // 4))
    before = simulation.snapshot().rebuilds
    start = process_time()
    simulation.run_steps(steps)
    seconds = process_time() - start
    simulation.check()
    return Block(GRAINS * steps / seconds, simulation.snapshot().rebuilds - before)


def measure_shapes(peer: bool, quick: bool = False, names: Sequence[str] = MEASURED) -> list[ShapeSpeed]:
    """Settle the shapes' beds and time blocks of them in turn, on one thread of one processor; spheres come first."""
    core = last_core()
    done: dict[str, list[Block]] = {name: [] for name in names}
    steps = {name: STEPS[name] // (4 if quick else 1) for name in names}
    rates: tuple[list[float], list[int]] = ([], [])
    with ExitStack() as stack:
        workers = {name: stack.enter_context(Worker(1, core)) for name in names}
        beds = {name: settled_bed(name, workers[name]) for name in names}
        theirs = None
        if peer and "clump" in names:
            theirs = _peer_bed(workers["clump"].call(time_step, "clump"), core or 0)
        for name in names:  # compiles or loads kernels
            workers[name].call(timed_block, name, *beds[name], 50)
        for block in range(BLOCKS):
            tell(f"beds of {', '.join(names)}: block {block + 1} of {BLOCKS}")
            for name in names:
                done[name].append(workers[name].call(timed_block, name, *beds[name], steps[name]))
                if theirs is not None and name == "clump":
                    theirs.run(steps[name])
        if theirs is not None:
            rates = theirs.close()
    spheres = [b.rate for b in done["sphere"]]
    return [_speed(name, done[name], spheres, rates if name == "clump" else ([], [])) for name in names]


def time_step(name: str) -> float:
    """Return the time step of a shape's bed [s]; runs in a worker."""
    return scene(name, *lattice(name)).dt


def _peer_bed(dt: float, core: int) -> PeerClumps:
    tell("clumps on LIGGGHTS: settling")
    return PeerClumps(CLUMP, GRAINS, STIFFNESS, dt, round(SETTLING / dt), core)


def _speed(name: str, blocks: list[Block], spheres: list[float], peer: tuple[list[float], list[int]]) -> ShapeSpeed:
    rates = [block.rate for block in blocks]
    costs = [sphere / rate for sphere, rate in zip(spheres, rates, strict=True)]
    return ShapeSpeed(NAMES[name], rates, costs, [block.rebuilds for block in blocks], *peer, TARGETS.get(name))


def main(arguments: Sequence[str] | None = None) -> int:
    """Measure the beds alone and print their table."""
    parser = argparse.ArgumentParser(prog="python -m benchmarks.shapes_bed", description=__doc__)
    parser.add_argument("--no-peer", action="store_true", help="do not run LIGGGHTS")
    parser.add_argument("--json", type=Path, metavar="FILE", help="write all numbers to a file")
    others = [name for name in SHAPES if name != "sphere"]
    parser.add_argument("--shapes", nargs="+", choices=others, default=MEASURED[1:], help="beside spheres")
    given = parser.parse_args(arguments)
    before = load()
    peer = not given.no_peer and peer_liggghts.executable() is not None
    shapes = measure_shapes(peer, names=("sphere", *given.shapes))
    print(f"{machine()}\nLoad before {before:.2f}, after {load():.2f} (the benchmark itself is 1).\n")
    print(shapes_table(shapes))
    if given.json is not None:
        numbers = {"machine": machine(), "load": [before, load()], "shapes": [s.as_dict() for s in shapes]}
        given.json.write_text(json.dumps(numbers, indent=2) + "\n")
    return 0


if __name__ == "__main__":
    sys.exit(main())
