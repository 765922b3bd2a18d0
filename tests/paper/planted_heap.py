"""A heap whose angle is a formula of the model, made of spheres piled into a cone: the paper's flow with a known truth."""

from __future__ import annotations

from types import SimpleNamespace
from typing import ClassVar

import numpy as np

import taichidem.experiments
from taichidem import plugins
from taichidem.experiments import BulkDensity, FixedFunnel
from taichidem.experiments.base import Outcome
from taichidem.library import PAPER_HEAP
from taichidem.paper import held_out, kept_heaps, next_factor, optimum, reproduction, session
from taichidem.paper.effort import SOFT, Effort
from taichidem.paper.heaps import model_at
from taichidem.paper.kept_heaps import KeptHeaps
from taichidem.snapshot import Snapshot
from tests.analysis.conftest import cone_heap
from tests.experiments.planted import snapshot

SAME = "polypropylene-polypropylene"
SCATTER = 0.3  # [deg] from heap to heap
SMALL = Effort("quick", stiffness=SOFT, screening=1, surface=2, search=4, confirmation=6, fine=2, held_out=2)


def model_of(levels):
    """Return the model that the small flow has at some levels."""
    return model_at(levels, stiffness=SMALL.stiffness)


def kept(angles, diameter=0.006):
    """Return heaps of these angles that were never poured."""
    angles = tuple(angles)
    return KeptHeaps(diameter, tuple(range(len(angles))), angles, angles, {"window": 0.3}, 1.0, 0, {}, {})


def true_angle(model) -> float:
    """Return the planted angle [deg]: friction raises it up to a maximum at 0.5, restitution lowers it."""
    values = {effect.name: effect.values for effect in model.effects}
    friction = values["tangential_mindlin"]["static_friction"][SAME]
    restitution = values["normal_hertz"]["restitution"][SAME]
    return 33.0 - 60.0 * (friction - 0.5) ** 2 - 15.0 * (restitution - 0.3) ** 2


class PlantedHeap(FixedFunnel):
    """Pours nothing: piles spheres into the cone that the formula asks for."""

    poured: ClassVar[list[int]] = []
    failing: ClassVar[set[int]] = set()
    offset: ClassVar[float] = 0.0  # [deg], of every heap
    raised: ClassVar[float] = -1.6  # [deg], of heaps whose grains fall twice as deep
    rolling: ClassVar[float] = 0.0  # [deg], per unit of rolling friction
    bent: ClassVar[float] = 0.0  # [deg], five times that per root of what rolling friction has above its fixed value
    late_offset: ClassVar[float] = 0.0  # [deg], of heaps at an optimum: what a surface can't know
    late: ClassVar[int] = 3000  # above which seeds have it

    def run(self, models, seeds, *, schedule="worlds", report=None, frames=None, checkpoint=None):
        outcomes = [self._one(model, seed) for model, seed in _pairs(models, seeds)]
        PlantedHeap.poured.extend(int(seed) for seed in seeds)
        if report:
            report(1.0)
        return outcomes

    def _one(self, model, seed):
        if seed in self.failing:
            return Outcome({}, seed, "World 0 diverged")
        angle = true_angle(model) + self.offset + (self.late_offset if seed > self.late else 0.0)
        rolling = {effect.name: effect.values for effect in model.effects}["rolling_constant_torque"]
        angle += self.rolling * rolling["rolling_friction"][SAME]
        angle += self.bent * np.sqrt(max(rolling["rolling_friction"][SAME] - 0.05, 0.0)) / 5
        angle += self.raised if self.settings.stream_bottom == 0.1 else 0.0
        angle += SCATTER * np.random.default_rng(seed).standard_normal()
        details = {"profile": {"angle_deg": angle}}
        return Outcome({"angle_of_repose": angle}, seed, None, cone_of(angle, seed), details)


def cone_of(angle: float, seed: int) -> Snapshot:
    """Return spheres of 6 mm piled into a cone of that angle, at rest."""
    return snapshot(*cone_heap(angle, seed))


class PlantedCup(BulkDensity):
    """Weighs nothing: coarse grains pack 2 % more loosely."""

    name: ClassVar[str] = "planted_cup"

    def run(self, models, seeds, *, schedule="worlds", report=None, frames=None):
        share = 0.55 if self.settings.diameter < 0.004 else 0.54
        values = [
            share * model.materials[0].density * (1 + 0.002 * (seed % 3 - 1)) for model, seed in _pairs(models, seeds)
        ]
        return [Outcome({"bulk_density": value}, seed) for value, seed in zip(values, seeds, strict=True)]


def _pairs(models, seeds):
    models = models if isinstance(models, list) else [models] * len(seeds)
    return zip(models, map(int, seeds), strict=True)


def plant(patch) -> None:
    """Put planted heaps and the planted cup in the place of the simulated ones; `patch` is pytest's monkeypatch."""
    patch.setattr(session, "coarse_heap", coarse_heap)
    patch.setattr(optimum, "coarse_heap", coarse_heap)
    patch.setattr(reproduction, "coarse_heap", coarse_heap)
    patch.setattr(next_factor, "similar_heap", similar_heap)
    patch.setattr(reproduction, "fine_heap", fine_heap)
    patch.setattr(kept_heaps, "Simulation", lambda scenes: SimpleNamespace(run_steps=lambda steps: None))
    patch.setitem(taichidem.experiments.BUILT_IN, "planted_cup", PlantedCup)
    patch.setattr(held_out, "TESTS", {"density": ("planted_cup", {"cup_radius": "36 mm"}, 1184)})
    plugins.refresh()


def coarse_heap() -> PlantedHeap:
    return PlantedHeap(**PAPER_HEAP)


def similar_heap() -> PlantedHeap:
    return PlantedHeap(**PAPER_HEAP | {"stream_bottom": "100 mm", "stream_top": "140 mm"})


def fine_heap() -> PlantedHeap:
    return PlantedHeap(**PAPER_HEAP | {"diameter": "3 mm", "particles": 20000})
