"""A diagnosis in sentences."""

from __future__ import annotations

import numpy as np

from analysis.missing_effect.next_measurement import NEW_TEST, REPEAT, Proposal
from analysis.missing_effect.problem import NO_EFFECT, Candidate, Problem
from analysis.missing_effect.search import Search, Trial
from analysis.missing_effect.verdict import CANNOT_TELL, EFFECT, NOTHING_MISSING, ONE_OF, Verdict

FAR = 3.0  # times the strongest that was tried: beyond it an effect counts as invisible


def sentences(found: Search, verdict: Verdict) -> tuple[str, ...]:
    """Return what was found, a sentence each."""
    return (*_recalibration(found), *_finding(found, verdict), *_bounds(found, verdict))


def _recalibration(found: Search) -> tuple[str, ...]:
    base = found.base.fit
    return (
        f"Re-calibrated within its ranges, the model misses {found.problem.count} measurements by χ² = {base.chi2:.3g} on "
        f"{base.dof} degrees of freedom (p = {_p(base.p_value)}).",
    )


def _finding(found: Search, verdict: Verdict) -> tuple[str, ...]:
    if verdict.word == NOTHING_MISSING:
        return ("Nothing is missing that these data could show.", limits(found))
    if verdict.word == EFFECT:
        return (
            f"What is missing is {_with_strength(found.problem, verdict.named[0])}.",
            _gain(found, verdict.named[0]),
        )
    if verdict.word == ONE_OF:
        names = [_with_strength(found.problem, trial) for trial in verdict.named]
        alike = "These data can't tell them apart: between them the odds are below 100 to 1."
        return (f"What is missing is one of these: {'; '.join(names)}.", alike, _gain(found, verdict.named[0]))
    return _no_name(found, verdict)


def _no_name(found: Search, verdict: Verdict) -> tuple[str, ...]:
    if verdict.why == "no_candidates":
        told = "The model fits" if verdict.word == CANNOT_TELL else "Something is missing"
        return (f"{told}, and no effect was put to the test, so that none can be named or ruled out.",)
    if verdict.word == CANNOT_TELL:
        if verdict.why == "blind":
            return (
                "These data can't tell whether something is missing: re-calibration would imitate most effects, strong ones too.",
                limits(found),
            )
        if verdict.why == "unchecked":
            return (
                "Something is missing, but there are so few measurements that any effect would fit them perfectly: none is "
                "named, for nothing is left to check it by. Measure more.",
            )
        return (
            "Something is missing, but no effect of the library predicts tests that it was not fitted to better than the model "
            "without it, so none is named.",
        )
    best = found.best
    nearest = (
        "" if best is None else f" The best of them, {_title(found.problem, best)}, leaves χ² = {best.fit.chi2:.3g}."
    )
    if verdict.why == "pair":
        pair = verdict.named[0]
        return (
            f"Something else is missing: no single effect of the library explains the misfit.{nearest}",
            f"Two at once would: {_title(found.problem, pair)} together bring χ² to {pair.fit.chi2:.3g} on {pair.fit.dof} "
            "degrees of freedom. With two free strengths that is a suggestion, not a finding: add one and diagnose again.",
        )
    return (f"Something else is missing: no effect of the library explains the misfit.{nearest}",)


def _gain(found: Search, trial: Trial) -> str:
    before, after = found.base.held_out_error, trial.held_out_error
    predicted = (
        f", and the error of predicting tests that were left out from {before:.2g} to {after:.2g} standard uncertainties."
        if np.isfinite([before, after]).all()
        else ". There are too few tests to leave one out and predict it, so nothing else bears it out."
    )
    return (
        f"With it χ² falls from {found.base.fit.chi2:.3g} to {trial.fit.chi2:.3g} on {trial.fit.dof} degrees of freedom "
        f"(p = {_p(trial.fit.p_value)}){predicted}"
    )


def limits(found: Search) -> str:
    """Return the smallest strengths that would have been seen, those that are seen best first."""
    share = found.scores.detectable_share
    order = [int(k) for k in np.argsort(share) if share[k] <= FAR]
    told = [_limit(found.problem.candidates[k], float(share[k])) for k in order]
    hidden = [c.name for c, s in zip(found.problem.candidates, share, strict=True) if not s <= FAR]
    blind = f" They could hardly show at any strength: {', '.join(hidden)}." if hidden else ""
    if not told:
        return "These tests could show none of the effects."
    return f"With 80 % probability they would have shown: {'; '.join(told)}.{blind}"


