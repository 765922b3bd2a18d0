"""The tables of the page: the paper's numbers beside ours."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

import pandas as pd

from analysis.report import Report
from taichidem import plugins
from taichidem.paper import published
from taichidem.paper.kept_heaps import KeptHeaps
from taichidem.paper.surface import SETTINGS

SUMMARY = {"S": "s, residual standard deviation [deg]", "R2 %": "R² [%]", "R2 adj %": "adjusted R² [%]"}
SUMMARY |= {"R2 pred %": "predicted R² [%]"}


def coefficients(ours: Report) -> list[dict[str, Any]]:
    """Return the terms of the surface in natural units: the paper's Equation 20, ours with standard errors."""
    table = ours.tables["uncoded_coefficients"].set_index("Term")
    terms = [*published.EQUATION_20, *(term for term in table.index if term not in published.EQUATION_20)]
    return [
        {
            "term": term,
            "paper": published.EQUATION_20.get(term),
            "ours": table["Coef"].get(term),
            "u": table["SE Coef"].get(term),
        }
        for term in terms
    ]


def variance(ours: Report) -> list[dict[str, Any]]:
    """Return the rows of the analysis of variance: the paper's degrees of freedom and sums of squares (Table 8), and ours."""
    found = {str(row["Source"]): row for row in ours.tables["anova"].to_dict("records")}
    printed = published.ANOVA
    return [
        {"source": source, "paper": printed.get(source, (None, None)), "ours": found.get(source, {})}
        for source in _merged(list(printed), list(found))
    ]


def _merged(first: list[str], second: list[str]) -> list[str]:
    """Return the names of both lists, each of the second's own behind the one that it follows there."""
    names = list(first)
    for place, name in enumerate(second):
        if name not in names:
            before = names.index(second[place - 1]) + 1 if place else 0
            names.insert(before, name)
    return names


def summary(ours: Report) -> list[dict[str, Any]]:
    """Return the model summary: as the paper prints it, recomputed from its Table 5, and ours."""
    analyser = plugins.get("analyser", "response_surface")(**SETTINGS)
    again = analyser.analyse(
        published.central_composite(),
        responses=[published.ANGLE],
        factors=published.SURFACE,
        space=published.factor_space(published.SURFACE),
    )
    return [
        {
            "name": words,
            "paper": published.MODEL_SUMMARY.get(name),
            "recomputed": again.numbers[name],
            "ours": ours.numbers[name],
        }
        for name, words in SUMMARY.items()
    ]


def angles(heaps: Mapping[str, KeptHeaps]) -> list[dict[str, Any]]:
    """Return statistics of the heaps' angles, a row per kind of heap: the registered analyser's."""
    columns = {name: pd.Series(kept.angles, dtype=float) for name, kept in heaps.items()}
    report = plugins.get("analyser", "property_statistics")().analyse(pd.DataFrame(columns))
    return report.tables["property_statistics"].to_dict("records")
