"""Which terms to keep: backward by p with hierarchy, forward by AICc or BIC."""

from __future__ import annotations

import math
from collections.abc import Iterable, Sequence
from dataclasses import dataclass

import numpy as np
import pandas as pd

from analysis.errors import AnalysisError
from analysis.regression import FittedModel
from analysis.run_table import RunTable
from designs.terms import Term

HIERARCHIES = ("each_step", "at_end", "none")
METHODS = ("none", "backward", "forward_aicc", "forward_bic")

#: A term within this factor of α on either side is called a close call.
CLOSE = 2.0


@dataclass(frozen=True)
class CloseCall:
    """A term that left or stayed with p within a factor two of α.

    Args:
        label: the term.
        p: its p when it was judged.
        stayed: whether it is in the final model.
        with_it, without_it: the models that differ by this term.
    """

    label: str
    p: float
    stayed: bool
    with_it: FittedModel
    without_it: FittedModel

    def sentence(self, alpha: float) -> str:
        """Return what hangs on this term, and what AICc and BIC prefer."""
        prefer = []
        for name in ("AICc", "BIC"):
            present, absent = (m.information(name) for m in (self.with_it, self.without_it))
            wins = "with" if present < absent else "without"
            prefer.append(f"{name} prefers the model {wins} it ({present:.2f} with, {absent:.2f} without)")
        did = "stays" if self.stayed else "leaves"
        return (
            f"Close call: {self.label} {did} at p = {self.p:.4f}, within a factor two of α = {alpha:g}; "
            f"{' and '.join(prefer)}."
        )


@dataclass(frozen=True)
class Selection:
    """A selected model, how it was reached, and what was close.

    Args:
        fit: the final model.
        full: the model that selection started from (or could at most have reached).
        path: one row per step: what was done, to which term, p, and the criteria afterwards.
        close_calls: terms within a factor two of α.
        method: how it was selected, in words.
        criterion: ``AICc`` or ``BIC`` where it was selected by one.
    """

    fit: FittedModel
    full: FittedModel
    path: pd.DataFrame
    close_calls: tuple[CloseCall, ...]
    method: str
    criterion: str = ""


def select(
    runs: RunTable,
    response: str,
    terms: Sequence[Term],
    *,
    method: str = "backward",
    alpha: float = 0.05,
    hierarchy: str = "each_step",
) -> Selection:
    """Return the model chosen among the terms.

    Args:
        runs, response: the data.
        terms: the candidate terms, without the constant.
        method: ``none`` (all terms), ``backward`` (drop the largest p > alpha again and again), ``forward_aicc`` or
            ``forward_bic`` (add the term that lowers the criterion most; the best model on the way is kept).
        alpha: level of the backward elimination.
        hierarchy: ``each_step`` (a term stays while a kept one contains it), ``at_end`` (missing parents are added
            after the elimination), ``none``. Forward selection adds parents first unless it is ``none``.

    Raises:
        AnalysisError: for an unknown method or hierarchy, or a saturated model.
    """
    if method == "none":
        fit = FittedModel(runs, response, tuple(terms))
        return Selection(fit, fit, _path([_step(0, "all terms", "", math.nan, fit)]), (), "all terms")
    if method == "backward":
        return _backward(FittedModel(runs, response, tuple(terms)), alpha, hierarchy)
    if method in ("forward_aicc", "forward_bic"):
        return _forward(runs, response, terms, method.removeprefix("forward_"), hierarchy != "none")
    raise AnalysisError(f"Unknown selection method {method!r}. Allowed: {', '.join(METHODS)}.")


def is_hierarchical(terms: Iterable[Term]) -> bool:
    """Return whether every factor of every product has its linear term in the model."""
    present = set(terms)
    return all(lower in present for term in present for lower in _lower(term))


def _lower(term: Term) -> list[Term]:
    """Return the terms one power below, the constant left out."""
    lower = []
    for i, power in enumerate(term.powers):
        if power and term.order > 1:
            lower.append(Term((*term.powers[:i], power - 1, *term.powers[i + 1 :])))
    return lower


