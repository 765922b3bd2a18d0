"""One verdict of five from what a search found."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from analysis.missing_effect.search import Search, Trial

NOTHING_MISSING = "nothing_missing"
EFFECT = "effect"
ONE_OF = "one_of"
SOMETHING_ELSE = "something_else"
CANNOT_TELL = "cannot_tell"
VERDICTS = (NOTHING_MISSING, EFFECT, ONE_OF, SOMETHING_ELSE, CANNOT_TELL)

VISIBLE = 1 / 3  # share of the candidates that the data must be able to show before "nothing missing" means something


@dataclass(frozen=True)
class Levels:
    """Error levels of the decisions. The first two are shares of the familywise 5 % of false alarms.

    Args:
        score: of the largest score: an effect points along the residual.
        misfit: of χ² after re-calibration: something is missing, whatever it is.
        fit: of χ² after the best addition, below which that isn't the answer, or not all of it.
    """

    score: float = 0.04
    misfit: float = 0.01
    fit: float = 0.02


@dataclass(frozen=True)
class Verdict:
    """One of the five words, the trials it rests on (best first), and why.

    Attributes:
        word: one of `VERDICTS`.
        named: the additions in question, best first; empty for nothing_missing and cannot_tell.
        why: a key for the sentences of the report.
    """

    word: str
    named: tuple[Trial, ...]
    why: str


def decide(found: Search, levels: Levels = Levels()) -> Verdict:
    """Return the verdict.

    An alarm is a score that is significant among all, or a χ² that re-calibration could not bring down. Without an alarm nothing
    is missing, if these data could have shown it. With one, there must be more measurements than unknowns to check an addition
    by; the best one must bring χ² down to what chance gives, improve on re-calibration by as much as the largest score must, and
    predict tests that it was not fitted to better than the model without it; whatever comes within `RIVAL` of it and predicts
    better too is named beside it.
    """
    seen = _significant(found, levels)
    misfit = found.base.fit.p_value < levels.misfit
    if not found.trials and not misfit:
        return Verdict(CANNOT_TELL, (), "no_candidates")
    if not seen and not misfit:
        return Verdict(NOTHING_MISSING, (), "fits") if could_have_shown(found) else Verdict(CANNOT_TELL, (), "blind")
    best = found.best
    if best is None:
        return Verdict(SOMETHING_ELSE, (), "no_candidates")
    if found.problem.count <= len(found.problem.parameters) + 1:
        return Verdict(CANNOT_TELL, (), "unchecked")
    if best.fit.p_value < levels.fit:
        return _no_single_one(found, levels)
    if not seen and found.base.fit.deviance - best.fit.deviance < found.scores.threshold**2:
        return Verdict(SOMETHING_ELSE, (), "no_direction")
    named = tuple(t for t in found.rivals if _predicts_better(t, found.base))
    if not named:
        return Verdict(CANNOT_TELL, (), "no_better_prediction")
    return Verdict(EFFECT if len(named) == 1 else ONE_OF, named, "")


def _significant(found: Search, levels: Levels) -> bool:
    return bool(len(found.scores.adjusted_p)) and float(np.min(found.scores.adjusted_p)) < levels.score


def could_have_shown(found: Search) -> bool:
    """Return whether enough of the effects would have been seen at their strongest."""
    share = found.scores.detectable_share
    return bool(len(share)) and float(np.mean(share <= 1.0)) >= VISIBLE


def _predicts_better(trial: Trial, base: Trial) -> bool:
    if np.isnan(base.held_out_error) or np.isnan(trial.held_out_error):
        return True  # nothing can be left out: χ² alone speaks
    return trial.held_out_error < base.held_out_error


def _no_single_one(found: Search, levels: Levels) -> Verdict:
    """Return the verdict where no single effect is enough: two at once, if they are, are named as a suggestion."""
    if found.pairs and found.pairs[0].fit.p_value >= levels.fit:
        return Verdict(SOMETHING_ELSE, found.pairs, "pair")
    return Verdict(SOMETHING_ELSE, (), "none_fits")
