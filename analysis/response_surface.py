"""Response-surface analysis: fit, selection, equation and everything people read beside it."""

from __future__ import annotations

import contextlib
from collections.abc import Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING, ClassVar

import pandas as pd

from analysis.anova import anova_sentences, anova_table
from analysis.base import check_choice
from analysis.canonical import StationaryPoint, stationary_point
from analysis.equation import equation, uncoded_coefficients, uncoded_standard_errors
from analysis.errors import AnalysisError
from analysis.model_choice import ModelAnalyser
from analysis.model_summary import summary_numbers, summary_sentences, summary_table
from analysis.regression import FittedModel
from analysis.report import Report
from analysis.selection import Selection, is_hierarchical, select
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
        point, others = stationary_point(fit), self._alternatives(chosen)
        sentences = (
            f"Model: {chosen.method}. Kept: {', '.join(fit.labels()) or 'the constant only'}.",
            f"In natural units: {equation(fit)}.",
            *_doubts(chosen, others, self.alpha),
            *anova_sentences(fit, anova, self.alpha),
            *summary_sentences(fit),
            *([point.sentence()] if point is not None else []),
        )
        tables = self._tables(chosen, others, anova)
        if point is not None:
            tables["stationary_point"] = point.table()
        details = {"fit": fit, "selection": chosen}
        return Report(self.name, response, tables, summary_numbers(fit), sentences, _advice(chosen, point), details)

    def _tables(self, chosen: Selection, others: Sequence[Selection], anova: pd.DataFrame) -> dict[str, pd.DataFrame]:
        fit = chosen.fit
        return {
            "sequential_models": sequential_summary(fit.runs, fit.response, self.alpha),
            "selection": chosen.path,
            "model_comparison": _comparison(chosen, others),
            "anova": anova,
            "coefficients": fit.coefficient_table(),
            "uncoded_coefficients": _uncoded_table(fit),
            "model_summary": summary_table(fit),
        }

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

    def _alternatives(self, chosen: Selection) -> list[Selection]:
        """Return what other ways of selecting from the same terms keep."""
        ways = [
            ("backward", "each_step"),
            ("backward", "none"),
            ("forward_aicc", "each_step"),
            ("forward_bic", "each_step"),
        ]
        found, fit = [], chosen.fit
        for method, hierarchy in ways:
            terms = self.candidate_terms(fit.runs)
            with contextlib.suppress(AnalysisError):  # a saturated full model has no backward elimination
                found.append(
                    select(fit.runs, fit.response, terms, method=method, alpha=self.alpha, hierarchy=hierarchy)
                )
        return found


def _comparison(chosen: Selection, others: Sequence[Selection]) -> pd.DataFrame:
    ways = {"all terms": chosen.full} if chosen.full.error_df else {}
    ways |= {other.method: other.fit for other in others}
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
        for way, fit in ways.items()
    )


def _doubts(chosen: Selection, others: Sequence[Selection], alpha: float) -> list[str]:
    """Return the close calls, and the models of forward selection that their criterion prefers."""
    sentences = [call.sentence(alpha) for call in chosen.close_calls]
    if not is_hierarchical(chosen.fit.terms):
        sentences.append(
            "The model isn't hierarchical: a square or product is in it without its linear terms, so the kept terms "
            "depend on how the factors are coded."
        )
    mine = chosen.fit.labels()
    for other in others:
        theirs, better = other.fit.labels(), other.fit.information(other.criterion)
        here = chosen.fit.information(other.criterion)
        if not other.criterion or not better < here - 1e-9:
            continue
        more, fewer = [t for t in theirs if t not in mine], [t for t in mine if t not in theirs]
        changes = [f"adds {', '.join(more)}"] * bool(more) + [f"drops {', '.join(fewer)}"] * bool(fewer)
        found = f"Forward selection by {other.criterion} finds a model that {other.criterion} prefers"
        sentences.append(f"{found} ({better:.2f} against {here:.2f}): it {' and '.join(changes)}.")
    return sentences


def _uncoded_table(fit: FittedModel) -> pd.DataFrame:
    names = [f"ln({f.name})" if f.log else f.name for f in fit.runs.space]
    errors = uncoded_standard_errors(fit)
    rows = [(t.label(names), value, errors[t]) for t, value in uncoded_coefficients(fit).items()]
    return pd.DataFrame(rows, columns=["Term", "Coef", "SE Coef"])


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
