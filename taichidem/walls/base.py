"""What a wall is: a rigid surface that may move, turn and be removed, made of elements of some kind."""

from __future__ import annotations

import math
from dataclasses import dataclass, field

import numpy as np

from taichidem.errors import InputError

Vector = tuple[float, float, float]


def finite_vector(name: str, value: object) -> np.ndarray:
    """Return three finite numbers as an array, or raise InputError."""
    try:
        vector = np.asarray(value, dtype=float)
    except (TypeError, ValueError):
        vector = np.empty(0)
    if vector.shape != (3,) or not np.all(np.isfinite(vector)):
        raise InputError(f"{name} is {value!r}; give three finite numbers (x, y, z).")
    return vector


def unit_vector(name: str, value: object) -> np.ndarray:
    """Return a direction of length 1, or raise InputError."""
    vector = finite_vector(name, value)
    length = float(np.linalg.norm(vector))
    if length == 0:
        raise InputError(f"{name} is {value!r}; a direction must not be zero.")
    return vector / length


def positive(name: str, value: float) -> float:
    """Return a finite number above 0, or raise InputError."""
    if not (math.isfinite(value) and value > 0):
        raise InputError(f"{name} is {value!r}; it must be a finite number above 0 (SI).")
    return float(value)


def frame_of(axis: np.ndarray) -> np.ndarray:
    """Return a right-handed orthonormal frame whose third row is `axis`, shape (3, 3)."""
    helper = np.array([1.0, 0.0, 0.0]) if abs(axis[0]) < 0.9 else np.array([0.0, 1.0, 0.0])
    first = np.cross(helper, axis)
    first /= np.linalg.norm(first)
    return np.array([first, np.cross(axis, first), axis])


@dataclass(frozen=True)
class Motion:
    """Rigid motion of a wall: translation and rotation about a centre.

    Args:
        velocity: of the centre [m/s].
        spin: angular velocity about the centre [rad/s].
        centre: the point it turns about [m], which moves with `velocity`.
        load: force [N] that pushes the wall; it then slides freely along the load's direction, as a weight in a guide
            does, and keeps its `velocity` across it.
        mass: of a loaded wall [kg], at least that of a grain, better that of all grains it rests on; any other wall moves
            as it is told and needs none.

    Raises:
        InputError: a load without a mass, or a mass without a load.
    """

    velocity: Vector = (0.0, 0.0, 0.0)
    spin: Vector = (0.0, 0.0, 0.0)
    centre: Vector = (0.0, 0.0, 0.0)
    load: Vector = (0.0, 0.0, 0.0)
    mass: float = 0.0

    def __post_init__(self) -> None:
        for name in ("velocity", "spin", "centre", "load"):
            finite_vector(f"Motion.{name}", getattr(self, name))
        if any(self.load) != (self.mass > 0 and math.isfinite(self.mass)):
            raise InputError(
                f"Motion.load is {self.load!r} and Motion.mass {self.mass!r}; a loaded wall needs both, its mass a finite "
                "number above 0 [kg], and any other wall neither."
            )

    @property
    def moves(self) -> bool:
        """True if anything changes with time."""
        return any(self.velocity) or any(self.spin) or any(self.load)


@dataclass(frozen=True, kw_only=True)
class Wall:
    """Base of all walls.

    Args:
        material: name of a material of the model.
        name: how later calls and pictures refer to it.
        motion: rigid motion; at rest by default.
        removed_at: time [s] from which the wall is gone; never by default.
    """

    material: str
    name: str = ""
    motion: Motion = field(default_factory=Motion)
    removed_at: float = math.inf

    def kind(self) -> str:
        """Return the name of the kernel kind whose rows `rows` gives."""
        raise NotImplementedError(f"{type(self).__name__} must define kind")

    def rows(self) -> list[dict]:
        """Return the kernel rows of this wall, in coordinates relative to the centre of its motion."""
        raise NotImplementedError(f"{type(self).__name__} must define rows")

    def extent(self) -> float:
        """Return the largest distance [m] of a point of the wall that turning displaces; infinite where unbounded."""
        raise NotImplementedError(f"{type(self).__name__} must define extent")

    def surface(self, resolution: int = 64) -> tuple[np.ndarray, np.ndarray]:
        """Return points (n, 3) [m] and triangles (m, 3) for pictures and files, at time 0."""
        raise NotImplementedError(f"{type(self).__name__} must define surface")
