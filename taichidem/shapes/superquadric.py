"""Superquadrics: ellipsoids, and what lies between them, cylinders, boxes and octahedra with rounded edges."""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np
from scipy.special import beta

from taichidem.errors import InputError
from taichidem.shapes.base import Elements, GrainShape

LARGEST_EXPONENT = 40.0  # beyond which edges are so sharp that their curvature means nothing to a contact law


@dataclass(frozen=True)
class Superquadric(GrainShape):
    """A superquadric, (|x/a|^n₂ + |y/b|^n₂)^(n₁/n₂) + |z/c|^n₁ ≤ 1.

    V = 2 a b c ε₁ ε₂ B(ε₁/2, ε₁ + 1) B(ε₂/2, ε₂/2 + 1),  ε = 2/n, B the Beta function

    Args:
        a, b, c: semi-axes [m], above 0.
        n1: exponent of the profile along z, 2 to 40; 2 is round, more is flatter with sharper edges.
        n2: exponent of the section across z, 2 to 40.

    Raises:
        InputError: a semi-axis not above 0, or an exponent outside its bounds.

    Source: Barr (1981), doi 10.1109/MCG.1981.1673799; Jaklič, Leonardis & Solina (2000), doi 10.1007/978-94-015-9456-1.
    """

    a: float
    b: float
    c: float
    n1: float = 2.0
    n2: float = 2.0

    def __post_init__(self) -> None:
        for name in ("a", "b", "c"):
            value = getattr(self, name)
            if not (_number(value) and value > 0):
                raise InputError(f"Superquadric.{name} is {value!r}; a semi-axis is a finite number above 0 [m].")
        for name in ("n1", "n2"):
            value = getattr(self, name)
            if not (_number(value) and 2 <= value <= LARGEST_EXPONENT):
                raise InputError(
                    f"Superquadric.{name} is {value!r}; allowed is 2 (round) to {LARGEST_EXPONENT:g} (nearly sharp edges). "
                    "Below 2 a superquadric has corners or is not convex, and contacts between such bodies are not defined."
                )

    @classmethod
    def sphere(cls, radius: float) -> Superquadric:
        """Return a sphere of a radius [m]."""
        return cls(radius, radius, radius)

    @classmethod
    def spheroid(cls, aspect_ratio: float, radius: float = 1.0) -> Superquadric:
        """Return a spheroid about z with the volume of a sphere of a radius [m].

        Args:
            aspect_ratio: length along z over width; above 1 prolate, below 1 oblate.

        Raises:
            InputError: a ratio or radius not above 0.
        """
        if not (_number(aspect_ratio) and aspect_ratio > 0):
            raise InputError(f"aspect_ratio is {aspect_ratio!r}; give length over width, a finite number above 0.")
        width = radius * aspect_ratio ** (-1 / 3)
        return cls(width, width, width * aspect_ratio)

    @property
    def volume(self) -> float:
        e1, e2 = 2 / self.n1, 2 / self.n2
        body = self.a * self.b * self.c
        return float(2 * body * e1 * e2 * beta(e1 / 2, e1 + 1) * beta(e2 / 2, e2 / 2 + 1))

    @property
    def inertia(self) -> np.ndarray:
        """Principal moments over the mass [m²], (3,).

        I_xx = ½ ρ a b c ε₁ ε₂ (b² B(3ε₂/2, ε₂/2) B(ε₁/2, 2ε₁ + 1) + 4 c² B(ε₂/2, ε₂/2 + 1) B(3ε₁/2, ε₁ + 1)), and so on
        """
        e1, e2 = 2 / self.n1, 2 / self.n2
        across = beta(1.5 * e2, 0.5 * e2) * beta(0.5 * e1, 2 * e1 + 1)
        along = 4 * self.c**2 * beta(0.5 * e2, 0.5 * e2 + 1) * beta(1.5 * e1, e1 + 1)
        a2, b2 = self.a**2, self.b**2
        moments = np.array([b2 * across + along, a2 * across + along, (a2 + b2) * across])
        return 0.5 * self.a * self.b * self.c * e1 * e2 * moments / self.volume

    @property
    def elements(self) -> Elements:
        return Elements(
            offset=np.zeros((1, 3)),
            radius=np.array([self.bounding_radius]),
            axes=np.array([[self.a, self.b, self.c]]),
            exponents=np.array([[self.n1, self.n2]]),
        )

    @property
    def bounding_radius(self) -> float:
        """Radius of the smallest sphere about the centre that holds it [m]: the largest |x| on the surface."""
        width = _longest(self.a, self.b, self.n2)
        return _longest(width, self.c, self.n1)

    def support(self, directions: np.ndarray) -> np.ndarray:
        """Return the point of the surface that lies farthest along each direction in its own frame, (n, 3) [m].

        With m = n/(n − 1): q = ‖(a d_x, b d_y)‖_m₂, h = ‖(q, c d_z)‖_m₁, and the point is ∂h/∂d.

        Args:
            directions: (n, 3), of any length above 0.
        """
        d = np.atleast_2d(np.asarray(directions, float))
        scaled = np.abs(d) * (self.a, self.b, self.c)
        m1, m2 = self.n1 / (self.n1 - 1), self.n2 / (self.n2 - 1)
        with np.errstate(invalid="ignore", divide="ignore"):
            q = _norm(scaled[:, 0], scaled[:, 1], m2)
            h = _norm(q, scaled[:, 2], m1)
            outer = np.nan_to_num(q / h) ** (m1 - 1)
            shares = np.column_stack(
                [
                    outer * np.nan_to_num(scaled[:, 0] / q) ** (m2 - 1),
                    outer * np.nan_to_num(scaled[:, 1] / q) ** (m2 - 1),
                    (scaled[:, 2] / h) ** (m1 - 1),
                ]
            )
        return np.sign(d) * (self.a, self.b, self.c) * shares


def _number(value: object) -> bool:
    return isinstance(value, (int, float, np.floating, np.integer)) and math.isfinite(value)


def _norm(first: np.ndarray, second: np.ndarray, power: float) -> np.ndarray:
    """Return (first^p + second^p)^(1/p) without overflow."""
    largest = np.maximum(np.maximum(first, second), 1e-300)
    return largest * ((first / largest) ** power + (second / largest) ** power) ** (1 / power)


def _longest(first: float, second: float, exponent: float) -> float:
    """Return the largest √(x² + y²) with |x/first|^n + |y/second|^n = 1."""
    longer, shorter = max(first, second), min(first, second)
    if exponent == 2:
        return longer
    # At the maximum y/shorter over x/longer is (shorter/longer)^(2/(n − 2)).
    share = (shorter / longer) ** (2 / (exponent - 2))
    return math.hypot(longer, shorter * share) * (1 + share**exponent) ** (-1 / exponent)
