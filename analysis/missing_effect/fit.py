"""Re-calibration: the parameters, and the strengths of effects that were let in, that agree best with the measurements.

χ²(θ, β) = Σ_i (D_i − S_i(θ, β))²/(u_i² + v_i(θ, β)) + Σ_j (θ_j,measured − θ_j)²/u_j²

with v the variance that the surrogate leaves. θ stays in its ranges, β between 0 (or −LARGEST where it has two sides) and
LARGEST.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from functools import cached_property, partial
from typing import Protocol

import numpy as np
from scipy import stats

from analysis.missing_effect.descent import descend
from analysis.missing_effect.problem import Array, Flags, Indices, Problem

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

    @cached_property
    def deviance(self) -> float:
        """Twice the negative log-likelihood, χ² + Σ ln(σ_i²/u_i²): what is fitted well only for want of certainty pays for it."""
        return self.chi2 + float(np.log(self.sigma[self.kept] ** 2 / self.problem.u[self.kept] ** 2).sum())

    @property
    def dof(self) -> int:
        """Degrees of freedom: measurements that were fitted, less parameters and strengths that are not at a bound."""
        return int(self.kept.sum()) + len(self.problem.direct) - int(self.free.sum())

    @property
    def p_value(self) -> float:
        """Probability of a larger χ² if nothing else is missing; nan without degrees of freedom."""
        return float(stats.chi2.sf(self.chi2, self.dof)) if self.dof > 0 else float("nan")

    @property
    def aicc(self) -> float:
        """Akaike's criterion with its small-sample term, deviance + 2k + 2k(k + 1)/(n − k − 1); infinite without room for it."""
        k, n = len(self.x) + len(self.effects), int(self.kept.sum()) + len(self.problem.direct)
        return self.deviance + 2 * k + 2 * k * (k + 1) / (n - k - 1) if n > k + 1 else float("inf")

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
        """Covariance of coded parameters and shares, (JᵀV⁻¹J + R⁻¹)⁻¹.

        R holds the variances of even distributions over the ranges, 1/3 and LARGEST²/12: what the data don't fix is limited by
        its range.
        """
        j = self.weighted_slope
        two_sided = np.array([self.problem.candidates[k].two_sided for k in self.effects], bool)
        shares = (LARGEST * (1 + two_sided)) ** 2 / 12
        return np.linalg.inv(j.T @ j + np.diag(1 / np.concatenate([np.full(len(self.x), 1 / 3), shares])))


def direct_slope(problem: Problem, x: Array, columns: int) -> Array:
    """Return the derivatives of standardised direct measurements by what is fitted, (…, p) → (…, direct, columns)."""
    which = list(problem.direct)
    rows = np.zeros((*x.shape[:-1], len(which), columns))
    rows[..., np.arange(len(which)), which] = problem.natural_slope(x)[..., which] / problem.direct_values[1]
    return rows


def fit(problem: Problem, simulator: Simulator, effects: Sequence[int] = (), *, start: Fit | None = None) -> Fit:
    """Return the best agreement with the measurements.

    Args:
        problem: measurements, ranges, candidates.
        simulator: the surrogate.
        effects: numbers of the candidates whose strengths are fitted too.
        start: a fit near which to begin.
    """
    return fits(problem, simulator, [tuple(effects)], [start])[0]


def fits(
    problem: Problem, simulator: Simulator, additions: Sequence[tuple[int, ...]], starts: Sequence[Fit | None]
) -> list[Fit]:
    """Return the best agreement for each of several additions, all of as many effects, side by side.

    Args:
        problem: measurements, ranges, candidates.
        simulator: the surrogate.
        additions: numbers of the candidates whose strengths are fitted too.
        starts: for each a fit near which to begin, or None.
    """
    if not additions:
        return []
    search = _Search(problem, simulator)
    begins = [search.starts(effects, start) for effects, start in zip(additions, starts, strict=True)]
    owner = np.repeat(np.arange(len(begins)), [len(b) for b in begins])
    kept = np.ones((len(owner), len(problem.labels)), bool)
    ends = search.run(np.vstack(begins), [additions[i] for i in owner.tolist()], kept, ROUNDS)
    return [
        min((end for end, i in zip(ends, owner, strict=True) if i == wanted), key=lambda end: end.deviance)
        for wanted in range(len(begins))
    ]


def refits(wholes: Sequence[Fit], simulator: Simulator, kept: Flags) -> list[Fit]:
    """Return fits of some of the responses only, each begun from a fit of all.

    Args:
        wholes: fits of all responses, of as many effects each (B).
        simulator: the surrogate.
        kept: which responses are fitted (B, m).
    """
    v = np.stack([np.concatenate([whole.x, whole.share[list(whole.effects)]]) for whole in wholes])
    return _Search(wholes[0].problem, simulator).run(v, [whole.effects for whole in wholes], kept, 1)


