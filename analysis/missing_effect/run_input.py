"""Tables that were given, as a problem and as simulated points; what can't be used is told in words."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import MISSING, fields
from typing import Any

import numpy as np
import pandas as pd

from analysis.errors import AnalysisError
from analysis.missing_effect.kernel import Points
from analysis.missing_effect.problem import Candidate, Problem

FEWEST_RUNS = 2  # of an effect that must have given every response


def columns_of(table: pd.DataFrame | None, wanted: Sequence[str], what: str) -> pd.DataFrame:
    """Return a table that was given, or an empty one; measurements must be there."""
    if table is None or table.empty:
        if what == "measurements":
            raise AnalysisError("missing_effect needs measurements: a table with the columns label, test, value and u.")
        return pd.DataFrame(columns=list(wanted))
    missing = [name for name in wanted if name not in table.columns]
    if missing:
        raise AnalysisError(
            f"The table {what} has the columns {', '.join(map(str, table.columns))} and lacks {', '.join(missing)}. It needs "
            f"{', '.join(wanted)}."
        )
    return table


def records(kind: type, table: pd.DataFrame) -> list[Any]:
    """Return a dataclass per row; what is missing where there is a default counts as not given."""
    needed = {f.name: f.default is MISSING for f in fields(kind)}
    return [
        kind(**{str(k): v for k, v in row.items() if k in needed and (needed[k] or not pd.isna(v))})
        for row in table.to_dict("records")
    ]


def check_runs(table: pd.DataFrame, responses: Sequence[str], keys: Sequence[str]) -> None:
    """Refuse a table of runs without the columns wanted, or with rows that say nothing certain of where they were made.

    Raises:
        AnalysisError: what is missing, or the first row that is wrong.
    """
    missing = [name for name in [*responses, *keys, "effect", "share"] if name not in table.columns]
    if missing:
        raise AnalysisError(
            f"The table of runs lacks the columns {', '.join(missing)}. Give one per response and parameter, effect and share."
        )
    acts, share = (table["effect"] != "").to_numpy(), table["share"].to_numpy(float)
    wrong = np.flatnonzero(~np.isfinite(share) | (acts == (share == 0)))
    if len(wrong):
        row = table.iloc[wrong[0]]
        raise AnalysisError(
            f"Run {wrong[0]} of the table has the effect {row['effect']!r} at the share {row['share']}. A run has either the "
            'effect "" and the share 0, or the name of an effect and a share that is not 0.'
        )
    for key in keys:
        gaps = np.flatnonzero(~np.isfinite(table[key].to_numpy(float)))
        if len(gaps):
            raise AnalysisError(
                f"Run {gaps[0]} of the table lacks a finite value of the parameter {key}. Give it, or drop the run."
            )


def testable(
    table: pd.DataFrame, labels: Sequence[str], candidates: Sequence[Candidate]
) -> tuple[list[Candidate], dict[str, str]]:
    """Return the candidates of which enough runs gave every response, and why the others are not tested."""
    kept, dropped = [], {}
    for candidate in candidates:
        good = table.loc[table["effect"] == candidate.name, list(labels)].notna().sum()
        worst = str(good.idxmin())
        if good[worst] >= FEWEST_RUNS:
            kept.append(candidate)
        else:
            dropped[candidate.name] = (
                f"{int(good[worst])} of its runs gave {worst}; {FEWEST_RUNS} are needed to tell what it does there."
            )
    return kept, dropped


def points_of(table: pd.DataFrame, problem: Problem) -> Points:
    """Return the simulated points in coded parameters and shares per candidate."""
    x = np.array([problem.coded(row) for row in table[[p.key for p in problem.parameters]].to_numpy(float)])
    share = np.zeros((len(table), len(problem.candidates)))
    for k, candidate in enumerate(problem.candidates):
        acts = (table["effect"] == candidate.name).to_numpy()
        share[acts, k] = table["share"].to_numpy(float)[acts]
    return Points(x.reshape(len(table), len(problem.parameters)), share)
