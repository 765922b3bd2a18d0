"""How alike two simulated points are: the prior of the surrogate, as a sum of kernels with few scales.

A point is x, the coded parameters (p,), and β, a share per candidate effect (K,); a response is

  S(x, β) = c + linear(x) + quadratic(x) + smooth(x) + Σ_k [ a_k β_k + curve_k(β_k) + β_k (linear_k(x) + smooth_k(x, β_k)) ]

so that an effect that is absent contributes nothing, and effects add. Every term has a Gaussian prior about zero; those of an
effect but its a_k are scaled by its size.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np

from analysis.missing_effect.problem import Array, Indices

REACH = 1.3  # over how many coded half-ranges a smooth term forgets
ROUGH_REACH, ROUGH = 0.5, 0.2  # the same for what is rough in it, and how much of that it holds, as variances
SHARE_REACH = 0.7  # and over what difference of shares
VAGUE = 10.0  # prior of the constant and of a_k, in units of the responses' scatter

BASE_TERMS = ("linear", "quadratic", "smooth")
EFFECT_TERMS = ("curve", "interaction", "effect_smooth")


@dataclass(frozen=True)
class Points:
    """Points at which responses are known or wanted: coded parameters x (n, p) and shares (n, K)."""

    x: Array
    share: Array

    def __len__(self) -> int:
        return len(self.x)

    def rows(self, which: Array) -> Points:
        """Return some of the points."""
        return Points(self.x[which], self.share[which])


@dataclass(frozen=True)
class Likeness:
    """The unscaled kernels between points a (n) and b (m).

    Attributes:
        base: (n, m) by the name of the term.
        which: numbers of the effects that act in some of a.
        plain: Σ_k β_k β'_k, (n, m).
        each: by the name of the term, for each of `which`, (len(which), n, m).
    """

    base: Mapping[str, Array]
    which: Indices
    plain: Array
    each: Mapping[str, Array]

    def terms(self, size: Array) -> dict[str, Array]:
        """Return the kernel of every term, effects joined by their squared sizes (K,)."""
        weights = size[self.which] ** 2
        return {**self.base, **{name: np.tensordot(weights, kernel, 1) for name, kernel in self.each.items()}}

    def combined(self, scale: Mapping[str, float], size: Array) -> Array:
        """Return the covariance for scales in units of the scatter and effect sizes (K,), (n, m)."""
        total = VAGUE**2 * (1 + self.plain)
        for name, kernel in self.terms(size).items():
            total = total + scale[name] ** 2 * kernel
        return total


def base_kernels(a: Array, b: Array) -> tuple[Array, Array, Array]:
    """Return the kernels of `BASE_TERMS` between coded parameters (n, p) and (m, p).

    They are a·b, (a·b)² + Σ_j a_j³ b_j³ and e(REACH) + ROUGH e(ROUGH_REACH) over 1 + ROUGH, with e(l) = exp(−|a − b|²/2l²). The
    cubes are for what saturates in one parameter, the rough part for what no smooth curve follows: without it that would be
    taken for scatter from seed to seed, and the surrogate would believe too much of itself.
    """
    dot, cubes = a @ b.T, a**3 @ (b**3).T
    apart = np.maximum((a**2).sum(1)[:, None] + (b**2).sum(1)[None] - 2 * dot, 0.0)
    smooth = np.exp(-apart / (2 * REACH**2)) + ROUGH * np.exp(-apart / (2 * ROUGH_REACH**2))
    return dot, dot**2 + cubes, smooth / (1 + ROUGH)


def own_kernels(a: Array) -> tuple[Array, Array, Array]:
    """Return the kernels of `BASE_TERMS` of points with themselves (n,)."""
    dot = (a**2).sum(axis=1)
    return dot, dot**2 + (a**6).sum(axis=1), np.ones_like(dot)


def effect_kernels(s: Array, t: Array, dot: Array, smooth: Array) -> tuple[Array, ...]:
    """Return β β', then the kernels of `EFFECT_TERMS`, for shares s and t of one effect, or of several in front."""
    both = s * t
    bend = (1 - np.abs(s)) * (1 - np.abs(t)) + both  # β (1 − |β|), and β² for effects with two sides
    near = np.exp(-((s - t) ** 2) / (2 * SHARE_REACH**2))
    return both, both * bend, both * dot, both * smooth * near


def likeness(a: Points, b: Points) -> Likeness:
    """Return the kernels between two sets of points."""
    dot, quadratic, smooth = base_kernels(a.x, b.x)
    which = np.flatnonzero(np.any(a.share != 0, axis=0))
    s, t = a.share.T[which][:, :, None], b.share.T[which][:, None, :]
    both, *others = effect_kernels(s, t, dot, smooth)
    base = dict(zip(BASE_TERMS, (dot, quadratic, smooth), strict=True))
    return Likeness(base, which, both.sum(axis=0), dict(zip(EFFECT_TERMS, others, strict=True)))
