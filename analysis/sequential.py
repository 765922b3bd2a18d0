"""Which order of polynomial is worth having: linear, with interactions, quadratic, cubic."""

from __future__ import annotations

import itertools
import math

import numpy as np
import pandas as pd
from scipy import stats

from analysis.lack_of_fit import lack_of_fit
from analysis.regression import FittedModel, block_matrix, residual_ss
from analysis.run_table import RunTable
from designs.terms import Term, model_matrix, model_terms


def sequential_summary(runs: RunTable, response: str, alpha: float = 0.05) -> pd.DataFrame:
    """Return what each order adds to the one before it.

    Columns: Source, DF (terms added), Seq SS, F and p of the addition (against the error of the larger model), p of
    the lack of fit that remains, S, R², adjusted and predicted R², Note (``Suggested``: the highest order whose
    addition is significant; ``Aliased``: the runs can't carry it).
    """
    rows: list[dict[str, object]] = []
    terms: list[Term] = []
    before = residual_ss(block_matrix(runs), runs.responses[response])
    for source, added in _orders(len(runs.space)):
        terms = [*terms, *added]
        matrix = np.column_stack([block_matrix(runs), model_matrix(runs.coded, terms, constant=False)])
        if np.linalg.matrix_rank(matrix) < matrix.shape[1]:
            rows.append({"Source": source, "DF": len(added), "Note": "Aliased"})
            break
        fit = FittedModel(runs, response, tuple(terms))
        rows.append(_row(source, len(added), before, fit))
        before = fit.error_ss
    table = pd.DataFrame(rows)
    good = table.index[(table["p"] < alpha) & (table["Note"] == "")]
    if len(good):
        table.loc[good[-1], "Note"] = "Suggested"
    return table


def _orders(k: int) -> list[tuple[str, list[Term]]]:
    squares = [t for t in model_terms(k, "pure_quadratic") if t.kind == "square"]
    interactions = [t for t in model_terms(k, "interactions") if t.order == 2]
    cubes = itertools.combinations_with_replacement(range(k), 3)
    cubic = [Term(tuple(chosen.count(i) for i in range(k))) for chosen in cubes]
    orders = [("Linear", model_terms(k, "linear")), ("2-way interactions", interactions)]
    return [(name, terms) for name, terms in [*orders, ("Quadratic", squares), ("Cubic", cubic)] if terms]


def _row(source: str, df: int, before: float, fit: FittedModel) -> dict[str, object]:
    gain = max(before - fit.error_ss, 0.0)
    f = gain / df / fit.s**2 if fit.error_df and fit.error_ss > 0 else math.nan
    return {
        "Source": source,
        "DF": df,
        "Seq SS": gain,
        "F": f,
        "p": float(stats.f.sf(f, df, fit.error_df)) if math.isfinite(f) else math.nan,
        "Lack-of-fit p": lack_of_fit(fit).p,
        "S": fit.s,
        "R2 %": fit.r_squared,
        "R2 adj %": fit.r_squared_adjusted,
        "R2 pred %": fit.r_squared_predicted,
        "Note": "" if fit.error_df else "Saturated",
    }
