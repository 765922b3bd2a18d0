"""Leave one test out: fit the others, predict it, see how far off the prediction is."""

from __future__ import annotations

import numpy as np

from analysis.missing_effect.fit import Fit, Simulator, fit
from analysis.missing_effect.problem import Array


def held_out_errors(whole: Fit, simulator: Simulator) -> Array:
    """Return for each response the standardised error of its prediction from the other tests (m,).

    z_i = (S_i − D_i)/√(u_i² + v_i + s_i (JᵀV⁻¹J)⁻¹ s_iᵀ): the last term is what the parameters, fitted without that test, leave
    uncertain. NaN where too few measurements are left to fit.
    """
    problem = whole.problem
    errors = np.full(len(problem.labels), np.nan)
    for test in dict.fromkeys(problem.tests):
        inside = np.array([t == test for t in problem.tests])
        if problem.count - inside.sum() <= len(whole.x) + len(whole.effects):
            continue
        part = fit(problem, simulator, whole.effects, start=whole, left_out=(test,))
        slope = part.slope[inside]
        spread = np.einsum("ij,jk,ik->i", slope, part.covariance, slope)
        u = np.sqrt(problem.u[inside] ** 2 + part.variance[inside] + spread)
        errors[inside] = (part.simulated - problem.measured)[inside] / u
    return errors


def root_mean_square(errors: Array) -> float:
    """Return √(mean z²) of those that are numbers; NaN where none is."""
    good = errors[np.isfinite(errors)]
    return float(np.sqrt(np.mean(good**2))) if len(good) else float("nan")
