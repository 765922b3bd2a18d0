"""The slope of a free surface: the highest grain centre in each bin, and a straight line through those."""

from __future__ import annotations

import numpy as np

from analysis.flank_regression import FlankLine, fit_line
from analysis.highest_bins import highest_in_bins
from taichidem.errors import InputError

FEWEST_BINS = 3  # with two, a line always fits


def surface_line(along: np.ndarray, height: np.ndarray, limits: tuple[float, float], width: float) -> FlankLine:
    """Return the least-squares line through the highest centre of each bin; a bin without a grain is left out.

    Bins lie as `analysis.highest_bins.highest_in_bins` says.

    Args:
        along, height: coordinates of the grains' centres [m], (n,).
        limits: between which the bins lie [m].
        width: of a bin [m].

    Raises:
        InputError: fewer than three bins hold a grain.
    """
    middles, tops = highest_in_bins(along, height, limits, width)
    highest = tops[:, 0]
    filled = np.isfinite(highest)
    if np.count_nonzero(filled) < FEWEST_BINS:
        raise InputError(
            f"Only {np.count_nonzero(filled)} of {len(middles)} bins between {limits[0]:.4g} and {limits[1]:.4g} m hold a "
            f"grain; a slope needs {FEWEST_BINS}. Take more grains or a wider window."
        )
    return fit_line(middles[filled], highest[filled])
