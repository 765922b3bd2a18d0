"""What "strong" is measured against when an effect is put to the test as a hypothesis about what a model lacks."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass

from taichidem.materials import Material, MaterialPair

Values = Mapping[str, "float | Mapping[str, float]"]


@dataclass(frozen=True)
class ProbeScale:
    """The grain, the materials and the pace of the tests for which an effect shall be plainly strong.

    Args:
        radius: of the grain [m].
        materials: of the model, that of the grains first.
        gravity: acceleration of free fall [m/s²]; that of the earth where a model has none.
        speed: at which things typically move in the tests [m/s].
        mass: of the grain [kg]; that of a solid sphere where not given.
    """

    radius: float
    materials: Sequence[Material]
    gravity: float = 9.81
    speed: float = 1.0
    mass: float | None = None

    @property
    def weight(self) -> float:
        """Weight of a grain [N]."""
        mass = self.mass or self.materials[0].density * 4 / 3 * math.pi * self.radius**3
        return mass * self.gravity

    @property
    def modulus(self) -> float:
        """E* of two grains [Pa]."""
        return MaterialPair(self.materials[0], self.materials[0]).youngs_modulus

    @property
    def grain_pair(self) -> str:
        """Name of the pair of two grains."""
        return f"{self.materials[0].name}-{self.materials[0].name}"

    def loaded_overlap(self, load: float) -> float:
        """Return the overlap of two grains pressed together by a force [N], δ = (F/(4/3 E* √(R/2)))^(2/3) [m]."""
        return (load / (4 / 3 * self.modulus * math.sqrt(self.radius / 2))) ** (2 / 3)

    def between_grains_and_at_walls(self, between: float, at_walls: float) -> dict[str, float]:
        """Return a value per pair of materials: of two grains, and of a grain with anything else."""
        grain, *others = (material.name for material in self.materials)
        pairs = {self.grain_pair: between} | {f"{grain}-{other}": at_walls for other in others}
        return pairs | {f"{a}-{b}": at_walls for k, a in enumerate(others) for b in others[k:]}


def between(start: float, end: float | Mapping[str, float], share: float) -> float | dict[str, float]:
    """Return start + share (end − start), pair by pair where the end is given per pair."""
    if isinstance(end, Mapping):
        return {pair: start + share * (value - start) for pair, value in end.items()}
    return start + share * (end - start)
