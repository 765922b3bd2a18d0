"""The search itself: re-calibrate, score every effect, refit with each, predict what was left out."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from functools import cached_property

import numpy as np

from analysis.missing_effect.fit import Fit, Simulator, at, fit, fits
from analysis.missing_effect.held_out import held_out_errors, root_mean_square
from analysis.missing_effect.problem import Array, Problem
from analysis.missing_effect.score import Scores, score_effects

RIVAL = 9.2  # deviance by which an explanation may be worse than the best and still be in question: odds of 100 to 1
PROMISING = 4  # pairs are looked for among these effects and all others


@dataclass(frozen=True)
class Trial:
    """A model with one effect more, or two, re-calibrated together with their strengths.

    Attributes:
        fit: the joint re-calibration.
        held_out: standardised errors of predictions (m,), NaN where they were not made.
    """

    fit: Fit
    held_out: Array

    @cached_property
    def held_out_error(self) -> float:
        """Root mean square of the standardised errors of predictions."""
        return root_mean_square(self.held_out)

    @property
    def effects(self) -> tuple[int, ...]:
        """Numbers of the effects."""
        return self.fit.effects


@dataclass(frozen=True)
class Search:
    """What was found.

    Attributes:
        problem: what was asked.
        believed: the model as it stood.
        base: re-calibrated, nothing added.
        scores: of every candidate.
        trials: a joint refit per candidate, best first.
        pairs: joint refits of two effects within reach of the best pair, best first; looked for where no single one fits.
    """

    problem: Problem
    believed: Fit
    base: Trial
    scores: Scores
    trials: tuple[Trial, ...]
    pairs: tuple[Trial, ...]

    @property
    def best(self) -> Trial | None:
        """The best single addition."""
        return self.trials[0] if self.trials else None

    @cached_property
    def rivals(self) -> tuple[Trial, ...]:
        """The best single addition and those that the data can't tell from it."""
        return tuple(t for t in self.trials if t.fit.deviance <= self.trials[0].fit.deviance + RIVAL)


def search(
    problem: Problem, simulator: Simulator, *, draws: int = 2000, seed: int = 1, look_for_pairs: float = 0.02
) -> Search:
    """Return what the measurements say of every candidate.

    Args:
        problem: measurements, ranges, candidates.
        simulator: the surrogate.
        draws, seed: of the bootstrap.
        look_for_pairs: p-value of the best single addition below which two at once are tried.
    """
    believed_x = problem.coded(np.array([p.believed for p in problem.parameters], float))
    nothing = np.zeros(len(problem.candidates))
    believed = at(problem, simulator, believed_x, nothing)
    base = fit(problem, simulator)
    scores = score_effects(base, simulator, draws, seed)
    singles = fits(problem, simulator, [(k,) for k in range(len(problem.candidates))], [base] * len(problem.candidates))
    trials = _tried(sorted(singles, key=lambda f: f.deviance), simulator)
    wanted = bool(trials) and base.p_value < look_for_pairs and trials[0].fit.p_value < look_for_pairs
    pairs = _pairs(problem, simulator, trials) if wanted else ()
    return Search(problem, believed, _tried([base], simulator)[0], scores, trials, pairs)


def _tried(found: Sequence[Fit], simulator: Simulator) -> tuple[Trial, ...]:
    errors = held_out_errors(found, simulator)
    return tuple(Trial(f, z) for f, z in zip(found, errors, strict=True))


def _pairs(problem: Problem, simulator: Simulator, singles: Sequence[Trial]) -> tuple[Trial, ...]:
    """Return the best two effects at once and their rivals, each with one of the promising ones; effects add."""
    chosen = [(a, b) for i, a in enumerate(singles[:PROMISING]) for b in singles[i + 1 :]]
    if not chosen:
        return ()
    together = [(*a.effects, *b.effects) for a, b in chosen]
    found = fits(problem, simulator, together, [a.fit for a, _ in chosen])
    found.sort(key=lambda f: f.deviance)
    return _tried([f for f in found if f.deviance <= found[0].deviance + RIVAL], simulator)
