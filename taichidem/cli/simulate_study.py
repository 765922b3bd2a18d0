"""What `taichidem simulate STUDY` does: run a study into its store and print what came out."""

from __future__ import annotations

import json
from collections.abc import Iterator, Mapping, Sequence
from concurrent.futures import Executor
from contextlib import contextmanager
from functools import partial
from pathlib import Path
from typing import TYPE_CHECKING, Any

import typer
from rich.console import Console
from rich.table import Table

from taichidem.cli.progress import progress
from taichidem.errors import InputError, unknown_name

if TYPE_CHECKING:
    import pandas as pd

    from taichidem.study import RunStore, Study
    from taichidem.study.execution import Run

RUN_FIELDS = ("key", "experiment", "type", "seed", "status", "stored", "attempts", "wall_time")  # as JSON
MOST_REASONS = 20  # failures printed in words; the store holds all


def is_study(text: str) -> bool:
    """Return whether a text means a study: a folder that holds study.toml, or a file that ends in .toml."""
    path = Path(text)
    return (path / "study.toml").is_file() or (path.is_file() and path.suffix == ".toml")


def neither(text: str) -> InputError:
    """Return the error for a text that is no study and no experiment."""
    from taichidem import plugins

    path = Path(text)
    if path.is_dir():
        found = f"The folder {text} holds no study.toml."
    elif path.exists():
        found = f"{text} is no study: its name does not end in .toml."
    else:
        found = f"There is no study {text}."
    return InputError(
        f"{unknown_name('experiment', text, plugins.names('experiment'))} {found} Give either of the two."
    )


def simulate_study(
    path: str,
    experiments: str | None,
    seeds: list[int],
    store: Path | None,
    retry_failed: bool,
    as_json: bool,
    executor: Executor | None = None,
) -> None:
    """Run a study and print mean and scatter of every observable, beside what was measured."""
    from taichidem.study import RunStore, read_measurements, read_study, summarise
    from taichidem.study.campaign import STORE, run_all, study_runs
    from taichidem.study.measurements import is_not_filled_in, measurements_file

    study = read_study(path)
    there = measurements_file(study).exists() and not is_not_filled_in(study)
    measured = read_measurements(study) if there else None
    names = None if experiments is None else [name.strip() for name in experiments.split(",") if name.strip()]
    file = store or study.path / STORE
    runs = study_runs(study, names, seeds)  # before a store is made for experiments that don't exist
    with RunStore(file) as opened, told_when_stopped(runs, opened), progress(quiet=as_json) as report:
        report("simulating", 0.0)
        told = partial(report, "simulating")
        table = run_all(runs, opened, told, retry_failed=retry_failed, executor=executor)
    summary = summarise(study, table, measured)
    if as_json:
        typer.echo(json.dumps(_as_dict(study, file, table, summary), indent=2))
    else:
        _print(study, file, table, summary)
    if not (table["status"] == "done").any():
        raise typer.Exit(1)


@contextmanager
def told_when_stopped(runs: list[Run], store: RunStore) -> Iterator[None]:
    """Say on Ctrl-C how far a campaign came, and end with 130 as shells expect."""
    try:
        yield
    except KeyboardInterrupt:
        keys = {run.key for run in runs}
        there = len(store.statuses(keys))
        typer.echo(f"Stopped. {there} of {len(keys)} runs are in {store.path}; the same command goes on.", err=True)
        raise typer.Exit(130) from None


def _as_dict(study: Study, file: Path, table: pd.DataFrame, summary: pd.DataFrame) -> dict[str, Any]:
    responses = [o.name for name in study.experiments for o in study.experiment(name).observables]
    runs = [
        {
            **{name: row[name] for name in RUN_FIELDS},
            "responses": {
                name: row[name] for name in dict.fromkeys(responses) if name in row and row[name] == row[name]
            },
            "reason": row["reason"] or None,
        }
        for row in table.to_dict("records")
    ]
    observables = [{k: None if v != v else v for k, v in row.items()} for row in summary.to_dict("records")]
    return {
        "study": study.title,
        "store": str(file),
        "already_there": int(table["stored"].sum()),
        "runs": runs,
        "observables": observables,
    }


def _print(study: Study, file: Path, table: pd.DataFrame, summary: pd.DataFrame) -> None:
    from taichidem.study.run_counts import counted

    shown = Table("experiment", "observable", "mean", "u (seeds)", "n", "measured", "unit", title=study.title)
    for row in summary.to_dict("records"):
        measured = f"{row['measured']:.4g} ± {row['measured_u']:.2g}" if row["measured"] == row["measured"] else "–"
        mean = f"{row['mean']:.4g}" if row["n"] else "failed"
        u = f"{row['u']:.2g}" if row["n"] > 1 else "–"
        shown.add_row(row["experiment"], row["observable"], mean, u, str(row["n"]), measured, row["unit"])
    Console().print(shown)
    print_counts(counted(table), file)
    print_failures(table[table["status"] == "failed"].to_dict("records"))


def print_counts(runs: Mapping[str, int], file: Path | None = None) -> None:
    """Say how many runs were there, were made, failed or were repeated, and in which store they are."""
    from taichidem.study.run_counts import in_words

    typer.echo(in_words(runs) + ("" if file is None else f" Store: {file}"))


def print_failures(failed: Sequence[Mapping[Any, Any]]) -> None:
    """Say which runs failed and why, each a mapping with experiment, seed, reason and stored (whether it failed before)."""
    for row in failed[:MOST_REASONS]:
        before = " (before; --retry-failed runs it again)" if row["stored"] else ""
        typer.echo(f"{row['experiment']}, seed {row['seed']} failed{before}: {row['reason']}")
    if len(failed) > MOST_REASONS:
        typer.echo(f"… and {len(failed) - MOST_REASONS} more; --json lists them all.")
