"""A form that runs in the engine and whose volume and moments everybody can add up: a row of touching spheres."""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np

from taichidem.shapes import Elements, GrainShape


@dataclass(frozen=True)
class Row(GrainShape):
    """So many equal spheres of a radius [m] in a row along z, each touching the next."""

    spheres: int = 2
    r: float = 1.0

    @property
    def volume(self) -> float:
        return self.spheres * 4 / 3 * math.pi * self.r**3

    @property
    def inertia(self) -> np.ndarray:
        across = 0.4 * self.r**2 + float(np.mean(self.places**2))
        return np.array([across, across, 0.4 * self.r**2])

    @property
    def places(self) -> np.ndarray:
        """Centres along z [m]."""
        return 2 * self.r * (np.arange(self.spheres) - (self.spheres - 1) / 2)

    @property
    def elements(self) -> Elements:
        flat = np.zeros(self.spheres)
        return Elements(np.column_stack([flat, flat, self.places]), np.full(self.spheres, self.r))
