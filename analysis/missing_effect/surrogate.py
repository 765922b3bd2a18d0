"""A surrogate of the simulator: what each response would be between the points that were simulated, and how sure that is.

Gaussian-process regression with the kernel of `kernel.py`; the scales of its terms are estimated per response by the largest
posterior density under weak priors. That they are estimated is counted as in regression: with t of them from n runs, variances
are larger by n/(n − t).

Source: Rasmussen & Williams, "Gaussian Processes for Machine Learning" (2006), ch. 2 and 5.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from scipy.linalg import cho_factor, cho_solve
from scipy.optimize import minimize

from analysis.errors import AnalysisError
from analysis.missing_effect.kernel import (
    BASE_TERMS,
    EFFECT_TERMS,
    VAGUE,
    Likeness,
    Points,
    base_kernels,
    effect_kernels,
    likeness,
    own_kernels,
)
from analysis.missing_effect.problem import Array, Indices

# Log-normal priors of the scales, in units of the responses' scatter, and for terms of effects of their size: median and
# spread of the logarithm. They say no more than that noise is smaller than signal and curvature smaller than slope.
PRIOR = {
    "noise": (0.1, 2.0),
    "linear": (0.5, 1.0),
    "quadratic": (0.15, 1.0),
    "smooth": (0.2, 0.7),
    "curve": (0.5, 0.7),
    "interaction": (0.3, 0.7),
    "effect_smooth": (0.4, 0.7),
}
LEAST = 1e-4  # noise in units of the scatter, so that deterministic responses stay solvable
LEAST_SIZE = 0.05  # of an effect in units of the scatter
STEPS = 60  # of the search for the scales


@dataclass(frozen=True)
class Response:
    """The surrogate of one response.

    Attributes:
        points: that were simulated (n).
        mean, scatter: of the simulated values.
        weights: α with S(·) = mean + scatter k(·)ᵀ α, (n,).
        inverse: of the covariance of the runs (n, n).
        scale, size: estimated scales, sizes of the effects (K,).
    """

    points: Points
    mean: float
    scatter: float
    weights: Array
    inverse: Array
    scale: dict[str, float]
    size: Array

    @property
    def noise(self) -> float:
        """Scatter from seed to seed, in the response's unit."""
        return self.scale["noise"] * self.scatter

    @property
    def doubt(self) -> float:
        """By how much variances are larger since scales and sizes were estimated from the same n runs, n/(n − t)."""
        n = len(self.weights)
        estimated = len(self.scale) + int(np.any(self.points.share != 0, axis=0).sum())
        return n / max(n - estimated, 1)


class Surrogate:
    """Surrogates of several responses.

    Args:
        points: that were simulated.
        values: responses, (n, m); NaN where a run failed.
        labels: names of the responses.

    Raises:
        AnalysisError: a response with too few runs.
    """

    def __init__(self, points: Points, values: Array, labels: Sequence[str]) -> None:
        self.labels = tuple(labels)
        self.responses = [_fitted(points, column, label) for column, label in zip(values.T, labels, strict=True)]
        members: dict[tuple[int, ...], list[int]] = {}
        for i, column in enumerate(values.T):
            members.setdefault(tuple(np.flatnonzero(np.isfinite(column))), []).append(i)
        self._groups = [_Group(self.responses, group) for group in members.values()]

    @property
    def noise(self) -> Array:
        """Scatter from seed to seed of each response (m,)."""
        return np.array([r.noise for r in self.responses])

    def mean(self, x: Array, share: Array) -> Array:
        """Return the expected responses at n points, (n, m).

        Args:
            x: coded parameters (n, p).
            share: of each effect (n, K).
        """
        found = np.empty((len(x), len(self.responses)))
        for group in self._groups:
            found[:, group.members] = group.mean(Points(x, share))
        return found

    def variance(self, x: Array, share: Array) -> Array:
        """Return how uncertain the surrogate leaves the expected responses, squared, (n, m)."""
        found = np.empty((len(x), len(self.responses)))
        for group in self._groups:
            found[:, group.members] = group.variance(Points(x, share))
        return found


class _Group:
    """Responses known from the same runs: their kernels are computed once, their means are one product of matrices.

    Most of a search is spent here. So weights and scales are multiplied out beforehand, and for an effect only its own runs are
    looked at.
    """

    def __init__(self, responses: Sequence[Response], members: list[int]) -> None:
        self.members = members
        chosen = [responses[i] for i in members]
        self.points = chosen[0].points
        self._offset = np.array([r.mean for r in chosen])
        self._unit = np.array([r.doubt * r.scatter**2 for r in chosen])
        self._inverse = np.stack([r.inverse for r in chosen])
        alpha = np.stack([r.scatter * r.weights for r in chosen], axis=1)  # (n, m)
        self._base = _scales_of(chosen, BASE_TERMS)  # (terms, m)
        self._base_weights = (self._base[:, None] * alpha).reshape(-1, len(chosen))
        self._runs = [np.flatnonzero(column) for column in self.points.share.T]
        self._effect = []  # per effect (terms, m)
        for k in range(len(self._runs)):
            scales = _scales_of(chosen, EFFECT_TERMS)
            scales[1:] *= np.array([r.size[k] ** 2 for r in chosen])
            self._effect.append(scales)
        self._effect_weights = [
            (scales[:, None] * alpha[runs]).reshape(-1, len(chosen))
            for scales, runs in zip(self._effect, self._runs, strict=True)
        ]

    def _kernels(self, at: Points) -> tuple[Array, dict[int, tuple[Indices, Array]]]:
        """Return the kernels of base terms (terms, n, runs), and of each acting effect where it acts with its own runs."""
        dot, quadratic, smooth = base_kernels(at.x, self.points.x)
        acting = {}
        for k in np.flatnonzero(np.any(at.share != 0, axis=0)):
            runs, rows = self._runs[k], np.flatnonzero(at.share[:, k])
            shares, here = (at.share[rows, k, None], self.points.share[None, runs, k]), np.ix_(rows, runs)
            acting[int(k)] = rows, np.stack(effect_kernels(*shares, dot[here], smooth[here]))
        return np.stack([np.ones_like(dot), dot, quadratic, smooth]), acting

    def mean(self, at: Points) -> Array:
        """Return the means (n, members)."""
        base, acting = self._kernels(at)
        found = self._offset + np.hstack(list(base)) @ self._base_weights
        for k, (rows, kernels) in acting.items():
            found[rows] += np.hstack(list(kernels)) @ self._effect_weights[k]
        return found

    def variance(self, at: Points) -> Array:
        """Return the variances of the means (n, members)."""
        base, acting = self._kernels(at)
        near = np.einsum("tm,tnr->mnr", self._base, base)
        dot, quadratic, one = own_kernels(at.x)
        own = np.stack([one, dot, quadratic, one]).T @ self._base
        for k, (rows, kernels) in acting.items():
            near[np.ix_(np.arange(len(near)), rows, self._runs[k])] += np.einsum(
                "tm,tnr->mnr", self._effect[k], kernels
            )
            s = at.share[rows, k]
            own[rows] += np.stack(effect_kernels(s, s, dot[rows], np.ones_like(s))).T @ self._effect[k]
        known = np.einsum("mnr,mrq,mnq->nm", near, self._inverse, near, optimize=True)
        return self._unit * np.maximum(own - known, 0.0)


