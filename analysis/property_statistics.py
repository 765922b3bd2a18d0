"""Statistics of repeated measurements of a property."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import ClassVar

import numpy as np
import pandas as pd

from analysis.base import Analyser
from analysis.errors import AnalysisError
from analysis.report import Report
from analysis.run_table import NEVER_FACTORS, numbers
from designs.space import FactorSpace


def describe(values: np.ndarray) -> dict[str, float]:
    """Return n, mean, standard deviation (n − 1), COV = 100 s/|mean| [%], min, max and standard error s/√n."""
    n, mean = len(values), float(np.mean(values))
    deviation = float(np.std(values, ddof=1)) if n > 1 else float("nan")
    return {
        "N": n,
        "Mean": mean,
        "SD": deviation,
        "COV %": 100 * deviation / abs(mean) if mean else float("nan"),
        "Min": float(np.min(values)),
        "Max": float(np.max(values)),
        "SE": deviation / np.sqrt(n),
    }


@dataclass(frozen=True, kw_only=True)
class PropertyStatistics(Analyser):
    """Statistics of measured properties: mean, standard deviation, COV %, minimum and maximum per column.

    s = √(Σ (x − x̄)²/(n − 1)), COV = 100 s/|x̄|. Gaps are left out and counted; text is an error.
    """

    name: ClassVar[str] = "property_statistics"
    n_responses: ClassVar[tuple[int, int | None]] = (0, None)

    def analyse(
        self,
        table: pd.DataFrame,
        *,
        responses: Sequence[str] = (),
        factors: Sequence[str] | None = None,
        space: FactorSpace | None = None,
    ) -> Report:
        """Return the statistics of the named columns, or of all numeric ones."""
        names = list(self.check_responses(responses)) or _numeric(table)
        if not names:
            raise AnalysisError("The table has no numeric column. Name the columns to describe (--response).")
        rows, sentences = [], []
        for name in names:
            present = table if name not in table.columns else table[table[name].notna()]
            values = numbers(present, name, "property")
            if not len(values):
                raise AnalysisError(f"Column {name!r} is empty. Give at least one measured value.")
            row = describe(values)
            rows.append({"Property": name, **row, "Missing": len(table) - len(present)})
            sentences.append(
                f"{name}: {row['Mean']:.4g} ± {row['SD']:.2g} (COV {row['COV %']:.2g} %, n = {len(values)})."
            )
        result = pd.DataFrame(rows)
        means = {str(row.Property): float(row.Mean) for row in result.itertuples()}
        single = result.loc[result["N"] < 2, "Property"]
        advice = tuple(f"Measure {name} again: one value has no scatter." for name in single)
        return Report(self.name, ", ".join(names), {"property_statistics": result}, means, tuple(sentences), advice)


def _numeric(table: pd.DataFrame) -> list[str]:
    return [str(c) for c in table.columns if str(c) not in NEVER_FACTORS and pd.api.types.is_numeric_dtype(table[c])]
