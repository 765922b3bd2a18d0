"""Compare a study's model with its measurements: run every test, say where the model fails, draw it."""

from __future__ import annotations

import re
import time
from collections.abc import Callable, Iterator, Sequence
from concurrent.futures import Executor
from contextlib import contextmanager
from functools import partial
from pathlib import Path
from typing import Any

import pandas as pd

from taichidem import plugins
from taichidem.study.campaign import STORE, run_all, study_runs
from taichidem.study.comparison import Comparison
from taichidem.study.comparison_photographs import Photographed, heap_pictures, photographed
from taichidem.study.comparison_rows import ANALYSER, analyse_errors, measured_parameters, rows_of, value_table
from taichidem.study.measurements import measurements_file, read_measurements
from taichidem.study.problems import FileError
from taichidem.study.result_file import RESULTS
from taichidem.study.run_counts import counted
from taichidem.study.run_store import RunStore
from taichidem.study.study_file import Study, read_study
from taichidem.whole_file import save_figure

Report = Callable[[str, float], None]
SEEDS = (1, 2, 3, 4)
DOTS_PER_INCH = 150


def compare(
    study: Study | str | Path,
    seeds: Sequence[int] = SEEDS,
    store: RunStore | str | Path | None = None,
    output: str | Path | None = None,
    report: Report | None = None,
    *,
    retry_failed: bool = False,
    executor: Executor | None = None,
) -> Comparison:
    """Run every measured test of a study with the model as it stands and hold the results against the measurements.

    Args:
        study: as `read_study` returns it, or its folder.
        seeds: every test is run with each; three or more show how far a result scatters.
        store: that keeps the runs, or its file; by default runs.sqlite in the study's folder. What is there isn't run again.
        output: folder for comparison.json, comparison.csv and pictures; by default results in the study's folder.
        report: called with the stage and the share done, for a progress bar.
        retry_failed: run those again that failed before.
        executor: workers that simulate, as for `run_all`.

    Returns:
        The comparison, written to the folder already. A run that fails is a row of its `failures`.

    Raises:
        FileError: (an InputError) what is wrong with study, measurements or photographs, before anything is run.
        InputError: a folder or store that can't be written, or no seed.
        EnvironmentProblem: there are photographs, and nothing can be drawn on this machine.
    """
    began = time.perf_counter()
    study = study if isinstance(study, Study) else read_study(study)
    measurements, photographs = checked(study)
    runs = study_runs(study, None, seeds)
    folder = writable(study.path / RESULTS if output is None else output)
    tell = report or (lambda stage, share: None)
    tell("simulating", 0.0)
    with opened(study, store) as kept:
        told = partial(tell, "simulating")
        table = run_all(runs, kept, told, retry_failed=retry_failed, executor=executor)
    found = _evaluated(study, measurements, table, folder)
    found |= _drawn(study, photographs, table, found, tell)
    del found["report"]
    comparison = Comparison(**found, wall_s=time.perf_counter() - began)
    comparison.save()
    return comparison


def checked(study: Study) -> tuple[pd.DataFrame, list[Photographed]]:
    """Return the measurements of a study and those with photographs, or raise what `compare` raises before anything is run."""
    measurements = read_measurements(study)
    check_measured(study, measurements)
    return measurements, photographed(study, measurements)


def check_measured(study: Study, measurements: pd.DataFrame) -> None:
    """Refuse experiments of a study without a measurement.

    Raises:
        FileError: names each of them.
    """
    missing = [name for name in study.experiments if name not in set(measurements["experiment"])]
    if missing:
        raise FileError(
            str(measurements_file(study)),
            [
                f"experiments.{name} has no measurement. Add a row for it, or take [experiments.{name}] out of "
                f"{study.file.name} ('#' before its lines)."
                for name in missing
            ],
        )


def writable(path: str | Path) -> Path:
    """Return a folder that exists and can be written, or raise InputError."""
    from taichidem.heap_comparison import writable_folder  # which takes a second to import

    return writable_folder(path)


@contextmanager
def opened(study: Study, store: RunStore | str | Path | None) -> Iterator[RunStore]:
    """Give an open store: that which is given, or the one in a file, by default the study's own."""
    if isinstance(store, RunStore):
        yield store
        return
    with RunStore(study.path / STORE if store is None else store) as own:
        yield own


def _evaluated(study: Study, measurements: pd.DataFrame, table: pd.DataFrame, folder: Path) -> dict[str, Any]:
    """Return the numbers and sentences of a comparison."""
    parameters = measured_parameters(study)
    values = value_table(study, measurements, table, parameters)
    report = analyse_errors(values)
    rows = rows_of(values, report)
    failed = table[table["status"] == "failed"]
    return {
        "report": report,
        "study": study.title,
        "table": rows,
        "parameters": parameters,
        **{name: report.numbers[name] for name in ("chi2", "dof", "p_value")},
        "failing": tuple(rows.loc[rows["fails"], "label"]),
        "trends": tuple(_trends(report, rows)),
        "text": " ".join(report.sentences),
        "advice": tuple(report.advice),
        "failures": tuple(failed[["experiment", "seed", "reason", "stored"]].to_dict("records")),
        "runs": counted(table),
        "folder": folder,
    }


def _trends(report: Any, rows: pd.DataFrame) -> Iterator[dict[str, Any]]:
    """Yield what is told of each series, with the names of its experiments."""
    for trend in report.details["trends"].to_dict("records"):
        name, unit = re.fullmatch(r"(.*) \[(.*)\]", trend["condition"]).groups()  # type: ignore[union-attr]
        kept = ("observable", "conditions", "z", "slope", "u_slope", "p", "adjusted_p", "claimed", "text")
        experiments = rows["experiment"].iloc[trend["rows"]].tolist()
        yield {key: trend[key] for key in kept} | {"condition": name, "unit": unit, "experiments": experiments}


def _drawn(
    study: Study, photographs: list[Photographed], table: pd.DataFrame, found: dict[str, Any], tell: Report
) -> dict[str, Any]:
    """Draw everything; return the pictures, and what photographs add to the text."""
    tell("drawing", 0.0)
    folder, pictures = found["folder"], {}
    for name, figure in plugins.get("analyser", ANALYSER)().figures(found["report"]).items():
        save_figure(figure, folder / f"{name}.png", dpi=DOTS_PER_INCH)
        pictures[name] = f"{name}.png"
    heaps, texts, numbers = heap_pictures(study, photographs, table, folder, lambda share: tell("drawing", share))
    tell("drawing", 1.0)
    return {
        "pictures": pictures | heaps,
        "text": " ".join([found["text"], *texts]),
        "photographs": tuple(numbers),
    }
