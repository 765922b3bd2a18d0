"""Leave one test out: fit the others, predict it, see how far off the prediction is."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from analysis.missing_effect.fit import Fit, Simulator, refits
from analysis.missing_effect.problem import Array, Flags, Problem


def held_out_errors(wholes: Sequence[Fit], simulator: Simulator) -> list[Array]:
    """Return for each fit, and each response, the standardised error of its prediction from the other tests (m,).

    z_i = (S_i − D_i)/√(u_i² + v_i + s_i (JᵀV⁻¹J)⁻¹ s_iᵀ): the last term is what the parameters, fitted without that test, leave
    uncertain. A test that has parameters of its own, which no other could tell, keeps the first half of its responses, and the
    others are predicted. NaN where nothing was predicted.

    Args:
        wholes: fits of all responses, of as many effects each.
        simulator: the surrogate.
    """
    if not wholes:
        return []
    problem, unknowns = wholes[0].problem, len(wholes[0].x) + len(wholes[0].effects)
    out = np.stack([left_out(problem, test) for test in dict.fromkeys(problem.tests)])
    out = out[problem.count - out.sum(axis=1) > unknowns]
    errors = [np.full(len(problem.labels), np.nan) for _ in wholes]
    if len(out):
        parts = refits([whole for whole in wholes for _ in out], simulator, np.tile(~out, (len(wholes), 1)))
        for i, part in enumerate(parts):
            errors[i // len(out)][~part.kept] = _predicted(part)
    return errors


def _predicted(part: Fit) -> Array:
    """Return the standardised errors of what was not fitted."""
    gone = ~part.kept
    slope = part.slope[gone]
    spread = np.einsum("ij,jk,ik->i", slope, part.covariance, slope)
    u = np.sqrt(part.problem.u[gone] ** 2 + part.variance[gone] + spread)
    return np.asarray((part.simulated - part.problem.measured)[gone] / u)


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
