"""Bodies as NumPy arrays: what a scene puts into the engine."""

from __future__ import annotations

from dataclasses import dataclass, fields

import numpy as np

from taichidem.errors import InputError


@dataclass(frozen=True)
class Bodies:
    """Rigid bodies and the contact elements they are made of.

    Args:
        position: centres of mass [m], shape (n, 3).
        velocity: [m/s], (n, 3).
        spin: angular velocity [rad/s], world frame, (n, 3).
        orientation: unit quaternions (w, x, y, z), principal frame → world, (n, 4).
        mass: [kg], (n,).
        inertia: principal moments [kg m²], (n, 3).
        radius: radius of the sphere of equal volume [m], (n,).
        element_body: body of each element, (m,).
        element_offset: centre of each element in the body's principal frame [m], (m, 3).
        element_radius: [m], (m,).
        element_material: number of its material, (m,).

    Raises:
        InputError: arrays of differing length, values that are no numbers, or a mass or radius not above 0.
    """

    position: np.ndarray
    velocity: np.ndarray
    spin: np.ndarray
    orientation: np.ndarray
    mass: np.ndarray
    inertia: np.ndarray
    radius: np.ndarray
    element_body: np.ndarray
    element_offset: np.ndarray
    element_radius: np.ndarray
    element_material: np.ndarray

    def __post_init__(self) -> None:
        n, m = len(self.mass), len(self.element_body)
        shapes = {
            "position": (n, 3),
            "velocity": (n, 3),
            "spin": (n, 3),
            "orientation": (n, 4),
            "inertia": (n, 3),
            "radius": (n,),
            "element_offset": (m, 3),
            "element_radius": (m,),
            "element_material": (m,),
        }
        for name, shape in shapes.items():
            array = getattr(self, name)
            if array.shape != shape:
                raise InputError(f"Bodies.{name} has shape {array.shape}; expected {shape}.")
        for field in fields(self):
            if not np.all(np.isfinite(getattr(self, field.name))):
                raise InputError(f"Bodies.{field.name} holds NaN or infinite values; give finite SI numbers.")
        for name in ("mass", "inertia", "radius", "element_radius"):
            if np.any(getattr(self, name) <= 0):
                raise InputError(f"Bodies.{name} holds values not above 0 (lowest {getattr(self, name).min():g}).")
        if np.any(np.abs(np.linalg.norm(self.orientation, axis=1) - 1) > 1e-6):
            raise InputError(
                "Bodies.orientation holds quaternions that are not of length 1; divide each by its length."
            )
        if m and (self.element_body.min() < 0 or self.element_body.max() >= n):
            raise InputError(
                f"Bodies.element_body names body {self.element_body.max()} of {n}; numbers run from 0 to {n - 1}."
            )

    @classmethod
    def spheres(
        cls,
        position: np.ndarray,
        radius: np.ndarray | float,
        density: float,
        *,
        material: int = 0,
        velocity: np.ndarray | tuple = (0.0, 0.0, 0.0),
        spin: np.ndarray | tuple = (0.0, 0.0, 0.0),
    ) -> Bodies:
        """Return solid spheres, m = 4/3 π ρ R³ and I = 2/5 m R², each its own single element."""
        position = np.atleast_2d(np.asarray(position, float))
        n = len(position)
        radii: np.ndarray = np.broadcast_to(np.asarray(radius, float), (n,)).copy()
        mass: np.ndarray = density * 4 / 3 * np.pi * radii**3
        return cls(
            position=position,
            velocity=np.broadcast_to(np.asarray(velocity, float), (n, 3)).copy(),
            spin=np.broadcast_to(np.asarray(spin, float), (n, 3)).copy(),
            orientation=np.tile([1.0, 0.0, 0.0, 0.0], (n, 1)),
            mass=mass,
            inertia=np.repeat((0.4 * mass * radii**2)[:, None], 3, axis=1),
            radius=radii,
            element_body=np.arange(n),
            element_offset=np.zeros((n, 3)),
            element_radius=radii.copy(),
            element_material=np.full(n, material),
        )

    @property
    def single(self) -> bool:
        """True if every body is one sphere about its own centre."""
        return (
            len(self.element_body) == len(self.mass)
            and bool(np.all(self.element_body == np.arange(len(self.mass))))
            and not np.any(self.element_offset)
            and bool(np.all(self.inertia == self.inertia[:, :1]))
        )

    def __len__(self) -> int:
        return len(self.mass)
