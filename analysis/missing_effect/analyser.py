"""The analyser `missing_effect`: a screening design and measurements in, one verdict of five out."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Any, ClassVar

import pandas as pd

from analysis.base import Analyser
from analysis.missing_effect.kernel import Points
from analysis.missing_effect.next_measurement import NEW_TEST, Proposal, options, part_rivals, see_more
from analysis.missing_effect.problem import Candidate, Parameter, Problem
from analysis.missing_effect.run_input import check_runs, columns_of, points_of, records, testable
from analysis.missing_effect.search import Search, search
from analysis.missing_effect.surrogate import Surrogate
from analysis.missing_effect.tables import candidate_table, error_table, parameter_table
from analysis.missing_effect.verdict import CANNOT_TELL, NOTHING_MISSING, ONE_OF, Levels, Verdict, decide
from analysis.missing_effect.wording import next_sentence, sentences, what_to_do
from analysis.report import Report
from designs.space import FactorSpace


@dataclass(frozen=True, kw_only=True)
class MissingEffect(Analyser):
    """Which effect a simulator lacks: re-calibration, projected score of every candidate, joint refits, held-out tests, verdict.

    The table holds a row per simulated point: a column per parameter, `effect` (the name of the one that acts, or ""), `share` of
    its strongest setting, and a column per response, empty where a run failed.

    Args:
        parameters: a row per parameter that may be re-calibrated, columns as the fields of `Parameter`.
        measurements: a row per measured response: label, test, value, u.
        candidates: a row per effect, columns as the fields of `Candidate`.
        new_tests: columns label and u: responses that were simulated but not measured, proposals for what to measure next.
        draws: of the bootstrap of the largest score.
        seed: of its random stream.

    Source: section by section in the modules of `analysis.missing_effect`.
    """

    parameters: pd.DataFrame | None = None
    measurements: pd.DataFrame | None = None
    candidates: pd.DataFrame | None = None
    new_tests: pd.DataFrame | None = None
    draws: int = 4000
    seed: int = 1

    name: ClassVar[str] = "missing_effect"
    n_responses: ClassVar[tuple[int, int | None]] = (0, None)

    def analyse(
        self,
        table: pd.DataFrame,
        *,
        responses: Sequence[str] = (),
        factors: Sequence[str] | None = None,
        space: FactorSpace | None = None,
    ) -> Report:
        """Return the report; `details` holds search, verdict, proposal and what could not be tested.

        Raises:
            AnalysisError: tables, columns or numbers missing or impossible, or no more measurements than parameters.
        """
        given = columns_of(self.measurements, ("label", "test", "value", "u"), "measurements")
        parameters = records(Parameter, columns_of(self.parameters, ("key", "low", "high", "believed"), "parameters"))
        candidates = records(Candidate, columns_of(self.candidates, ("name",), "candidates"))
        new = columns_of(self.new_tests, ("label", "u"), "new_tests").to_dict("records")
        labels = list(given["label"])
        check_runs(table, [*labels, *(row["label"] for row in new)], [p.key for p in parameters])
        kept, dropped = testable(table, labels, candidates)
        values = given["value"].to_numpy(float), given["u"].to_numpy(float)
        problem = Problem(tuple(labels), tuple(given["test"]), *values, tuple(parameters), tuple(kept))
        known = table[table["effect"].isin(["", *(c.name for c in kept)])]
        points = points_of(known, problem)
        simulator = Surrogate(points, known[labels].to_numpy(float), labels)
        levels = Levels()
        found = search(problem, simulator, draws=self.draws, seed=self.seed, look_for_pairs=levels.fit)
        verdict = decide(found, levels)
        proposal = _next(found, verdict, simulator, _unmeasured(known, points, new), new)
        return _report(self.name, found, verdict, proposal, dropped, simulator)


def _unmeasured(table: pd.DataFrame, points: Points, new: list[dict[Any, Any]]) -> Surrogate | None:
    labels = [row["label"] for row in new]
    return Surrogate(points, table[labels].to_numpy(float), labels) if labels else None


def _next(
    found: Search, verdict: Verdict, simulator: Surrogate, unmeasured: Surrogate | None, new: list[dict[Any, Any]]
) -> Proposal | None:
    """Return the next measurement: to part rivals where there are some, to see more where the data show too little."""
    wanted = options(found, [row["label"] for row in new], [float(row["u"]) for row in new])
    if verdict.word == ONE_OF:
        return part_rivals(verdict.named, unmeasured, wanted)
    if verdict.word in (NOTHING_MISSING, CANNOT_TELL) and found.trials:
        return see_more(found.base.fit, simulator, unmeasured, wanted)
    return None


def _report(
    name: str,
    found: Search,
    verdict: Verdict,
    proposal: Proposal | None,
    dropped: Mapping[str, str],
    simulator: Surrogate,
) -> Report:
    named = verdict.named[0] if verdict.named else None
    base = found.base
    numbers = {
        "chi2_believed": found.believed.chi2,
        "chi2_recalibrated": base.fit.chi2,
        "chi2_with_effect": named.fit.chi2 if named else float("nan"),
        "dof": base.fit.dof,
        "dof_with_effect": named.fit.dof if named else float("nan"),
        "p_recalibrated": base.fit.p_value,
        "p_with_effect": named.fit.p_value if named else float("nan"),
        "held_out_before": base.held_out_error,
        "held_out_after": named.held_out_error if named else float("nan"),
        "threshold": found.scores.threshold,
    }
    tables = {
        "candidates": candidate_table(found),
        "parameters": parameter_table(found, named),
        "errors": error_table(found, named),
        "parameters_with_best": parameter_table(found, found.best),
        "errors_with_best": error_table(found, found.best),
    }
    details = {
        "verdict": verdict.word,
        "effects": effect_names(found, verdict),
        "proposal": proposal,
        "next": None if proposal is None else _as_dict(found, proposal),
        "next_text": "" if proposal is None else next_sentence(found.problem, proposal),
        "draws": found.scores.draws,
        "not_tested": dict(dropped),
        "seed_scatter": dict(zip(simulator.labels, simulator.noise.tolist(), strict=True)),
        "search": found,
    }
    advice = what_to_do(verdict, found.problem, proposal)
    return Report(name, "missing effect", tables, numbers, sentences(found, verdict), advice, details)


def effect_names(found: Search, verdict: Verdict) -> list[str]:
    """Return the effects in question, best first, each once."""
    return list(dict.fromkeys(found.problem.candidates[k].name for trial in verdict.named for k in trial.effects))


def _as_dict(found: Search, proposal: Proposal) -> dict[str, Any]:
    names = {-1: "none"} | {k: c.name for k, c in enumerate(found.problem.candidates)}
    return {
        "what": proposal.option.kind,
        "label": proposal.option.label,
        "is_new": proposal.option.kind == NEW_TEST,
        "u_assumed": proposal.option.u,
        "separates": [names[k] for k in proposal.between],
        "separation": proposal.separation,
        "predictions": {names[k]: value for k, value in proposal.predictions.items()},
    }
