"""Residual diagnostics."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING, ClassVar

import numpy as np
import pandas as pd
from scipy import optimize, stats
from statsmodels.stats.stattools import durbin_watson

from analysis.model_choice import ModelAnalyser
from analysis.regression import FittedModel, residual_ss
from analysis.report import Report
from designs.space import FactorSpace

if TYPE_CHECKING:
    from matplotlib.figure import Figure

_LARGE = 2.0
_LAMBDA_RANGE = (-2.0, 2.0)


def residual_table(fit: FittedModel) -> pd.DataFrame:
    """Return one row per run: observed, fitted, residual, standardised and deleted residual, leverage, Cook's D, flags.

    Flag R: |standardised residual| > 2. Flag X: leverage > 3p/n (or 0.99 when that is larger).

    Raises:
        AnalysisError: for a saturated model.
    """
    fit.require_error_df("residuals")
    n, p = fit.matrix.shape
    spare = np.clip(1 - fit.leverage, 1e-12, None)
    with np.errstate(divide="ignore", invalid="ignore"):
        standardised = np.where(spare > 1e-9, fit.residuals / (fit.s * np.sqrt(spare)), np.nan)
        cook = standardised**2 * fit.leverage / (p * spare)
        inner = (fit.error_df - standardised**2) / max(fit.error_df - 1, 1)
        deleted = np.where(
            inner > 1e-12, standardised / np.sqrt(np.clip(inner, 1e-12, None)), np.sign(standardised) * np.inf
        )
    large = np.abs(standardised) > _LARGE
    unusual = fit.leverage > min(3 * p / n, 0.99)
    flags = ["".join(["R" * bool(r), "X" * bool(x)]) for r, x in zip(large, unusual, strict=True)]
    return pd.DataFrame(
        {
            "Row": np.arange(1, n + 1),
            "Observed": fit.y,
            "Fitted": fit.fitted,
            "Residual": fit.residuals,
            "Standardised": standardised,
            "Deleted": deleted if fit.error_df > 1 else np.full(n, np.nan),
            "Leverage": fit.leverage,
            "Cook": cook,
            "Flag": flags,
        }
    )


def box_cox(fit: FittedModel) -> tuple[float, float, float]:
    """Return (best λ, low, high) of the Box–Cox power with its 95 % interval, within −2 … 2; NaN for y ≤ 0.

    y is replaced by (y^λ − 1)/(λ ẏ^(λ−1)), ẏ the geometric mean (ẏ ln y for λ = 0), and λ minimises the error SSE(λ);
    the interval holds the λ with SSE ≤ SSE_min (1 + t²/df).
    Source: Box & Cox, J. R. Stat. Soc. B 26 (1964) 211, doi 10.1111/j.2517-6161.1964.tb00553.x.
    """
    if (fit.y <= 0).any() or not fit.error_df:
        return math.nan, math.nan, math.nan
    mean_log = np.log(fit.y).mean()

    def error(power: float) -> float:
        ratio = np.log(fit.y) - mean_log
        scaled = ratio if abs(power) < 1e-9 else np.expm1(power * ratio) / power
        return residual_ss(fit.matrix, scaled)

    best = float(optimize.minimize_scalar(error, bounds=_LAMBDA_RANGE, method="bounded").x)
    limit = error(best) * (1 + stats.t.ppf(0.975, fit.error_df) ** 2 / fit.error_df)
    ends = [
        end if error(end) <= limit else float(optimize.brentq(lambda power: error(power) - limit, best, end))
        for end in _LAMBDA_RANGE
    ]
    return best, ends[0], ends[1]


@dataclass(frozen=True, kw_only=True)
class Residuals(ModelAnalyser):
    """Residual diagnostics: unusual runs, normality, independence in run order, and whether y should be transformed."""

    name: ClassVar[str] = "residuals"

    def analyse(
        self,
        table: pd.DataFrame,
        *,
        responses: Sequence[str] = (),
        factors: Sequence[str] | None = None,
        space: FactorSpace | None = None,
    ) -> Report:
        """Return the diagnostics of one response's model."""
        (response,) = self.check_responses(responses)
        fit = self.select(table, response, factors, space).fit
        rows = residual_table(fit)
        shapiro_p = float(stats.shapiro(fit.residuals).pvalue) if len(fit.y) >= 3 and fit.s > 0 else math.nan
        ordered = fit.residuals[np.argsort(fit.runs.order)]
        watson = float(durbin_watson(ordered)) if fit.s > 0 else math.nan
        power, low, high = box_cox(fit)
        tests = pd.DataFrame(
            {
                "Shapiro-Wilk p": [shapiro_p],
                "Durbin-Watson": [watson],
                "Box-Cox lambda": [power],
                "lambda low": [low],
                "lambda high": [high],
            }
        )
        sentences = (_unusual(rows), *_tests_sentences(shapiro_p, watson, low, high))
        numbers = {str(name): float(tests[name].iloc[0]) for name in tests.columns}
        return Report(self.name, response, {"residuals": rows, "tests": tests}, numbers, sentences, (), {"fit": fit})

    def figures(self, report: Report) -> dict[str, Figure]:
        """Return the four-in-one plot and predicted against actual."""
        from analysis.plot_residuals import four_in_one, predicted_against_actual

        fit = report.details["fit"]
        return {"residuals": four_in_one(fit), "predicted_against_actual": predicted_against_actual(fit)}


def _unusual(rows: pd.DataFrame) -> str:
    flagged = rows[rows["Flag"] != ""]
    if flagged.empty:
        return "No run is unusual (R: standardised residual beyond ±2, X: high leverage)."
    listed = ", ".join(f"{r['Row']} ({r['Flag']}, {r['Standardised']:+.2f})" for r in flagged.to_dict("records"))
    return f"Unusual rows (R: standardised residual beyond ±2, X: high leverage): {listed}. Look at these runs first."


def _tests_sentences(shapiro_p: float, watson: float, low: float, high: float) -> list[str]:
    sentences = []
    if not math.isnan(shapiro_p):
        look = "don't look normal" if shapiro_p < 0.05 else "look normal"
        sentences.append(f"The residuals {look} (Shapiro–Wilk p = {shapiro_p:.4f}).")
    if not math.isnan(watson):
        drift = "near 2: no drift in run order" if 1.2 < watson < 2.8 else "far from 2: neighbouring runs are related"
        sentences.append(f"Durbin–Watson is {watson:.2f}, {drift}.")
    if not math.isnan(low):
        keep = low <= 1 <= high
        verdict = (
            "1 is inside, no transformation needed" if keep else "1 is outside, consider transforming the response"
        )
        sentences.append(f"Box–Cox λ lies in {low:.2f} … {high:.2f}: {verdict}.")
    return sentences
