"""The two definitions of the angle of repose of a heap given by positions: rings and sectors."""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import Any, Protocol

import numpy as np
import pandas as pd

from analysis.errors import AnalysisError
from analysis.flank_regression import FlankLine, fit_flank
from analysis.height_map import Array, upper_surface
from analysis.highest_bins import highest_in_bins
from analysis.repose_window import FitWindow

QUADRANTS = 4
FEWEST_BINS = 4


@dataclass(frozen=True)
class Grains:
    """The grains of a heap: centres [m] (n, 3), radii [m] (n,), cup radius [m]."""

    centres: Array
    radii: Array
    cup_radius: float

    @property
    def diameter(self) -> float:
        """Median diameter [m]."""
        return 2.0 * float(np.median(self.radii))


class ProfileMethod(Protocol):
    """A definition of the radial profile and of the line through it."""

    def fit(self, window: FitWindow) -> tuple[FlankLine, list[FlankLine]]:
        """Return the line of the heap and those of its parts."""

    def table(self) -> pd.DataFrame:
        """Return the profile: radius_m, height_m, scatter_m, height_1_m …"""


class RingProfile:
    """Upper surface of the spheres on a grid, averaged over the azimuth in rings; parts are quadrants."""

    def __init__(self, grains: Grains, settings: Any) -> None:
        spacing = settings.grid_spacing_m or grains.diameter / 12.0
        width = settings.ring_width_m or grains.diameter / 3.0
        surface = upper_surface(grains.centres, grains.radii, spacing)
        rings = int(np.floor(1.1 * grains.cup_radius / width))
        ring = np.floor(surface.distance / width).astype(np.intp)
        quadrant = np.minimum((surface.azimuth / (np.pi / 2.0)).astype(np.intp), QUADRANTS - 1)
        inside = ring < rings
        cell = ring[inside] * QUADRANTS + quadrant[inside]
        count = np.bincount(cell, minlength=rings * QUADRANTS).reshape(rings, QUADRANTS)
        total = np.bincount(cell, surface.height[inside], rings * QUADRANTS).reshape(rings, QUADRANTS)
        self.cup_radius = grains.cup_radius
        self.radius = (np.arange(rings) + 0.5) * width
        self.height = _ratio(total.sum(axis=1), count.sum(axis=1))
        self.parts = _ratio(total, count)

    def fit(self, window: FitWindow) -> tuple[FlankLine, list[FlankLine]]:
        """Return the line through the mean profile and those through the quadrants."""
        limits = window.limits(self.cup_radius)
        parts = [fit_flank(self.radius, part, limits, FEWEST_BINS) for part in self.parts.T]
        return fit_flank(self.radius, self.height, limits, FEWEST_BINS), parts

    def table(self) -> pd.DataFrame:
        """Return the profile, one row for each ring."""
        return _table(self.radius, self.height, self.parts)


class SectorProfile:
    """Highest centre in bins of one diameter in each sector, as `highest_in_bins` says; parts are the sectors."""

    def __init__(self, grains: Grains, settings: Any) -> None:
        self.grains = grains
        self.sectors = int(settings.sectors)
        self.width = settings.bin_width_m or grains.diameter
        self.window = settings.window
        self.distance = np.hypot(grains.centres[:, 0], grains.centres[:, 1])
        azimuth = np.mod(np.arctan2(grains.centres[:, 1], grains.centres[:, 0]), 2.0 * np.pi)
        self.sector = np.minimum((azimuth / (2.0 * np.pi) * self.sectors).astype(np.intp), self.sectors - 1)

    def fit(self, window: FitWindow) -> tuple[FlankLine, list[FlankLine]]:
        """Return the line with the mean slope of the sectors, and those of the sectors."""
        limits = window.limits(self.grains.cup_radius)
        radius, highest = self._highest(limits)
        parts = [fit_flank(radius, part, limits, FEWEST_BINS) for part in highest.T]
        whole = fit_flank(radius, _row_mean(highest), limits, FEWEST_BINS)
        slope = float(np.mean([part.slope for part in parts]))
        intercept = float(np.mean([part.intercept for part in parts]))
        return replace(whole, slope=slope, intercept=intercept), parts

    def table(self) -> pd.DataFrame:
        """Return the profile, one row for each bin, of the settings' window."""
        radius, highest = self._highest(self.window.limits(self.grains.cup_radius))
        return _table(radius, _row_mean(highest), highest)

    def _highest(self, limits: tuple[float, float]) -> tuple[Array, Array]:
        """Return the middles of the bins and the highest centre in each bin and sector, NaN where none is."""
        height = self.grains.centres[:, 2]
        middles, highest = highest_in_bins(self.distance, height, limits, self.width, self.sector, self.sectors)
        if len(middles) < FEWEST_BINS:
            raise AnalysisError(
                f"The window {limits[0]:.4g}–{limits[1]:.4g} m holds {len(middles)} bins of {self.width:.4g} m. Allowed: "
                f"{FEWEST_BINS} or more. Widen the window (fit_from, fit_to) or give a smaller bin_width_m."
            )
        return middles, highest


METHODS: dict[str, Any] = {"rings": RingProfile, "sectors": SectorProfile}


def _ratio(total: Any, count: Any) -> Array:
    return np.where(count > 0, total / np.maximum(count, 1), np.nan)


def _row_mean(values: Array) -> Array:
    """Return the mean of each row over the values that are there."""
    there = np.isfinite(values)
    return _ratio(np.where(there, values, 0.0).sum(axis=1), there.sum(axis=1))


def _table(radius: Array, height: Array, parts: Array) -> pd.DataFrame:
    mean = _row_mean(parts)[:, None]
    there = np.isfinite(parts)
    squares = np.where(there, (parts - mean) ** 2, 0.0).sum(axis=1)
    degrees = there.sum(axis=1) - 1
    columns = {"radius_m": radius, "height_m": height, "scatter_m": np.sqrt(_ratio(squares, degrees))}
    columns |= {f"height_{number + 1}_m": part for number, part in enumerate(parts.T)}
    return pd.DataFrame(columns)
