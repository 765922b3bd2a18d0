"""Re-calibration: the parameters, and the strengths of effects that were let in, that agree best with the measurements.

χ²(θ, β) = Σ_i (D_i − S_i(θ, β))²/(u_i² + v_i(θ, β)) + Σ_j (θ_j,measured − θ_j)²/u_j²

with v the variance that the surrogate leaves. θ stays in its ranges, β between 0 (or −LARGEST where it has two sides) and
LARGEST.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from functools import cached_property
from typing import Protocol

import numpy as np
from scipy import stats
from scipy.optimize import least_squares

from analysis.missing_effect.problem import Array, Flags, Problem

LARGEST = 1.3  # share up to which a strength may be fitted, a little beyond what was simulated
STEP = 1e-4  # of coded numbers, for derivatives
ROUNDS = 3  # of weights: the surrogate's variance is taken where the last round ended
AT_BOUND = 1e-3  # coded distance from a bound that counts as being at it
FIRST_SHARES = (0.3, 0.8)  # from which a strength is looked for


class Simulator(Protocol):
    """What a fit asks: expected responses and how uncertain they are, (n, m), at points x (n, p), share (n, K)."""

    def mean(self, x: Array, share: Array) -> Array: ...

    def variance(self, x: Array, share: Array) -> Array: ...


@dataclass(frozen=True)
class Fit:
    """The best agreement that was found.

    Attributes:
        problem: what was fitted.
        effects: numbers of the effects that were let in.
        x: coded parameters (p,).
        share: of each effect (K,).
        simulated, variance: responses there and what the surrogate leaves of them (m,).
        slope: derivatives of the m responses by parameters and let-in shares (m, p + len(effects)).
        kept: which responses were fitted (m,).
        chi2: over the responses that were fitted and the direct measurements.
    """

    problem: Problem
    effects: tuple[int, ...]
    x: Array
    share: Array
    simulated: Array
    variance: Array
    slope: Array
    kept: Flags
    chi2: float

    @cached_property
    def sigma(self) -> Array:
        """Standard uncertainty of D − S (m,)."""
        return np.sqrt(self.problem.u**2 + self.variance)

    @cached_property
    def z(self) -> Array:
        """Standardised errors (S − D)/u_val of all responses, left-out ones included (m,)."""
        return (self.simulated - self.problem.measured) / self.sigma

    @property
    def dof(self) -> int:
        """Degrees of freedom: measurements that were fitted, less parameters and strengths."""
        return int(self.kept.sum()) + len(self.problem.direct) - len(self.x) - len(self.effects)

    @property
    def p_value(self) -> float:
        """Probability of a larger χ² if nothing else is missing; nan without degrees of freedom."""
        return float(stats.chi2.sf(self.chi2, self.dof)) if self.dof > 0 else float("nan")

    @property
    def aicc(self) -> float:
        """Akaike's criterion with its small-sample term, χ² + 2k + 2k(k + 1)/(n − k − 1); infinite without room for it."""
        k, n = len(self.x) + len(self.effects), int(self.kept.sum()) + len(self.problem.direct)
        return self.chi2 + 2 * k + 2 * k * (k + 1) / (n - k - 1) if n > k + 1 else float("inf")

    @cached_property
    def free(self) -> Flags:
        """Which parameters and strengths are not at a bound (p + len(effects),)."""
        x_free = np.abs(self.x) < 1 - AT_BOUND
        held = [abs(self.share[k]) > AT_BOUND for k in self.effects]
        return np.concatenate([x_free, np.array(held, bool)])

    @cached_property
    def weighted_slope(self) -> Array:
        """Derivatives of standardised responses and direct measurements (count, p + len(effects))."""
        direct = direct_slope(self.problem, self.x, self.slope.shape[1])
        return np.vstack([self.slope[self.kept] / self.sigma[self.kept, None], direct])

    @cached_property
    def covariance(self) -> Array:
        """Covariance of coded parameters and shares, (JᵀV⁻¹J)⁻¹; what the data don't fix is limited by its range."""
        j = self.weighted_slope
        ranges = np.full(j.shape[1], 1 / 3.0)  # a uniform range of ±1 has the variance 1/3
        return np.linalg.inv(j.T @ j + np.diag(1e-6 / ranges))


def direct_slope(problem: Problem, x: Array, columns: int) -> Array:
    """Return the derivatives of standardised direct measurements by what is fitted (direct, columns)."""
    which = list(problem.direct)
    rows = np.zeros((len(which), columns))
    rows[np.arange(len(which)), which] = problem.natural_slope(x)[which] / problem.direct_values[1]
    return rows