def _scales_of(responses: Sequence[Response], names: Sequence[str]) -> Array:
    """Return the squared scales of the vague term and of the named ones, (1 + names, m)."""
    return np.array([[VAGUE**2] * len(responses), *([r.scale[name] ** 2 for r in responses] for name in names)])


def _fitted(points: Points, values: Array, label: str) -> Response:
    good = np.isfinite(values)
    if good.sum() < points.x.shape[1] + 2:
        raise AnalysisError(
            f"{label}: {good.sum()} of {len(values)} runs of the screening design gave a value; too few to tell what it "
            "depends on. See why the others failed."
        )
    known = points if good.all() else points.rows(good)
    y = values[good]
    mean = float(y.mean())
    scatter = float(y.std()) or max(abs(mean), 1.0) * 1e-6
    near, scaled = likeness(known, known), (y - mean) / scatter
    full = np.zeros(points.share.shape[1])
    full[near.which] = LEAST_SIZE * 4
    scale = _scales(near, scaled, full)
    size = _sizes(known, near, scaled, scale, full)
    scale = _scales(near, scaled, size)
    factor = cho_factor(_covariance(near.combined(scale, size), scale["noise"]), lower=True)
    inverse = cho_solve(factor, np.eye(len(y)))
    return Response(known, mean, scatter, cho_solve(factor, scaled), inverse, scale, size)


def _covariance(signal: Array, noise: float) -> Array:
    return signal + (noise**2 + LEAST**2) * np.eye(len(signal))


def _scales(near: Likeness, y: Array, size: Array) -> dict[str, float]:
    """Return the scales of largest posterior density."""
    terms = {"noise": np.eye(len(y)), **near.terms(size)}
    fixed = VAGUE**2 * (1 + near.plain) + LEAST**2 * np.eye(len(y))
    names, kernels = list(terms), np.stack(list(terms.values()))
    middle = np.log([PRIOR[name][0] for name in names])
    spread = np.array([PRIOR[name][1] for name in names])
    bounds = [(np.log(LEAST), np.log(30.0))] * len(names)
    found = minimize(
        minus_log_posterior,
        middle,
        args=(y, fixed, kernels, middle, spread),
        jac=True,
        method="L-BFGS-B",
        bounds=bounds,
        options={"maxiter": STEPS},
    )
    return dict(zip(names, np.exp(found.x).tolist(), strict=True))


def minus_log_posterior(
    logs: Array, y: Array, fixed: Array, kernels: Array, middle: Array, spread: Array
) -> tuple[float, Array]:
    """Return ½ yᵀC⁻¹y + ½ ln det C + ½ Σ ((ln s − middle)/spread)², C = fixed + Σ s² kernel, and its derivatives by ln s.

    Args:
        logs: ln s of every term (t,).
        y: values (n,).
        fixed, kernels: (n, n), (t, n, n).
        middle, spread: of the priors of ln s (t,).
    """
    weights = np.exp(2 * logs)
    factor = cho_factor(fixed + np.tensordot(weights, kernels, 1), lower=True)
    alpha, inverse = cho_solve(factor, y), cho_solve(factor, np.eye(len(y)))
    fit = 0.5 * y @ alpha + np.log(np.diag(factor[0])).sum()
    slope = weights * np.einsum("kij,ij->k", kernels, inverse - np.outer(alpha, alpha))
    off = (logs - middle) / spread
    return float(fit + 0.5 * off @ off), slope + off / spread


def _sizes(points: Points, near: Likeness, y: Array, scale: dict[str, float], size: Array) -> Array:
    """Return how much each effect does at full share in the middle of the ranges, in units of the scatter."""
    weights = cho_solve(cho_factor(_covariance(near.combined(scale, size), scale["noise"]), lower=True), y)
    count, p = len(size), points.x.shape[1]
    full, none = Points(np.zeros((count, p)), np.eye(count)), Points(np.zeros((1, p)), np.zeros((1, count)))
    with_effect = likeness(full, points).combined(scale, size) @ weights
    without = likeness(none, points).combined(scale, size) @ weights
    return np.maximum(np.abs(with_effect - without), LEAST_SIZE)
