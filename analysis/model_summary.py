"""How good a fitted polynomial is."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass
from typing import ClassVar

import pandas as pd

from analysis.model_choice import ModelAnalyser
from analysis.regression import FittedModel
from analysis.report import Report
from designs.space import FactorSpace

_R2_GAP = 20.0
_ENOUGH_PRECISION = 4.0
_HIGH_VIF = 10.0


def summary_numbers(fit: FittedModel) -> dict[str, float]:
    """Return S, R², adjusted and predicted R² [%], PRESS, adequate precision, C.V. [%], mean, AICc, BIC, error df."""
    return {
        "S": fit.s,
        "R2 %": fit.r_squared,
        "R2 adj %": fit.r_squared_adjusted,
        "R2 pred %": fit.r_squared_predicted,
        "PRESS": fit.press,
        "Adequate precision": fit.adequate_precision,
        "C.V. %": fit.cv_percent,
        "Mean": float(fit.y.mean()),
        "AICc": fit.information("aicc"),
        "BIC": fit.information("bic"),
        "Error df": fit.error_df,
    }


def summary_table(fit: FittedModel) -> pd.DataFrame:
    """Return the numbers as a table of one row."""
    return pd.DataFrame([summary_numbers(fit)])


def summary_sentences(fit: FittedModel) -> list[str]:
    """Return the sentences that people quote."""
    if not fit.error_df:
        return ["The model is saturated: it passes through every run, and nothing is left to judge it by."]
    return [
        f"R² is {fit.r_squared:.2f} %, adjusted {fit.r_squared_adjusted:.2f} %, S = {fit.s:.4g}.",
        _predicted_sentence(fit),
        _precision_sentence(fit),
        *_vif_sentences(fit),
    ]


def _predicted_sentence(fit: FittedModel) -> str:
    predicted, adjusted = fit.r_squared_predicted, fit.r_squared_adjusted
    if math.isnan(predicted):
        return "The predicted R² can't be computed: a run determines a coefficient alone."
    if predicted < 0:
        return f"The predicted R² of {predicted:.1f} % is negative: the mean predicts new runs better than this model."
    if adjusted - predicted <= _R2_GAP:
        return (
            f"The predicted R² of {predicted:.1f} % is in reasonable agreement with the adjusted R² of {adjusted:.1f} "
            "%: they differ by less than 20 points."
        )
    return (
        f"The predicted R² of {predicted:.1f} % is more than 20 points below the adjusted R² of {adjusted:.1f} %: "
        "look for a block effect, an outlier or a model with too many terms."
    )


def _precision_sentence(fit: FittedModel) -> str:
    value = fit.adequate_precision
    if math.isnan(value):
        return "The fit is exact, so adequate precision has no meaning."
    if value > _ENOUGH_PRECISION:
        return f"Adequate precision is {value:.1f}; above 4 the signal is large enough to move in the design space."
    return f"Adequate precision is {value:.1f}, below 4: the signal is too small against the noise to be followed."


def _vif_sentences(fit: FittedModel) -> list[str]:
    high = {term.label(fit.runs.names): vif for term, vif in fit.vif().items() if vif > _HIGH_VIF}
    if not high:
        return []
    listed = ", ".join(f"{label} {vif:.1f}" for label, vif in high.items())
    return [f"Terms that lean on one another (VIF above 10): {listed}; their coefficients can't be read one by one."]


@dataclass(frozen=True, kw_only=True)
class ModelSummary(ModelAnalyser):
    """Model summary: S, R², adjusted and predicted R², adequate precision, C.V., and the coded coefficients with VIF.

    R²(pred) = 1 − PRESS/SST with PRESS = Σ (eᵢ/(1 − hᵢ))²; adequate precision = (max ŷ − min ŷ)/√(p s²/n).
    """

    name: ClassVar[str] = "model_summary"

    def analyse(
        self,
        table: pd.DataFrame,
        *,
        responses: Sequence[str] = (),
        factors: Sequence[str] | None = None,
        space: FactorSpace | None = None,
    ) -> Report:
        """Return the summary of one response's model."""
        (response,) = self.check_responses(responses)
        selection = self.select(table, response, factors, space)
        fit = selection.fit
        tables = {"model_summary": summary_table(fit), "coefficients": fit.coefficient_table()}
        sentences = (f"Model: {selection.method}.", *summary_sentences(fit))
        return Report(self.name, response, tables, summary_numbers(fit), sentences, details={"fit": fit})
