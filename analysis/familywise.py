"""Judge several p-values together, so that one of them is wrongly called real no more often than one alone would be."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray


def holm(p_values: Sequence[float]) -> NDArray[np.float64]:
    """Return adjusted p-values, p̃(i) = max over j ≤ i of min(1, (m − j + 1) p(j)); those missing (nan) stay so and count not.

    Rejecting where p̃ ≤ α keeps the chance of one false rejection or more at α, whatever the dependence of the tests.

    Source: Holm, Scandinavian Journal of Statistics 6 (1979) 65.
    """
    p = np.asarray(p_values, dtype=float)
    adjusted = np.full(p.shape, np.nan)
    known = np.flatnonzero(~np.isnan(p))
    order = known[np.argsort(p[known], kind="stable")]
    factors = np.arange(len(order), 0, -1)
    adjusted[order] = np.minimum(np.maximum.accumulate(p[order] * factors), 1.0)
    return adjusted
