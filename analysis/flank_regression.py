"""Straight lines through the flanks of a heap."""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from analysis.errors import AnalysisError


@dataclass(frozen=True)
class FlankLine:
    """A least-squares line height = intercept + slope · distance from the axis.

    Attributes
    ----------
    slope : [1]; negative on a heap, where height falls outwards.
    intercept : height of the line above the heap's axis, in the unit of the heights.
    low, high : first and last distance used.
    residual : root mean square of the residuals, in the unit of the heights.
    determination : R², 1 for points on a line [1].
    points : number of points used.
    """

    slope: float
    intercept: float
    low: float
    high: float
    residual: float
    determination: float
    points: int

    @property
    def angle_deg(self) -> float:
        """Angle of the flank to the base, atan(−slope) [deg]."""
        return math.degrees(math.atan(-self.slope))

    def height(self, distance: float) -> float:
        """Return the height of the line at a distance from the axis."""
        return self.intercept + self.slope * distance


def fit_line(distance: NDArray[np.float64], height: NDArray[np.float64]) -> FlankLine:
    """Lay a line through points by least squares, slope = Σ(x−x̄)(y−ȳ)/Σ(x−x̄)².

    Parameters
    ----------
    distance, height : points, any one unit of length, shape (n,).

    Raises
    ------
    AnalysisError : fewer than two different distances.
    """
    if distance.size < 2 or np.ptp(distance) <= 0:
        raise AnalysisError(
            f"A flank needs at least two points at different distances; given: {distance.size}. Widen the fit window."
        )
    x = distance - distance.mean()
    y = height - height.mean()
    slope = float(x @ y / (x @ x))
    rest = y - slope * x
    spread = float(y @ y)
    return FlankLine(
        slope=slope,
        intercept=float(height.mean() - slope * distance.mean()),
        low=float(distance.min()),
        high=float(distance.max()),
        residual=float(np.sqrt(np.mean(rest**2))),
        determination=1.0 - float(rest @ rest) / spread if spread > 0 else 1.0,
        points=int(distance.size),
    )


def fit_flank(
    distance: NDArray[np.float64], height: NDArray[np.float64], limits: tuple[float, float], fewest: int
) -> FlankLine:
    """Lay a line through the points whose distance lies in the window.

    Parameters
    ----------
    distance, height : points of one flank, shape (n,).
    limits : first and last distance used, same unit.
    fewest : smallest number of points accepted.

    Raises
    ------
    AnalysisError : fewer than `fewest` points lie in the window.
    """
    low, high = limits
    used = (distance >= low) & (distance <= high) & np.isfinite(height)
    if np.count_nonzero(used) < fewest:
        raise AnalysisError(
            f"Only {np.count_nonzero(used)} points of the flank lie in the window {low:.4g} to {high:.4g}; allowed: "
            f"{fewest} or more. Widen the window (fit_from, fit_to) or use a larger heap or picture."
        )
    return fit_line(distance[used], height[used])
