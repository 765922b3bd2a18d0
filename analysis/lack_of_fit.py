"""Splitting the error into lack of fit and pure error."""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np
from scipy import stats

from analysis.regression import FittedModel


@dataclass(frozen=True)
class LackOfFit:
    """The two parts of the error.

    Args:
        df, ss: degrees of freedom and sum of squares of the lack of fit.
        pure_df, pure_ss: the same of the pure error, Σ (yᵢⱼ − ȳᵢ)² over groups of replicates.
    """

    df: int
    ss: float
    pure_df: int
    pure_ss: float

    @property
    def f(self) -> float:
        """(SS/df) / (pure SS/pure df); NaN without replicates or when these agree exactly."""
        if not self.df or not self.pure_df or self.pure_ss <= 0:
            return math.nan
        return (self.ss / self.df) / (self.pure_ss / self.pure_df)

    @property
    def p(self) -> float:
        """Chance of an F as large if the model fits."""
        return float(stats.f.sf(self.f, self.df, self.pure_df)) if math.isfinite(self.f) else math.nan

    def sentence(self) -> str:
        """Return what the split says."""
        if not self.pure_df:
            return "No run is replicated, so lack of fit can't be tested."
        if self.pure_ss <= 0:
            return (
                "All replicates agree exactly: pure error is zero and lack of fit can't be tested. Simulated "
                "replicates need a seed of their own."
            )
        if not self.df:
            return "The model uses up all distinct settings, so lack of fit can't be tested."
        verdict = "significant: the model misses some of the shape" if self.p < 0.05 else "not significant"
        return f"Lack of fit is {verdict} (F = {self.f:.2f}, p = {self.p:.4f}, {self.df} and {self.pure_df} df)."


def lack_of_fit(fit: FittedModel) -> LackOfFit:
    """Return the split of the error of a fit; replicates agree in all factors of the table, used or not, and block."""
    groups = fit.runs.replicate_groups()
    counts = np.bincount(groups)
    means = np.bincount(groups, weights=fit.y) / counts
    deviation = fit.y - means[groups]
    pure_df = int(len(fit.y) - len(counts))
    # Rounding of the means leaves 1e-30; replicates that agree exactly have exactly no pure error.
    same = np.ptp(fit.y) == 0 or np.abs(deviation).max() < 1e-12 * max(np.abs(fit.y).max(), 1e-300)
    pure_ss = 0.0 if same else float(deviation @ deviation)
    return LackOfFit(fit.error_df - pure_df, max(fit.error_ss - pure_ss, 0.0), pure_df, pure_ss)
