"""The highest point in each bin of a window: what a free surface is taken to be where only grain centres are known."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]


def highest_in_bins(
    along: Array,
    height: Array,
    limits: tuple[float, float],
    width: float,
    part: NDArray[np.intp] | None = None,
    parts: int = 1,
) -> tuple[Array, Array]:
    """Return the middles of the bins (b,) and the greatest height in each bin and part (b, parts), NaN where none is.

    Bins begin at the lower limit and are as many as have their middle within the limits, b = ⌊(high − low)/width + 1/2⌋.
    Points beyond the upper limit don't count, so that the last bin may be cut short. A bin's place is its middle.

    Parameters
    ----------
    along, height : points, any one unit of length, shape (n,).
    limits : low and high, between which the bins lie.
    width : of a bin.
    part : number of the part to which each point belongs, such as a sector, shape (n,); one part where left out.
    parts : how many there are.
    """
    low, high = limits
    bins = max(0, int(np.floor((high - low) / width + 0.5 + 1e-9)))
    number = np.floor((along - low) / width).astype(np.intp)
    inside = (number >= 0) & (number < bins) & (along < high)
    belongs = 0 if part is None else part[inside]
    highest = np.full(bins * parts, -np.inf)
    np.maximum.at(highest, number[inside] * parts + belongs, height[inside])
    highest[~np.isfinite(highest)] = np.nan
    middles = (low + (np.arange(bins) + 0.5) * width).astype(np.float64)
    return middles, highest.reshape(bins, parts)
