"""The settled bed: grains at rest in a box, the same for every code, made by us from a written recipe.

6 mm polypropylene spheres at real stiffness between steel walls, 20 × 20 diameters wide, open above. A jittered lattice is
settled with soft, slightly larger grains, then with the real ones; at their small overlaps the bed barely moves while it
is measured, so that the rates are almost purely those of contact forces.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np
from scipy.spatial import cKDTree

from benchmarks.worker import Worker

if TYPE_CHECKING:
    from taichidem.bodies import Bodies
    from taichidem.scene import Scene
    from taichidem.walls import Plane

DIAMETER = 0.006  # [m]
WIDTH = 20 * DIAMETER
DENSITY = 910.0
STIFFNESS = 1.3e9  # [Pa]
TIME_STEP = 2.78e-6  # [s], 0.2 of the Rayleigh time
SKIN = 0.0006  # [m], the peer's; ours by default is another
CACHE = Path(__file__).parent / ".cache"

_LATTICE = 18  # grains along a side


def lattice(grains: int) -> np.ndarray:
    """Return the centres the recipe starts from: 18 × 18 grains a layer, jittered by 4 % of a diameter, (n, 3) [m]."""
    k = np.arange(grains)
    cells = np.column_stack([k % _LATTICE, (k // _LATTICE) % _LATTICE, k // _LATTICE**2]) + 0.5
    jitter = np.random.default_rng(12345).uniform(-0.04 * DIAMETER, 0.04 * DIAMETER, (grains, 3))
    return cells * (WIDTH / _LATTICE) + jitter


@dataclass(frozen=True)
class Stage:
    """Settling at one stiffness E [Pa]: soft grains are a little larger, by what they overlap more than real ones."""

    stiffness: float
    diameter: float
    steps: int

    @property
    def time_step(self) -> float:
        """0.2 of the Rayleigh time, which goes as E^(−1/2) [s]."""
        return TIME_STEP * math.sqrt(STIFFNESS / self.stiffness)


REAL = Stage(STIFFNESS, DIAMETER, 0)


def settling(grains: int) -> tuple[Stage, ...]:
    """Return the stages, those of the recipe up to 10,000 grains.

    Beyond, where the recipe has 20,000 soft and 64,000 real steps, a stage in between and fewer steps save minutes.
    """
    if grains > 10000:
        return Stage(1e7, 0.006024, 16000), Stage(1e8, 0.0060044, 10000), Stage(STIFFNESS, DIAMETER, 20000)
    return Stage(1e7, 0.006024, 16000), Stage(STIFFNESS, DIAMETER, 40000 if grains <= 3000 else 30000)


def bed_scene(position: np.ndarray, skin: float | None = SKIN, stage: Stage = REAL) -> Scene:
    """Return the box with spheres at rest at the given centres."""
    from taichidem.bodies import Bodies

    return box(Bodies.spheres(position, stage.diameter / 2, DENSITY), stage.stiffness, skin, stage.time_step)


def box(
    grains: Bodies,
    stiffness: float,
    skin: float | None = SKIN,
    time_step: float | None = None,
    headroom: float = 2 * DIAMETER,
) -> Scene:
    """Return the box with grains in it.

    Args:
        grains: at rest; stiffness: their E [Pa].
        skin, time_step: as for `Scene`.
        headroom: from the highest centre to where grains are lost [m].
    """
    from taichidem.library import polypropylene
    from taichidem.scene import Scene

    top = float(grains.position[:, 2].max()) + headroom
    return Scene(
        model=polypropylene(youngs_modulus=stiffness),
        walls=_sides(),
        bodies=grains,
        domain=((-DIAMETER,) * 3, (WIDTH + DIAMETER, WIDTH + DIAMETER, top)),
        grain_materials=("polypropylene",),
        skin=skin,
        time_step=time_step,
    )


def _sides() -> tuple[Plane, ...]:
    """Return the box: four sides and the bottom."""
    from taichidem.walls import Plane

    return (
        Plane(point=(0.0, 0.0, 0.0), normal=(1.0, 0.0, 0.0), material="steel"),
        Plane(point=(WIDTH, 0.0, 0.0), normal=(-1.0, 0.0, 0.0), material="steel"),
        Plane(point=(0.0, 0.0, 0.0), normal=(0.0, 1.0, 0.0), material="steel"),
        Plane(point=(0.0, WIDTH, 0.0), normal=(0.0, -1.0, 0.0), material="steel"),
        Plane(point=(0.0, 0.0, 0.0), normal=(0.0, 0.0, 1.0), material="steel"),
    )


def settled_bed(grains: int) -> np.ndarray:
    """Return the centres of the settled bed (n, 3) [m], kept in a file between runs."""
    stages = settling(grains)
    path = CACHE / f"bed_{grains}_{'_'.join(str(stage.steps) for stage in stages)}.npy"
    if not path.is_file():
        with Worker(1) as worker:
            position = worker.call(settle, grains, stages)
        CACHE.mkdir(exist_ok=True)
        np.save(path, position)
    return np.load(path)


def settle(grains: int, stages: Sequence[Stage]) -> np.ndarray:
    """Return the centres of the bed after its stages of settling; runs in a worker."""
    from taichidem.simulation import Simulation

    position = lattice(grains)
    for stage in stages:
        simulation = Simulation(bed_scene(position, stage=stage))
        simulation.run_steps(stage.steps)
        simulation.check()
        position = simulation.snapshot().position
    if len(position) != grains:
        raise RuntimeError(f"{grains - len(position)} of {grains} grains left the box while settling.")
    return position


def contacts_per_grain(position: np.ndarray) -> float:
    """Return the touching pairs, grain to grain and grain to wall, per grain."""
    pairs = len(cKDTree(position).query_pairs(DIAMETER, output_type="ndarray"))
    gaps = np.concatenate([position, WIDTH - position[:, :2]], axis=1) - DIAMETER / 2
    return (pairs + int((gaps < 0).sum())) / len(position)
