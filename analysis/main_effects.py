"""Effects of two-level designs: size, share, order, and which stand out."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING, ClassVar

import numpy as np
import pandas as pd

from analysis.base import Analyser, check_fraction
from analysis.errors import AnalysisError
from analysis.lenth import Lenth, lenth
from analysis.regression import FittedModel, residual_ss
from analysis.report import Report
from analysis.run_table import RunTable, read_runs
from designs.space import FactorSpace
from designs.terms import Term, interaction_terms

if TYPE_CHECKING:
    from matplotlib.figure import Figure


@dataclass(frozen=True, kw_only=True)
class MainEffects(Analyser):
    """Main effects of a two-level design: effect, mean square, per cent contribution, order, and which are real.

    effect = ȳ(high) − ȳ(low), which is twice the coded coefficient; its mean square (one degree of freedom) is what the
    error grows by without it; contribution = 100 · mean square / total sum of squares. With error degrees of freedom
    left the effects get t and p; Lenth's PSE gives individual and simultaneous margins in any case. Runs at the centre
    of all factors are used for curvature, not for the effects.

    Args:
        order: largest order of interactions among the effects: 1 = none, 2 = two-factor interactions, …
        alpha: significance level.

    Sources: Plackett & Burman, Biometrika 33 (1946) 305, doi 10.1093/biomet/33.4.305; Lenth, Technometrics 31 (1989)
    469, doi 10.1080/00401706.1989.10488595.
    """

    order: int = 1
    alpha: float = 0.05

    name: ClassVar[str] = "main_effects"

    def __post_init__(self) -> None:
        check_fraction(self, "alpha", self.alpha)
        if isinstance(self.order, bool) or not isinstance(self.order, int) or self.order < 1:
            raise AnalysisError(f"main_effects has order = {self.order!r}; a whole number ≥ 1 is needed.")

    def analyse(
        self,
        table: pd.DataFrame,
        *,
        responses: Sequence[str] = (),
        factors: Sequence[str] | None = None,
        space: FactorSpace | None = None,
    ) -> Report:
        """Return the effects of one response."""
        (response,) = self.check_responses(responses)
        runs = read_runs(table, [response], factors=factors, space=space)
        centre = _check_two_levels(runs)
        fit = FittedModel(_rows(runs, ~centre), response, tuple(self._terms(len(runs.space))))
        effects = effects_table(fit)
        yardstick = lenth(effects["Effect"].to_numpy(), self.alpha)
        lenth_table = pd.DataFrame(
            {"PSE": [yardstick.pse], "Margin": yardstick.margin, "Simultaneous margin": yardstick.simultaneous_margin}
        )
        curvature = _curvature(runs, response, centre)
        numbers = {"pse": yardstick.pse, "margin": yardstick.margin, "error_df": fit.error_df, "s": fit.s}
        sentences = (*self._sentences(effects, fit, yardstick), *curvature)
        return Report(
            self.name,
            response,
            {"effects": effects, "lenth": lenth_table},
            numbers,
            sentences,
            _advice(fit),
            {"fit": fit},
        )

    def figures(self, report: Report) -> dict[str, Figure]:
        """Return Pareto chart, half-normal plot, main effects and interactions."""
        from analysis.plot_effects import half_normal, interaction_grid, main_effect_lines, pareto_of_effects

        fit: FittedModel = report.details["fit"]
        figures = {
            "pareto": pareto_of_effects(fit, self.alpha),
            "half_normal": half_normal(fit, self.alpha),
            "main_effects": main_effect_lines(fit),
        }
        if 2 <= len(fit.runs.space) <= 6:
            figures["interactions"] = interaction_grid(fit)
        return figures

    def _terms(self, k: int) -> list[Term]:
        return [term for size in range(1, min(self.order, k) + 1) for term in interaction_terms(k, size)]

    def _sentences(self, effects: pd.DataFrame, fit: FittedModel, yardstick: Lenth) -> list[str]:
        first = effects.sort_values("Order").iloc[0]
        share = f"{first['Contribution %']:.1f} %"
        sentences = [
            f"{first['Term']} has the largest effect, {first['Effect']:.4g} from low to high ({share} of all)."
        ]
        if fit.error_df:
            found = effects.loc[effects["p"] < self.alpha].sort_values("Order")["Term"]
            how = f"by t with {fit.error_df} error degrees of freedom"
            sentences.append(_found_sentence(found, how, self.alpha))
        size = effects["Effect"].abs()
        sure = effects.loc[size > yardstick.simultaneous_margin].sort_values("Order")["Term"]
        likely = effects.loc[size.between(yardstick.margin, yardstick.simultaneous_margin)].sort_values("Order")["Term"]
        sentences.append(_found_sentence(sure, "by Lenth's simultaneous margin", self.alpha))
        if len(likely):
            sentences.append(f"Between the individual and the simultaneous margin: {', '.join(likely)}.")
        if fit.error_df == 0:
            sentences.append("The design is saturated: there are no p-values, only Lenth's margins.")
        return sentences


def effects_table(fit: FittedModel) -> pd.DataFrame:
    """Return term, effect, coded coefficient, mean square, contribution [%], order, t and p (NaN when saturated)."""
    coefficients = np.array(list(fit.term_coefficients.values()))
    squares = np.array([_mean_square(fit, i) for i in range(len(fit.terms))])
    blank = np.full(len(squares), np.nan)
    first = fit.n_blocks
    total = fit.total_ss
    return pd.DataFrame(
        {
            "Term": fit.labels(),
            "Effect": 2 * coefficients,
            "Coef": coefficients,
            "Mean square": squares,
            "Contribution %": 100 * squares / total if total else blank,
            "Order": (-np.abs(coefficients)).argsort(kind="stable").argsort(kind="stable") + 1,
            "t": np.asarray(fit.results.tvalues)[first:] if fit.error_df else blank,
            "p": np.asarray(fit.results.pvalues)[first:] if fit.error_df else blank,
        }
    )


def _mean_square(fit: FittedModel, i: int) -> float:
    without = np.delete(fit.matrix, fit.n_blocks + i, axis=1)
    return max(residual_ss(without, fit.y) - fit.error_ss, 0.0)


def _check_two_levels(runs: RunTable) -> np.ndarray:
    """Return which runs lie at the centre of all factors.

    Raises:
        AnalysisError: for a factor that takes more than low, high and centre.
    """
    coded = np.round(runs.coded, 6)
    centre = (coded == 0).all(axis=1)
    for name, column in zip(runs.names, coded[~centre].T, strict=True):
        extra = sorted(set(column) - {-1.0, 1.0})
        if extra:
            levels = len(set(column))
            raise AnalysisError(
                f"main_effects needs two levels per factor (and centre runs); {name!r} has {levels} levels. Use "
                "response_surface, or name the two-level factors (--factors A,B,…)."
            )
    return centre


def _rows(runs: RunTable, keep: np.ndarray) -> RunTable:
    block = pd.factorize(runs.block[keep], sort=True)[0].astype(np.int64)
    responses = {name: values[keep] for name, values in runs.responses.items()}
    return RunTable(runs.space, runs.coded[keep], block, responses, runs.order[keep])


def _curvature(runs: RunTable, response: str, centre: np.ndarray) -> list[str]:
    """Return what the centre runs say: mean of the corners against mean of the centre."""
    if not centre.any():
        return []
    y = runs.responses[response]
    gap = float(y[centre].mean() - y[~centre].mean())
    return [
        f"Curvature: the {centre.sum()} centre runs lie {gap:+.4g} from the mean of the others; if that is more than "
        "noise, go on with a response-surface design."
    ]


def _found_sentence(found: pd.Series, how: str, alpha: float) -> str:
    if len(found):
        return f"Stand out {how} (α = {alpha:g}): {', '.join(found)}."
    return f"Nothing stands out {how} (α = {alpha:g})."


def _advice(fit: FittedModel) -> tuple[str, ...]:
    advice = ["Take the factors that stand out into a response-surface design; fix the others at a known value."]
    if 0 < fit.error_df < 4:
        advice.append(
            f"Only {fit.error_df} error degree{'s' if fit.error_df > 1 else ''} of freedom: t and p are weak; trust "
            "order and Lenth's margins more, or add centre points or replicates."
        )
    return tuple(advice)
