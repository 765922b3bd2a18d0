"""The result of comparing a study with its measurements, and the files it is kept in."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any, ClassVar

import pandas as pd

from taichidem.study.result_file import ResultFile
from taichidem.whole_file import write_whole

JSON_FILE, CSV_FILE = "comparison.json", "comparison.csv"


@dataclass(frozen=True, eq=False)
class Comparison(ResultFile):
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

    file: ClassVar[str] = JSON_FILE
    hidden: ClassVar[tuple[str, ...]] = ("folder", "table", "parameters")

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

    def extra(self) -> dict[str, Any]:
        """Return the tables as rows."""
        return {"rows": self.table.to_dict("records"), "parameters": self.parameters.to_dict("records")}

    def save(self) -> Path:
        """Write comparison.json and comparison.csv into the folder and return the path of the first."""
        write_whole(self.folder / CSV_FILE, self.table.to_csv(index=False, lineterminator="\n"))
        return super().save()
