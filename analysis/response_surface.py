"""Response-surface analysis: fit, selection, equation and everything people read beside it."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING, ClassVar

import pandas as pd

from analysis.anova import anova_sentences, anova_table
from analysis.base import check_choice
from analysis.canonical import StationaryPoint, stationary_point
from analysis.equation import equation, uncoded_coefficients
from analysis.errors import AnalysisError
from analysis.model_choice import ModelAnalyser
from analysis.model_summary import summary_numbers, summary_sentences, summary_table
from analysis.regression import FittedModel
from analysis.report import Report
from analysis.selection import METHODS, Selection, is_hierarchical, select
from analysis.sequential import sequential_summary
from designs.space import FactorSpace

if TYPE_CHECKING:
    from matplotlib.figure import Figure


@dataclass(frozen=True, kw_only=True)
class ResponseSurface(ModelAnalyser):
    """Response surface: coded fit, term selection, equation in natural units, ANOVA, summary and stationary point.

    y = b₀ + Σ bᵢ xᵢ + Σ bᵢᵢ xᵢ² + Σ bᵢⱼ xᵢ xⱼ in coded x. Selection starts from the model asked for; a term that
    leaves or stays with p within a factor two of alpha is named, with what AICc and BIC prefer.

    Args:
        ss_type: ``III`` or ``II``, for the analysis of variance.

    Source: Myers, Montgomery & Anderson-Cook, "Response Surface Methodology", 4th ed. (2016).
    """

    selection: str = "backward"
    ss_type: str = "III"

    name: ClassVar[str] = "response_surface"

    def __post_init__(self) -> None:
        super().__post_init__()
        check_choice(self, "ss_type", self.ss_type, ("III", "II"))

    def analyse(
        self,
        table: pd.DataFrame,
        *,
        responses: Sequence[str] = (),
        factors: Sequence[str] | None = None,
        space: FactorSpace | None = None,
    ) -> Report:
        """Return the full report on one response."""
        (response,) = self.check_responses(responses)
        chosen = self.select(table, response, factors, space)
        fit = chosen.fit
        fit.require_error_df("p-values")
        anova = anova_table(fit, self.ss_type)
        tables = {
            "sequential_models": sequential_summary(fit.runs, response, self.alpha),
            "selection": chosen.path,
            "model_comparison": self._comparison(chosen),
            "anova": anova,
            "coefficients": fit.coefficient_table(),
            "uncoded_coefficients": _uncoded_table(fit),
            "model_summary": summary_table(fit),
        }
        point = stationary_point(fit)
        sentences = [
            f"Model: {chosen.method}. Kept: {', '.join(fit.labels()) or 'the constant only'}.",
            f"In natural units: {equation(fit)}.",
            *self._doubts(chosen),
            *anova_sentences(fit, anova, self.alpha),
            *summary_sentences(fit),
        ]
        if point is not None:
            tables["stationary_point"] = point.table()
            sentences.append(point.sentence())
        numbers = summary_numbers(fit)
        return Report(
            self.name,
            response,
            tables,
            numbers,
            tuple(sentences),
            _advice(chosen, point),
            {"fit": fit, "selection": chosen},
        )

    def figures(self, report: Report) -> dict[str, Figure]:
        """Return Pareto chart, residuals, predicted against actual, contours and surface."""
        from analysis.plot_effects import pareto_of_terms
        from analysis.plot_residuals import four_in_one, predicted_against_actual
        from analysis.plot_surface import contours, surfaces

        fit: FittedModel = report.details["fit"]
        figures = {
            "residuals": four_in_one(fit),
            "predicted_against_actual": predicted_against_actual(fit),
        }
        if fit.terms:
            figures["pareto"] = pareto_of_terms(fit, self.alpha)
        figures.update(contours(fit))
        figures.update(surfaces(fit))
        return figures

    def _comparison(self, chosen: Selection) -> pd.DataFrame:
        """Return what other ways of selecting from the same terms would have kept."""
        ways = [("all terms", chosen.full)] if chosen.full.error_df else []
        for method in METHODS[1:]:
            for hierarchy in ("each_step", "none") if method == "backward" else ("each_step",):
                other = self._select_again(chosen, method, hierarchy)
                if other is not None:
                    ways.append((other.method, other.fit))
        return pd.DataFrame(
            {
                "Way": way,
                "Terms": ", ".join(fit.labels()) or "constant",
                "S": fit.s,
                "R2 %": fit.r_squared,
                "R2 pred %": fit.r_squared_predicted,
                "AICc": fit.information("aicc"),
                "BIC": fit.information("bic"),
            }
            for way, fit in ways
        )

    def _select_again(self, chosen: Selection, method: str, hierarchy: str) -> Selection | None:
        fit = chosen.fit
        try:
            terms = self.candidate_terms(fit.runs)
            return select(fit.runs, fit.response, terms, method=method, alpha=self.alpha, hierarchy=hierarchy)
        except AnalysisError:  # a saturated full model has no backward elimination
            return None

    def _doubts(self, chosen: Selection) -> list[str]:
        """Return the close calls, and disagreements between criteria."""
        sentences = [call.sentence(self.alpha) for call in chosen.close_calls]
        if not is_hierarchical(chosen.fit.terms):
            sentences.append(
                "The model isn't hierarchical: a square or product is in it without its linear terms, so the kept "
                "terms depend on how the factors are coded."
            )
        for method in ("forward_aicc", "forward_bic"):
            other = self._select_again(chosen, method, "each_step")
            if other is None or set(other.fit.terms) == set(chosen.fit.terms):
                continue
            more = [label for label in other.fit.labels() if label not in chosen.fit.labels()]
            fewer = [label for label in chosen.fit.labels() if label not in other.fit.labels()]
            changes = [f"adds {', '.join(more)}"] * bool(more) + [f"drops {', '.join(fewer)}"] * bool(fewer)
            sentences.append(
                f"{other.method.capitalize()} disagrees: it {' and '.join(changes)}.".replace("aicc", "AICc").replace(
                    "bic", "BIC"
                )
            )
        return sentences


def _uncoded_table(fit: FittedModel) -> pd.DataFrame:
    names = [f"ln({f.name})" if f.log else f.name for f in fit.runs.space]
    return pd.DataFrame([{"Term": t.label(names), "Coef": value} for t, value in uncoded_coefficients(fit).items()])


def _advice(chosen: Selection, point: StationaryPoint | None) -> tuple[str, ...]:
    advice = [
        "Check the residual plots before you use the model.",
        "Confirm the optimum with new runs: they should fall inside the prediction interval (analyser optimise).",
    ]
    if chosen.close_calls:
        labels = ", ".join(dict.fromkeys(call.label for call in chosen.close_calls))
        advice.insert(
            0, f"Repeat runs with new seeds where {labels} matters most (low, centre, high) to settle the close call."
        )
    if point is not None and not point.inside:
        advice.append("The stationary point lies outside the design: don't extrapolate; move the design that way.")
    return tuple(advice)
