"""What a grain's shape is: a rigid body's form, its mass properties, and the bodies made in it."""

from __future__ import annotations

import math
from abc import ABC, abstractmethod
from dataclasses import dataclass

import numpy as np

from taichidem.bodies import Bodies, Kind
from taichidem.errors import InputError


@dataclass(frozen=True)
class Elements:
    """The contact elements of a shape, in its principal frame about its centre of mass.

    Args:
        offset: centres [m], (m, 3).
        radius: of the spheres, or of the sphere about a superquadric [m], (m,).
        axes: semi-axes of superquadrics [m], (m, 3); None for spheres.
        exponents: n₁ and n₂ of superquadrics, (m, 2); None for spheres.
    """

    offset: np.ndarray
    radius: np.ndarray
    axes: np.ndarray | None = None
    exponents: np.ndarray | None = None


class GrainShape(ABC):
    """A form of some size; bodies are made in it at any other size too.

    A shape is hashable and equal to another that describes the same form, since stored runs are found by it.
    """

    @property
    @abstractmethod
    def volume(self) -> float:
        """Volume [m³]."""

    @property
    @abstractmethod
    def inertia(self) -> np.ndarray:
        """Principal moments of inertia over the mass [m²], (3,)."""

    @property
    @abstractmethod
    def elements(self) -> Elements:
        """The contact elements in the principal frame."""

    @property
    def equal_volume_radius(self) -> float:
        """Radius of the sphere of equal volume [m]."""
        return (3 * self.volume / (4 * math.pi)) ** (1 / 3)

    @property
    def bounding_radius(self) -> float:
        """Radius of a sphere about the centre of mass that holds the shape [m]."""
        parts = self.elements
        return float((np.linalg.norm(parts.offset, axis=1) + parts.radius).max())

    @property
    def kind(self) -> Kind:
        """What bodies of this shape need of an engine."""
        return self.bodies(np.zeros((1, 3)), 1.0).kind

    @property
    def round(self) -> bool:
        """True of spheres alone: no other body has the volume of the smallest sphere about it."""
        return math.isclose(self.bounding_radius, self.equal_volume_radius, rel_tol=1e-9)

    def bodies(
        self,
        position: np.ndarray,
        density: float,
        *,
        radius: np.ndarray | float | None = None,
        orientation: np.ndarray | None = None,
        material: int = 0,
        velocity: np.ndarray | tuple = (0.0, 0.0, 0.0),
        spin: np.ndarray | tuple = (0.0, 0.0, 0.0),
    ) -> Bodies:
        """Return solid bodies of this shape.

        Args:
            position: centres of mass [m], (n, 3).
            density: [kg/m³].
            radius: of the sphere of equal volume [m], one number or (n,); the shape's own size where left out.
            orientation: unit quaternions (w, x, y, z), principal frame → world, (n, 4) or (4,); unturned where left out.
            material: number of the material in the model.
            velocity: [m/s]; spin: [rad/s], world frame.

        Raises:
            InputError: arrays that do not fit together, or values not above 0.
        """
        position = np.atleast_2d(np.asarray(position, float))
        n = len(position)
        own = self.equal_volume_radius
        try:
            radii: np.ndarray = np.broadcast_to(np.asarray(own if radius is None else radius, float), (n,)).copy()
            turned = np.broadcast_to(
                np.asarray((1.0, 0, 0, 0) if orientation is None else orientation, float), (n, 4)
            ).copy()
            velocities = np.broadcast_to(np.asarray(velocity, float), (n, 3)).copy()
            spins = np.broadcast_to(np.asarray(spin, float), (n, 3)).copy()
        except ValueError as error:
            raise InputError(f"radius, orientation, velocity or spin does not fit {n} bodies: {error}.") from None
        scale = radii / own
        parts = self.elements
        m = len(parts.radius)
        mass: np.ndarray = density * self.volume * scale**3
        return Bodies(
            position=position,
            velocity=velocities,
            spin=spins,
            orientation=turned,
            mass=mass,
            inertia=(mass * scale**2)[:, None] * self.inertia,
            radius=radii,
            element_body=np.repeat(np.arange(n), m),
            element_offset=_each(scale, parts.offset),
            element_radius=_each(scale, parts.radius[:, None])[:, 0],
            element_material=np.full(n * m, material),
            element_axes=None if parts.axes is None else _each(scale, parts.axes),
            element_exponents=None if parts.exponents is None else np.tile(parts.exponents, (n, 1)),
        )


def _each(scale: np.ndarray, rows: np.ndarray) -> np.ndarray:
    """Return the rows once per body, times its scale, (n m, k)."""
    return (scale[:, None, None] * rows[None]).reshape(-1, rows.shape[1])
