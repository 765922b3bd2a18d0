"""Measured beside simulated: the rows of a comparison, from measurements and a table of runs, without running anything."""

from __future__ import annotations

import math
from collections.abc import Mapping
from typing import Any

import numpy as np
import pandas as pd

from taichidem import plugins
from taichidem.study.calibrate_section import Calibration
from taichidem.study.comparison_conditions import (
    condition_columns,
    condition_texts,
    labels,
    observable_of,
    quantity_name,
    records,
)
from taichidem.study.parameter_key import all_pairs, pair_name
from taichidem.study.setting_key import SettingKey
from taichidem.study.study_file import Study
from taichidem.study.summary import summarise

ANALYSER = "standardised_errors"
ROW = (
    *("experiment", "type", "observable", "condition", "label", "unit", "measured", "u_measured", "n_measured"),
    *("simulated", "u_simulated", "n_seeds", "error", "u_val", "z", "ratio", "p", "fails"),
)


def comparison_rows(study: Study, measurements: pd.DataFrame, run_table: pd.DataFrame) -> pd.DataFrame:
    """Return a row per measurement: D ± u_D, S ± u_S over the seeds that succeeded, E = S − D, u_val, z, p, whether it fails.

    Args:
        study: whose experiments were measured.
        measurements: as `read_measurements` returns them.
        run_table: runs of one model, as `simulate` or `run_all` returns them; experiments may be missing.

    Returns:
        The columns `ROW`. Where no run gave a value, and for what one seed can't tell, numbers are nan. See
        `StandardisedErrors` of the analysers for z, p (two-sided) and fails (p corrected for the number of rows).
    """
    values = value_table(study, measurements, run_table)
    return rows_of(values, analyse_errors(values))


def rows_of(values: pd.DataFrame, report: Any) -> pd.DataFrame:
    """Return the tests among the values given to the analyser, with what its report says of each."""
    errors = report.tables["errors"].reset_index(drop=True)
    found = values.reset_index(drop=True).drop(columns="observable").rename(columns={"named": "observable"})
    found = found.join(errors[["error", "u_val", "z", "p", "fails"]])
    found["ratio"] = found["z"].abs()
    return found[found["kind"] == "test"].reindex(columns=list(ROW)).astype({"n_measured": int, "n_seeds": int})


def analyse_errors(values: pd.DataFrame, alpha: float = 0.05) -> Any:
    """Return the report of the registered analyser on a table of measured and simulated values."""
    return plugins.get("analyser", ANALYSER)(alpha=alpha).analyse(values, factors=conditions_of(values))


def conditions_of(values: pd.DataFrame) -> list[str]:
    """Return the columns of a table of values that are conditions, named with their unit."""
    return [str(name) for name in values if str(name).endswith("]")]


def value_table(
    study: Study, measurements: pd.DataFrame, run_table: pd.DataFrame, parameters: pd.DataFrame | None = None
) -> pd.DataFrame:
    """Return measured and simulated values for the analyser, a row per measurement and per parameter measured directly.

    Args:
        study, measurements, run_table: as for `comparison_rows`.
        parameters: as `measured_parameters` returns them; left out where None.
    """
    simulated = _simulated(study, run_table)
    rows = [_row(study, row, simulated) for row in records(measurements)]
    tests = pd.DataFrame(rows).assign(label=labels(study, measurements), condition=condition_texts(study, measurements))
    tests = tests.join(condition_columns(study, measurements))
    if parameters is None or parameters.empty:
        return tests
    direct = pd.DataFrame(
        {
            "label": parameters["key"],
            "unit": parameters["unit"],
            "measured": parameters["measured"],
            "u_measured": parameters["u_measured"],
            "simulated": parameters["believed"],
            "kind": "parameter",
        }
    ).assign(type="parameter", observable=parameters["key"], u_simulated=0.0, n_seeds=1, exact=True)
    return pd.concat([tests, direct], ignore_index=True)


def _simulated(study: Study, run_table: pd.DataFrame) -> dict[tuple[str, str], dict[str, float]]:
    summary = summarise(study, run_table[run_table["status"] == "done"])
    return {(row["experiment"], row["observable"]): row for row in records(summary)}


def _row(study: Study, measured: Mapping[str, Any], simulated: Mapping[tuple[str, str], Mapping]) -> dict[str, Any]:
    name, observable = measured["experiment"], observable_of(study, measured["experiment"], measured["observable"])
    found = simulated.get((name, observable.name), {"mean": math.nan, "u": math.nan, "n": 0})
    random = study.experiment(name).random
    return {
        "experiment": name,
        "type": study.experiments[name].type,
        "observable": quantity_name(observable),  # rows of a series have one quantity
        "named": observable.name,
        "unit": observable.unit,
        "measured": measured["value"],
        "u_measured": measured["u"],
        "n_measured": measured["n"],
        "simulated": found["mean"],
        "u_simulated": found["u"] if random or found["n"] == 0 else 0.0,
        "n_seeds": found["n"],
        "kind": "test",
        "exact": not random,
    }


def measured_parameters(study: Study) -> pd.DataFrame:
    """Return the parameters under [calibrate] that were measured directly: key, unit, believed, measured, u_measured, z.

    z = (believed − measured)/u. Where a key means all pairs and the model holds several values, the one farthest from the
    measurement is compared.
    """
    rows = []
    for entry in study.calibrate:
        if entry.value is None or entry.u is None:
            continue
        believed = min(believed_values(study, entry), key=lambda held: -abs(held - entry.value))  # type: ignore[operator]
        rows.append(
            {
                "key": entry.key,
                "unit": entry.unit,
                "believed": believed,
                "measured": entry.value,
                "u_measured": entry.u,
                "z": (believed - entry.value) / entry.u,
            }
        )
    return pd.DataFrame(rows, columns=["key", "unit", "believed", "measured", "u_measured", "z"])


def believed_values(study: Study, entry: Calibration) -> list[float]:
    """Return the values that the study's model holds for a parameter under [calibrate]: one, or a different one per pair."""
    if isinstance(entry.names, SettingKey):
        return [study.believed(entry.key)]
    held = next(e for e in study.model().effects if e.name == entry.names.effect).values[entry.names.parameter]
    if not isinstance(held, Mapping):
        return [float(held)]
    by_pair = {pair_name(*pair.split("-")): float(value) for pair, value in held.items()}
    if entry.names.pair is not None:
        return [by_pair[entry.names.pair]]
    touching = all_pairs(list(study.materials))
    return list(dict.fromkeys(np.array([by_pair[pair] for pair in touching if pair in by_pair]).tolist()))
