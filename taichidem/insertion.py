"""Put grains at random places where they overlap no other grain; walls are not looked at, so choose a region clear of them."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from scipy.spatial import cKDTree

from taichidem.errors import InputError
from taichidem.shapes.outlines import Outlines
from taichidem.walls.base import finite_vector, positive

ROUNDS = 300
FIRST_ROUNDS = (
    20  # with one try per waiting grain; afterwards free places are rare, and all tries go to those that wait
)


def smaller(length: float, times: float, unit: float) -> bool:
    """Return True if a length is below so many units, such as diameters, the rounding of decimal numbers aside."""
    return length < times * unit * (1 - 1e-9)


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
        if smaller(self.radius, 1, grain_radius) or smaller(self.top - self.bottom, 2, grain_radius):
            raise InputError(
                f"The region (radius {self.radius:g} m, height {self.top - self.bottom:g} m) is smaller than one grain of "
                f"radius {grain_radius:g} m. Widen it."
            )

    def sample(self, rng: np.random.Generator, grains: Outlines) -> np.ndarray:
        """Return random centres, uniform in the volume in which each grain lies wholly inside, (n, 3) [m].

        A grain that is no sphere may pass the curved side by what this bends away over half the grain's length.
        """
        every = np.arange(len(grains.radius))
        share, azimuth = np.sqrt(rng.random(len(every))), 2 * np.pi * rng.random(len(every))
        cosine, sine = np.cos(azimuth), np.sin(azimuth)
        rho = (self.radius - grains.reach(every, np.column_stack([cosine, sine, 0 * sine]))) * share
        below, above = grains.both_ways(2)
        height = self.bottom + below + (self.top - self.bottom - (below + above)) * rng.random(len(every))
        x, y = self.centre
        return np.column_stack([x + rho * cosine, y + rho * sine, height])

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
        if smaller(float(np.subtract(self.upper, self.lower).min()), 2, grain_radius):
            raise InputError(
                f"The region from {self.lower} to {self.upper} m is smaller than one grain of radius {grain_radius:g} m. "
                "Widen it."
            )

    def sample(self, rng: np.random.Generator, grains: Outlines) -> np.ndarray:
        """Return random centres, uniform in the volume in which each grain lies wholly inside, (n, 3) [m]."""
        below, above = (np.column_stack(ends) for ends in zip(*map(grains.both_ways, range(3)), strict=True))
        lower = np.asarray(self.lower) + below
        return lower + rng.random(lower.shape) * (np.asarray(self.upper) - above - lower)

    def volume(self) -> float:
        """Return the volume [m³]."""
        return float(np.prod(np.subtract(self.upper, self.lower)))


Region = CylinderRegion | BoxRegion

LOOSE = 0.15  # share of a region that grains fill at random without searching long


def loose_height(grain_radius: float, count: int, cross_section: float) -> float:
    """Return the height [m] of a region in which grains of a mean radius [m] fill 15 %, for a cross-section [m²]."""
    return count * 4 / 3 * np.pi * grain_radius**3 / (LOOSE * cross_section) + 2 * grain_radius


def place_at_random(
    rng: np.random.Generator,
    region: Region,
    grains: Outlines | np.ndarray,
    present: np.ndarray,
    present_grains: Outlines | np.ndarray,
) -> np.ndarray:
    """Return a centre for each new grain that touches nothing, (n, 3) [m]; NaN for a grain that found no place.

    Args:
        rng: the world's own stream of random numbers.
        region: where the grains appear.
        grains: outlines of the new grains, or radii of spheres (n,) [m]; they look for a place in this order, again and again.
        present: centres of the grains already there (m, 3) [m].
        present_grains: their outlines, or radii of spheres (m,) [m].
    """
    new, old = Outlines.of(grains), Outlines.of(present_grains)
    radii = new.radius
    centres: np.ndarray = np.full((len(radii), 3), np.nan)
    if len(radii) == 0:
        return centres
    positive("radius of the grains", float(radii.min()))
    region.check(float(radii.max()))
    waiting = np.arange(len(radii))
    for k in range(ROUNDS):
        tries = np.repeat(waiting, 1 if k < FIRST_ROUNDS else len(radii) // len(waiting))
        each = new.rows(tries)
        tried = region.sample(rng, each)
        placed = np.setdiff1d(np.arange(len(radii)), waiting)
        free = _free_of(tried, each, present, old)
        free &= _free_of(tried, each, centres[placed], new.rows(placed))
        won = free.copy()
        won[free] = _first_come(tried[free], each.rows(np.flatnonzero(free)))
        centres[tries[won]] = tried[won]  # of a grain's several free places the last one counts
        waiting = np.setdiff1d(waiting, tries[won])
        if len(waiting) == 0:
            break
    return centres


def fill_at_random(
    rng: np.random.Generator,
    region: Region,
    grains: Outlines | np.ndarray,
    present: np.ndarray,
    present_grains: Outlines | np.ndarray,
) -> np.ndarray:
    """Return a centre for every grain as `place_at_random` does.

    Raises:
        InputError: the region is too small for the number asked for.
    """
    new, old = Outlines.of(grains), Outlines.of(present_grains)
    radii = new.radius
    centres: np.ndarray = np.full((len(radii), 3), np.nan)
    for radius in np.unique(radii)[::-1]:  # large grains first: small ones still find places between them
        own, there = np.flatnonzero(radii == radius), np.flatnonzero(np.isfinite(centres[:, 0]))
        around = np.concatenate([present, centres[there]])
        centres[own] = place_at_random(rng, region, new.rows(own), around, old.joined(new.rows(there)))
    placed = int(np.count_nonzero(np.isfinite(centres[:, 0])))
    if placed < len(centres):
        share = float((4 / 3 * np.pi * new.size**3).sum()) / region.volume()
        raise InputError(
            f"Only {placed} of {len(centres)} grains of radius up to {float(np.max(new.size)):g} m found a place at random; "
            f"they would fill {100 * share:.0f} % of the region, and beyond about 30 % hardly any place is free. Enlarge "
            "the region or ask for fewer."
        )
    return centres


def _free_of(tried: np.ndarray, grains: Outlines, present: np.ndarray, others: Outlines) -> np.ndarray:
    """Return which of the tried centres touch nothing that is present."""
    if len(present) == 0 or len(tried) == 0:
        return np.ones(len(tried), bool)
    reach = float(grains.radius.max() + others.radius.max())
    near = cKDTree(tried).sparse_distance_matrix(cKDTree(present), reach, output_type="ndarray")
    point, other = near["i"], near["j"]
    distance = np.sqrt(((present[other] - tried[point]) ** 2).sum(axis=1))
    close = distance < grains.radius[point] + others.radius[other]
    point, other = point[close], other[close]
    free = np.ones(len(tried), bool)
    free[point[grains.meets(point, present[other] - tried[point], others, other)]] = False
    return free


def _first_come(tried: np.ndarray, grains: Outlines) -> np.ndarray:
    """Return which centres touch no earlier kept one."""
    kept = np.ones(len(tried), bool)
    if len(tried) > 1:
        pairs = np.array(sorted(cKDTree(tried).query_pairs(2 * float(grains.radius.max()))), int).reshape(-1, 2)
        apart = np.sqrt(((tried[pairs[:, 0]] - tried[pairs[:, 1]]) ** 2).sum(axis=1))
        pairs = pairs[apart < grains.radius[pairs[:, 0]] + grains.radius[pairs[:, 1]]]
        first, second = pairs.T
        pairs = pairs[grains.meets(first, tried[second] - tried[first], grains, second)]
        for first, second in pairs.tolist():
            if kept[first]:
                kept[second] = False
    return kept
