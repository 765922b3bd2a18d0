"""The slope of a free surface: the highest grain centre in each bin, and a straight line through those."""

from __future__ import annotations

import numpy as np

from analysis.flank_regression import FlankLine, fit_line
from taichidem.errors import InputError

FEWEST_BINS = 3  # with two, a line always fits


def surface_line(along: np.ndarray, height: np.ndarray, limits: tuple[float, float], width: float) -> FlankLine:
    """Return the least-squares line through the highest centre of each bin; a bin without a grain is left out.

    Bins begin at the lower limit and are as many as have their middle within the limits; the upper limit may cut the last
    one short. A bin's place is its middle.

    Args:
        along, height: coordinates of the grains' centres [m], (n,).
        limits: between which the bins lie [m].
        width: of a bin [m].

    Raises:
        InputError: fewer than three bins hold a grain.
    """
    low, high = limits
    bins = int(np.floor((high - low) / width + 0.5 + 1e-9))
    number = np.floor((along - low) / width).astype(int)
    inside = (number >= 0) & (number < bins) & (along < high)
    highest = np.full(max(bins, 0), -np.inf)
    np.maximum.at(highest, number[inside], height[inside])
    filled = np.isfinite(highest)
    if np.count_nonzero(filled) < FEWEST_BINS:
        raise InputError(
            f"Only {np.count_nonzero(filled)} of {bins} bins between {low:.4g} and {high:.4g} m hold a grain; a slope needs "
            f"{FEWEST_BINS}. Take more grains or a wider window."
        )
    return fit_line((low + (np.arange(bins) + 0.5) * width)[filled], highest[filled])
