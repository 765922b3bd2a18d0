"""The fit window of an angle of repose: the part of the flank that the straight line is laid through."""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np

from analysis.errors import AnalysisError

# Half-width of the rectangular distribution, in fractions of the base radius, that a window stated to
# one decimal leaves open: 0.4–0.92 could as well have been 0.3–0.92, 0.5–0.92 or 0.4–0.84.
INNER_SHIFT = 0.10
OUTER_SHIFT = 0.08
NARROWEST = 0.15


@dataclass(frozen=True)
class FitWindow:
    """The part of the flank used for the regression, fit_from ≤ r/R ≤ fit_to.

    Parameters
    ----------
    fit_from, fit_to : distance from the heap's axis as a fraction of the base (cup) radius R [1].
        The default 0.4–0.92 leaves out the top that the pour flattens and the grains at the rim.

    Raises
    ------
    AnalysisError : the limits are not finite, not in order, closer than 0.15 or outside 0–1.2.
    """

    fit_from: float = 0.4
    fit_to: float = 0.92

    def __post_init__(self) -> None:
        finite = math.isfinite(self.fit_from) and math.isfinite(self.fit_to)
        if not finite or self.fit_from < 0 or self.fit_to > 1.2 or self.fit_to - self.fit_from < NARROWEST - 1e-12:
            raise AnalysisError(
                f"Fit window given: fit_from={self.fit_from}, fit_to={self.fit_to}. Allowed: fractions of the base "
                f"radius with 0 ≤ fit_from, fit_to ≤ 1.2 and fit_to − fit_from ≥ {NARROWEST}. "
                "Try the default 0.4 and 0.92."
            )

    def alternatives(self) -> tuple[FitWindow, ...]:
        """Return the neighbouring windows that could have been chosen with equal right."""
        shifts = ((-INNER_SHIFT, 0.0), (INNER_SHIFT, 0.0), (0.0, -OUTER_SHIFT), (INNER_SHIFT, -OUTER_SHIFT))
        limits = [(max(self.fit_from + inner, 0.0), self.fit_to + outer) for inner, outer in shifts]
        return tuple(FitWindow(low, high) for low, high in limits if high - low >= NARROWEST)

    def limits(self, base_radius: float) -> tuple[float, float]:
        """Return the window in the unit of `base_radius`."""
        return self.fit_from * base_radius, self.fit_to * base_radius


def window_uncertainty(angle: float, alternatives: list[float]) -> float:
    """Return the standard uncertainty that the choice of the window leaves, u = (max − min)/2/√3.

    The angles over the neighbouring windows and over the window itself are taken as equally
    probable limits of a rectangular distribution (GUM, JCGM 100:2008, 4.3.7).

    Parameters
    ----------
    angle : angle over the chosen window [deg].
    alternatives : angles over the neighbouring windows [deg]; empty gives 0.
    """
    values = np.array([angle, *alternatives], dtype=float)
    return float(np.ptp(values) / 2.0 / math.sqrt(3.0))


def combine(components: dict[str, float]) -> float:
    """Return the root of the sum of squares of independent standard uncertainties."""
    return math.sqrt(sum(value**2 for value in components.values()))
