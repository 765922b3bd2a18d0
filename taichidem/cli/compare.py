"""The command `taichidem compare`: a study's model beside what was measured."""

from __future__ import annotations

import math
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

import typer
from rich import box
from rich.console import Console
from rich.table import Table

from taichidem.cli.progress import progress
from taichidem.cli.simulate import parse_seeds
from taichidem.cli.simulate_study import print_counts, print_failures, told_when_stopped
from taichidem.cli.workers import Cluster, Workers, executor_of

if TYPE_CHECKING:
    from taichidem.study import Comparison

WIDE = 125  # columns of a terminal that has room for everything


def register(app: typer.Typer) -> None:
    """Add the command to the application."""
    app.command("compare")(compare)


def compare(
    study: Annotated[str, typer.Argument(metavar="STUDY", help="A study folder, or its study.toml.")],
    seeds: Annotated[
        str, typer.Option(help="How many seeds, such as 4 (which are 1,2,3,4), or which, such as 1,2,3.")
    ] = "4",
    output: Annotated[
        Path | None, typer.Option("--output", "-o", help="Folder for the results; STUDY/results where left out.")
    ] = None,
    store: Annotated[
        Path | None, typer.Option(help="File that keeps the runs; runs.sqlite in the study's folder where left out.")
    ] = None,
    retry_failed: Annotated[bool, typer.Option("--retry-failed", help="Run again what failed before.")] = False,
    workers: Workers = None,
    cluster: Cluster = None,
    as_json: Annotated[bool, typer.Option("--json", help="Print comparison.json and nothing else.")] = False,
) -> None:
    """Hold every measurement of a study against its simulation: errors, χ², which fail, and what the misfit follows."""
    from taichidem.study import RunStore, read_study
    from taichidem.study import compare as compare_study
    from taichidem.study.campaign import STORE, study_runs
    from taichidem.study.comparison_run import checked

    read, numbers = read_study(study), parse_seeds(seeds)
    checked(read)  # before a store is made
    runs = study_runs(read, None, numbers)
    file = store or read.path / STORE
    with (
        executor_of(workers, cluster) as executor,
        RunStore(file) as opened,
        told_when_stopped(runs, opened),
        progress(quiet=as_json) as report,
    ):
        result = compare_study(read, numbers, opened, output, report, retry_failed=retry_failed, executor=executor)
    if as_json:
        typer.echo(result.to_json())
    else:
        _print(result, file)
    if (result.table["n_seeds"] == 0).all():
        raise typer.Exit(1)


def _print(result: Comparison, file: Path) -> None:
    console = Console()
    console.print(_table(result, console.width >= WIDE))
    typer.echo(result.text + "\n")
    for line in result.advice:
        typer.echo(f"Next: {line}")
    typer.echo()
    print_counts(result.runs, file)
    print_failures(list(result.failures))
    for name in ("comparison.json", "comparison.csv", *result.pictures.values()):
        typer.echo(f"wrote {result.folder / name}")


def _table(result: Comparison, wide: bool) -> Table:
    """Return measured and simulated values, with observable and p where there is room; what fails is red and said in a word."""
    shown = Table(title=result.study, box=box.SIMPLE_HEAD, padding=(0, 1), collapse_padding=True, pad_edge=False)
    shown.add_column("test", overflow="fold", min_width=16)
    headings = ["measured D", "simulated S", "E = S − D", "u_val", "|E|/u_val", ""]
    if wide:
        headings[0:0], headings[6:6] = ["observable"], ["p"]
    for heading in headings:
        shown.add_column(heading, no_wrap=True)
    for row in result.table.to_dict("records"):
        simulated = _with_u(row["simulated"], row["u_simulated"]) if row["n_seeds"] else "failed"
        unjudged = row["n_seeds"] > 0 and not math.isfinite(row["p"])
        judged = "fails" if row["fails"] else "1 seed" if unjudged else ""
        cells = _cells(row, simulated, [row[name] for name in ("error", "u_val", "ratio", "p")], judged, wide)
        shown.add_row(row["label"] + _unit(row), *cells, style="red" if row["fails"] else None)
    for row in result.parameters.to_dict("records"):
        errors = [row["believed"] - row["measured"], row["u_measured"], abs(row["z"]), math.nan]
        cells = _cells(row | {"observable": "(parameter)"}, f"{row['believed']:.4g}", errors, "", wide)
        shown.add_row(row["key"] + _unit(row), *cells)
    return shown


def _cells(row: Any, simulated: str, errors: list[float], judged: str, wide: bool) -> list[str]:
    numbers = [_number(value, digits) for value, digits in zip(errors, (3, 2, 2, 2), strict=True)]
    measured = _with_u(row["measured"], row["u_measured"])
    shown = [*([row["observable"]] if wide else []), measured, simulated, *(numbers if wide else numbers[:3])]
    return [*shown, judged]


def _unit(row: Any) -> str:
    return "" if row["unit"] == "1" else f" \\[{row['unit']}]"  # the backslash keeps rich from reading it as markup


def _with_u(value: float, u: float) -> str:
    return f"{value:.4g}" + (f" ± {u:.2g}" if math.isfinite(u) and u > 0 else "")


def _number(value: float, digits: int) -> str:
    return f"{value:.{digits}g}".replace("-", "−") if math.isfinite(value) else "–"
