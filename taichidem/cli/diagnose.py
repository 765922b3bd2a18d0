"""The commands `taichidem diagnose`, `add` and `discover`: which effect a model lacks, and the model with it."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from contextlib import contextmanager
from functools import partial
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
    from taichidem.study import Addition, Diagnosis, RunStore, Study

StudyArgument = Annotated[str, typer.Argument(metavar="STUDY", help="A study folder, or its study.toml.")]
Store = Annotated[
    Path | None, typer.Option(help="File that keeps the runs; runs.sqlite in the study's folder where left out.")
]
Effects = Annotated[
    str | None, typer.Option(help="Effects to test, separated by commas; every registered one where left out.")
]
Rows = Annotated[
    int | None, typer.Option(help="Simulated points per effect; 4, or 12 where no test has a scatter.", min=2)
]
BaseRows = Annotated[
    int | None, typer.Option(help="Simulated points without an effect, beyond centre and edges.", min=0)
]
Json = Annotated[bool, typer.Option("--json", help="Print the result as JSON and nothing else.")]
WIDE = 100  # columns of a terminal that has room for everything
SHOWN = 12  # candidates printed; verdict.json holds all


def register(app: typer.Typer) -> None:
    """Add the commands to the application."""
    app.command("diagnose")(diagnose)
    app.command("add")(add)
    app.command("discover")(discover)


def diagnose(
    study: StudyArgument,
    effects: Effects = None,
    seeds: Annotated[str, typer.Option(help="Seeds of the model as it stands: how many, or which.")] = "4",
    output: Annotated[
        Path | None, typer.Option("--output", "-o", help="Folder for the results; STUDY/results where left out.")
    ] = None,
    store: Store = None,
    effect_rows: Rows = None,
    base_rows: BaseRows = None,
    new_tests: Annotated[
        str | None, typer.Option(help="Types of tests that might be made next, simulated too; 'none' for none of them.")
    ] = None,
    retry_failed: Annotated[bool, typer.Option("--retry-failed", help="Run again what failed before.")] = False,
    workers: Workers = None,
    cluster: Cluster = None,
    as_json: Json = False,
) -> None:
    """Re-calibrate the model, put every effect that it lacks on trial, and come to one verdict of five."""
    from taichidem.study import diagnose as diagnose_study
    from taichidem.study.diagnosis_plan import plan

    read, names, numbers = _read(study), _names(effects), parse_seeds(seeds)
    new = () if new_tests == "none" else _names(new_tests)
    runs = plan(read, names, numbers, effect_rows, base_rows, new).runs  # what is wrong is told before a store is made
    with (
        executor_of(workers, cluster) as executor,
        _store(read, store) as opened,
        told_when_stopped(runs, opened),
        progress(quiet=as_json) as report,
    ):
        found = diagnose_study(
            read,
            names,
            numbers,
            opened,
            output,
            report,
            effect_rows=effect_rows,
            base_rows=base_rows,
            new_tests=new,
            retry_failed=retry_failed,
            executor=executor,
        )
    if as_json:
        typer.echo(found.to_json())
        return
    _print_diagnosis(found)
    _print_end(found.runs, found.failures, found.folder, ["verdict.json", *found.pictures.values()])


def add(
    study: StudyArgument,
    effect: Annotated[
        str, typer.Argument(metavar="EFFECT", help="Name of the effect; `taichidem plugins effect` lists them.")
    ],
    output: Annotated[Path, typer.Option("--output", "-o", help="Folder of the new study.")],
    store: Store = None,
    effect_rows: Rows = None,
    base_rows: BaseRows = None,
    workers: Workers = None,
    cluster: Cluster = None,
    as_json: Json = False,
) -> None:
    """Write a study with the effect in the model, re-calibrated with it by simulation, and watch the error fall."""
    from taichidem.study import add as add_effect

    read = _read(study)
    with (
        executor_of(workers, cluster) as executor,
        _told_when_stopped(read, store),
        progress(quiet=as_json) as report,
    ):
        found = add_effect(
            read, effect, output, store, report, effect_rows=effect_rows, base_rows=base_rows, executor=executor
        )
    if as_json:
        typer.echo(found.to_json())
        return
    print_addition(found)
    _print_end(found.runs, found.failures, found.folder, ["addition.json", *found.pictures.values()])
    typer.echo(f"wrote {found.new_study / 'study.toml'}")


def discover(
    study: StudyArgument,
    effects: Effects = None,
    output: Annotated[
        Path | None,
        typer.Option(
            "--output", "-o", help="Folder for results and the study of each step; STUDY/results where left out."
        ),
    ] = None,
    store: Store = None,
    most: Annotated[int, typer.Option(help="Effects that may be added.", min=1)] = 3,
    effect_rows: Rows = None,
    base_rows: BaseRows = None,
    workers: Workers = None,
    cluster: Cluster = None,
    as_json: Json = False,
) -> None:
    """Diagnose and add until nothing is missing or nothing helps, then check that each added effect is still needed."""
    from taichidem.study import discover as discover_effects

    read, names = _read(study), _names(effects)
    with (
        executor_of(workers, cluster) as executor,
        _told_when_stopped(read, store),
        progress(quiet=as_json) as report,
    ):
        discover_here = partial(discover_effects, effect_rows=effect_rows, base_rows=base_rows, executor=executor)
        found = discover_here(read, names, store, output, report, most=most)
    if as_json:
        typer.echo(found.to_json())
        return
    for step in found.steps:
        added = f"; added {step['added']}" if step["added"] else ""
        typer.echo(f"{step['folder']}: {step['verdict']} {', '.join(step['effects'])} (χ² {step['chi2']:.3g}){added}")
    typer.echo(f"\n{found.text}\nlast study: {found.final}\nwrote {found.folder / 'discovery.json'}")


def _read(study: str) -> Study:
    from taichidem.study import read_study

    return read_study(study)


def _names(text: str | None) -> list[str] | None:
    return None if text is None else [name.strip() for name in text.split(",") if name.strip()]


@contextmanager
def _store(study: Study, path: Path | None) -> Iterator[RunStore]:
    from taichidem.study import RunStore
    from taichidem.study.campaign import STORE

    with RunStore(path or study.path / STORE) as opened:
        yield opened


@contextmanager
def _told_when_stopped(study: Study, store: Path | None) -> Iterator[None]:
    """Say on Ctrl-C that nothing is lost, and end with 130; how many runs are still to come is not known beforehand."""
    from taichidem.study.campaign import STORE

    try:
        yield
    except KeyboardInterrupt:
        kept = store or study.path / STORE
        typer.echo(f"Stopped. What was simulated so far is in {kept}; the same command goes on.", err=True)
        raise typer.Exit(130) from None


def _print_diagnosis(found: Diagnosis) -> None:
    shown = Table(title=found.study, box=box.SIMPLE_HEAD, padding=(0, 1), collapse_padding=True, pad_edge=False)
    console = Console()
    wide = console.width >= WIDE
    shown.add_column("effect", no_wrap=True)
    for heading in ("strength", "χ²", "adj. p", *(("η", "held out", "seen from") if wide else ())):
        shown.add_column(heading, justify="right", no_wrap=True)
    for row in found.table[:SHOWN]:
        cells = [_strength(row), f"{row['chi2']:.3g}", f"{row['adjusted_p']:.1g}"]
        if wide:
            cells += [f"{row['eta']:.2f}", _known(row["held_out_error"], ".2g"), _known(row["detection_limit"], ".2g")]
        shown.add_row(row["effect"], *cells, style="bold" if row["effect"] in found.effects else None)
    console.print(shown)
    typer.echo(f"Verdict: {found.verdict}{': ' + ', '.join(found.effects) if found.effects else ''}\n\n{found.text}\n")
    for line in found.advice:
        typer.echo(line)
    for entry in found.not_tested:
        typer.echo(f"Not tested: {entry['effect']}: {entry['reason']}")


def _known(value: float, form: str) -> str:
    return f"{value:{form}}" if value == value else "–"


def _strength(row: Mapping[str, Any]) -> str:
    unit = "" if row["unit"] == "1" else f" {row['unit']}"
    return f"{row['strength']:.3g} ± {row['u_strength']:.2g}{unit}"


def print_addition(found: Addition) -> None:
    """Print the waterfall and the error of every test before and after."""
    console = Console()
    steps = Table(title=found.study, box=box.SIMPLE_HEAD, padding=(0, 1), collapse_padding=True, pad_edge=False)
    steps.add_column("model", no_wrap=True)
    for heading in ("χ²", "dof", "error of tests", "held out"):
        steps.add_column(heading, justify="right", no_wrap=True)
    for step in found.waterfall:
        numbers = (_known(step[name], ".2f") for name in ("rms_fitted", "rms_held_out"))
        steps.add_row(step["label"], _known(step["chi2"], ".1f"), str(step["dof"]), *numbers)
    console.print(steps)
    tests = Table(box=box.SIMPLE_HEAD, padding=(0, 1), collapse_padding=True, pad_edge=False)
    tests.add_column("error / u", no_wrap=True)
    for heading in ("as believed", "re-calibrated", "with effect"):
        tests.add_column(heading, justify="right", no_wrap=True)
    for row in found.tests:
        tests.add_row(
            row["label"], *(_known(row[f"z_{s}"], "+.1f") for s in ("believed", "recalibrated", "with_effect"))
        )
    console.print(tests)
    typer.echo(found.text + "\n")


def _print_end(runs: Mapping[str, int], failures: Any, folder: Path, files: list[str]) -> None:
    typer.echo()
    print_counts(runs)
    print_failures([{**row, "stored": False} for row in failures])
    for name in files:
        typer.echo(f"wrote {folder / name}")
