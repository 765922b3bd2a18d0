"""The command `taichidem coarse-grain`: what larger grains move in a study's tests, or a study with such grains."""

from __future__ import annotations

import math
from concurrent.futures import Executor
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

import typer
from rich import box
from rich.console import Console
from rich.table import Table

from taichidem.cli.progress import progress
from taichidem.cli.simulate import parse_seeds
from taichidem.cli.simulate_study import print_counts, told_when_stopped
from taichidem.cli.workers import Cluster, Workers, executor_of
from taichidem.errors import InputError

if TYPE_CHECKING:
    import pandas as pd

    from taichidem.study import CoarseGrainingCheck, Study

MOST_REASONS = 20  # failures printed in words; coarse_graining.json holds all


def register(app: typer.Typer) -> None:
    """Add the command to the application."""
    app.command("coarse-grain")(coarse_grain)


def coarse_grain(
    study: Annotated[str, typer.Argument(metavar="STUDY", help="A study folder, or its study.toml.")],
    factors: Annotated[
        str, typer.Option(help="Factors of the check, such as 1,2,4; shifts are from the smallest.")
    ] = "1,2,4",
    seeds: Annotated[
        str, typer.Option(help="How many seeds, such as 3 (which are 1,2,3), or which, such as 1,2,3.")
    ] = "3",
    tests: Annotated[str | None, typer.Option(help="Tests to run, such as heap,drum; all where left out.")] = None,
    coverage: Annotated[float, typer.Option(help="Standard uncertainties beyond which an observable has moved.")] = 2.0,
    output: Annotated[
        Path | None, typer.Option("--output", "-o", help="Folder for the results; STUDY/results where left out.")
    ] = None,
    store: Annotated[
        Path | None, typer.Option(help="File that keeps the runs; runs.sqlite in the study's folder where left out.")
    ] = None,
    retry_failed: Annotated[bool, typer.Option("--retry-failed", help="Run again what failed before.")] = False,
    factor: Annotated[
        float | None, typer.Option(help="Together with --write: how many times as large the grains become.")
    ] = None,
    write: Annotated[
        Path | None,
        typer.Option(metavar="FOLDER", help="Write a study with grains of --factor times the size; run nothing."),
    ] = None,
    workers: Workers = None,
    cluster: Cluster = None,
    as_json: Annotated[bool, typer.Option("--json", help="Print coarse_graining.json and nothing else.")] = False,
) -> None:
    """Run a study's tests with grains of several sizes that stand in for the real ones, and say which observables moved.

    Grains s times as large are s³ times fewer; every effect follows its rule, the apparatus stays: docs/coarse_graining.md.
    """
    from taichidem.study import read_study

    if (factor is None) != (write is None):
        raise InputError(
            "--factor and --write belong together: give both to write a study, or neither to check one by --factors."
        )
    read = read_study(study)
    if factor is not None and write is not None:
        _write(read, factor, write, as_json)
        return
    names = None if tests is None else [name.strip() for name in tests.split(",") if name.strip()]
    asked = (parse_factors(factors), parse_seeds(seeds), names, coverage)
    with executor_of(workers, cluster) as executor:
        result, file = _checked(read, asked, output, store, retry_failed, as_json, executor)
    if as_json:
        typer.echo(result.to_json())
    else:
        _print(result, file)
    if result.table["moved"].isna().all() or not (result.table["n"] > 0).any():
        raise typer.Exit(1)


def parse_factors(text: str) -> list[float]:
    """Return factors from a text such as "1,2,4"."""
    try:
        return [float(part) for part in text.split(",") if part.strip()]
    except ValueError:
        raise InputError(f"factors is {text!r}; give numbers from 1, separated by commas, such as 1,2,4.") from None


def _checked(
    read: Study,
    asked: Any,
    output: Path | None,
    store: Path | None,
    retry_failed: bool,
    quiet: bool,
    executor: Executor | None,
) -> tuple[CoarseGrainingCheck, Path]:
    from taichidem.study import RunStore
    from taichidem.study.campaign import STORE
    from taichidem.study.coarse_graining_check import carried_out, study_plan
    from taichidem.study.comparison_run import writable
    from taichidem.study.result_file import RESULTS

    plan = study_plan(read, *asked)  # before a store is made
    folder = writable(read.path / RESULTS if output is None else output)
    file = store or read.path / STORE
    runs = [run for _, run in plan.runs]
    with RunStore(file) as opened, told_when_stopped(runs, opened), progress(quiet=quiet) as report:
        return carried_out(plan, opened, folder, report, retry_failed=retry_failed, executor=executor), file


