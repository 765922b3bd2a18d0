"""Analysis of variance of a fitted polynomial."""

from __future__ import annotations

import math
from collections.abc import Iterable, Sequence
from dataclasses import dataclass
from typing import ClassVar

import pandas as pd
from scipy import stats

from analysis.base import check_choice
from analysis.lack_of_fit import lack_of_fit
from analysis.model_choice import ModelAnalyser
from analysis.regression import FittedModel, block_matrix, residual_ss
from analysis.report import Report
from designs.space import FactorSpace
from designs.terms import Term, model_matrix

#: Groups of terms in the order in which people read them.
_GROUPS = {"linear": "Linear", "square": "Square", "2-way interaction": "2-Way Interaction"}
_COLUMNS = ["Source", "DF", "Adj SS", "Adj MS", "F", "p"]


def anova_table(fit: FittedModel, ss_type: str = "III") -> pd.DataFrame:
    """Return the analysis of variance, one row per source.

    Rows: Model, Blocks, Linear with its terms, Square, 2-Way Interaction (higher orders as they come), Error,
    Lack-of-Fit, Pure Error, Total. Type III compares the model with and without the term; type II compares the models
    without all terms that contain it. In coded units both belong to coded terms.

    Args:
        fit: the model.
        ss_type: ``III`` or ``II``.

    Raises:
        AnalysisError: for a saturated model.
    """
    fit.require_error_df("F and p in an analysis of variance")
    model_ss, model_df = fit.total_ss - fit.error_ss, fit.matrix.shape[1] - 1
    rows = [_tested(fit, "Model", model_df, model_ss)]
    if fit.n_blocks > 1:
        without_blocks = residual_ss(fit.matrix[:, [0, *range(fit.n_blocks, fit.matrix.shape[1])]], fit.y)
        rows.append(_tested(fit, "Blocks", fit.n_blocks - 1, without_blocks - fit.error_ss))
    for kind, group in grouped(fit.terms).items():
        rows.append(_tested(fit, kind, len(group), _adjusted_ss(fit, group, ss_type)))
        rows += [_tested(fit, "  " + t.label(fit.runs.names), 1, _adjusted_ss(fit, [t], ss_type)) for t in group]
    return pd.DataFrame([*rows, *_error_rows(fit)], columns=_COLUMNS)


def grouped(terms: Iterable[Term]) -> dict[str, list[Term]]:
    """Return the terms by kind, linear, squares, interactions first."""
    found: dict[str, list[Term]] = {}
    order = list(_GROUPS)
    for term in sorted(terms, key=lambda t: order.index(t.kind) if t.kind in order else len(order) + t.order):
        found.setdefault(_GROUPS.get(term.kind, term.kind.capitalize()), []).append(term)
    return found


def _adjusted_ss(fit: FittedModel, dropped: Sequence[Term], ss_type: str) -> float:
    """Return how much the error grows when the terms are dropped."""
    if ss_type == "III":
        return _rss(fit, [t for t in fit.terms if t not in dropped]) - fit.error_ss
    reference = [t for t in fit.terms if t in dropped or not any(t.contains(d) for d in dropped)]
    return _rss(fit, [t for t in reference if t not in dropped]) - _rss(fit, reference)


def _rss(fit: FittedModel, terms: Sequence[Term]) -> float:
    columns = model_matrix(fit.runs.coded, terms, constant=False)
    return residual_ss(
        pd.concat([pd.DataFrame(block_matrix(fit.runs)), pd.DataFrame(columns)], axis=1).to_numpy(), fit.y
    )


def _tested(fit: FittedModel, source: str, df: int, ss: float) -> tuple[str, int, float, float, float, float]:
    if not df:
        return source, 0, 0.0, math.nan, math.nan, math.nan
    ss = max(ss, 0.0)
    f = ss / df / fit.s**2 if fit.s > 0 else math.inf
    return source, df, ss, ss / df, f, float(stats.f.sf(f, df, fit.error_df))


def _error_rows(fit: FittedModel) -> list[tuple[str, int, float, float, float, float]]:
    split = lack_of_fit(fit)
    rows = [("Error", fit.error_df, fit.error_ss, fit.s**2, math.nan, math.nan)]
    if split.pure_df:
        lack_ms = split.ss / split.df if split.df else math.nan
        rows.append(("  Lack-of-Fit", split.df, split.ss, lack_ms, split.f, split.p))
        rows.append(("  Pure Error", split.pure_df, split.pure_ss, split.pure_ss / split.pure_df, math.nan, math.nan))
    rows.append(("Total", len(fit.y) - 1, fit.total_ss, math.nan, math.nan, math.nan))
    return rows


def anova_sentences(fit: FittedModel, table: pd.DataFrame, alpha: float) -> list[str]:
    """Return what the table says: is the model significant, which terms are, does it fit."""
    p = float(table["p"].iloc[0])
    is_it = "significant" if p < alpha else "not significant"
    found = [label for label in fit.labels() if float(table.loc[table["Source"] == "  " + label, "p"].iloc[0]) < alpha]
    terms = (
        f"Significant at α = {alpha:g}: {', '.join(found)}." if found else f"No term is significant at α = {alpha:g}."
    )
    first = f"The model is {is_it} (F = {float(table['F'].iloc[0]):.2f}, p {_p_text(p)})." if fit.terms else ""
    return [sentence for sentence in (first, terms, lack_of_fit(fit).sentence()) if sentence]


def _p_text(p: float) -> str:
    return "< 0.0001" if p < 1e-4 else f"= {p:.4f}"


@dataclass(frozen=True, kw_only=True)
class Anova(ModelAnalyser):
    """Analysis of variance: DF, adjusted SS and MS, F and p per term and group, lack of fit and pure error.

    Args:
        ss_type: ``III`` (each term against all others) or ``II`` (respects hierarchy).
    """

    ss_type: str = "III"

    name: ClassVar[str] = "anova"

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
        """Return the analysis-of-variance table and what it says."""
        (response,) = self.check_responses(responses)
        selection = self.select(table, response, factors, space)
        rows = anova_table(selection.fit, self.ss_type)
        split = lack_of_fit(selection.fit)
        numbers = {"s": selection.fit.s, "error_df": selection.fit.error_df, "lack_of_fit_p": split.p}
        sentences = (f"Model: {selection.method}.", *anova_sentences(selection.fit, rows, self.alpha))
        return Report(self.name, response, {"anova": rows}, numbers, sentences, details={"fit": selection.fit})
