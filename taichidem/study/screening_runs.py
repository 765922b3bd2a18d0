"""Turn the rows of a screening design into runs, and what the runs gave into the table that an analyser reads."""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence

import pandas as pd

from taichidem.experiments.base import Experiment
from taichidem.study.execution import Run
from taichidem.study.hypothesis import Hypotheses
from taichidem.study.screening import EFFECT, SEED, SHARE
from taichidem.study.study_file import Study


def row_runs(
    study: Study,
    hypotheses: Hypotheses,
    design: pd.DataFrame,
    measured: Iterable[str],
    extra: Mapping[str, Experiment],
) -> list[dict[str, Run]]:
    """Return for each row of a design the run of each test, by the test's name.

    Args:
        study: whose model and experiments are changed.
        hypotheses: the effects that the design names.
        design: as `screening_design` returns it.
        measured: names of the study's experiments to run.
        extra: further experiments by a name that the study doesn't use.
    """
    keys = [entry.key for entry in study.calibrate]
    names = list(measured)
    found = []
    for row in design.to_dict("records"):
        point = study.at({key: float(row[key]) for key in keys})
        model = point.model
        if row[EFFECT]:
            model = hypotheses[str(row[EFFECT])].joined(model, float(row[SHARE]))
        tests = {name: point.experiments[name] for name in names} | dict(extra)
        found.append({name: Run(test, model, int(row[SEED]), name) for name, test in tests.items()})
    return found


def response_table(
    design: pd.DataFrame,
    rows: Sequence[Mapping[str, Run]],
    outcomes: pd.DataFrame,
    responses: Mapping[str, tuple[str, str]],
) -> pd.DataFrame:
    """Return the design with a column per response, empty where the run failed.

    Args:
        design, rows: as given to and returned by `row_runs`.
        outcomes: what `run_all` returned for the runs of those rows.
        responses: label → (test, observable).
    """
    by_key = outcomes.drop_duplicates("key").set_index("key")
    table = design.copy()
    for label, (test, observable) in responses.items():
        values = by_key[observable] if observable in by_key else pd.Series(dtype=float)
        table[label] = [values.get(row[test].key, float("nan")) for row in rows]
    return table
