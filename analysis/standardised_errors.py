"""All measurements of a study against one model: standardised errors, χ², which fail, and what the misfit follows."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any, ClassVar

import numpy as np
import pandas as pd
from scipy import stats

from analysis.base import Analyser, check_fraction
from analysis.comparison import SimulatedMean, compare
from analysis.error_trends import series_of, trends_table
from analysis.errors import AnalysisError
from analysis.familywise import holm
from analysis.known_and_estimated import normal_deviate, two_sided
from analysis.report import Report
from analysis.standardised_errors_text import advice, sentences
from designs.space import FactorSpace

if TYPE_CHECKING:
    from matplotlib.figure import Figure

NEEDED = ("measured", "u_measured", "simulated", "u_simulated", "n_seeds")
OTHERS = ("label", "type", "observable", "unit", "kind", "exact", "experiment", "condition", "n_measured")
TEST, PARAMETER = "test", "parameter"


@dataclass(frozen=True, kw_only=True)
class StandardisedErrors(Analyser):
    """Standardised errors z = (S − D)/u_val of all measurements, χ² = Σ z², which fail, and the conditions that E follows.

    u_val² = u_D² + u_S², where u_S is the scatter of the mean over n seeds. As few seeds estimate it badly, p is the chance
    of |u_D N + u_S T| ≥ |E| with a normal variate N and Student's T with n − 1 degrees of freedom; u_D is taken as it is given.
    A row fails where its p, adjusted for the number of rows (Holm), is at most α. The p of χ² adds, in place of each z², the
    square of the normal deviate that has z's own p, so that it is exact where u_S is 0 and not too small elsewhere. A row with a
    single seed gets no p, unless it is exact.

    Columns of the table: measured, u_measured, simulated, u_simulated (missing where one seed was run), n_seeds; and where
    wanted label, type, observable, unit, kind ("test", or "parameter" for one that was measured directly), exact (whether
    the simulation has no scatter). All further columns, or `factors`, are conditions; "speed [rad/s]" states a unit. Rows of
    one type and observable that differ in one condition alone get a weighted straight line of E over it.

    Args:
        alpha: chance of calling one row or more wrong while none is; the same for the trends.

    Sources: terms of ASME V&V 20; p after JCGM 101:2008 (GUM supplement 1); Holm, Scandinavian Journal of Statistics 6
    (1979) 65.
    """

    alpha: float = 0.05

    name: ClassVar[str] = "standardised_errors"
    n_responses: ClassVar[tuple[int, int | None]] = (0, 0)

    def __post_init__(self) -> None:
        check_fraction(self, "alpha", self.alpha)

    def analyse(
        self,
        table: pd.DataFrame,
        *,
        responses: Sequence[str] = (),
        factors: Sequence[str] | None = None,
        space: FactorSpace | None = None,
    ) -> Report:
        """Return the errors, their χ² and their trends.

        Raises:
            AnalysisError: for a missing column, or numbers that can't be compared (see `compare`).
        """
        self.check_responses(responses)
        table = _complete(table)
        conditions = [str(c) for c in table if c not in (*NEEDED, *OTHERS)] if factors is None else list(factors)
        _check_columns(table, (*NEEDED, *conditions))
        rows = errors_table(table, self.alpha)
        tests = (table["kind"] == TEST).to_numpy()
        series = series_of(table[tests], conditions)
        trends = trends_table(table[tests], rows[tests], series, self.alpha)
        numbers = chi_square(rows) | {"alpha": self.alpha}
        said = {"table": table, "rows": rows, "trends": trends, "numbers": numbers}
        tables = {"errors": rows, "trends": trends.drop(columns=["rows", "conditions", "z"])}
        details = said | {"series": series, "tests": table[tests].reset_index(drop=True)}
        return Report(self.name, "S − D", tables, numbers, tuple(sentences(said)), tuple(advice(said)), details)

    def figures(self, report: Report) -> dict[str, Figure]:
        """Return the chart of standardised errors, and one of S and D over the condition of each series of three or more."""
        from analysis.plot_standardised_errors import chart, series_charts

        return {"standardised_errors": chart(report)} | series_charts(report)


def _complete(table: pd.DataFrame) -> pd.DataFrame:
    """Return the table with the columns that may be left out."""
    _check_columns(table, NEEDED)
    if table.empty:
        raise AnalysisError("The table holds no row. Give one for each measurement.")
    table = table.reset_index(drop=True)
    usual: dict[str, Any] = {
        "label": [f"row {k + 1}" for k in range(len(table))],
        "unit": "",
        "observable": "value",
        "kind": TEST,
        "exact": False,
    }
    return table.assign(**{name: value for name, value in usual.items() if name not in table})


def _check_columns(table: pd.DataFrame, names: Sequence[str]) -> None:
    missing = [name for name in names if name not in table]
    if missing:
        raise AnalysisError(
            f"standardised_errors lacks the column{'s' if len(missing) > 1 else ''} {', '.join(missing)}; the table has "
            f"{', '.join(map(str, table.columns))}. Needed: {', '.join(NEEDED)}."
        )


def errors_table(table: pd.DataFrame, alpha: float) -> pd.DataFrame:
    """Return label, error, u_val, z, p, adjusted p and whether it fails, a row for each of the table.

    A row without a simulated value has none of these numbers. Tests and parameters are families of their own.
    """
    rows = pd.DataFrame([_error(dict(row)) for row in table.to_dict("records")], index=table.index)
    rows["adjusted_p"] = np.nan
    for kind in dict.fromkeys(table["kind"]):
        own = table["kind"] == kind
        rows.loc[own, "adjusted_p"] = holm(rows.loc[own, "p"])
    rows["fails"] = (rows["adjusted_p"] <= alpha).to_numpy(bool)
    return rows


def _error(row: dict[Any, Any]) -> dict[str, Any]:
    found: dict[str, Any] = {"label": row["label"]}
    if not (row["n_seeds"] > 0 and math.isfinite(row["simulated"])):
        return found | dict.fromkeys(("error", "u_val", "z", "p"), math.nan)
    known = bool(row["exact"]) or not math.isnan(row["u_simulated"])
    seeds = int(row["n_seeds"])
    scatter = (row["u_simulated"] if not math.isnan(row["u_simulated"]) else 0.0) if known else None
    mean = SimulatedMean(row["simulated"], scatter, seeds)
    result = compare(mean, row["measured"], row["u_measured"], quantity=row["label"], unit=row["unit"])
    p = two_sided(result.error, row["u_measured"], scatter or 0.0, max(seeds - 1, 1)) if known else math.nan
    return found | {
        "error": result.error,
        "u_val": result.validation_uncertainty,
        "z": result.error / result.validation_uncertainty,
        "p": p,
    }


def chi_square(rows: pd.DataFrame) -> dict[str, float]:
    """Return χ² = Σ z², the number of its terms, and its p; nan for the p while that of a term isn't known."""
    there = rows[rows["z"].notna()]
    z, each = there["z"].to_numpy(float), there["p"].to_numpy(float)
    deviates = np.array([normal_deviate(a, b) for a, b in zip(z, each, strict=True)])
    known = bool(there["p"].notna().all()) and len(there) > 0
    p = float(stats.chi2.sf(float(deviates @ deviates), len(there))) if known else math.nan
    return {"chi2": float(z @ z), "dof": len(there), "p_value": p}