def fit(
    problem: Problem,
    simulator: Simulator,
    effects: Sequence[int] = (),
    *,
    start: Fit | None = None,
    kept: Flags | None = None,
) -> Fit:
    """Return the best agreement with the measurements.

    Args:
        problem: measurements, ranges, candidates.
        simulator: the surrogate.
        effects: numbers of the candidates whose strengths are fitted too.
        start: a fit from which to begin, without looking elsewhere too if it has the same effects.
        kept: which responses are fitted (m,); all by default.
    """
    search = _Search(problem, simulator, tuple(effects), np.ones(len(problem.labels), bool) if kept is None else kept)
    ends = [
        search.run(v, 1 if start is not None and start.effects == search.effects else ROUNDS)
        for v in search.starts(start)
    ]
    return min(ends, key=lambda end: end.chi2)


def at(problem: Problem, simulator: Simulator, x: Array, share: Array, effects: Sequence[int] = ()) -> Fit:
    """Return the agreement at a point, nothing fitted."""
    search = _Search(problem, simulator, tuple(effects), np.ones(len(problem.labels), bool))
    return search.end(np.concatenate([x, share[list(effects)]]))


class _Search:
    """A fit under way; v holds coded parameters, then the shares of the effects let in."""

    def __init__(self, problem: Problem, simulator: Simulator, effects: tuple[int, ...], kept: Flags) -> None:
        self.problem, self.simulator, self.effects, self.kept = problem, simulator, effects, kept
        sides = [problem.candidates[k].two_sided for k in effects]
        p = len(problem.parameters)
        self.p = p
        self.low = np.concatenate([-np.ones(p), np.where(sides, -LARGEST, 0.0)]) if effects else -np.ones(p)
        self.high = np.concatenate([np.ones(p), np.full(len(effects), LARGEST)])

    def starts(self, start: Fit | None) -> list[Array]:
        """Return the points to begin from."""
        if start is not None and start.effects == self.effects:
            return [np.concatenate([start.x, start.share[list(self.effects)]])]
        if start is not None:
            bases = [start.x]
        else:
            believed = self.problem.coded(np.array([q.believed for q in self.problem.parameters], float))
            bases = [np.clip(believed, -1, 1), np.zeros(self.p), np.full(self.p, -0.5), np.full(self.p, 0.5)]
        if not self.effects:
            return bases
        signs = [-1.0, 1.0] if any(self.problem.candidates[k].two_sided for k in self.effects) else [1.0]
        shares = [sign * share for sign in signs for share in FIRST_SHARES]
        known = start.share[list(self.effects)] if start is not None else np.zeros(len(self.effects))
        return [np.concatenate([b, np.where(known != 0, known, s)]) for b in bases for s in shares]

    def run(self, v: Array, rounds: int) -> Fit:
        """Return where a descent from v ends."""
        if len(v):
            v = np.clip(v, self.low + 1e-6, self.high - 1e-6)
            for _ in range(rounds):
                sigma = np.sqrt(self.problem.u**2 + self._variance(v))
                v = least_squares(
                    self._residual,
                    v,
                    self._slope,
                    (self.low, self.high),
                    args=(sigma,),
                    x_scale=1.0,
                    xtol=1e-6,
                    ftol=1e-8,
                ).x
        return self.end(v)

    def end(self, v: Array) -> Fit:
        x, share = self._split(v[None])
        values = self._values(self._around(v))
        variance = self._variance(v)
        slope = (values[1:] - values[0]).T / STEP if len(v) else np.zeros((len(values[0]), 0))
        residual = self._standardised(v, values[0], np.sqrt(self.problem.u**2 + variance))
        chi2 = float(residual @ residual)
        return Fit(self.problem, self.effects, x[0], share[0], values[0], variance, slope, self.kept, chi2)

    def _around(self, v: Array) -> Array:
        return np.vstack([v, v + STEP * np.eye(len(v))])

    def _split(self, points: Array) -> tuple[Array, Array]:
        share = np.zeros((len(points), len(self.problem.candidates)))
        share[:, list(self.effects)] = points[:, self.p :]
        return points[:, : self.p], share

    def _values(self, points: Array) -> Array:
        return self.simulator.mean(*self._split(points))

    def _variance(self, v: Array) -> Array:
        return self.simulator.variance(*self._split(v[None]))[0]

    def _standardised(self, v: Array, simulated: Array, sigma: Array) -> Array:
        errors = ((simulated - self.problem.measured) / sigma)[self.kept]
        value, u = self.problem.direct_values
        return np.concatenate([errors, (self.problem.natural(v[: self.p])[list(self.problem.direct)] - value) / u])

    def _residual(self, v: Array, sigma: Array) -> Array:
        return self._standardised(v, self._values(v[None])[0], sigma)

    def _slope(self, v: Array, sigma: Array) -> Array:
        values = self._values(self._around(v))
        slope = ((values[1:] - values[0]) / STEP / sigma).T[self.kept]
        return np.vstack([slope, direct_slope(self.problem, v[: self.p], len(v))])