def _write(read: Study, factor: float, folder: Path, as_json: bool) -> None:
    import json

    from taichidem.coarse_graining import CoarseGraining
    from taichidem.study import write_coarse_grained

    written = write_coarse_grained(read, factor, folder)
    graining = CoarseGraining(factor)
    table = graining.table(read.model(), read.particle.diameter)
    masses = {name: graining.mass_kept(read.experiment(name)) for name in read.experiments}
    if as_json:
        rules = table.to_dict("records")
        typer.echo(
            json.dumps({"study": str(written.file), "factor": factor, "rules": rules, "mass_kept": masses}, indent=2)
        )
        return
    shown = Table("of", "quantity", "rule", "before", "after", "unit", box=box.SIMPLE_HEAD, title=written.title)
    for row in table.to_dict("records"):
        pair = f" ({row['pair']})" if row["pair"] else ""
        numbers = [f"{row[name]:.4g}" for name in ("before", "after")]
        unit = "" if row["unit"] == "1" else row["unit"]
        shown.add_row(row["effect"] or "every model", row["parameter"] + pair, row["rule"], *numbers, unit)
    Console().print(shown)
    for name, mass in masses.items():
        if mass != 1:
            typer.echo(f"{name}: {100 * (mass - 1):+.2g} % of mass, by rounding to whole grains")
    typer.echo(f"wrote {written.file}; its measurements are those of the real grains")


def _print(result: CoarseGrainingCheck, file: Path) -> None:
    Console().print(_table(result.table, result.study))
    typer.echo(result.text + "\n")
    for row in result.failures[:MOST_REASONS]:
        seed = "" if row["seed"] is None else f", seed {row['seed']}"
        typer.echo(f"{row['experiment']} at s = {row['factor']:g}{seed}: {row['reason']}")
    if len(result.failures) > MOST_REASONS:
        typer.echo(f"… and {len(result.failures) - MOST_REASONS} more; --json lists them all.")
    print_counts(result.runs, file)
    for name in (result.file, *result.pictures.values()):
        typer.echo(f"wrote {result.folder / name}")


def _table(table: pd.DataFrame, title: str) -> Table:
    """Return a line per observable and factor; what moved is red and said in a word."""
    shown = Table(title=title, box=box.SIMPLE_HEAD, padding=(0, 1), collapse_padding=True, pad_edge=False)
    shown.add_column("test: observable", overflow="fold", min_width=16)
    for heading in ("s", "grains", "mean ± u", "shift", "z", "", "s per run"):
        shown.add_column(heading, no_wrap=True)
    before = None
    for row in table.to_dict("records"):
        here = (row["experiment"], row["observable"])
        unit = "" if row["unit"] == "1" else f" \\[{row['unit']}]"  # the backslash keeps rich from reading it as markup
        name = "" if here == before else f"{here[0]}: {here[1]}{unit}"
        moved = {True: "moved", False: "", None: "" if row["shift"] == 0 else "?"}[row["moved"]]
        cells = [
            f"{row['factor']:g}",
            str(row["grains"]),
            _with_u(row),
            *_shift(row),
            moved,
            _number(row["wall_time"], 3),
        ]
        shown.add_row(name, *cells, style="red" if row["moved"] else None)
        before = here
    return shown


def _shift(row: Any) -> list[str]:
    if row["shift"] == 0 and row["u_shift"] == 0:
        return ["", ""]
    return [_number(row["shift"], 3), _number(row["z"], 2)]


def _with_u(row: Any) -> str:
    if not row["n"]:
        return "failed"
    return f"{row['mean']:.4g}" + (f" ± {row['u']:.2g}" if math.isfinite(row["u"]) else "")


def _number(value: float, digits: int) -> str:
    return f"{value:.{digits}g}".replace("-", "−") if math.isfinite(value) else "–"
