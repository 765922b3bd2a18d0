"""The result of comparing a study with its measurements, and the files it is kept in."""

from __future__ import annotations

import json
import math
from collections.abc import Mapping
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

import numpy as np
import pandas as pd

SCHEMA = 1
JSON_FILE, CSV_FILE = "comparison.json", "comparison.csv"


@dataclass(frozen=True, eq=False)
class Comparison:
    """A study's measurements beside its simulations.

    Attributes:
        study: the study's title.
        table: a row per measurement, as `comparison_rows` gives it.
        parameters: those measured directly, as `measured_parameters` gives them; they count in χ².
        chi2, dof, p_value: χ² = Σ z², the number of its terms, its p (nan where single seeds leave it open).
        failing: labels of the measurements that fail.
        trends: a dictionary per series: observable, condition, unit, experiments, conditions, z, slope, u_slope, p,
            adjusted_p, claimed, text.
        text: one paragraph for a reader who doesn't program.
        advice: what to do next, a sentence each.
        failures: runs that failed: experiment, seed, reason, stored (whether they had failed before).
        runs: how many were stored, new, failed.
        photographs: angles in photographs and in pictures of the simulated heaps.
        pictures: files by name, relative to `folder`.
        folder: where everything was written.
        wall_s: time it took [s].
    """

    study: str
    table: pd.DataFrame
    parameters: pd.DataFrame
    chi2: float
    dof: int
    p_value: float
    failing: tuple[str, ...]
    trends: tuple[Mapping[str, Any], ...]
    text: str
    advice: tuple[str, ...]
    failures: tuple[Mapping[str, Any], ...]
    runs: Mapping[str, int]
    folder: Path
    wall_s: float
    photographs: tuple[Mapping[str, Any], ...] = ()
    pictures: Mapping[str, str] = field(default_factory=dict)

    def as_dict(self) -> dict[str, Any]:
        """Return what comparison.json holds, in plain types; missing numbers are None."""
        return plain(
            {
                "schema": SCHEMA,
                "study": self.study,
                "rows": self.table.to_dict("records"),
                "parameters": self.parameters.to_dict("records"),
                "chi2": self.chi2,
                "dof": self.dof,
                "p_value": self.p_value,
                "failing": self.failing,
                "trends": self.trends,
                "text": self.text,
                "advice": self.advice,
                "failures": self.failures,
                "runs": self.runs,
                "wall_s": self.wall_s,
                "photographs": self.photographs,
                "pictures": self.pictures,
            }
        )

    def to_json(self) -> str:
        """Return comparison.json as text."""
        return json.dumps(self.as_dict(), indent=2, ensure_ascii=False, allow_nan=False)

    def save(self) -> list[Path]:
        """Write comparison.json and comparison.csv into the folder; return their paths."""
        written = [self.folder / JSON_FILE, self.folder / CSV_FILE]
        written[0].write_text(self.to_json() + "\n", encoding="utf-8")
        self.table.to_csv(written[1], index=False, encoding="utf-8")
        return written


def plain(value: Any) -> Any:
    """Return mappings, sequences and numbers as types that JSON knows; numbers that aren't finite become None."""
    if isinstance(value, Mapping):
        return {str(key): plain(inner) for key, inner in value.items()}
    if isinstance(value, (list, tuple)):
        return [plain(inner) for inner in value]
    if isinstance(value, np.generic):
        value = value.item()
    return None if isinstance(value, float) and not math.isfinite(value) else value
