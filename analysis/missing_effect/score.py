"""The projected score: how much of the residual that re-calibration left points along the signature of each effect.

With r = D − S(θ̂), V its covariance, J = ∂S/∂θ and j_k = [S(θ̂, β_k = δ) − S(θ̂, 0)]/δ for finite δ,

  M = V⁻¹ − V⁻¹ J (Jᵀ V⁻¹ J)⁻¹ Jᵀ V⁻¹
  T_k = j_kᵀ M r / √(j_kᵀ M j_k),   η_k = j_kᵀ M j_k / j_kᵀ V⁻¹ j_k,   ρ_kl = j_kᵀ M j_l / √(j_kᵀ M j_k · j_lᵀ M j_l)

η is the share of a signature that re-calibration can't imitate, ρ how alike two signatures are in what is left of them.
p-values are those of the largest of all scores, from residuals drawn by the same model (familywise, single step). The signature
is taken at two strengths, since some effects do nothing while they are weak and others are soon saturated.

Source: Rao (1948), doi 10.1017/S0305004100023987 (score test); Westfall & Young, "Resampling-Based Multiple Testing" (1993).
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from analysis.missing_effect.fit import Fit, Simulator
from analysis.missing_effect.problem import Array, Flags

DELTAS = (0.4, 1.0)  # shares at which the signature of an effect is taken
GRID = (0.1, 0.2, 0.3, 0.4, 0.5, 0.6, 0.8, 1.0)  # shares at which it is seen how much an effect shows
POWER = 0.8416  # standard normal quantile of 80 %
TINY = 1e-12


@dataclass(frozen=True)
class Scores:
    """Scores of K effects.

    Attributes:
        score: the larger of T at the two strengths, signed for effects with two sides (K,).
        adjusted_p: familywise p-values (K,).
        eta: (K,).
        rho: (K, K), at full strength.
        detectable_share: at which each effect is seen with 80 % probability; infinite where never (K,).
        threshold: 95 % quantile of the largest score if nothing is missing.
        draws: number of bootstrap draws.
    """

    score: Array
    adjusted_p: Array
    eta: Array
    rho: Array
    detectable_share: Array
    threshold: float
    draws: int


def score_effects(base: Fit, simulator: Simulator, draws: int, seed: int) -> Scores:
    """Return the scores of every candidate at a re-calibrated model.

    Args:
        base: the re-calibrated model, without the candidates.
        simulator: the surrogate.
        draws: of the bootstrap.
        seed: of its random stream.
    """
    both = np.stack([signatures(base, simulator, delta) for delta in DELTAS])  # (2, K, count)
    project = projection(base.weighted_slope[:, base.free])
    residual = _residual(base)
    full = both[-1]
    left = full @ project
    power = np.einsum("kc,kc->k", left, full)
    with np.errstate(invalid="ignore", divide="ignore"):
        eta = np.where(power > TINY, power / np.einsum("kc,kc->k", full, full), 0.0)
        rho = (left @ full.T) / np.sqrt(np.outer(power, power))
    directions = _directions(both, project)
    score = _largest(directions @ residual, base)
    random = np.random.default_rng(seed).standard_normal((draws, len(residual)))
    null = _largest(np.einsum("dkc,nc->ndk", directions, random @ project), base)
    peaks = np.abs(null).max(axis=1) if null.shape[1] else np.zeros(draws)
    adjusted = (1 + (peaks[:, None] >= np.abs(score)[None] * np.where(_counts(score, base), 1, 0)).sum(axis=0)) / (
        draws + 1
    )
    threshold = float(np.quantile(peaks, 0.95))
    detectable = detectable_shares(base, simulator, project, threshold + POWER)
    return Scores(score, adjusted, eta, np.nan_to_num(rho), detectable, threshold, draws)


def detectable_shares(base: Fit, simulator: Simulator, project: Array, wanted: float) -> Array:
    """Return the least share of each effect whose score is expected to be `wanted` (K,).

    It is that at which |M^½ (S(θ̂, β) − S(θ̂, 0))| reaches it, with straight lines between the shares of `GRID` and beyond.
    """
    grid = np.array([0.0, *GRID])
    rows = [delta * np.linalg.norm(signatures(base, simulator, delta) @ project, axis=1) for delta in GRID]
    found = np.full(len(rows[0]), np.inf)
    for k, heights in enumerate(np.vstack([np.zeros_like(rows[:1]), rows]).T):
        above = np.flatnonzero(heights >= wanted)
        if len(above):
            before = slice(above[0] - 1, above[0] + 1)
            found[k] = np.interp(wanted, heights[before], grid[before])
        elif heights[-1] > np.sqrt(TINY):
            found[k] = wanted / heights[-1]
    return found


def _counts(score: Array, base: Fit) -> Flags:
    """Return which scores speak for their effect: positive ones, or any for effects with two sides."""
    two = np.array([c.two_sided for c in base.problem.candidates], bool)
    return two | (score > 0)


def _residual(base: Fit) -> Array:
    """Return standardised D − S of the fitted responses and of the direct measurements (count,)."""
    value, u = base.problem.direct_values
    held = base.problem.natural(base.x)[list(base.problem.direct)]
    return np.concatenate([-base.z[base.kept], (value - held) / u])


def signatures(base: Fit, simulator: Simulator, delta: float) -> Array:
    """Return the standardised change of every measurement by each effect at a share δ, over δ (K, count)."""
    count = len(base.problem.candidates)
    delta_of = [1.0 if c.all_or_nothing else delta for c in base.problem.candidates]
    x = np.repeat(base.x[None], count, axis=0)
    changed = simulator.mean(x, np.diag(delta_of) + base.share[None])
    signature = ((changed - base.simulated) / base.sigma)[:, base.kept] / np.array(delta_of)[:, None]
    return np.hstack([signature, np.zeros((count, len(base.problem.direct)))])


def projection(slope: Array) -> Array:
    """Return I − J (Jᵀ J)⁻¹ Jᵀ for the derivatives J of standardised measurements by what is free to move.

    Parameters held at a bound can't imitate anything; they are left out of J.
    """
    return np.eye(len(slope)) - slope @ np.linalg.pinv(slope)


def _directions(both: Array, project: Array) -> Array:
    """Return unit vectors along the projected signatures (2, K, count); zero for what nobody can see."""
    left = both @ project
    length = np.linalg.norm(left, axis=-1, keepdims=True)
    return np.where(length > np.sqrt(TINY), left / np.maximum(length, np.sqrt(TINY)), 0.0)


def _largest(scores: Array, base: Fit) -> Array:
    """Return for each effect the score at the strength where it is larger, (…, 2, K) → (…, K).

    Of effects with one side a negative score counts as 0.
    """
    two = np.array([c.two_sided for c in base.problem.candidates], bool)
    size = np.where(two, np.abs(scores), scores)
    best = np.take_along_axis(scores, size.argmax(axis=-2)[..., None, :], axis=-2)[..., 0, :]
    return np.where(two, best, np.maximum(best, 0.0))
