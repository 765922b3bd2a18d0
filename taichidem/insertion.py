"""Put grains at random places where they overlap no other grain; walls are not looked at, so choose a region clear of them."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from scipy.spatial import cKDTree

from taichidem.errors import InputError
from taichidem.walls.base import finite_vector, positive

ROUNDS = 300


@dataclass(frozen=True)
class CylinderRegion:
    """An upright cylinder; grains lie in it wholly.

    Args:
        radius: [m].
        bottom, top: heights [m].
        centre: of the axis (x, y) [m].
    """

    radius: float
    bottom: float
    top: float
    centre: tuple[float, float] = (0.0, 0.0)

    def check(self, grain_radius: float) -> None:
        """Raise InputError unless one grain fits."""
        finite_vector("CylinderRegion (radius, bottom, top)", (self.radius, self.bottom, self.top))
        if self.radius < grain_radius or self.top - self.bottom < 2 * grain_radius:
            raise InputError(
                f"The region (radius {self.radius:g} m, height {self.top - self.bottom:g} m) is smaller than one grain of "
                f"radius {grain_radius:g} m. Widen it."
            )

    def sample(self, rng: np.random.Generator, count: int, grain_radius: float) -> np.ndarray:
        """Return random centres, uniform in the volume in which a grain lies wholly inside, (count, 3) [m]."""
        rho = (self.radius - grain_radius) * np.sqrt(rng.random(count))
        azimuth = 2 * np.pi * rng.random(count)
        height = self.bottom + grain_radius + (self.top - self.bottom - 2 * grain_radius) * rng.random(count)
        x, y = self.centre
        return np.column_stack([x + rho * np.cos(azimuth), y + rho * np.sin(azimuth), height])

    def volume(self) -> float:
        """Return the volume [m³]."""
        return float(np.pi * self.radius**2 * (self.top - self.bottom))


@dataclass(frozen=True)
class BoxRegion:
    """A box between two corners [m]; grains lie in it wholly."""

    lower: tuple[float, float, float]
    upper: tuple[float, float, float]

    def check(self, grain_radius: float) -> None:
        """Raise InputError unless one grain fits."""
        finite_vector("BoxRegion.lower", self.lower)
        finite_vector("BoxRegion.upper", self.upper)
        if np.any(np.subtract(self.upper, self.lower) < 2 * grain_radius):
            raise InputError(
                f"The region from {self.lower} to {self.upper} m is smaller than one grain of radius {grain_radius:g} m. "
                "Widen it."
            )

    def sample(self, rng: np.random.Generator, count: int, grain_radius: float) -> np.ndarray:
        """Return random centres, uniform in the volume in which a grain lies wholly inside, (count, 3) [m]."""
        lower = np.asarray(self.lower) + grain_radius
        return lower + rng.random((count, 3)) * (np.asarray(self.upper) - grain_radius - lower)

    def volume(self) -> float:
        """Return the volume [m³]."""
        return float(np.prod(np.subtract(self.upper, self.lower)))


Region = CylinderRegion | BoxRegion


def place_at_random(
    rng: np.random.Generator, region: Region, count: int, radius: float, present: np.ndarray, present_radius: np.ndarray
) -> np.ndarray:
    """Return as many centres as could be placed, one after another, without touching each other or what is present.

    Args:
        rng: the world's own stream of random numbers.
        region: where the grains appear.
        count: how many are wanted.
        radius: of the new grains [m].
        present, present_radius: centres (n, 3) and radii (n,) of the grains already there [m].
    """
    positive("radius of the grains", radius)
    if count < 0:
        raise InputError(f"count is {count}; give a number of grains from 0.")
    region.check(radius)
    placed = np.empty((0, 3))
    for _ in range(ROUNDS):
        missing = count - len(placed)
        if missing == 0:
            break
        tried = region.sample(rng, missing, radius)
        tried = tried[_free_of(tried, radius, present, present_radius)]
        tried = tried[_free_of(tried, radius, placed, np.full(len(placed), radius))]
        placed = np.concatenate([placed, _first_come(tried, 2 * radius)])
    return placed


def fill_at_random(
    rng: np.random.Generator, region: Region, count: int, radius: float, present: np.ndarray, present_radius: np.ndarray
) -> np.ndarray:
    """Return exactly `count` centres as `place_at_random` does.

    Raises:
        InputError: the region is too small for the number asked for.
    """
    placed = place_at_random(rng, region, count, radius, present, present_radius)
    if len(placed) < count:
        share = count * 4 / 3 * np.pi * radius**3 / region.volume()
        raise InputError(
            f"Only {len(placed)} of {count} grains of radius {radius:g} m found a place at random; they would fill "
            f"{100 * share:.0f} % of the region, and beyond about 30 % hardly any place is free. Enlarge the region "
            "or ask for fewer."
        )
    return placed


def _free_of(tried: np.ndarray, radius: float, present: np.ndarray, present_radius: np.ndarray) -> np.ndarray:
    """Return which of the tried centres touch nothing that is present."""
    if len(present) == 0 or len(tried) == 0:
        return np.ones(len(tried), bool)
    near = cKDTree(present).query_ball_point(tried, radius + float(present_radius.max()))
    point = np.repeat(np.arange(len(tried)), [len(found) for found in near])
    other = np.concatenate(near).astype(int)
    distance = np.sqrt(((present[other] - tried[point]) ** 2).sum(axis=1))
    free = np.ones(len(tried), bool)
    free[point[distance < radius + present_radius[other]]] = False
    return free


def _first_come(tried: np.ndarray, distance: float) -> np.ndarray:
    """Return the centres that keep their distance from every earlier kept one."""
    kept = np.ones(len(tried), bool)
    if len(tried) > 1:
        for first, second in sorted(cKDTree(tried).query_pairs(distance)):
            if kept[first]:
                kept[second] = False
    return tried[kept]
