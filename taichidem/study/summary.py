"""Condense runs into one line per experiment and observable, beside what was measured."""

from __future__ import annotations

from typing import Any

import numpy as np
import pandas as pd

from taichidem.study.study_file import Study


def summarise(study: Study, table: pd.DataFrame, measurements: pd.DataFrame | None = None) -> pd.DataFrame:
    """Return mean and scatter over seeds of every observable of the experiments that a table of runs holds.

    u = s/√n, s the standard deviation over the n runs that succeeded.

    Args:
        study: whose experiments were run.
        table: of one model, as `simulate` returns it.
        measurements: as `read_measurements` returns them.

    Returns:
        Columns experiment, observable, unit, mean, u (nan below two runs), n, measured, measured_u (nan where there is no
        measurement); a measurement of several conditions gives a row each.
    """
    rows = []
    for name in dict.fromkeys(table["experiment"]):
        runs = table[table["experiment"] == name]  # a failed one has no responses
        for observable in study.experiment(name).observables:
            row = {"experiment": name, "observable": observable.name, "unit": observable.unit}
            row |= _scatter(runs[observable.name].dropna() if observable.name in runs else [])
            rows += [row | measured for measured in _measured(measurements, name, observable.name)]
    return pd.DataFrame(rows)


def _scatter(values: Any) -> dict[str, Any]:
    good = np.asarray(values, float)
    return {
        "mean": float(good.mean()) if len(good) else np.nan,
        "u": float(good.std(ddof=1) / np.sqrt(len(good))) if len(good) > 1 else np.nan,
        "n": len(good),
    }


def _measured(measurements: pd.DataFrame | None, experiment: str, observable: str) -> list[dict[str, Any]]:
    none = [{"measured": np.nan, "measured_u": np.nan}]
    if measurements is None:
        return none
    rows = measurements[(measurements["experiment"] == experiment) & (measurements["observable"] == observable)]
    return [{"measured": v, "measured_u": u} for v, u in zip(rows["value"], rows["u"], strict=True)] or none
