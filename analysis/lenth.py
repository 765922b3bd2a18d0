"""Lenth's pseudo standard error: judging effects when no degree of freedom is left for the error."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from scipy import stats

from designs.space import Array


@dataclass(frozen=True)
class Lenth:
    """Yardsticks for a set of m contrasts on the same scale.

    Args:
        pse: pseudo standard error.
        margin: margin of error, t(1 − α/2; m/3) · PSE, for one contrast at a time.
        simultaneous_margin: the same for all m at once, with (1 − α)^(1/m) in place of 1 − α.
    """

    pse: float
    margin: float
    simultaneous_margin: float


def lenth(contrasts: Array, alpha: float = 0.05) -> Lenth:
    """Return Lenth's yardsticks of m effects.

    s₀ = 1.5 · median|c|, PSE = 1.5 · median of the |c| below 2.5 s₀, degrees of freedom m/3.
    Source: Lenth, Technometrics 31 (1989) 469, doi 10.1080/00401706.1989.10488595.

    Args:
        contrasts: effects, shape (m,), in the unit of the response.
        alpha: significance level.
    """
    size = np.abs(np.asarray(contrasts, dtype=float))
    first = 1.5 * np.median(size)
    kept = size[size < 2.5 * first]
    pse = float(1.5 * np.median(kept)) if kept.size else 0.0
    df = len(size) / 3
    together = (1 + (1 - alpha) ** (1 / len(size))) / 2
    return Lenth(pse, pse * float(stats.t.ppf(1 - alpha / 2, df)), pse * float(stats.t.ppf(together, df)))
