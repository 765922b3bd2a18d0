"""The grains of a test: their sizes, form and material, and the bodies that are made of them."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from taichidem.bodies import Bodies
from taichidem.effects.base import SetupEffect
from taichidem.materials import Material
from taichidem.shapes.base import GrainShape


@dataclass(frozen=True)
class Drawn:
    """Sizes and orientations of grains that wait to be put somewhere.

    Args:
        radii: of the spheres of equal volume [m], (n,).
        orientation: quaternions (n, 4), or None where all are spheres.
    """

    radii: np.ndarray
    orientation: np.ndarray | None = None

    def rows(self, chosen: np.ndarray) -> Drawn:
        """Return some of them."""
        return Drawn(self.radii[chosen], None if self.orientation is None else self.orientation[chosen])


@dataclass(frozen=True)
class Grain:
    """Grains of one material and form, of one size or of several sizes in equal numbers.

    Args:
        radius: nominal, of the sphere of equal volume [m]; that of a grain of the mean volume.
        material: of the grains.
        number: of the material in the model.
        relative_sizes: radii over the nominal one.
        changes: set-up effects, which may change the bodies, such as their mass.
        shape: their form; spheres where left out.
    """

    radius: float
    material: Material
    number: int
    relative_sizes: tuple[float, ...] = (1.0,)
    changes: tuple[SetupEffect, ...] = ()
    shape: GrainShape | None = None

    @property
    def mass(self) -> float:
        """m = 4/3 π ρ R³ [kg], the mean mass."""
        return 4 / 3 * np.pi * self.material.density * self.radius**3

    def draw(self, rng: np.random.Generator, count: int) -> Drawn:
        """Return `count` grains: as many of each size as can be, in random order, turned at random unless they are round."""
        if len(self.relative_sizes) == 1:
            radii: np.ndarray = np.full(count, self.radius * self.relative_sizes[0])
        else:
            radii = self.radius * rng.permutation(np.resize(self.relative_sizes, count))
        if self.shape is None or self.shape.round:
            return Drawn(radii)
        return Drawn(radii, random_rotations(rng, count))

    def bodies(
        self, drawn: Drawn, centres: np.ndarray | None = None, velocity: tuple[float, float, float] = (0.0, 0.0, 0.0)
    ) -> Bodies:
        """Return grains at the given centres [m], all at the origin where none are given."""
        places = np.zeros((len(drawn.radii), 3)) if centres is None else centres
        density, material = self.material.density, self.number
        if self.shape is None:
            bodies = Bodies.spheres(places, drawn.radii, density, material=material, velocity=velocity)
        else:
            bodies = self.shape.bodies(
                places,
                density,
                radius=drawn.radii,
                orientation=drawn.orientation,
                material=material,
                velocity=velocity,
            )
        for change in self.changes:
            bodies = change.grains(bodies)
        return bodies

    def sample(self) -> Bodies:
        """Return a grain of the largest and one of the smallest size, at the origin: what a scene must make room for."""
        return self.bodies(Drawn(self.radius * np.array([max(self.relative_sizes), min(self.relative_sizes)])))


def random_rotations(rng: np.random.Generator, count: int) -> np.ndarray:
    """Return unit quaternions, uniform over all rotations, (count, 4): directions of normal numbers in four dimensions."""
    drawn = rng.normal(size=(count, 4))
    return drawn / np.linalg.norm(drawn, axis=1, keepdims=True)
