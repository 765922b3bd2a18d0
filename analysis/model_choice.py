"""The settings that all analysers of a polynomial share: which terms, and how they are selected."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import pandas as pd

from analysis.base import Analyser, check_choice, check_fraction
from analysis.run_table import RunTable, read_runs
from analysis.selection import HIERARCHIES, METHODS, Selection, select
from designs.space import FactorSpace
from designs.terms import MODELS, Term, model_terms, parse_term


@dataclass(frozen=True, kw_only=True)
class ModelAnalyser(Analyser):
    """An analyser that fits a polynomial to a response.

    Args:
        model: ``linear``, ``interactions``, ``pure_quadratic`` or ``quadratic``: the candidate terms.
        terms: the candidate terms themselves, such as ``F,D,F*F``; overrules ``model``.
        selection: ``none``, ``backward``, ``forward_aicc`` or ``forward_bic``.
        alpha: significance level of backward elimination and of intervals.
        hierarchy: ``each_step``, ``at_end`` or ``none``.
    """

    model: str = "quadratic"
    terms: str | Sequence[str] | None = None
    selection: str = "none"
    alpha: float = 0.05
    hierarchy: str = "each_step"

    def __post_init__(self) -> None:
        check_choice(self, "model", self.model, MODELS)
        check_choice(self, "selection", self.selection, METHODS)
        check_choice(self, "hierarchy", self.hierarchy, HIERARCHIES)
        check_fraction(self, "alpha", self.alpha)

    def candidate_terms(self, runs: RunTable) -> list[Term]:
        """Return the terms that the settings ask for."""
        if self.terms is None:
            return model_terms(len(runs.space), self.model)
        labels = self.terms.split(",") if isinstance(self.terms, str) else list(self.terms)
        return list(dict.fromkeys(parse_term(label.strip(), runs.names) for label in labels))

    def select(
        self,
        table: pd.DataFrame,
        response: str,
        factors: Sequence[str] | None,
        space: FactorSpace | None,
        *,
        others: Sequence[str] = (),
    ) -> Selection:
        """Return the model of one response; ``others`` are further responses, so that they aren't taken as factors."""
        runs = read_runs(table, [response, *others], factors=factors, space=space)
        return select(
            runs,
            response,
            self.candidate_terms(runs),
            method=self.selection,
            alpha=self.alpha,
            hierarchy=self.hierarchy,
        )