def at(problem: Problem, simulator: Simulator, x: Array, share: Array, effects: Sequence[int] = ()) -> Fit:
    """Return the agreement at a point, nothing fitted."""
    v = np.concatenate([x, share[list(effects)]])
    everything = np.ones((1, len(problem.labels)), bool)
    return _Search(problem, simulator).ends(v[None], np.array([effects], int), everything)[0]


class _Search:
    """Fits under way side by side; a row v (d,) holds coded parameters, then the shares of the effects let in."""

    def __init__(self, problem: Problem, simulator: Simulator) -> None:
        self.problem, self.simulator = problem, simulator
        self.p = len(problem.parameters)
        self.two_sided = np.array([c.two_sided for c in problem.candidates], bool)

    def starts(self, effects: tuple[int, ...], start: Fit | None) -> Array:
        """Return the points to begin from (B, d)."""
        if start is not None:
            bases = [start.x]
        else:
            believed = self.problem.coded(np.array([q.believed for q in self.problem.parameters], float))
            bases = [believed, np.zeros(self.p), np.full(self.p, -0.5), np.full(self.p, 0.5)]
        if not effects:
            return np.stack(bases)
        signs = [-1.0, 1.0] if self.two_sided[list(effects)].any() else [1.0]
        shares = [sign * share for sign in signs for share in FIRST_SHARES]
        known = start.share[list(effects)] if start is not None else np.zeros(len(effects))
        return np.stack([np.concatenate([b, np.where(known != 0, known, s)]) for b in bases for s in shares])

    def run(self, v: Array, effects: Sequence[tuple[int, ...]], kept: Flags, rounds: int) -> list[Fit]:
        """Return where descents from v (B, d) end, each with its effects and fitted to some of the responses (B, m)."""
        which = np.array(effects, int).reshape(len(v), -1)
        low, high = self._bounds(which)
        v = np.clip(v, low + 1e-6, high - 1e-6)
        for _ in range(rounds if v.size else 0):
            sigma = np.sqrt(self.problem.u**2 + self.simulator.variance(*self._split(v, which)))
            v = descend(partial(self._running, which, sigma, kept), v, low, high)
        return self.ends(v, which, kept)

    def _bounds(self, which: Indices) -> tuple[Array, Array]:
        ones = np.ones((len(which), self.p))
        lowest = np.where(self.two_sided[which], -LARGEST, 0.0) if which.size else np.zeros(which.shape)
        return np.hstack([-ones, lowest]), np.hstack([ones, np.full(which.shape, LARGEST)])

    def ends(self, v: Array, which: Indices, kept: Flags) -> list[Fit]:
        """Return the agreement at points (B, d) with effects (B, q)."""
        (x, share), variance = self._split(v, which), self.simulator.variance(*self._split(v, which))
        values, slope = self._values(v, which)
        residuals = self._errors(v, values, np.sqrt(self.problem.u**2 + variance), kept)
        chi2 = (residuals**2).sum(axis=1)
        effects = [tuple(row) for row in which.tolist()]
        return [
            Fit(self.problem, effects[i], x[i], share[i], values[i], variance[i], slope[i], kept[i], float(chi2[i]))
            for i in range(len(v))
        ]

    def _split(self, v: Array, which: Indices) -> tuple[Array, Array]:
        share = np.zeros((len(v), len(self.problem.candidates)))
        share[np.arange(len(v))[:, None], which] = v[:, self.p :]
        return v[:, : self.p], share

    def _values(self, v: Array, which: Indices) -> tuple[Array, Array]:
        """Return the responses at points (B, m) and their derivatives (B, m, d)."""
        count, d = v.shape
        around = (v[:, None] + np.vstack([np.zeros(d), STEP * np.eye(d)])).reshape(count * (d + 1), d)
        values = self.simulator.mean(*self._split(around, np.repeat(which, d + 1, axis=0))).reshape(count, d + 1, -1)
        return values[:, 0], (values[:, 1:] - values[:, :1]).transpose(0, 2, 1) / STEP

    def _errors(self, v: Array, values: Array, sigma: Array, kept: Flags) -> Array:
        """Return standardised errors of responses, 0 where left out, and of direct measurements (B, n)."""
        value, u = self.problem.direct_values
        direct = self.problem.natural(v[:, : self.p])[:, list(self.problem.direct)]
        return np.hstack([(values - self.problem.measured) * kept / sigma, (direct - value) / u])

    def _running(self, which: Indices, sigma: Array, kept: Flags, v: Array, running: Flags) -> tuple[Array, Array]:
        """Return standardised errors and their derivatives (B, n, d) of those descents that are still running."""
        values, slope = self._values(v, which[running])
        direct = direct_slope(self.problem, v[:, : self.p], v.shape[1])
        weight = (kept[running] / sigma[running])[..., None]
        errors = self._errors(v, values, sigma[running], kept[running])
        return errors, np.concatenate([slope * weight, direct], axis=1)
