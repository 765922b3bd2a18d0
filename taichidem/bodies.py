"""Bodies as NumPy arrays: what a scene puts into the engine."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, fields, replace
from typing import Literal

import numpy as np

from taichidem.errors import InputError

Kind = Literal["sphere", "multisphere", "superquadric"]


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
        element_radius: of the sphere, or of the sphere about a superquadric [m], (m,).
        element_material: number of its material, (m,).
        element_axes: semi-axes of superquadrics along the principal axes [m], (m, 3); None where all elements are spheres.
        element_exponents: their exponents n₁ (profile along z) and n₂ (section across z), (m, 2); None as above.

    Raises:
        InputError: arrays of differing length, values that are no numbers, a mass or radius not above 0, or bodies composed
            of superquadrics.
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
    element_axes: np.ndarray | None = None
    element_exponents: np.ndarray | None = None

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
            "element_axes": (m, 3),
            "element_exponents": (m, 2),
        }
        if (self.element_axes is None) != (self.element_exponents is None):
            raise InputError("Bodies has one of element_axes and element_exponents; give both, or neither for spheres.")
        given = {name: array for name in shapes if (array := getattr(self, name)) is not None}
        given["mass"] = self.mass
        for name, shape in shapes.items():
            array = given.get(name)
            if array is not None and array.shape != shape:
                raise InputError(f"Bodies.{name} has shape {array.shape}; expected {shape}.")
        for name, array in given.items():
            if not np.all(np.isfinite(array)):
                raise InputError(f"Bodies.{name} holds NaN or infinite values; give finite SI numbers.")
        for name in {"mass", "inertia", "radius", "element_radius", "element_axes"} & given.keys():
            if np.any(given[name] <= 0):
                raise InputError(f"Bodies.{name} holds values not above 0 (lowest {given[name].min():g}).")
        if np.any(np.abs(np.linalg.norm(self.orientation, axis=1) - 1) > 1e-6):
            raise InputError(
                "Bodies.orientation holds quaternions that are not of length 1; divide each by its length."
            )
        if m and (self.element_body.min() < 0 or self.element_body.max() >= n):
            raise InputError(
                f"Bodies.element_body names body {self.element_body.max()} of {n}; numbers run from 0 to {n - 1}."
            )
        if self.element_axes is not None and not self.single:
            raise InputError(
                "Bodies holds superquadrics that are not each a body of their own about its centre; compose bodies of spheres."
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

    @classmethod
    def joined(cls, parts: Sequence[Bodies]) -> Bodies:
        """Return several sets of bodies as one, in order; spheres beside superquadrics become superquadrics.

        Raises:
            InputError: no set, or composed bodies beside superquadrics.
        """
        if not parts:
            raise InputError("No bodies were given to join; give one set or more.")
        if any(part.element_axes is not None for part in parts):
            parts = [part.as_superquadrics() for part in parts]
        starts = np.cumsum([0, *(len(part) for part in parts)])[:-1]
        numbered = [part.element_body + start for part, start in zip(parts, starts, strict=True)]
        arrays = {
            field.name: None
            if getattr(parts[0], field.name) is None
            else np.concatenate([getattr(p, field.name) for p in parts])
            for field in fields(cls)
        }
        return cls(**{**arrays, "element_body": np.concatenate(numbered)})  # type: ignore[arg-type]

    def as_superquadrics(self) -> Bodies:
        """Return the bodies with their spheres described as superquadrics of three equal axes and exponents 2.

        Raises:
            InputError: composed bodies, which superquadrics can't describe.
        """
        if self.element_axes is not None:
            return self
        if not self.single:
            raise InputError(
                "Composed bodies can't stand beside superquadrics in one world; put them into two simulations."
            )
        m = len(self.element_radius)
        return replace(
            self,
            element_axes=np.repeat(self.element_radius[:, None], 3, axis=1),
            element_exponents=np.full((m, 2), 2.0),
        )

    @property
    def single(self) -> bool:
        """True if every body is one element about its own centre."""
        return (
            len(self.element_body) == len(self.mass)
            and bool(np.all(self.element_body == np.arange(len(self.mass))))
            and not np.any(self.element_offset)
        )

    @property
    def kind(self) -> Kind:
        """What the bodies need of an engine: "sphere", "multisphere" or "superquadric"."""
        if self.element_axes is not None:
            return "superquadric"
        isotropic = bool(np.all(self.inertia == self.inertia[:, :1]))
        return "sphere" if self.single and isotropic else "multisphere"

    @property
    def bounding_radius(self) -> np.ndarray:
        """Radius of a sphere about each body's centre that holds it whole [m], (n,)."""
        bounds: np.ndarray = np.zeros(len(self.mass))
        np.maximum.at(bounds, self.element_body, np.linalg.norm(self.element_offset, axis=1) + self.element_radius)
        return bounds

    @property
    def smallest_radius(self) -> float:
        """Smallest radius of a sphere, or semi-axis of a superquadric [m]; the time step is chosen for it."""
        return float((self.element_radius if self.element_axes is None else self.element_axes).min())

    def __len__(self) -> int:
        return len(self.mass)
