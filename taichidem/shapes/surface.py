"""The surface of a superquadric as triangles: points and normals on it exactly, spread so that edges look right."""

from __future__ import annotations

from dataclasses import dataclass
from functools import lru_cache

import numpy as np


@dataclass(frozen=True)
class Surface:
    """A closed surface.

    Attributes:
        points: (v, 3).
        normals: outward, of length 1, (v, 3).
        triangles: numbers of three points each, counter-clockwise seen from outside, (t, 3).
    """

    points: np.ndarray
    normals: np.ndarray
    triangles: np.ndarray


@lru_cache(maxsize=64)
def unit_surface(n1: float, n2: float, fineness: int) -> Surface:
    """Return the surface of the superquadric with semi-axes 1, (|x|^n₂ + |y|^n₂)^(n₁/n₂) + |z|^n₁ = 1.

    Args:
        n1, n2: exponents, 2 or more.
        fineness: k; the surface has 8 k points around, 4 k steps from pole to pole, and about 64 k² triangles.

    It is the product of two curves, x = (u x̂, u ŷ, z): the section |x̂|^n₂ + |ŷ|^n₂ = 1 and the profile u^n₁ + |z|^n₁ = 1,
    with normals along (u^(n₁−1) x̂^(n₂−1), u^(n₁−1) ŷ^(n₂−1), z^(n₁−1)), powers taken with the sign of their base.
    """
    section, section_normal = _ring(n2, fineness)
    quarter, quarter_normal = _quarter(n1, fineness)
    down = (1.0, -1.0)
    profile = np.concatenate([quarter[:0:-1] * down, quarter])
    profile_normal = np.concatenate([quarter_normal[:0:-1] * down, quarter_normal])
    points = _product(profile, section)
    normals = _product(profile_normal, section_normal)
    normals /= np.linalg.norm(normals, axis=1)[:, None]
    return Surface(points, normals, _triangles(len(profile) - 2, len(section)))


def _product(profile: np.ndarray, section: np.ndarray) -> np.ndarray:
    """Return south pole, rings from below and north pole, (rings · around + 2, 3)."""
    rings = np.empty((len(profile) - 2, len(section), 3))
    rings[:, :, :2] = profile[1:-1, None, :1] * section
    rings[:, :, 2] = profile[1:-1, 1:]
    return np.concatenate([[[0.0, 0.0, profile[0, 1]]], rings.reshape(-1, 3), [[0.0, 0.0, profile[-1, 1]]]])


def _ring(exponent: float, fineness: int) -> tuple[np.ndarray, np.ndarray]:
    """Return points and normals of the whole curve |u|^n + |v|^n = 1, counter-clockwise, each (8 k, 2)."""
    turns = [np.array([[c, s], [-s, c]]) for c, s in ((1, 0), (0, 1), (-1, 0), (0, -1))]
    points, normals = _quarter(exponent, fineness)
    return np.concatenate([points[:-1] @ t for t in turns]), np.concatenate([normals[:-1] @ t for t in turns])


def _quarter(exponent: float, fineness: int) -> tuple[np.ndarray, np.ndarray]:
    """Return points of |u|^n + |v|^n = 1 from (1, 0) to (0, 1) and their gradients over n, each (2 k + 1, 2).

    k + 1 points lie at equal steps of the direction from the centre, which covers the flat parts, and k between them
    at equal steps of the normal's direction, which covers the edge; for a circle both are one even division.
    """
    step = np.pi / 2 / fineness
    even = np.arange(fineness + 1) * step
    bent = (np.arange(fineness) + 0.5) * step
    direction = np.sort(np.concatenate([even, np.arctan(np.tan(bent) ** (1 / (exponent - 1)))]))
    u, v = np.cos(direction), np.sin(direction)
    u[-1], v[0] = 0.0, 0.0
    larger = np.maximum(u, v)
    length = larger * ((u / larger) ** exponent + (v / larger) ** exponent) ** (1 / exponent)
    points = np.column_stack([u, v]) / length[:, None]
    return points, points ** (exponent - 1)


def _triangles(rings: int, around: int) -> np.ndarray:
    """Return the triangles between poles and rings, as numbers of the points of `_product`."""
    here = 1 + np.arange(around)
    there = np.roll(here, -1)
    first, last = np.zeros(around, dtype=int), np.full(around, rings * around + 1)
    parts = [np.column_stack([first, there, here])]
    for below in around * np.arange(rings - 1):
        above = below + around
        parts.append(np.column_stack([below + here, below + there, above + there]))
        parts.append(np.column_stack([below + here, above + there, above + here]))
    top = around * (rings - 1)
    parts.append(np.column_stack([last, top + here, top + there]))
    return np.concatenate(parts)