def _backward(full: FittedModel, alpha: float, hierarchy: str) -> Selection:
    if hierarchy not in HIERARCHIES:
        raise AnalysisError(f"Unknown hierarchy {hierarchy!r}. Allowed: {', '.join(HIERARCHIES)}.")
    full.require_error_df("p-values for a backward elimination")
    fit, calls, steps = full, [], [_step(0, "all terms", "", math.nan, full)]
    while fit.terms:
        p_values = fit.p_values()
        free = [t for t in fit.terms if hierarchy != "each_step" or not any(o.contains(t) for o in fit.terms)]
        worst = max(free, key=lambda term: p_values[term])
        if not p_values[worst] > alpha:
            calls += _close_stays(fit, {term: p_values[term] for term in free}, alpha)
            break
        smaller = fit.with_terms([term for term in fit.terms if term != worst])
        label = worst.label(fit.runs.names)
        if p_values[worst] <= CLOSE * alpha:
            calls.append(CloseCall(label, p_values[worst], False, fit, smaller))
        steps.append(_step(len(steps), "remove", label, p_values[worst], smaller))
        fit = smaller
    if hierarchy == "at_end":
        fit, steps = _add_parents(fit, full, steps)
    words = {
        "each_step": "with hierarchy at each step",
        "at_end": "with hierarchy at the end",
        "none": "without hierarchy",
    }
    return Selection(fit, full, _path(steps), tuple(calls), f"backward elimination at α = {alpha:g} {words[hierarchy]}")


def _close_stays(fit: FittedModel, p_values: dict[Term, float], alpha: float) -> list[CloseCall]:
    return [
        CloseCall(t.label(fit.runs.names), p, True, fit, fit.with_terms([o for o in fit.terms if o != t]))
        for t, p in p_values.items()
        if p >= alpha / CLOSE
    ]


def _add_parents(fit: FittedModel, full: FittedModel, steps: list[dict[str, object]]) -> tuple[FittedModel, list]:
    missing = [t for t in full.terms if t not in fit.terms and any(kept.contains(t) for kept in fit.terms)]
    for term in missing:
        fit = fit.with_terms([t for t in full.terms if t in fit.terms or t == term])
        steps = [*steps, _step(len(steps), "add for hierarchy", term.label(fit.runs.names), math.nan, fit)]
    return fit, steps


def _forward(runs: RunTable, response: str, terms: Sequence[Term], criterion: str, hierarchical: bool) -> Selection:
    fit = FittedModel(runs, response, ())
    best, steps = fit, [_step(0, "constant only", "", math.nan, fit)]

    def score(model: FittedModel) -> float:
        return model.information(criterion)

    while True:
        options = list(_larger(fit, terms, hierarchical))
        options = [(term, model) for term, model in options if np.isfinite(score(model))]
        if not options:
            break
        term, fit = min(options, key=lambda option: score(option[1]))
        steps.append(_step(len(steps), "add", term.label(runs.names), math.nan, fit))
        if score(fit) < score(best):
            best = fit
    name = {"aicc": "AICc", "bic": "BIC"}[criterion]
    return Selection(best, fit, _path(steps), (), f"forward selection by {name}", name)


def _larger(fit: FittedModel, terms: Sequence[Term], hierarchical: bool) -> Iterable[tuple[Term, FittedModel]]:
    """Yield each fit with one more term that the runs can carry, its parents among the candidates being there."""
    for term in terms:
        waits = hierarchical and any(term.contains(other) and other not in fit.terms for other in terms)
        if term in fit.terms or waits:
            continue
        try:
            larger = fit.with_terms([t for t in terms if t in fit.terms or t == term])
        except AnalysisError:  # aliased or too many: not an option
            continue
        if larger.error_df:
            yield term, larger


def _step(number: int, action: str, label: str, p: float, fit: FittedModel) -> dict[str, object]:
    return {
        "Step": number,
        "Action": action,
        "Term": label,
        "p": p,
        "S": fit.s,
        "R2 %": fit.r_squared,
        "R2 adj %": fit.r_squared_adjusted,
        "R2 pred %": fit.r_squared_predicted,
        "AICc": fit.information("aicc"),
        "BIC": fit.information("bic"),
    }


def _path(steps: list[dict[str, object]]) -> pd.DataFrame:
    return pd.DataFrame(steps)
