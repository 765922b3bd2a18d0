"""How improbable an error is whose uncertainty is known in one part and estimated from a few values in another."""

from __future__ import annotations

import math
from functools import lru_cache

import numpy as np
from numpy.typing import NDArray
from scipy import stats

_NODES = 96
_CROWDING = 4  # nodes q = v⁴: the heavy tail comes from the rare small estimates


def two_sided(error: float, u_known: float, u_estimated: float, degrees: float) -> float:
    """Return the chance of so large an error, P(|u_known N + u_estimated T| ≥ |error|).

    N is a normal variate, T Student's t with so many degrees of freedom: the distribution that supplement 1 of the GUM gives
    to the sum, and the solution of Behrens and Fisher. It is Student's t where nothing is known, the normal distribution
    where nothing is estimated, and on the safe side between: six right results each, three or four seeds, are called wrong
    as a whole in 1 to 5 % of cases at a level of 5 %, where the degrees of freedom of Welch and Satterthwaite give up to 14 %,
    as they rise just when the estimate happens to be too small.

    Args:
        error: that is judged.
        u_known: standard uncertainty that is taken as known.
        u_estimated: standard uncertainty estimated from few values, such as s/√n.
        degrees: its degrees of freedom, n − 1.

    Source: JCGM 101:2008 (GUM supplement 1), 6.4.9; Fisher, Annals of Eugenics 6 (1935) 391, doi
    10.1111/j.1469-1809.1935.tb02120.x.
    """
    if u_estimated == 0.0:
        return float(2.0 * stats.norm.sf(abs(error) / u_known))
    shares, weights = _true_shares(degrees)
    spread = np.sqrt(u_known**2 + u_estimated**2 / shares)
    return float(min(weights @ (2.0 * stats.norm.sf(abs(error) / spread)), 1.0))


@lru_cache(maxsize=64)
def _true_shares(degrees: float) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
    """Return values of s²/σ², which is χ²_ν/ν, and their weights: Gauss–Legendre nodes over its quantiles."""
    nodes, weights = np.polynomial.legendre.leggauss(_NODES)
    v = (nodes + 1.0) / 2.0
    shares = stats.chi2.ppf(v**_CROWDING, degrees) / degrees
    return shares, weights / 2.0 * _CROWDING * v ** (_CROWDING - 1)


def normal_deviate(z: float, p: float) -> float:
    """Return the normal deviate ≥ 0 that is as improbable as p says; |z| itself where p is too small to be computed."""
    return float(stats.norm.isf(p / 2.0)) if p > 1e-290 else abs(z)


def joint_degrees(u_estimated: NDArray[np.float64], degrees: NDArray[np.float64]) -> float:
    """Return the degrees of freedom of a sum of estimated parts, ν = (Σ u²)² / Σ u⁴/ν_i; infinite where all are 0.

    Source: Welch and Satterthwaite, as in JCGM 100:2008 (GUM), G.4.1.
    """
    total = float(np.sum(u_estimated**4 / degrees))
    return float(np.sum(u_estimated**2)) ** 2 / total if total > 0 else math.inf
