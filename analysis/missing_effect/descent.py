"""Bounded least squares from many starting points at once.

Most of a diagnosis is spent in small fits of a surrogate whose answer for a hundred points costs little more than for one. So the
descents go side by side, a row each.

Source: Kanzow, Yamashita & Fukushima (2004), doi 10.1016/j.cam.2004.02.013 (projected Levenberg–Marquardt steps).
"""

from __future__ import annotations

from collections.abc import Callable

import numpy as np

from analysis.missing_effect.problem import Array, Flags

# Points (B, d) and which of the descents they belong to (B,) → residuals (B, n) and their derivatives (B, n, d).
Residuals = Callable[[Array, Flags], tuple[Array, Array]]

MOST_STEPS = 60
FIRST_DAMPING = 1e-3  # in units of the diagonal of JᵀJ
EASED, STIFFENED = 0.2, 5.0  # what a good step and a bad one make of it
MOST_DAMPING = 1e8
SETTLED = 1e-4  # coded length of a step, or change of Σ r², that counts as none
FLAT = 1e-9  # curvature that a direction is given at least


def descend(residuals: Residuals, start: Array, low: Array, high: Array) -> Array:
    """Return where each descent ends, v = argmin Σ r² with low ≤ v ≤ high, (B, d).

    Args:
        residuals: of points, with derivatives.
        start: (B, d).
        low, high: bounds (B, d).
    """
    v = np.clip(start, low, high)
    running = np.ones(len(v), bool)
    r, slope = residuals(v, running)
    damping = np.full(len(v), FIRST_DAMPING)
    for _ in range(MOST_STEPS):
        bounds = low[running], high[running]
        step = _step(r[running], slope[running], v[running], damping[running], *bounds)
        tried = np.clip(v[running] + step, *bounds)
        new_r, new_slope = residuals(tried, running)
        gain = (r[running] ** 2).sum(axis=1) - (new_r**2).sum(axis=1)
        moved = np.abs(tried - v[running]).max(axis=1)
        better = gain > 0
        rows = np.flatnonzero(running)
        v[rows[better]], r[rows[better]], slope[rows[better]] = tried[better], new_r[better], new_slope[better]
        damping[rows] *= np.where(better, EASED, STIFFENED)
        running[rows] = (np.minimum(moved, np.abs(gain)) > SETTLED) & (damping[rows] < MOST_DAMPING)
        if not running.any():
            break
    return v


def _step(r: Array, slope: Array, v: Array, damping: Array, low: Array, high: Array) -> Array:
    """Return damped Gauss–Newton steps; what is pressed against a bound stays there."""
    gradient = np.einsum("bnd,bn->bd", slope, r)
    curvature = np.einsum("bnd,bne->bde", slope, slope)
    free = ~(((v <= low) & (gradient > 0)) | ((v >= high) & (gradient < 0)))
    diagonal = np.arange(v.shape[1])
    own = np.maximum(curvature[:, diagonal, diagonal], FLAT)
    curvature = curvature * (free[:, :, None] & free[:, None])
    curvature[:, diagonal, diagonal] = own * (1 + damping[:, None])
    return np.linalg.solve(curvature, -(gradient * free)[..., None])[..., 0]
