"""Leave one test out: fit the others, predict it, see how far off the prediction is."""

from __future__ import annotations

import numpy as np

from analysis.missing_effect.fit import Fit, Simulator, fit
from analysis.missing_effect.problem import Array, Flags, Problem


def held_out_errors(whole: Fit, simulator: Simulator) -> Array:
    """Return for each response the standardised error of its prediction from the other tests (m,).

    z_i = (S_i − D_i)/√(u_i² + v_i + s_i (JᵀV⁻¹J)⁻¹ s_iᵀ): the last term is what the parameters, fitted without that test, leave
    uncertain. A test that has parameters of its own, which no other could tell, keeps the first half of its responses, and the
    others are predicted. NaN where nothing was predicted.
    """
    problem = whole.problem
    errors = np.full(len(problem.labels), np.nan)
    for test in dict.fromkeys(problem.tests):
        out = left_out(problem, test)
        if problem.count - out.sum() <= len(whole.x) + len(whole.effects):
            continue
        part = fit(problem, simulator, whole.effects, start=whole, kept=~out)
        slope = part.slope[out]
        spread = np.einsum("ij,jk,ik->i", slope, part.covariance, slope)
        u = np.sqrt(problem.u[out] ** 2 + part.variance[out] + spread)
        errors[out] = (part.simulated - problem.measured)[out] / u
    return errors


def left_out(problem: Problem, test: str) -> Flags:
    """Return which responses are predicted when a test is left out (m,)."""
    inside = np.array([t == test for t in problem.tests])
    if any(parameter.test == test for parameter in problem.parameters):
        members = np.flatnonzero(inside)
        inside[members[: (len(members) + 1) // 2]] = False
    return inside


def root_mean_square(errors: Array) -> float:
    """Return √(mean z²) of those that are numbers; NaN where none is."""
    good = errors[np.isfinite(errors)]
    return float(np.sqrt(np.mean(good**2))) if len(good) else float("nan")
