"""A simulator that is linear and known exactly, for which everything has a closed form."""

from __future__ import annotations

import numpy as np

from analysis.missing_effect.problem import Candidate, Parameter, Problem


class Linear:
    """S = c + J x + E β, with a given variance left open."""

    def __init__(self, slope, effects, constant=0.0, left=0.0):
        self.slope, self.effects = np.asarray(slope, float), np.asarray(effects, float)
        self.constant = np.broadcast_to(np.asarray(constant, float), len(self.slope))
        self.left = np.broadcast_to(np.asarray(left, float), len(self.slope))

    def mean(self, x, share):
        """Return the responses at points (n, m)."""
        return self.constant + x @ self.slope.T + share @ self.effects.T

    def variance(self, x, share):
        """Return what is left open (n, m)."""
        return np.repeat(self.left[None], len(x), axis=0)


def linear(seed=0, m=9, p=3, k=4, left=0.0) -> Linear:
    """Return a linear simulator with random slopes, slopes and effects well above u."""
    rng = np.random.default_rng(seed)
    return Linear(2 * rng.normal(size=(m, p)), 4 * rng.normal(size=(m, k)), rng.normal(size=m), left)


def problem_of(simulator, measured, u=0.3, direct=(), u_direct=0.2, truth=None, tests=None, **flags) -> Problem:
    """Return a problem whose parameters range from −1 to 1, so that coded and natural are one.

    Args:
        simulator: what is fitted.
        measured: values (m,).
        u: their standard uncertainty.
        direct: numbers of the parameters that were measured directly, at `truth`, with `u_direct`.
        truth: values of the direct measurements (p,).
        tests: name of the test of each response; each its own by default.
        flags: of every candidate.
    """
    m, p = simulator.slope.shape
    truth = np.zeros(p) if truth is None else truth
    parameters = tuple(
        Parameter(f"p{j}", -1, 1, 0.0, *((float(truth[j]), u_direct) if j in direct else (None, None)))
        for j in range(p)
    )
    labels = tuple(f"r{i}" for i in range(m))
    candidates = tuple(Candidate(f"e{k}", **flags) for k in range(simulator.effects.shape[1]))
    u = np.broadcast_to(np.asarray(u, float), m).copy()
    return Problem(
        labels, labels if tests is None else tuple(tests), np.asarray(measured, float), u, parameters, candidates
    )