def _limit(candidate: Candidate, share: float) -> str:
    beyond = ", more than the strongest that was tried" if share > 1 else ""
    if candidate.all_or_nothing:
        return f"{candidate.name} at {100 * share:.0f} % of its whole difference"
    return f"{candidate.name} from {candidate.parameter} {candidate.strength(share):.3g}{_unit(candidate)}{beyond}"


def _bounds(found: Search, verdict: Verdict) -> tuple[str, ...]:
    shown = verdict.named[0].fit if verdict.word in (EFFECT, ONE_OF) else found.base.fit
    at = [p.key for p, x in zip(found.problem.parameters, shown.x, strict=True) if abs(abs(x) - 1) < 1e-3]
    if not at:
        return ()
    return (
        f"{', '.join(at)} ended at the edge of the believed range. Widen the range if it may lie beyond, or take this as a "
        "further sign that the model lacks something.",
    )


def _title(problem: Problem, trial: Trial) -> str:
    return " and ".join(problem.candidates[k].name for k in trial.effects)


def _with_strength(problem: Problem, trial: Trial) -> str:
    return " and ".join(
        _one(problem.candidates[k], float(trial.fit.share[k]), uncertainty(trial, k)) for k in trial.effects
    )


def uncertainty(trial: Trial, effect: int) -> float:
    """Return the standard uncertainty of an effect's share."""
    place = len(trial.fit.x) + trial.effects.index(effect)
    return float(np.sqrt(trial.fit.covariance[place, place]))


def _one(candidate: Candidate, share: float, u: float) -> str:
    if candidate.all_or_nothing:
        return f"{candidate.name} ({share:.2g} ± {u:.1g} of its whole difference)"
    spread = abs(u * (candidate.at_full - candidate.at_zero))
    return (
        f"{candidate.name} ({candidate.parameter} = {candidate.strength(share):.3g} ± {spread:.2g}{_unit(candidate)})"
    )


def _unit(candidate: Candidate) -> str:
    return "" if candidate.unit == "1" else f" {candidate.unit}"


def _p(p: float) -> str:
    return "below 0.0001" if p < 1e-4 else f"{p:.2g}"


def next_sentence(problem: Problem, proposal: Proposal) -> str:
    """Return what to measure next and why."""
    names = {NO_EFFECT: "the model as it is"} | {k: c.name for k, c in enumerate(problem.candidates)}
    option = proposal.option
    what = {
        NEW_TEST: f"make the test {option.label}",
        REPEAT: f"repeat {option.label} until its standard uncertainty is {option.u:.2g}",
    }.get(option.kind, f"measure {option.label} directly, to ± {option.u:.2g}")
    if not proposal.between:
        more = 100 * (np.exp(proposal.separation) - 1)
        return f"Next, {what}: on average the effects would be seen {more:.0f} % better."
    predicted = "; ".join(f"{names[k]} predicts {value:.4g}" for k, value in proposal.predictions.items())
    first, second = (names[k] for k in proposal.between)
    return f"Next, {what}: it parts {first} from {second} by {proposal.separation:.1f} standard uncertainties ({predicted})."


def what_to_do(verdict: Verdict, problem: Problem, proposal: Proposal | None) -> tuple[str, ...]:
    """Return advice."""
    advice: list[str] = [] if proposal is None else [next_sentence(problem, proposal)]
    if verdict.word in (EFFECT, ONE_OF):
        advice.append(
            f"Add {_title(problem, verdict.named[0])} to the model and see whether fresh simulations bear it out."
        )
    elif verdict.word not in (NOTHING_MISSING, CANNOT_TELL):
        advice.append(
            "Look at what no library knows: grain shape and size, density, geometry, how the measured quantity is defined."
        )
    if proposal is None and verdict.word == ONE_OF:
        advice.append(
            "No single further measurement of those that were considered parts the best explanation from the others."
        )
    return tuple(advice)
